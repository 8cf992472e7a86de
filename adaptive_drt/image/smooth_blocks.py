# SPDX-License-Identifier: GPL-3.0-or-later
"""First pass over a tile: smooth blocks by interpolation from a few points, the rest pixel by
pixel.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from ..detection.detect import Clear, detect_clear, trace_center
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.vector import cross
from ..parallel.call_progress import part_of_call, tell
from ..shading.direct_light import unshadowed
from ..tracing.compile import Plan
from ..tracing.intersect import pair_hits, surface
from ..tracing.occluder_culling import Occluders
from .chebyshev_blocks import SIDES, Squares, coarse, means, nodes, roughness, series
from .first_pass import Lawn, Sheet, first_pass

__all__ = ["Survey", "survey"]

Clock: TypeAlias = Callable[[str], None]

TIMES = (-0.5 * np.sqrt(0.6), 0.0, 0.5 * np.sqrt(0.6))
"""Shutter times of a three-point Gauss rule, with the shutter from -0.5 to 0.5."""
LATE = 0.1
"""Relative error of the three-point rule in time, as a multiple of the third power of the relative
second difference of its samples. For example, 1 / (1 - e t)^3 has a second difference of 1.8 e^2,
and the rule leaves e^6 / 72."""
ALLOWED = 0.1
"""Largest interpolation error of a block, as a fraction of the tolerance times its own radiance."""
CLEARED = 0.2
"""Fraction of the work of a first pass that is done after the blocks of a side, multiplied by that
side in pixels; for a progress bar."""


@dataclass(frozen=True)
class Survey:
    """Results of the first pass: smooth blocks, all other pixels, and the points shaded for blocks.

    `rest` holds pixel coordinates x, y and their results.
    """

    lawns: list[Lawn]
    rest: list[tuple[Ints, Ints, Sheet]]
    points: int


def survey(
    plan: Plan, occluders: Occluders, bounds: Ints, squares: Squares, clock: Clock
) -> Survey:
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
            rough = coarse(plan, side)
            center = trace_center(rough, *squares.middles, squares.pairs)
            with part_of_call(CLEARED / (2 * side), CLEARED / side):
                found = detect_clear(rough, occluders, center, clock)
            squares = Squares(side, squares.x, squares.y, found.pairs)
            some = found.clear.nonzero()[0]
            lawn, smooth, count = _mow(plan, squares, some, found)
            lawns.append(lawn)
            points += count
            cut[some[smooth]] = False
        squares = squares.cut(cut.nonzero()[0], smaller, plan.region)
        clock("clear squares")
        tell(CLEARED / side)
    squares = squares.within(bounds)
    rest = []
    cleared, batch, count = CLEARED / SIDES[-1], plan.settings.batch, squares.x.size
    with part_of_call(cleared, 1.0):
        for first in range(0, count, batch):
            plan.go_on()
            part = squares.part(first, first + batch)
            with part_of_call(first / count, min((first + batch) / count, 1.0)):
                sheet = first_pass(plan, occluders, *part.middles, part.pairs, clock)
            rest.append((part.x, part.y, sheet))
    return Survey(lawns, rest, points)


def _mow(plan: Plan, squares: Squares, some: Ints, found: Clear) -> tuple[Lawn, Mask, int]:
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
    for rows, times in ((~moving & (item >= 0), (0.0,)), (moving, TIMES)):
        hit = rows.nonzero()[0]
        if hit.size:
            across, up = squares.middles
            x, y = nodes(across[some[hit]], up[some[hit]], side)
            hidden = [np.tile(each[some[hit]], 16) for each in found.hidden]
            light, there = _shade(plan, x.ravel(), y.ravel(), np.tile(item[hit], 16), hidden, times)
            light = light.reshape(len(times), 3, 16, -1)
            color[:, :, hit], late[hit] = _over_time(light)
            seen[hit] = there.reshape(16, -1).all(axis=0)
            points += 16 * len(times) * hit.size
    coefficients = series(color)
    size = np.sqrt((color * color).mean(axis=(0, 1)))
    off = roughness(coefficients) + late * size
    smooth = seen & (off <= ALLOWED * plan.settings.tolerance * size)
    # sorted by object, so that the blocks of one object are one slice of the arrays
    index = smooth.nonzero()[0]
    index = index[np.argsort(item[index], kind="stable")]
    # radiance is never below 0, whatever the polynomial gives
    mean = np.maximum(means(columns(coefficients, index, -1), side), 0.0)
    lawn = _lawn(plan, squares, some[index], item[index], mean, off[index], moving[index])
    return lawn, smooth, points


def _over_time(light: Array) -> tuple[Array, Array]:
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
    return mean, LATE * part**3


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
    t = pair_hits(plan, w, item)
    found = np.isfinite(t)
    hits = surface(plan, w, np.where(found, t, 1.0), item)
    light = [unshadowed(plan, hits, time, hidden) for time in times]
    return np.array(light), found


def _lawn(
    plan: Plan,
    squares: Squares,
    chosen: Ints,
    item: Ints,
    mean: Array,
    error: Array,
    moving: Mask,
) -> Lawn:
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
    return Lawn(side, x, y, mean, error, item, depth, normal, moving)


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
    t = pair_hits(plan, w, items)
    normal = surface(plan, w, t, items).normal
    return t.reshape(shape), normal.reshape(3, *shape)
