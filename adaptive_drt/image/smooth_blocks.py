# SPDX-License-Identifier: GPL-3.0-or-later
"""First pass over a tile: smooth blocks by interpolation from a few points, the rest pixel by
pixel.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from ..detection.detect import SmoothBlockFlags, detect_smooth_blocks, trace_center_rays
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.error_coefficients import TIME_ERROR_FACTOR
from ..numerics.gather import columns
from ..numerics.vector import cross
from ..parallel.call_progress import progress_range, report_progress
from ..shading.direct_light import unshadowed_radiance
from ..tracing.compile import Plan
from ..tracing.intersect import intersect_pairs, surface
from ..tracing.occluder_culling import Occluders
from .chebyshev_blocks import (
    SIDES,
    PixelBlocks,
    block_means,
    block_nodes,
    chebyshev_series,
    coarse_plan,
    interpolation_error,
)
from .first_pass import FirstPassPixels, SmoothBlocks, first_pass

__all__ = ["FirstPass", "trace_first_pass"]

Clock: TypeAlias = Callable[[str], None]

GAUSS_TIMES = (-0.5 * np.sqrt(0.6), 0.0, 0.5 * np.sqrt(0.6))
"""Shutter times of a three-point Gauss rule, with the shutter from -0.5 to 0.5."""
ALLOWED_ERROR = 0.1
"""Largest interpolation error of a block, as a fraction of the tolerance times its own radiance.
Chosen, not fitted: smooth blocks are cheap, and their errors have one sign over many pixels."""
BLOCK_WORK_SHARE = 0.2
"""Fraction of the work of a first pass that is done after the blocks of a side, multiplied by that
side in pixels; for a progress bar."""


@dataclass(frozen=True)
class FirstPass:
    """Results of the first pass: smooth blocks, all other pixels, and the points shaded for blocks.

    `rest` holds pixel coordinates x, y and their results.
    """

    lawns: list[SmoothBlocks]
    rest: list[tuple[Ints, Ints, FirstPassPixels]]
    points: int


def trace_first_pass(
    plan: Plan, occluders: Occluders, bounds: Ints, squares: PixelBlocks, clock: Clock
) -> FirstPass:
    """Find the smooth blocks; trace, detect and shade the centres of all other pixels.

    Parameters
    ----------
    plan : its region bounds the pixels.
    bounds : (4, objects) `screen_bounds` of the plan.
    squares : blocks of the largest side.
    clock : called at the end of each stage.
    """
    lawns, points = [], 0
    for side, smaller in zip(SIDES, (*SIDES[1:], 1), strict=True):
        plan.go_on()
        cut = np.ones(squares.x.size, dtype=np.bool_)
        if plan.edges:
            rough = coarse_plan(plan, side)
            center = trace_center_rays(rough, *squares.middles, squares.pairs)
            with progress_range(BLOCK_WORK_SHARE / (2 * side), BLOCK_WORK_SHARE / side):
                found = detect_smooth_blocks(rough, occluders, center, clock)
            squares = PixelBlocks(side, squares.x, squares.y, found.pairs)
            some = found.clear.nonzero()[0]
            lawn, smooth, count = _interpolate_blocks(plan, squares, some, found)
            lawns.append(lawn)
            points += count
            cut[some[smooth]] = False
        squares = squares.cut(cut.nonzero()[0], smaller, plan.region)
        clock("clear squares")
        report_progress(BLOCK_WORK_SHARE / side)
    squares = squares.within(bounds)
    rest = []
    cleared, batch, count = BLOCK_WORK_SHARE / SIDES[-1], plan.settings.batch, squares.x.size
    with progress_range(cleared, 1.0):
        for first in range(0, count, batch):
            plan.go_on()
            part = squares.part(first, first + batch)
            with progress_range(first / count, min((first + batch) / count, 1.0)):
                sheet = first_pass(plan, occluders, *part.middles, part.pairs, clock)
            rest.append((part.x, part.y, sheet))
    return FirstPass(lawns, rest, points)


def _interpolate_blocks(
    plan: Plan, squares: PixelBlocks, some: Ints, found: SmoothBlockFlags
) -> tuple[SmoothBlocks, Mask, int]:
    """Interpolate clear blocks, those where nothing changes abruptly.

    Returns the blocks that are smooth enough, which of the given ones those are, and the number of
    points shaded.
    """
    side, item, moving = squares.side, found.item[some], found.moving[some]
    color = np.zeros((3, 16, some.size))
    if not plan.transparent:
        color[:] = plan.background[:, None, None]
    seen, late = np.ones(some.size, dtype=np.bool_), np.zeros(some.size)
    points = 0
    for rows, times in ((~moving & (item >= 0), (0.0,)), (moving, GAUSS_TIMES)):
        hit = rows.nonzero()[0]
        if hit.size:
            across, up = squares.middles
            x, y = block_nodes(across[some[hit]], up[some[hit]], side)
            hidden = [np.tile(each[some[hit]], 16) for each in found.hidden]
            light, there = _shade(plan, x.ravel(), y.ravel(), np.tile(item[hit], 16), hidden, times)
            light = light.reshape(len(times), 3, 16, -1)
            color[:, :, hit], late[hit] = _shutter_means(light)
            seen[hit] = there.reshape(16, -1).all(axis=0)
            points += 16 * len(times) * hit.size
    coefficients = chebyshev_series(color)
    size = np.sqrt((color * color).mean(axis=(0, 1)))
    off = interpolation_error(coefficients) + late * size
    smooth = seen & (off <= ALLOWED_ERROR * plan.settings.tolerance * size)
    # sorted by object, so that the blocks of one object are one slice of the arrays
    index = smooth.nonzero()[0]
    index = index[np.argsort(item[index], kind="stable")]
    # radiance is never below 0, whatever the polynomial gives
    mean = np.maximum(block_means(columns(coefficients, index, -1), side), 0.0)
    lawn = _make_smooth_blocks(
        plan, squares, some[index], item[index], mean, off[index], moving[index]
    )
    return lawn, smooth, points


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
    x: Array,
    y: Array,
    item: Ints,
    hidden: list[Mask],
    times: tuple[float, ...],
) -> tuple[Array, Mask]:
    """Radiance (times, 3, n) of objects at pixel coordinates, and whether they are hit (n,).

    hidden : for each light (n,), whether it is occluded there; no other shadows are considered.
    """
    w = plan.lens.directions(x, y)
    t = intersect_pairs(plan, w, item)
    found = np.isfinite(t)
    hits = surface(plan, w, np.where(found, t, 1.0), item)
    light = [unshadowed_radiance(plan, hits, time, hidden) for time in times]
    return np.array(light), found


def _make_smooth_blocks(
    plan: Plan,
    squares: PixelBlocks,
    chosen: Ints,
    item: Ints,
    mean: Array,
    error: Array,
    moving: Mask,
) -> SmoothBlocks:
    """Smooth blocks of the chosen squares, by object, given their pixel means (3, s, s, n)."""
    side = squares.side
    x, y = squares.x[chosen], squares.y[chosen]
    depth, normal = np.full(mean.shape[1:], np.inf), np.zeros_like(mean)
    place = np.arange(side) + 0.5
    across, up = side * x + place[None, :, None], side * y + place[:, None, None]
    ends = np.append(np.diff(item).nonzero()[0] + 1, item.size)
    first = 0
    for last in ends.tolist():
        part = np.s_[..., first:last]
        if last > first and item[first] >= 0:
            depth[part], normal[part] = _geometry(plan, across[part], up[part], int(item[first]))
        first = last
    return SmoothBlocks(side, x, y, mean, error, item, depth, normal, moving)


def _geometry(plan: Plan, x: Array, y: Array, item: int) -> tuple[Array, Array]:
    """Depth and normal of an object that fills blocks of pixels; x is (1, s, n) and y (s, 1, n)."""
    if item >= plan.sphere_count:
        lens, own = plan.lens, slice(item - plan.sphere_count, item - plan.sphere_count + 1)
        across = cross(plan.quads.edge_u[:, own], plan.quads.edge_v[:, own])[:, 0]
        height = float(across @ plan.quads.corner[:, own][:, 0])
        facing = (across @ lens.base + x * (across @ lens.right)) + y * (across @ lens.up)
        # facing the camera
        unit = across / np.sqrt(across @ across) * (-1.0 if height > 0.0 else 1.0)
        return height / facing, unit[:, None, None, None]
    shape = np.broadcast_shapes(x.shape, y.shape)
    w = plan.lens.directions(*(np.broadcast_to(at, shape).ravel() for at in (x, y)))
    items = np.full(w.shape[1], item)
    t = intersect_pairs(plan, w, items)
    normal = surface(plan, w, t, items).normal
    return t.reshape(shape), normal.reshape(3, *shape)
