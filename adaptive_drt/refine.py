# SPDX-License-Identifier: GPL-3.0-or-later
"""Means over pixels and shutter, to a goal: cells are split where they are least sure.

A cell is a box of a pixel's square and the shutter. Lines with exact events cut it into regions,
one for each object that is nearest somewhere in it, and each region is shaded once, exactly, at
its centroid: that is right for radiance linear in x, y and t. How far it may be from that is
estimated where it is shaded; the cells that matter most are split until their pixel's estimate
meets its goal.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from .ahead import hits_or_near
from .cells import Cells, merge, split
from .goal import Goal
from .lines import TIME
from .occluder import Occluders
from .patch import make_patch
from .plan import Plan
from .primary import Pairs, places, surface
from .regions import Boxes, Regions, find_regions
from .shade import Shaded, shade
from .stray import kept_parts
from .variation import BENDS, KINKS, STEPS
from .vector import dot

__all__ = ["Refined", "Task", "refine"]

Array: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Mask: TypeAlias = NDArray[np.bool_]

ROUNDS = 24
"""Splits of a cell at most: an axis is cut into 2^24 parts at the very most."""
MOST_CELLS = 4096
"""Cells of a pixel at most."""
CROWD = 1 << 20
"""Cells at a time, about: bounds memory (some 300 bytes a cell)."""
WORST = 0.3
"""Of the worst cell's error in its pixel: cells from there on are split with it. No ratio that
equal parts bring about (1/4, 1/8), so that rounding does not choose."""
FAR = 7.3
"""Times its goal: a pixel so far off has its cells cut into four, not two."""
AXIS = 0.4
"""Of the worst axis' error in a cell: axes from there on are cut with it."""
STAR = np.array([0.04, 0.15, 0.5])
"""Of the deviation of a centroid's sample: that of a star's mean, by kind: about
twice what was measured, 0.02, 0.07 and 0.3."""
CORNERS = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])
"""Of a cube: the star in three dimensions, (samples, axes). Exact for quadratics as six arms along
the axes are, in four samples, and not as far out."""
INSIDE = 1.0 - 2.0**-10
"""Of a star's arms: of a box or a triangle they would end on a side. Whether a point on an outline
is hit, or one on a seam is inside another object, is for rounding to say; this keeps the points
off, and the quadrature's second moments to a five hundredth."""
ASIDE = 2.0**-30
"""Of the shutter: regions whose centroids are nearer to its middle lie in it but for rounding."""
STRAY = 0.5
"""Of the contrast: how far a region may be off whose sample sees another object's place."""
LINES = 16
"""Lines an axis, at most, that show the shape of regions: with more, cells are better split."""
EDGE_SHARE = 0.7
"""Of the goal: what the shape of regions may add to a pixel's error."""


@dataclass(frozen=True)
class Task:
    """Pixels to refine.

    Attributes
    ----------
    cells : one root a pixel. Those that are not `cut` are shaded already.
    item : (n,) the object that fills a pixel that is not cut.
    cut : (n,) whether outlines or seams may pass through the pixel's domain.
    rivals : of cut pixels, the objects that may be seen; sorted by pixel.
    goal : what each pixel is refined to.
    """

    cells: Cells
    item: Ints
    cut: Mask
    rivals: Pairs
    goal: Goal


@dataclass(frozen=True)
class Refined:
    """Refined pixels: `color` (3, n), `alpha` (n,), `samples` (n,) shaded points, `error` (n,)."""

    color: Array
    alpha: Array
    samples: Ints
    error: Array


