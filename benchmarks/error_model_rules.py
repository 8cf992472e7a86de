# SPDX-License-Identifier: GPL-3.0-or-later
"""Coefficients of the error model that are fitted to integrals over boxes, blocks and intervals.

Each study draws integrands at random, integrates them exactly or by a fine rule, and compares the
errors of the tracer's own rules with their estimates. Nothing is rendered here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import gamma

import numpy as np

from adaptive_drt.cubature.limb_correction import _mean_root
from adaptive_drt.cubature.nodes import Nodes, make_nodes
from adaptive_drt.cubature.posteriori import CONFIRMING_DIFFERENCE
from adaptive_drt.image import chebyshev_blocks
from adaptive_drt.numerics.arrays import Array, Ints
from adaptive_drt.shading import unoccluded_variation

COUNT = 20_000
"""Number of samples of a study."""
LEAST_IN_BIN = 50
"""Number of samples below which a bin is not looked at."""
AXES = {1: (2,), 2: (0, 1), 3: (0, 1, 2)}
"""Axes of boxes that extend along one, two and three: shutter, pixel, both."""
POWERS = {"roots": 1.5, "kinks": 1.0, "steps": 0.0}
KINDS = ("bends", *POWERS)


@dataclass(frozen=True)
class Samples:
    """Errors of n integrals: `true` (n,), the estimate `unit` (n,) that a coefficient of 1 would
    give, and the bin (n,) of each.
    """

    true: Array
    unit: Array
    bin: Ints

    def fit(self) -> float:
        """Coefficient for which the RMS of the errors equals that of the estimates."""
        return rms(self.true) / rms(self.unit)

    def bins(self) -> list[float]:
        """The same for each bin."""
        each = [self.bin == k for k in np.unique(self.bin)]
        return [
            rms(self.true[some]) / max(rms(self.unit[some]), 1e-300)
            for some in each
            if some.sum() >= LEAST_IN_BIN
        ]

    def ratios(self, value: float) -> tuple[float, float]:
        """RMS of errors over that of estimates by a value, for all samples and in the worst bin."""
        return self.fit() / value, max(self.bins(), default=self.fit()) / value


def rms(values: Array) -> float:
    """Root mean square."""
    return float(np.sqrt((values * values).mean()))


def together(parts: list[Samples]) -> Samples:
    """Samples of several studies; bins stay apart."""
    first = np.cumsum([0, *(1 + int(part.bin.max()) for part in parts[:-1])])
    return Samples(
        np.concatenate([part.true for part in parts]),
        np.concatenate([part.unit for part in parts]),
        np.concatenate([part.bin + k for part, k in zip(parts, first, strict=True)]),
    )


def log_bins(values: Array, edges: list[float]) -> Ints:
    """Bin numbers by edges."""
    found: Ints = np.digitize(values, edges)
    return found


def boxes(axes: int, count: int, rng: np.random.Generator, box: bool = True) -> Nodes:
    """Nodes of the multi-node rule of boxes of half extents 1, at random rotations."""
    half = np.zeros((3, count))
    half[list(AXES[axes])] = 1.0
    spread = np.zeros((6, count))
    spread[[0, 2, 5]] = half / np.sqrt(3.0)
    place, every = np.zeros((3, count)), np.ones(count, dtype=np.bool_)
    place[2] = 0.3
    return make_nodes(
        place, spread, half > 0.0, every, every & box, rng.integers(0, 1 << 20, count)
    )


def rule_means(nodes: Nodes, values: Array, center: Array) -> Array:
    """Means by the rule, of values at nodes (k,) and at centroids (n,)."""
    mean = np.bincount(nodes.subdomain, values) / nodes.count
    result: Array = (1.0 - nodes.centroid_weight) * mean + nodes.centroid_weight * center
    return result


def tensor(axes: int, count: int) -> tuple[Array, Array]:
    """Points (axes, p) and weights (p,) of a Gauss-Legendre rule over a box of half extents 1."""
    x, w = np.polynomial.legendre.leggauss(count)
    grid = np.stack(np.meshgrid(*[x] * axes, indexing="ij")).reshape(axes, -1)
    weight = np.stack(np.meshgrid(*[0.5 * w] * axes, indexing="ij")).reshape(axes, -1).prod(axis=0)
    return grid, weight


# planes through boxes: roots, kinks and steps


@dataclass(frozen=True)
class Edges:
    """Transitions along planes of random direction and place in boxes: errors of the centroid
    rule and of the multi-node rule (n,), what the centroid differs by from the nodes, and bins by
    how oblique the plane is.
    """

    center: Array
    rule: Array
    found: Array
    bin: Ints


def edges(axes: int, power: float, rng: np.random.Generator) -> Edges:
    """Integrands max(0, n x - p)^power, whose zero lies in the box."""
    slope = np.maximum(np.abs(rng.normal(size=(axes, COUNT))), 0.03)
    slope /= np.sqrt((slope * slope).sum(axis=0))
    slope *= rng.choice([-1.0, 1.0], (axes, COUNT))
    size = np.abs(slope).sum(axis=0)
    start = rng.uniform(-1.0, 1.0, COUNT) * size
    truth = np.zeros(COUNT)
    for corner in np.ndindex(*(2,) * axes):
        # sums over corners, Marichal and Mossinghoff 2008
        sign = 2.0 * np.array(corner) - 1.0
        height = (sign[:, None] * np.abs(slope)).sum(axis=0) - start
        truth += sign.prod() * np.maximum(height, 0.0) ** (power + axes)
    truth *= gamma(power + 1.0) / gamma(power + axes + 1.0) / np.prod(2.0 * np.abs(slope), axis=0)
    nodes = boxes(axes, COUNT, rng)

    def value(height: Array) -> Array:
        return np.where(height > 0.0, np.maximum(height, 0.0) ** power, 0.0)

    center = value(-start)
    away = (slope[:, nodes.subdomain] * nodes.offset[list(AXES[axes])]).sum(axis=0)
    mean = rule_means(nodes, value(away - start[nodes.subdomain]), center)
    return Edges(center - truth, mean - truth, center - mean, log_bins(size, [1.2, 1.4, 1.6]))


# smooth transitions: bends


def penumbrae(axes: int, rng: np.random.Generator) -> Samples:
    """A round light before a straight edge, within its penumbra; true: rule, unit: centroid."""
    extent = 10.0 ** rng.uniform(np.log10(0.05), np.log10(0.5), COUNT)
    slope = rng.normal(size=(axes, COUNT))
    slope *= extent / np.abs(slope).sum(axis=0)
    start = rng.uniform(-1.0, 1.0, COUNT) * (0.98 - extent)

    def value(height: Array) -> Array:
        seen: Array = (np.arccos(-height) + height * np.sqrt(1.0 - height * height)) / np.pi
        return seen

    def along(x: Array, rows: Ints | slice) -> Array:
        moved: Array = start[rows] + (slope[:, rows] * x).sum(axis=0)
        return value(moved)

    return smooth(axes, along, extent, rng)


def falloffs(axes: int, rng: np.random.Generator) -> Samples:
    """A point light over a plane, and moving where the box extends in time."""
    light, _, steps, extent = plane_patches(axes, rng, (0.05, 0.3))

    def along(x: Array, rows: Ints | slice) -> Array:
        return irradiance(light[:, rows], steps[:, :, rows], x)

    return smooth(axes, along, extent, rng)


def plane_patches(
    axes: int, rng: np.random.Generator, reach: tuple[float, float]
) -> tuple[Array, Array, Array, Array]:
    """Point lights (3, n) at distance 1 from points of the plane z = 0, the sine of their
    elevation (n,), steps (axes, 3, n) from the middle of a box to its sides, and the root of the
    sum of the squares of their lengths (n,).
    """
    sine = rng.uniform(0.05, 1.0, COUNT)
    angle = rng.uniform(0.0, 2.0 * np.pi, COUNT)
    cosine = np.sqrt(1.0 - sine * sine)
    light = np.array([cosine * np.cos(angle), cosine * np.sin(angle), sine])
    steps = rng.normal(size=(axes, 3, COUNT))
    if axes > 1:  # a pixel's square in the plane; time may move anything along any direction
        steps[:2, 2] = 0.0
        steps[1, 0], steps[1, 1] = -steps[0, 1], steps[0, 0]
        steps[1] *= 10.0 ** rng.uniform(-0.5, 0.5, COUNT)
    extent = 10.0 ** rng.uniform(np.log10(reach[0]), np.log10(reach[1]), COUNT)
    steps *= extent / np.sqrt((steps * steps).sum(axis=(0, 1)))
    return light, sine, steps, extent


def irradiance(light: Array, steps: Array, x: Array) -> Array:
    """Cosine over squared distance of lights (3, n), after steps (axes, 3, n) times x (axes, n or
    1).
    """
    to = light - (steps * x[:, None]).sum(axis=0)
    square = (to * to).sum(axis=0)
    result: Array = np.maximum(to[2], 0.0) / square**1.5
    return result


def smooth(
    axes: int, along: Callable[..., Array], extent: Array, rng: np.random.Generator
) -> Samples:
    """Errors of the multi-node rule and of the centroid rule, over the squared extent, so that
    all sizes count alike."""
    points, weights = tensor(axes, 8)
    every = slice(None)
    truth = np.zeros(COUNT)
    for x, weight in zip(points.T, weights, strict=True):
        truth += weight * along(x[:, None], every)
    nodes = boxes(axes, COUNT, rng)
    center = along(np.zeros((axes, 1)), every)
    mean = rule_means(nodes, along(nodes.offset[list(AXES[axes])], nodes.subdomain), center)
    scale = extent * extent
    low, high = float(extent.min()), float(extent.max())
    bins = log_bins(extent, list(np.geomspace(low, high, 4)[1:3]))
    return Samples((mean - truth) / scale, (center - truth) / scale, bins)


def bends(axes: int, rng: np.random.Generator) -> Samples:
    """Smooth transitions of both sorts, with centroid errors of the same size."""
    parts = [penumbrae(axes, rng), falloffs(axes, rng)]
    sized = [Samples(p.true / rms(p.unit), p.unit / rms(p.unit), p.bin) for p in parts]
    return together(sized)


# falloff of light


def falloff_patches(rng: np.random.Generator, reach: tuple[float, float]) -> dict[str, Array]:
    """Errors of the centre and of the multi-node rule for plane patches under a point light.

    `unit` is the estimate for a `FALLOFF_COEFFICIENT` of 1, `steep` the same where the peak of the
    light may lie in the patch, `near` the half extent over the distance.
    """
    light, sine, steps, extent = plane_patches(2, rng, reach)
    points, weights = tensor(2, 24)
    truth = np.zeros(COUNT)
    for x, weight in zip(points.T, weights, strict=True):
        truth += weight * irradiance(light, steps, x[:, None])
    nodes = boxes(2, COUNT, rng)
    center = irradiance(light, steps, np.zeros((2, 1)))
    far = irradiance(light[:, nodes.subdomain], steps[..., nodes.subdomain], nodes.offset[:2])
    mean = rule_means(nodes, far, center)
    along, square = (steps * light).sum(axis=1), (steps * steps).sum(axis=1)
    curve = np.abs(5.0 * along * along - square)
    return {
        "center": center - truth, "rule": mean - truth, "unit": center * curve.sum(axis=0),
        "steep": center * np.maximum(curve, square).sum(axis=0), "near": extent, "sine": sine,
    }  # fmt: skip


def crossing(found: dict[str, Array], estimate: Array, share: float) -> float:
    """Ratio of extent and distance from which the rule leaves more than a share of the estimate."""
    marks = np.geomspace(0.05, 2.0, 30)
    for low, high in zip(marks, marks[3:], strict=False):
        some = (found["near"] >= low) & (found["near"] < high)
        if rms(found["rule"][some]) > share * rms(estimate[some]):
            return float(np.sqrt(low * high))
    return float(marks[-1])


# midpoint rule on rows of pixels


def kinks_on_pixels(rng: np.random.Generator, reach: tuple[float, float]) -> dict[str, Array]:
    """Kinks at distances `reach` from the centre of a pixel: true errors and differences."""
    place = rng.uniform(*reach, COUNT) * rng.choice([-1.0, 1.0], COUNT)
    values = np.stack([np.maximum(k - place, 0.0) for k in range(-2, 3)])
    truth = 0.5 * (np.maximum(0.5 - place, 0.0) ** 2 - np.maximum(-0.5 - place, 0.0) ** 2)
    before, bend, after = (values[k - 1] - 2.0 * values[k] + values[k + 1] for k in (1, 2, 3))
    third = np.maximum(np.abs(bend - before), np.abs(after - bend))
    fourth = np.abs(before - 2.0 * bend + after)
    return {
        "off": values[2] + bend / 24.0 - truth, "second": np.abs(bend), "third": third,
        "fourth": fourth, "place": np.abs(place),
    }  # fmt: skip


def peaks_on_pixels(rng: np.random.Generator) -> Samples:
    """Smooth peaks of random width: true errors of corrected centres, the largest correction of
    the pixel and its neighbours, bins by width.
    """
    width = np.exp(rng.uniform(0.0, np.log(8.0), COUNT))
    power = rng.choice([0.5, 1.0, 1.5, 2.0], COUNT)
    middle = rng.uniform(-3.0, 3.0, COUNT) * width

    def value(x: Array | float) -> Array:
        return (1.0 + ((x - middle) / width) ** 2) ** -power

    values = np.stack([value(float(k)) for k in range(-2, 3)])
    x, w = np.polynomial.legendre.leggauss(12)
    truth = sum(0.5 * b * value(0.5 * a) for a, b in zip(x, w, strict=True))
    changes = [np.abs(values[k - 1] - 2.0 * values[k] + values[k + 1]) / 24.0 for k in (1, 2, 3)]
    bend = values[1] - 2.0 * values[2] + values[3]
    off = values[2] + bend / 24.0 - truth
    scale = width * width
    return Samples(off * scale, np.max(changes, axis=0) * scale, log_bins(width, [2.0, 4.0]))


# blocks of pixels, times of a shutter, limbs


def chebyshev_blocks_of_light(rng: np.random.Generator) -> tuple[Array, Array, Array, Array]:
    """Blocks of 8 x 8 pixels under a point light: true RMS errors of the pixel means, the last and
    the last but one coefficients (2, n) along both axes, and extents.
    """
    light, _, steps, extent = plane_patches(2, rng, (0.05, 0.5))
    nodes = chebyshev_blocks.CHEBYSHEV_NODES
    grid = np.stack([np.tile(nodes, 4), np.repeat(nodes, 4)])
    values = np.stack([irradiance(light, steps, x[:, None]) for x in grid.T])[None]
    series = chebyshev_blocks.chebyshev_series(values)
    means = chebyshev_blocks.block_means(series, 8)[0]
    points, weights = tensor(2, 2)
    off = np.zeros(extent.size)
    for row, column in np.ndindex(8, 8):
        middle = (2.0 * np.array([column, row]) + 1.0) / 8.0 - 1.0
        truth = np.zeros(extent.size)
        for x, weight in zip(points.T, weights, strict=True):
            truth += weight * irradiance(light, steps, (middle + x / 8.0)[:, None])
        off += (means[row, column] - truth) ** 2 / 64.0
    size = np.sqrt((values * values).mean(axis=(0, 1)))
    square = (series * series).mean(axis=0)
    last, before = (
        np.stack([np.sqrt(square.take(k, axis=axis).sum(axis=0)) for axis in (0, 1)])
        for k in (3, 2)
    )
    return np.sqrt(off) / size, last / size, before / size, extent


def decayed(last: Array, before: Array, decay: float) -> Array:
    """Interpolation error as `chebyshev_blocks.interpolation_error` estimates it: (n,)."""
    total: Array = (last * np.minimum(decay * last / np.maximum(before, 1e-300), 1.0)).sum(axis=0)
    return total


def shutters(rng: np.random.Generator) -> Samples:
    """Lights that pass a point or come nearer: relative errors of the three-point Gauss rule over
    the shutter, the third power of the relative second difference, and bins by motion.
    """
    speed = 10.0 ** rng.uniform(np.log10(0.2), np.log10(1.0), COUNT)
    angle = rng.uniform(0.0, np.pi, COUNT)
    power = rng.choice([2.0, 3.0], COUNT)

    def value(t: float) -> Array:
        along, aside = 1.0 - speed * t * np.cos(angle), speed * t * np.sin(angle)
        result: Array = (along**2 + aside**2) ** (-0.5 * power)
        return result

    root = 0.5 * np.sqrt(0.6)
    first, middle, last = (value(t) for t in (-root, 0.0, root))
    mean = (5.0 * (first + last) + 8.0 * middle) / 18.0
    x, w = np.polynomial.legendre.leggauss(24)
    truth = sum(0.5 * b * value(0.5 * a) for a, b in zip(x, w, strict=True))
    part = np.abs(first - 2.0 * middle + last) / mean
    scale = speed**6
    return Samples((mean - truth) / mean / scale, part**3 / scale, log_bins(speed, [0.35, 0.6]))


def limbs(rng: np.random.Generator) -> Samples:
    """Roots of something linear over boxes with a corner at 0: how far the mean root is below that
    of a uniform density, over the root of the mean; unit: s^4 (1/3 - s^2).
    """
    parts = []
    for axes in (2, 3):
        slope = np.maximum(np.abs(rng.normal(size=(axes, COUNT))), 0.03)
        slope /= slope.sum(axis=0)
        truth = np.zeros(COUNT)
        for corner in np.ndindex(*(2,) * axes):
            height = (np.array(corner)[:, None] * slope).sum(axis=0)
            truth += (-1.0) ** (axes - sum(corner)) * height ** (0.5 + axes)
        truth *= gamma(1.5) / gamma(1.5 + axes) / slope.prod(axis=0)
        mean, spread = 0.5, (slope * slope).sum(axis=0) / 12.0 / 0.25
        even = _mean_root(spread, np.zeros(COUNT, dtype=np.bool_))
        unit = spread**2 * np.maximum(1.0 / 3.0 - spread, 0.0)
        parts.append(Samples(even - truth / np.sqrt(mean), unit, np.zeros(COUNT, dtype=np.int64)))
    return together(parts)


def undetected(found: list[Edges]) -> Samples:
    """Errors of the rule where nodes do not detect a transition, in units of its RMS error."""
    parts = []
    for one in found:
        predicted = rms(one.center)
        missed = np.abs(one.found) < 0.5 * CONFIRMING_DIFFERENCE * predicted
        true = one.rule[missed] / rms(one.rule)
        parts.append(Samples(true, np.ones_like(true), one.bin[missed] * 0))
    return together(parts)


def second_difference_errors(rng: np.random.Generator) -> Samples:
    """Kinks in the pixel: true errors, and the second difference; bins by place."""
    found = kinks_on_pixels(rng, (0.0, 0.5))
    return Samples(found["off"], found["second"], log_bins(found["place"], [0.17, 0.33]))


def fourth_difference_errors(rng: np.random.Generator) -> Samples:
    """Kinks in the pixel: true errors, and the fourth difference; bins by place."""
    found = kinks_on_pixels(rng, (0.0, 0.5))
    return Samples(found["off"], found["fourth"], log_bins(found["place"], [0.17, 0.33]))


def falloff_estimate(found: dict[str, Array], steep: bool) -> Array:
    """Estimates (n,) of `unoccluded_variation` for a `FALLOFF_COEFFICIENT` of 1."""
    if not steep:
        return found["unit"]
    near = np.maximum(found["sine"], 1.0 - found["near"])
    least = np.maximum(near, unoccluded_variation.MIN_PEAK_DISTANCE)
    result: Array = found["steep"] / (least * least)
    return result
