# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels integrated by distributed rays, to a stated error.

Where what is seen or hidden is known by rays only (`ShapeSet.sampled`), a pixel is the mean over
low-discrepancy points of its square and of the shutter (Cook, Porter and Carpenter 1984), each of
which sends a few rays to every light. The noise of three sources is removed in closed form:

- unhidden light is exact, and rays estimate the visible fraction only, over the whole pixel: a
  ratio estimator (Heitz, Hill and McGuire 2018);
- lights that nothing may hide, or that one object hides, get no rays;
- the part of the unhidden light that is linear over the pixel and the shutter is known to have the
  value at the middle as its mean: its slope, by least squares, serves as a control variate.

The points of a pixel form a net (Sobol'), also along each axis by itself: thin shadows along rows
and columns are not missed. It is cut into consecutive batches of equal size. The spread of their
estimates gives the error (batch means: Owen 2013, chapter 17); the number of points is doubled
while that is above the limit. Consecutive batches complement each other, so that their mean is
better than the spread says; but sampling ends where the spread happens to be low. Measured errors
were 0.4 to 0.7 of the stated ones (ten random scenes, 1 % and 0.1 %, against brute force).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.sobol_points import MOST_POINTS, net_points
from ..numerics.vector import cross, dot, rms
from ..numerics.vector import total as sum_rows
from ..parallel.call_progress import progress_range, report_progress
from ..shading.center_light import MIXED, visibility_numbers
from ..shading.direct_light import emission
from ..shading.sample_light import LightSampler, SkyRays
from ..shading.sampled_occlusion import BATCHES, UNSEEN_SHARE
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface, intersect_pairs, surface
from ..tracing.occluder_culling import Occluders
from ..tracing.shadow_rays import batches_by_rank
from .heap_limits import ERROR_DECAY

__all__ = [
    "FIRST_POINTS",
    "MIXED",
    "SampledPixels",
    "SamplingTask",
    "sample_pixels",
    "unseen_error",
]


FIRST_POINTS, LAST_POINTS = BATCHES, 16_384
"""Number of points that every pixel takes, and the number up to which it is doubled; in heaps of
spheres up to the last point of the net."""
POINTS_PER_CHUNK = 1 << 14
"""Number of points in one batch of work; it bounds memory."""
UNSEEN_AREA = 0.3
"""Error of the area of a part of a pixel that no point met, as a fraction of one point's share.
Derived: a part that is cut off by an outline at random and met by no point has areas of up to one
share; its root mean square is 0.58 of it, and about every fourth such pixel has one."""
CAMERA_STREAM = 40
"""Stream of the hashes that shift the points of each pixel; those from `sample_light.LIGHT_STREAM`
on belong to the lights."""


@dataclass(frozen=True)
class SamplingTask:
    """n pixels to be sampled.

    Attributes
    ----------
    x, y : (n,) picture coordinates of the centres.
    index : (n,) numbers of the pixels in the whole picture, which their points depend on.
    moves : (n,) whether anything may change during the shutter.
    pairs : pairs of pixels and all objects that may be seen in them, sorted by pixel.
    limit : (n,) error, as a radiance, at which a pixel is done after its first points.
    contrast : (n,) difference of radiance across outlines in the pixel, or between it and parts of
        it that no point may have met; 0 where there are none.
    agreeing : (n,) number of pixels around and including the pixel from all of which all rays, or
        none, have reached the lights.
    growth : power of the number of points by which the limit grows.
    spread : error of the mean of all points of a net, as a fraction of what the spread of its
        batches gives as if they were independent.
    """

    x: Array
    y: Array
    index: Ints
    moves: Mask
    pairs: Pairs
    limit: Array
    contrast: Array
    agreeing: Array
    growth: float = 0.0
    spread: float = 1.0


def unseen_error(contrast: Array, points: int) -> Array:
    """Error of a pixel that outlines cut, if none of its points lies beyond one."""
    error: Array = UNSEEN_AREA / points * contrast
    return error


@dataclass(frozen=True)
class SampledPixels:
    """Sampled pixels: `color` (3, n), `alpha` (n,), `samples` (n,) points.

    Attributes
    ----------
    spread : (n,) estimated error by the spread of batches, and by what outlines may have cut off.
    unseen : (n,) error of parts of lights that no ray may have met, where nothing is known of the
        pixels around.
    visibility : (n,) a number that tells which lights all rays have reached, and which none; or
        `MIXED` where a light is visible in part.
    item : (n,) the object that all points have hit, counted from 1, and 0 if none has hit one; or
        `MIXED`.
    dusk : (n,) whether a light is below the horizon of a smooth surface at some points.
    """

    color: Array
    alpha: Array
    samples: Ints
    spread: Array
    unseen: Array
    visibility: Ints
    item: Ints
    dusk: Mask

    @classmethod
    def zeros(cls, count: int) -> SampledPixels:
        """Pixels of which nothing is known."""
        color, (alpha, spread, unseen) = np.zeros((3, count)), np.zeros((3, count))
        samples, visibility, item = np.zeros((3, count), dtype=np.int64)
        dusk = np.zeros(count, dtype=np.bool_)
        return cls(color, alpha, samples, spread, unseen, visibility, item, dusk)

    def error(self, agreeing: Array) -> Array:
        """Estimated errors (n,) where so many pixels agree; see `SamplingTask.agreeing`.

        A part of a light that is hidden from a pixel is nearly as large for those around it: as
        many more rays have missed it.
        """
        return np.maximum(self.spread, self.unseen / agreeing)

    def enter(self, rows: Ints, other: SampledPixels) -> None:
        """Enter some pixels."""
        for name in self.__dataclass_fields__:
            getattr(self, name)[..., rows] = getattr(other, name)


def sample_pixels(plan: Plan, occluders: Occluders, task: SamplingTask) -> SampledPixels:
    """Sample pixels to their limits."""
    count = task.x.size
    done = SampledPixels.zeros(count)
    for moving in (False, True):
        rows = (task.moves == moving).nonzero()[0]
        step = max(1, POINTS_PER_CHUNK // FIRST_POINTS)
        for first in range(0, rows.size, step):
            with progress_range(first / count, min(first + step, rows.size) / count):
                _sample_chunk(plan, occluders, task, rows[first : first + step], moving, done)
    return done


def _sample_chunk(
    plan: Plan,
    occluders: Occluders,
    task: SamplingTask,
    rows: Ints,
    moving: bool,
    done: SampledPixels,
) -> None:
    """Sample some pixels, and enter them in `done`."""
    sums, before, points = None, None, FIRST_POINTS
    while rows.size:
        plan.raise_if_cancelled()
        first = 0 if sums is None else points // 2
        new = _sums(plan, occluders, task, rows, moving, (first, points))
        sums = new if sums is None else sums.joined(new)
        found = sums.estimate(points, task.contrast[rows], plan.least_radiance)
        found = _with_known_decay(found, task.spread, before)
        done.enter(rows, found)
        limit = task.limit[rows] * (points / FIRST_POINTS) ** task.growth
        points *= 2
        if points > (LAST_POINTS if plan.traced is None else MOST_POINTS):
            return
        more = (found.error(task.agreeing[rows]) > limit).nonzero()[0]
        rows, sums, before = rows[more], sums.take(more), found.spread[more]


def _with_known_decay(found: SampledPixels, part: float, before: Array | None) -> SampledPixels:
    """Pixels with errors that follow from what is known of the points of a net.

    part : see `SamplingTask.spread`.
    before : (n,) errors of half as many points; None for the first ones. The spread of eight
        batches is known to a quarter only, and sampling ends where it is low by chance, or where
        an edge along rows or columns leaves the same number of points of each batch on its sides.
        So it is pooled with those before, which are as far off, but not in the same direction.
    """
    spread = part * found.spread
    if before is not None:
        spread = np.sqrt(0.5 * (spread**2 + (2.0**-ERROR_DECAY * before) ** 2))
    return replace(found, spread=spread)


def _sums(
    plan: Plan,
    occluders: Occluders,
    task: SamplingTask,
    rows: Ints,
    moving: bool,
    span: tuple[int, int],
) -> _Sums:
    """Sums over the points span[0] to span[1] of some pixels."""
    step = max(1, POINTS_PER_CHUNK // (span[1] - span[0]))
    parts = []
    for first in range(0, rows.size, step):
        plan.raise_if_cancelled()
        report_progress(first / rows.size)
        some = rows[first : first + step]
        own = task.pairs.for_pixels(some, task.x.size)
        points = _Points.make(plan, task, some, moving, span)
        parts.append(points.sums(plan, occluders, own))
    return _Sums.concatenate(parts)


@dataclass(frozen=True)
class _Points:
    """k points of each of n pixels and of the shutter.

    Attributes
    ----------
    index : (n,) numbers of the pixels.  first : number of the first point in each sequence.
    offset : (axes, n, k) coordinates along the axes that the points vary along, from -0.5 to 0.5.
    w : (3, n, k) directions of the rays.  time : (n, k) shutter times.
    """

    index: Ints
    first: int
    offset: Array
    w: Array
    time: Array

    @classmethod
    def make(
        cls, plan: Plan, task: SamplingTask, rows: Ints, moving: bool, span: tuple[int, int]
    ) -> _Points:
        axes, index = 2 * plan.edges + moving, task.index[rows]
        seed, stream = plan.settings.seed, CAMERA_STREAM
        spots = net_points(seed, index, stream, np.arange(*span), tuple(range(axes)))
        offset = spots[:axes] - 0.5
        zero = np.zeros((rows.size, span[1] - span[0]))
        across = offset[:2] if plan.edges else (zero, zero)
        x, y = task.x[rows, None] + across[0], task.y[rows, None] + across[1]
        return cls(
            index, span[0], offset, plan.lens.directions(x, y), offset[-1] if moving else zero
        )

    def sums(self, plan: Plan, occluders: Occluders, pairs: Pairs) -> _Sums:
        """Trace and shade the points. pairs : candidates of the pixels, sorted by pixel."""
        depth, item = self._nearest(plan, occluders, pairs)
        row, point = np.nonzero(item >= 0)
        hits = self._surface(plan, depth, item, row, point)
        shape = item.shape
        hit = item >= 0
        plain = np.zeros((4, *shape))
        if not plan.transparent:
            plain[:3] = plan.background[:, None, None] * ~hit
            if plan.backdrop is not None:
                plain[:3, ~hit] = plan.backdrop.radiance(self.w[:, ~hit])
        plain[3] = plan.opacity(item)
        glow = emission(plan, hits)
        if glow is not None:
            plain[:3, row, point] = glow
        closed, total, visible = np.zeros((3, len(plan.lights), 3, *shape))
        rays = np.zeros((len(plan.lights), shape[0]))
        bent = np.zeros(row.size, dtype=np.bool_)
        if hits.smooth is not None:
            bent = hits.smooth.rise.any(axis=0)
        dusk = np.zeros(shape[0], dtype=np.bool_)
        time, known = self.time[row, point], SkyRays()
        for number in range(len(plan.lights)):
            sampler = LightSampler(plan, occluders, number, len(self.offset))
            if sampler.traces_sky:
                index = np.arange(self.first, self.first + shape[1])
                found = sampler.sample_sky(hits, self.index, index, (row, point), known)
            else:
                numbers = self.index[row], self.first + point
                found = sampler.sample(hits, row, time, numbers)
            for values, part in zip((closed, total, visible), found.colors, strict=True):
                values[number][:, row, point] = part
            dusk[row[bent & ~found.colors[0].any(axis=0)]] = True
            rays[number] = np.bincount(row[found.sampled], minlength=shape[0])
            # all rays from a point to a light without extent are one, where meshes hide it
            if not plan.any_mesh or plan.as_shadow_caster(plan.lights[number]).extended:
                rays[number] *= sampler.rays
        same = np.where((item == item[:, :1]).all(axis=1), item[:, 0] + 1, MIXED)
        return _Sums.make(self.offset, plain, (closed, total, visible), (rays, same, dusk))

    def _nearest(self, plan: Plan, occluders: Occluders, pairs: Pairs) -> tuple[Array, Ints]:
        """Nearest hits (n, k): ray parameters and objects, inf and -1 where nothing is hit."""
        depth, item = np.full(self.time.shape, np.inf), np.full(self.time.shape, -1)
        if occluders.tracer is not None and plan.seen is None:
            depth, item = occluders.tracer.nearest(self.w, self.time)
            pairs = pairs.take(~occluders.tracer.traced[pairs.item])
        for rows, ids in batches_by_rank(self.index.size, pairs):
            t = intersect_pairs(plan, columns(self.w, rows), ids, self.time[rows])
            before, which = depth[rows], item[rows]
            # at equal depth the object of lower index is nearer
            closer = (t < before) | ((t == before) & np.isfinite(t) & (ids[:, None] < which))
            depth[rows] = np.where(closer, t, before)
            item[rows] = np.where(closer, ids[:, None], which)
        return depth, item

    def _surface(self, plan: Plan, depth: Array, item: Ints, row: Ints, point: Ints) -> Surface:
        """The surfaces at the hits of some points."""
        w, t = np.ascontiguousarray(self.w[:, row, point]), depth[row, point]
        return surface(plan, w, t, item[row, point], self.time[row, point])


PRODUCTS = ("square", "plain_product", "product")
"""Names of those of `_Sums` that are means over all points of a pixel."""
MEANS = ("offset", "plain", "closed", "total", "visible", *PRODUCTS)
"""Names of all means of `_Sums`."""


@dataclass(frozen=True)
class _Sums:
    """Means over batches of points of n pixels, and what the slopes follow from.

    Attributes
    ----------
    offset : (axes, B, n) mean coordinates.  square : (axes, axes, n) mean products of coordinates.
    plain : (4, B, n) emitted and background radiance, and coverage.  plain_product : (axes, 4, n).
    closed, total, visible : (lights, 3, B, n) radiance of the unhidden light in closed form, of
        all points of light and of the visible ones.  product : (axes, lights, 3, n), of `closed`.
    rays : (lights, n) number of rays.  item, dusk : (n,) see `SampledPixels`.
    """

    offset: Array
    square: Array
    plain: Array
    plain_product: Array
    closed: Array
    total: Array
    visible: Array
    product: Array
    rays: Array
    item: Ints
    dusk: Mask

    @classmethod
    def make(
        cls,
        offset: Array,
        plain: Array,
        light: tuple[Array, Array, Array],
        rest: tuple[Array, Ints, Mask],
    ) -> _Sums:
        """From values (..., n, k) at k points; `light` are closed form, all and visible points.

        rest : `rays`, `item` and `dusk`.
        """
        closed, total, visible = light

        def batches(values: Array) -> Array:
            shape = (*values.shape[:-1], BATCHES, values.shape[-1] // BATCHES)
            means: Array = values.reshape(shape).mean(axis=-1)
            return np.ascontiguousarray(np.moveaxis(means, -1, -2))

        def products(values: Array) -> Array:
            axes = offset.shape[0]
            each = [(offset[axis] * values).mean(axis=-1) for axis in range(axes)]
            return np.array(each).reshape(axes, *values.shape[:-1])

        return cls(
            batches(offset), products(offset), batches(plain), products(plain), batches(closed),
            batches(total), batches(visible), products(closed), *rest,
        )  # fmt: skip

    @classmethod
    def concatenate(cls, parts: list[_Sums]) -> _Sums:
        """The sums of all pixels of several parts."""
        names = (*MEANS, "rays", "item", "dusk")
        values = {
            name: np.concatenate([getattr(p, name) for p in parts], axis=-1) for name in names
        }
        return cls(**values)

    def take(self, rows: Ints) -> _Sums:
        """The sums of some pixels."""
        names = (*MEANS, "rays", "item", "dusk")
        return _Sums(**{name: columns(getattr(self, name), rows, -1) for name in names})

    def joined(self, other: _Sums) -> _Sums:
        """The sums with those of equally many more points: two consecutive batches become one."""

        def pairs(a: Array, b: Array) -> Array:
            both = np.concatenate([a, b], axis=-2)
            mean: Array = 0.5 * (both[..., ::2, :] + both[..., 1::2, :])
            return mean

        parts = {}
        for name in MEANS:
            a, b = getattr(self, name), getattr(other, name)
            parts[name] = 0.5 * (a + b) if name in PRODUCTS else pairs(a, b)
        item = np.where(self.item == other.item, self.item, MIXED)
        dusk = self.dusk | other.dusk
        return _Sums(**parts, rays=self.rays + other.rays, item=item, dusk=dusk)

    def estimate(self, points: int, contrast: Array, least: float) -> SampledPixels:
        """What is known of the pixels after so many points.

        contrast : (n,) see `SamplingTask`.  least : radiance below which no pixel may be.
        """
        closed, plain = self._without_slopes()
        total, visible = _batch_mean(self.total), _batch_mean(self.visible)
        whole = _batch_mean(closed)
        # each channel of a light has a sign of its own
        met = total != 0.0
        safe = np.where(met, total, 1.0)
        ratio = np.where(met, visible, 1.0) / safe
        part = np.where(met, whole / safe, 0.0)
        # estimates of single batches, linear in what differs between them
        hidden = self.visible - ratio[..., None, :] * self.total
        each = ratio[..., None, :] * closed + part[..., None, :] * hidden
        batch = sum_rows(each) + plain[:3]
        mean = _batch_mean(batch)
        residual = batch - mean[:, None]
        free = BATCHES - 1 - self.offset.shape[0]
        spread = rms(np.sqrt(_batch_mean(residual * residual) / free))
        spread = np.maximum(spread, unseen_error(contrast, points))
        share = np.where(self.rays > 0.0, UNSEEN_SHARE / np.maximum(self.rays, 1.0), 0.0)
        bright = np.array([rms(np.abs(one)) for one in whole]).reshape(share.shape)
        unseen = np.sqrt(sum_rows((share * bright) ** 2))
        alpha = np.clip(_batch_mean(plain[3]), 0.0, 1.0)
        samples = np.full(alpha.size, points)
        sums = (sum_rows(np.moveaxis(np.abs(part), 1, 0)) for part in (total, visible))
        state = visibility_numbers(*sums)
        color = np.maximum(mean, least)
        return SampledPixels(color, alpha, samples, spread, unseen, state, self.item, self.dusk)

    def _without_slopes(self) -> tuple[Array, Array]:
        """`closed` and `plain`, less the part that is linear in the coordinates."""
        axes = self.offset.shape[0]
        if not axes:
            return self.closed, self.plain
        middle = _batch_mean(self.offset)
        spread = self.square - middle[:, None] * middle
        inverse = _inverse(spread)

        def without(values: Array, products: Array) -> Array:
            mean = _batch_mean(values)
            trend = products - middle.reshape(axes, *(1,) * (mean.ndim - 1), -1) * mean
            rest = values.copy()
            for axis in range(axes):
                slope = sum(inverse[axis, other] * trend[other] for other in range(axes))
                rest -= slope[..., None, :] * self.offset[axis]
            return rest

        return without(self.closed, self.product), without(self.plain, self.plain_product)


def _batch_mean(values: Array) -> Array:
    """Means (..., n) over the batches of values (..., B, n), summed in the same order for any n."""
    mean: Array = sum_rows(np.moveaxis(values, -2, 0)) / BATCHES
    return mean


def _inverse(matrix: Array) -> Array:
    """Inverses of symmetric matrices (k, k, n) of up to three rows, by their cofactors."""
    if len(matrix) == 1:
        rows, determinant = np.ones_like(matrix), matrix[0, 0]
    elif len(matrix) == 2:
        (a, b), (_, c) = matrix
        rows, determinant = np.array([[c, -b], [-b, a]]), a * c - b * b
    else:
        rows = np.array([cross(matrix[(k + 1) % 3], matrix[(k + 2) % 3]) for k in range(3)])
        determinant = dot(matrix[0], rows[0])
    inverse: Array = rows / np.maximum(determinant, TINY)
    return inverse