def refine(plan: Plan, occluders: Occluders, task: Task) -> Refined:
    """Resolve pixels to their goal."""
    count = task.cut.size
    samples = np.ones(count, dtype=np.int64)
    cells = task.cells
    raw = np.flatnonzero(task.cut[cells.pixel])
    if raw.size:
        done, points = _shaded(plan, occluders, task, cells.take(raw))
        cells = merge([cells.take(~task.cut[cells.pixel]), done])
        samples += points
    color, alpha, error = np.zeros((3, count)), np.zeros(count), np.zeros(count)
    crowds = [(cells, 0)]
    while crowds:
        cells, rounds = crowds.pop()
        for turn in range(rounds, ROUNDS):
            plan.go_on()
            chosen, parts = _choose(task, cells, count)
            if not chosen.size:
                break
            kept = np.ones(cells.pixel.size, dtype=np.bool_)
            kept[chosen] = False
            done, points = _shaded(plan, occluders, task, _finer(cells.take(chosen), parts))
            samples += points
            cells = merge([cells.take(kept), done])
            later = cells.pixel > cells.pixel[cells.pixel.size // 2]
            if cells.pixel.size > CROWD and later.any():
                # pixels know nothing of each other: one half after the other
                crowds.append((cells.take(later), turn + 1))
                cells = cells.take(~later)
        color += np.stack([_sum(cells.pixel, cells.share * c, count) for c in cells.color])
        alpha += _sum(cells.pixel, cells.share * cells.alpha, count)
        error += _error(cells, count)
    return Refined(color, alpha, samples, error)


def _error(cells: Cells, count: int) -> Array:
    """Estimated error of pixels (count,): bends add up, the signs of kinks and steps are random."""
    by_kind = cells.deviation.sum(axis=1)
    bends = _sum(cells.pixel, cells.share * by_kind[BENDS], count)
    rest = cells.share * (by_kind[KINKS] + by_kind[STEPS] + cells.edge)
    error: Array = bends + np.sqrt(_sum(cells.pixel, rest * rest, count))
    return error


def _choose(task: Task, cells: Cells, count: int) -> tuple[Ints, Ints]:
    """Cells to split, and into how many parts along each axis: (k,) and (3, k)."""
    error = _error(cells, count)
    number = np.bincount(cells.pixel, minlength=count)
    open_ = (error > task.goal.error) & (number < MOST_CELLS)
    own = cells.error
    worst = np.zeros(count)
    np.maximum.at(worst, cells.pixel, own)
    chosen = np.flatnonzero(open_[cells.pixel] & (own >= WORST * worst[cells.pixel]) & (own > 0.0))
    part = cells.take(chosen)
    wide = part.high > part.low
    by_axis = part.deviation.sum(axis=0) * wide
    # the shape of regions: cut across the picture, and in time where there is nothing else
    flat = wide[0] | wide[1]
    by_axis[:2] += part.edge * wide[:2]
    by_axis[2] += part.edge * (wide[2] & ~flat)
    largest = by_axis.max(axis=0, initial=0.0)
    cut = (by_axis >= AXIS * largest) & (by_axis > 0.0)
    excess = error[part.pixel] / task.goal.error
    far = (excess > FAR) & (cut.sum(axis=0) == 1)
    # a star gains more than a split does
    cut &= part.star | (part.edge > part.deviation.sum(axis=(0, 1)))
    parts = np.where(cut, np.where(far, 4, 2), 1)
    some = cut.any(axis=0) | ~part.star
    return chosen[some], parts[:, some]


def _finer(cells: Cells, parts: Ints) -> Cells:
    """Blank cells in place of some: their parts, or the same to be sampled by stars."""
    return split(replace(cells, star=np.ones(cells.pixel.size, dtype=np.bool_)), parts)


def _shaded(plan: Plan, occluders: Occluders, task: Task, cells: Cells) -> tuple[Cells, Ints]:
    """The cells with their colours and errors, and the points (n,) shaded in each pixel."""
    count = task.cut.size
    cut = task.cut[cells.pixel]
    parts, points = [], np.zeros(count, dtype=np.int64)
    for rows, shaded in ((np.flatnonzero(~cut), _plain), (np.flatnonzero(cut), _by_regions)):
        if rows.size:
            done, where = shaded(plan, occluders, task, cells.take(rows))
            parts.append(done)
            points += np.bincount(where, minlength=count)
    return merge(parts), points


def _plain(plan: Plan, occluders: Occluders, task: Task, cells: Cells) -> tuple[Cells, Ints]:
    """Cells that one object fills."""
    middle, half = 0.5 * (cells.low + cells.high), 0.5 * (cells.high - cells.low)
    spread = np.zeros((6, cells.pixel.size))
    spread[[0, 2, 5]] = half / np.sqrt(3.0)
    light, points, _ = _sample(
        plan, occluders, middle, spread, half, task.item[cells.pixel], cells.star
    )
    done = replace(
        cells,
        color=light.color,
        alpha=np.ones(cells.pixel.size),
        deviation=light.deviation,
    )
    return done, np.repeat(cells.pixel, points)


def _sample(
    plan: Plan,
    occluders: Occluders,
    place: Array,
    spread: Array,
    half: Array,
    item: Ints,
    star: Mask,
    found: tuple[Regions, Ints] | None = None,
) -> tuple[Shaded, Ints, Array]:
    """Mean light of regions (m,), by their centroids or by stars, and the points that took.

    Parameters
    ----------
    place : (3, m) centroids.  spread : (6, m) lower triangular roots of their second moments:
        xx, yx, yy, tx, ty, tt.  half : (3, m) half the extents of their boxes.
    found : where there are others beside them: all regions, and which of them (m,) these are.

    Returns with it the part (m,) of their points that none saw where it should be.
    """
    region, offset, lot = _arms(place[2], spread, half > 0.0, star)
    count = np.bincount(region, minlength=item.size)
    at = place[:, region]
    short, lost = np.zeros(region.size), np.zeros(region.size)
    if found is not None:
        kept, stray = kept_parts(plan, found[0], found[1][region], at, offset, half[:, region], lot)
        offset *= kept
        short, lost = 1.0 - kept * kept, stray.astype(np.float64)
    light = _look(plan, occluders, at + offset, half[:, region], item[region], count)
    part = 1.0 / count[region]

    def mean(values: Array) -> Array:
        return np.stack([_sum(region, part * row, item.size) for row in values])

    gain = np.where(count[region] > 1, STAR[:, None] + (1.0 - STAR[:, None]) * short, 1.0)
    deviation = np.stack([mean(kind * g) for kind, g in zip(light.deviation, gain, strict=True)])
    return Shaded(mean(light.color), deviation), count, _sum(region, part * lost, item.size)


def _arms(time: Array, spread: Array, wide: Mask, star: Mask) -> tuple[Ints, Array, Ints]:
    """Samples of regions (m,) at times; wide : (3, m) axes that they extend along.

    A tetrahedron has a sense of direction. It follows the side of the shutter that a region lies
    on, so that a reversed shutter gives the same picture; one that lies on both gets a star.

    Returns
    -------
    region : (k,) which one each stands for.  offset : (3, k) from its centroid.
    lot : (k,) numbers of those samples that balance each other.
    """
    axes = wide.sum(axis=0)
    side = np.where(np.abs(time) > ASIDE, np.sign(time), 0.0)
    cube = star & (axes == 3) & (side != 0.0)
    count = np.where(star & (axes > 0), np.where(cube, len(CORNERS), 2 * axes), 1)
    region = np.repeat(np.arange(count.size), count)
    number = places(count)
    inner = cube[region]
    many, sign = count[region] > 1, np.where(number % 2 == 0, 1.0, -1.0)
    # which axis an arm is along: the k-th of those that are wide
    order = np.cumsum(wide, axis=0) - 1
    offset = np.zeros((3, region.size))
    for axis, columns in ((0, (0, 1, 3)), (1, (-1, 2, 4)), (2, (-1, -1, 5))):
        own = many & wide[axis, region] & (inner | (order[axis, region] == number // 2))
        rows = np.flatnonzero(own)
        which = region[rows]
        corner = CORNERS[number[rows] % len(CORNERS), axis]
        if axis == TIME:
            corner = corner * side[which]
        length = np.where(inner[rows], corner, sign[rows] * np.sqrt(axes[which]))
        for along, column in enumerate(columns):
            if column >= 0:
                offset[along, rows] += length * spread[column, which] * INSIDE
    first = np.where(inner, number == 0, number % 2 == 0)
    return region, offset, np.cumsum(first) - 1


def _by_regions(plan: Plan, occluders: Occluders, task: Task, cells: Cells) -> tuple[Cells, Ints]:
    """Cells with outlines in them."""
    accuracy = EDGE_SHARE * task.goal.error / (task.goal.contrast * np.sqrt(cells.share))
    rivals = _of_cells(task.rivals, cells.pixel, task.cut.size)
    found = find_regions(plan, Boxes(cells.low, cells.high), rivals, accuracy, LINES)
    count = cells.pixel.size
    hit = np.flatnonzero(found.item >= 0)
    box = found.box[hit]
    half = np.minimum(0.5 * (cells.high - cells.low)[:, box], _extent(found.spread[:, hit]))
    light, points, lost = _sample(
        plan, occluders, found.place[:, hit], found.spread[:, hit], half, found.item[hit],
        cells.star[box], (found, hit),
    )  # fmt: skip
    light.deviation[STEPS] += STRAY * task.goal.contrast * lost * (half > 0.0)
    backdrop = np.zeros(3) if plan.transparent else plan.background
    color = np.empty((3, found.box.size))
    color[:] = backdrop[:, None]
    color[:, hit] = light.color
    mean = np.stack([_sum(found.box, found.weight * c, count) for c in color])
    weight = found.weight[hit]
    deviation = np.stack(
        [[_sum(box, weight * row, count) for row in kind] for kind in light.deviation]
    )
    away = color - mean[:, found.box]
    edge = _sum(found.box, found.error * np.sqrt(dot(away, away) / 3.0), count)
    edge += task.goal.contrast * found.missed
    deviation[STEPS, 2] += task.goal.contrast * found.late
    alpha = np.ones(count)
    if plan.transparent:
        alpha = _sum(box, weight, count)
    done = replace(cells, color=mean, alpha=alpha, deviation=deviation, edge=edge)
    return done, np.repeat(cells.pixel[box], points)


def _extent(spread: Array) -> Array:
    """Half the extents (3, m) of even regions with these roots of second moments."""
    xx, yx, yy, tx, ty, tt = spread * spread
    extent: Array = np.sqrt(3.0 * np.stack([xx, yx + yy, tx + ty + tt]))
    return extent


def _look(
    plan: Plan, occluders: Occluders, place: Array, half: Array, item: Ints, sizes: Ints
) -> Shaded:
    """Light from objects at places (3, m) in x, y and t that stand for boxes of half extents.

    `sizes` are numbers of places that belong together.
    """
    w = plan.lens.directions(place[0], place[1])
    time: Array | float = place[2] if plan.motion else 0.0
    t = hits_or_near(plan, w, item, time)
    hits = surface(plan, w, t, item, time)
    with np.errstate(over="ignore", invalid="ignore"):  # sizes that only estimates hang on
        patch = make_patch(plan, w, t, hits, half)
    return shade(plan, occluders, hits, time, patch, sizes=sizes)


def _of_cells(rivals: Pairs, pixel: Ints, count: int) -> Pairs:
    """The rivals of each cell's pixel: pairs (cell, object)."""
    start = np.searchsorted(rivals.pixel, np.arange(count + 1))
    size = (start[1:] - start[:-1])[pixel]
    cell = np.repeat(np.arange(pixel.size), size)
    return Pairs(cell, rivals.item[np.repeat(start[pixel], size) + places(size)])


def _sum(row: Ints, values: Array, count: int) -> Array:
    """Sums (count,) of the values of each row, in their order."""
    return np.bincount(row, weights=values, minlength=count).astype(np.float64, copy=False)
