# SPDX-License-Identifier: GPL-3.0-or-later
"""Smooth blocks of pixels: those that detection found clear, interpolated from a few points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..detection.detect import SmoothBlockFlags
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.error_coefficients import TIME_ERROR_FACTOR
from ..numerics.gather import columns
from ..shading.direct_light import smooth_radiance
from ..tracing.compile import Plan
from ..tracing.intersect import intersect_pairs, surface
from ..tracing.occluder_culling import Occluders
from .chebyshev_blocks import (
    PixelBlocks,
    block_means,
    block_nodes,
    chebyshev_series,
    interpolation_error,
)

__all__ = [
    "FittedBlocks",
    "SmoothBlocks",
    "fit_blocks",
    "interpolate_blocks",
    "make_smooth_blocks",
]


GAUSS_TIMES = (-0.5 * np.sqrt(0.6), 0.0, 0.5 * np.sqrt(0.6))
"""Shutter times of a three-point Gauss rule, with the shutter from -0.5 to 0.5."""
ALLOWED_ERROR = 0.1
"""Largest interpolation error of a block, as a fraction of the tolerance times its own radiance.
Chosen, not fitted: smooth blocks are cheap, and their errors have one sign over many pixels."""


@dataclass(frozen=True)
class SmoothBlocks:
    """n smooth blocks of s x s pixels, whose pixels need no ray of their own.

    Attributes
    ----------
    side : s.  x, y : (n,) the lower left corners in the picture, in units of s.
    color : (3, s, s, n) mean radiance, y first.  error : (n,) its estimated error.
    item : (n,) object that fills the block, -1 for none.
    depth : (s, s, n), normal : (3, s, s, n) of the hits at the pixels' centres.
    moving : (n,) whether the light on it changes during the shutter.
    penumbra : (n,) whether a part of a light may be hidden.
    """

    side: int
    x: Ints
    y: Ints
    color: Array
    error: Array
    item: Ints
    depth: Array
    normal: Array
    moving: Mask
    penumbra: Mask


@dataclass(frozen=True)
class FittedBlocks:
    """Polynomials over n clear blocks, of which some are smooth enough.

    Attributes
    ----------
    coefficients : (3, 4, 4, n) Chebyshev series of radiance.  error : (n,) estimated errors.
    item : (n,) object that fills the block, -1 for none.
    moving : (n,) whether the light on it changes during the shutter.
    smooth : (n,) whether the error is as small as it has to be.
    points : number of points shaded.
    """

    coefficients: Array
    error: Array
    item: Ints
    moving: Mask
    smooth: Mask
    points: int

    def by_object(self) -> Ints:
        """Indices of the smooth blocks, those of one object as one slice."""
        index = self.smooth.nonzero()[0]
        order: Ints = index[np.argsort(self.item[index], kind="stable")]
        return order

    def means(self, plan: Plan, index: Ints, side: int) -> Array:
        """Mean radiance (3, side, side, k) of the pixels of some blocks."""
        mean = block_means(columns(self.coefficients, index, -1), side)
        # the polynomial may leave the range that radiance has
        return np.maximum(mean, plan.least_radiance)


def fit_blocks(
    plan: Plan, occluders: Occluders, blocks: PixelBlocks, clear: Ints, found: SmoothBlockFlags
) -> FittedBlocks:
    """Fit polynomials to clear blocks, those where nothing changes abruptly.

    Parameters
    ----------
    clear : indices of those blocks.  found : what detection found of all blocks.
    """
    side, item, moving = blocks.side, found.item[clear], found.light_moves[clear]
    color = np.zeros((3, 16, clear.size))
    if not plan.transparent:
        color[:] = plan.background[:, None, None]
    seen, late = np.ones(clear.size, dtype=np.bool_), np.zeros(clear.size)
    points = 0
    for rows, times in ((~moving & (item >= 0), (0.0,)), (moving, GAUSS_TIMES)):
        hit = rows.nonzero()[0]
        if hit.size:
            across, up = blocks.centers
            x, y = block_nodes(across[clear[hit]], up[clear[hit]], side)
            hidden = [np.tile(each[clear[hit]], 16) for each in found.hidden]
            spots = x.ravel(), y.ravel(), np.tile(item[hit], 16)
            light, there = _shade(plan, occluders, *spots, hidden, times)
            light = light.reshape(len(times), 3, 16, -1)
            color[:, :, hit], late[hit] = _shutter_means(light)
            seen[hit] = there.reshape(16, -1).all(axis=0)
            points += 16 * len(times) * hit.size
    if plan.backdrop is not None and not plan.transparent:
        seen &= item >= 0  # an environment is filtered pixel by pixel
    coefficients = chebyshev_series(color)
    size = np.sqrt((color * color).mean(axis=(0, 1)))
    off = interpolation_error(coefficients) + late * size
    smooth = seen & (off <= ALLOWED_ERROR * plan.settings.tolerance * size)
    return FittedBlocks(coefficients, off, item, moving, smooth, points)


def interpolate_blocks(
    plan: Plan, occluders: Occluders, blocks: PixelBlocks, clear: Ints, found: SmoothBlockFlags
) -> tuple[SmoothBlocks, Mask, int]:
    """Interpolate clear blocks; parameters as of `fit_blocks`.

    Returns the blocks that are smooth enough, which of the given ones those are, and the number of
    points shaded.
    """
    fitted = fit_blocks(plan, occluders, blocks, clear, found)
    index = fitted.by_object()
    kept = make_smooth_blocks(
        plan, blocks, clear[index], fitted.item[index], fitted.means(plan, index, blocks.side),
        fitted.error[index], (fitted.moving[index], found.penumbra[clear[index]]),
    )  # fmt: skip
    return kept, fitted.smooth, fitted.points


def _shutter_means(light: Array) -> tuple[Array, Array]:
    """Means over the shutter (3, 16, n) of radiance (times, 3, 16, n), and their relative error
    (n,).

    With one time nothing moves. The error of three Gauss points is of sixth order; for light that
    comes nearer it is some power of the second-order term, which their second difference measures.
    """
    if light.shape[0] == 1:
        return light[0], np.zeros(light.shape[-1])
    first, middle, last = light
    mean = (5.0 * (first + last) + 8.0 * middle) / 18.0
    bend = np.sqrt(((first - 2.0 * middle + last) ** 2).mean(axis=(0, 1)))
    size = np.sqrt((mean * mean).mean(axis=(0, 1)))
    part = bend / np.where(size > 0.0, size, 1.0)
    return mean, TIME_ERROR_FACTOR * part**3


def _shade(
    plan: Plan,
    occluders: Occluders,
    x: Array,
    y: Array,
    item: Ints,
    hidden: list[Mask],
    times: tuple[float, ...],
) -> tuple[Array, Mask]:
    """Radiance (times, 3, n) of objects at pixel coordinates, and where it is known exactly (n,).

    hidden : for each light (n,), whether it is occluded there; for other shadows see
    `smooth_radiance`.
    """
    w = plan.lens.directions(x, y)
    t = intersect_pairs(plan, w, item)
    found = np.isfinite(t)
    hits = surface(plan, w, np.where(found, t, 1.0), item)
    light = []
    for time in times:
        color, exact = smooth_radiance(plan, occluders, hits, time, hidden)
        light.append(color)
        found &= exact
    return np.array(light), found


def make_smooth_blocks(
    plan: Plan,
    blocks: PixelBlocks,
    chosen: Ints,
    item: Ints,
    mean: Array,
    error: Array,
    flags: tuple[Mask, Mask],
) -> SmoothBlocks:
    """The chosen blocks, by object, given their pixel means (3, s, s, n).

    flags : `SmoothBlocks.moving` and `penumbra`.
    """
    side = blocks.side
    x, y = blocks.x[chosen], blocks.y[chosen]
    depth, normal = np.full(mean.shape[1:], np.inf), np.zeros_like(mean)
    place = np.arange(side) + 0.5
    across, up = side * x + place[None, :, None], side * y + place[:, None, None]
    ends = np.append(np.diff(item).nonzero()[0] + 1, item.size)
    first = 0
    for last in ends.tolist():
        part = np.s_[..., first:last]
        if last > first and item[first] >= 0:
            shapes, index = plan.shapes.locate(int(item[first]))
            depth[part], normal[part] = shapes.depth_over_pixels(
                index, plan.lens, across[part], up[part]
            )
        first = last
    return SmoothBlocks(side, x, y, mean, error, item, depth, normal, *flags)
