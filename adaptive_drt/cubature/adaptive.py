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

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.floats import TINY
from ..numerics.gather import columns, place
from ..numerics.vector import rms
from ..parallel.call_progress import part_of_call, tell
from ..shading.direct_light import Shaded
from ..shading.variation import BENDS, KINKS, ROOTS, STEPS, no_variation
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs
from ..tracing.occluder_culling import Occluders
from ..visibility.fragments import Boxes, Regions, find_regions, no_regions
from .error_budget import Goal
from .evaluate import IN_VAIN, Parts, join, left_by_stars, sample
from .nodes import turns
from .regions import Cells, merge, split, sums
from .safety_factor import learn

__all__ = ["Begun", "Refined", "Task", "begin", "refine"]


ROUNDS = 32
"""Splits of a cell at most: an axis is cut into 2^32 parts at the very most."""
ROUND = 0.3
"""Of what is left of a call's work, about: what one round does. For a progress bar."""
MOST_CELLS = 4096
"""Cells of a pixel at most ..."""
MORE_CELLS = 16_384
"""... and where that many are likely to settle it. Hard shadows that move take them at 0.01 %."""
NEARLY = 5.0
"""Times its limit: the error of a pixel that four times as many cells settle (they leave a third of
it, and the limit grows by half)."""
CROWD = 1 << 20
"""Cells at a time, about: bounds memory (some 300 bytes a cell)."""
WORST = 0.29
"""Of the worst cell's error in its pixel: cells from there on are split with it. No ratio that
equal parts bring about (1/4, 1/8), or a step that stars met and did not meet (3/10), so that
rounding does not choose."""
FAR = 16.0
"""Times its goal: a pixel so far off has its cells cut into four, not two. (Steps in time that
stars sample in halves are left at 0.007 of before, and at 0.07 in one of ten; from 7.3 on it
takes up to 8 % more points at 1 %.)"""
SLACK = 1.25
"""Times its limit: what may be left of a pixel that has been split, where anything moves. A tenth
of the pixels just miss their limits, and a round for them takes as long as it has calls. The goal
is foreseen with it (see `REACHED`). Where nothing moves, it lasts a round or two in any case."""
DOMINANT = 0.5
"""Of its pixel's error: that of a cell that is split even if there are `MOST_CELLS` of them: a
few cells more settle it. (A pixel whose last split met what no other had: estimates of 489 times
the tolerance at 0.01 %, and of 10 with this.)"""
AXIS = 0.4
"""Of the worst axis' error in a cell: axes from there on are cut with it."""
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
    cells : one root a pixel.
    blank : (n,) whether that is yet to be shaded.
    item : (n,) the object that fills a pixel that is not cut.
    cut : (n,) whether outlines or seams may pass through the pixel's domain.
    rivals : of cut pixels, the objects that may be seen; sorted by pixel.
    goal : what each pixel is refined to.
    growth : power of the number of a pixel's cells by which its goal grows.
    """

    cells: Cells
    blank: Mask
    item: Ints
    cut: Mask
    rivals: Pairs
    goal: Goal
    growth: float


@dataclass(frozen=True)
class Refined:
    """Refined pixels: `color` (3, n), `alpha` (n,), `samples` (n,) shaded points, `error` (n,)."""

    color: Array
    alpha: Array
    samples: Ints
    error: Array


@dataclass(frozen=True)
class Begun:
    """Pixels' roots, shaded: `cells`, one a pixel; `samples` (n,) points; `error` (n,)."""

    cells: Cells
    samples: Ints
    error: Array


@dataclass(frozen=True)
class _Limits:
    """Of n pixels: `error` (n,), what each may be off by, now that it has `cells` (n,)."""

    cells: Ints
    error: Array

    @classmethod
    def of(cls, task: Task, pixel: Ints) -> _Limits:
        """The limits of a task's pixels, by the pixels of all their cells."""
        number = np.maximum(np.bincount(pixel, minlength=task.cut.size), 1)
        return cls(number, task.goal.error * number**task.growth)

    def stakes(self, cells: Cells) -> tuple[Array, Ints]:
        """Of what their pixels may be off by, what errors of 1 in cells are; and how many cells
        these have: (c,) each."""
        most = np.maximum(self.error[cells.pixel], TINY)
        return cells.share / most, self.cells[cells.pixel]


def begin(plan: Plan, occluders: Occluders, task: Task) -> Begun:
    """Shade the roots that are blank, and no more."""
    cells, samples = _roots(plan, occluders, task)
    return Begun(cells, samples, _error(cells, task.cut.size))


def _roots(plan: Plan, occluders: Occluders, task: Task) -> tuple[Cells, Ints]:
    """The roots, all shaded, and the points (n,) that took."""
    plan.go_on()
    count = task.cut.size
    samples = np.ones(count, dtype=np.int64)
    cells = task.cells
    blank = task.blank.nonzero()[0]
    if blank.size:
        limits = _Limits.of(task, cells.pixel)
        blanks, known = cells.take(blank), np.zeros(blank.size, dtype=np.bool_)
        done, points = _shaded(plan, occluders, task, blanks, limits, known)
        cells = merge([cells.take(~task.blank), done])
        samples += points
    return cells, samples


def refine(plan: Plan, occluders: Occluders, task: Task) -> Refined:
    """Resolve pixels to their goal."""
    count = task.cut.size
    with part_of_call(0.0, ROUND):
        cells, samples = _roots(plan, occluders, task)
    refined = Refined(np.zeros((3, count)), np.zeros(count), samples, np.zeros(count))
    strain, settled = np.ones(count), 0
    crowds = [(cells, 0)]
    while crowds:
        cells, rounds = crowds.pop()
        limits, mean = _Limits.of(task, cells.pixel), _means(cells, count)
        for turn in range(rounds, ROUNDS):
            plan.go_on()
            off = _error(cells, count)
            slack = SLACK if turn and plan.motion else 1.0
            chosen, parts = _choose(limits, cells, off * strain, slack)
            split_up = np.unique(cells.pixel[chosen])
            kept = np.isin(cells.pixel, split_up)
            _enter(refined, cells.take(~kept))
            settled += np.unique(cells.pixel[~kept]).size
            tell(settled / count)
            if not chosen.size:
                break
            kept[chosen] = False
            cells, (finer, known) = cells.take(kept), _finer(cells.take(chosen), parts)
            limits = _Limits.of(task, np.concatenate([cells.pixel, finer.pixel]))
            part = (count - settled) / count
            with part_of_call(1.0 - part, 1.0 - (1.0 - ROUND) * part):
                done, points = _shaded(plan, occluders, task, finer, limits, known)
            samples += points
            cells = merge([cells, done])
            before, mean = mean, _means(cells, count)
            change = columns(mean - before, split_up)
            strain[split_up] = learn(strain[split_up], change, off[split_up])
            later = cells.pixel > cells.pixel[cells.pixel.size // 2]
            if cells.pixel.size > CROWD and later.any():
                # pixels know nothing of each other: one half after the other
                crowds.append((cells.take(later), turn + 1))
                cells = cells.take(~later)
        else:
            _enter(refined, cells)
    return refined


def _enter(refined: Refined, cells: Cells) -> None:
    """Enter pixels whose cells are all there."""
    count = refined.alpha.size
    refined.color[:] += _means(cells, count)
    refined.alpha[:] += sums(cells.pixel, cells.share * cells.alpha, count)
    refined.error[:] += _error(cells, count)


def _means(cells: Cells, count: int) -> Array:
    """Mean radiance (3, count) of pixels."""
    return np.array([sums(cells.pixel, cells.share * c, count) for c in cells.color])


def _error(cells: Cells, count: int) -> Array:
    """Estimated error of pixels (count,): bends add up, the signs of kinks and steps are random."""
    by_kind = cells.deviation.sum(axis=1)
    bends = sums(cells.pixel, cells.share * by_kind[BENDS], count)
    rest = cells.share * (by_kind[ROOTS] + by_kind[KINKS] + by_kind[STEPS] + cells.edge)
    error: Array = bends + np.sqrt(sums(cells.pixel, rest * rest, count))
    return error


def _choose(limits: _Limits, cells: Cells, error: Array, slack: float) -> tuple[Ints, Ints]:
    """Cells to split, and into how many parts along each axis: (k,) and (3, k).

    error : (count,) of pixels.  slack : times their limits, what they may be off by.
    """
    limit, own = limits.error, cells.error
    worst = np.zeros(error.size)
    np.maximum.at(worst, cells.pixel, own)
    likely = (error < NEARLY * limit) | (worst > DOMINANT * error)
    open_ = (error > slack * limit) & (limits.cells < np.where(likely, MORE_CELLS, MOST_CELLS))
    chosen = (open_[cells.pixel] & (own >= WORST * worst[cells.pixel]) & (own > 0.0)).nonzero()[0]
    part = cells.take(chosen)
    wide = part.high > part.low
    by_axis = part.deviation.sum(axis=0) * wide
    # the shape of regions: cut across the picture, and in time where there is nothing else
    flat = wide[0] | wide[1]
    by_axis[:2] += part.edge * wide[:2]
    by_axis[2] += part.edge * (wide[2] & ~flat)
    largest = by_axis.max(axis=0, initial=0.0)
    cut = (by_axis >= AXIS * largest) & (by_axis > 0.0)
    with np.errstate(over="ignore"):  # lights of 1e30 beside a picture of 1e-214
        excess = (error / limit)[part.pixel]
    far = (excess > FAR) & (cut.sum(axis=0) == 1)
    # a star gains more than a split does, but in vain where it leaves more than the pixel may
    gone = part.star | (part.edge > part.deviation.sum(axis=(0, 1)))
    left = part.share * left_by_stars(part.deviation, wide.sum(axis=0))
    cut &= gone | (left > IN_VAIN * limit[part.pixel])
    parts = np.where(cut, np.where(far, 4, 2), 1)
    some = cut.any(axis=0) | ~part.star
    return chosen[some], columns(parts, some)


def _finer(cells: Cells, parts: Ints) -> tuple[Cells, Mask]:
    """Cells to shade in place of some: their parts, or the same to be sampled by stars.

    Returns with them (c,) which are the same: their centroids are shaded, if nothing cuts them.
    """
    finer = split(replace(cells, star=np.ones(cells.pixel.size, dtype=np.bool_)), parts)
    size = parts.prod(axis=0)
    same = (size == 1).nonzero()[0]
    rows = np.cumsum(size)[same] - 1
    place(finer.color, rows, columns(cells.color, same))
    place(finer.deviation, rows, columns(cells.deviation, same, -1))
    known = np.zeros(finer.pixel.size, dtype=np.bool_)
    known[rows] = True
    return finer, known


def _shaded(
    plan: Plan, occluders: Occluders, task: Task, cells: Cells, limits: _Limits, known: Mask
) -> tuple[Cells, Ints]:
    """The cells with their colours and errors, and the points (n,) shaded in each pixel.

    known : (c,) which have the colours and deviations of their centroids, if nothing cuts them.

    Those that one object fills and the regions of the others are shaded together.
    """
    cut = task.cut[cells.pixel]
    crossed, filled = cells.take(cut.nonzero()[0]), cells.take((~cut).nonzero()[0])
    found = _find_regions(plan, task, crossed) if crossed.pixel.size else no_regions()
    hit = (found.item >= 0).nonzero()[0]
    parts = join(
        _region_parts(crossed, found, hit, limits),
        _whole_parts(task, filled, crossed, limits, known[~cut]),
    )
    samples = sample(plan, occluders, parts, found, hit)
    light = samples.light
    own, rest = slice(hit.size), slice(hit.size, None)
    done = []
    if filled.pixel.size:
        ones = np.ones(filled.pixel.size)
        color, deviation = light.color[:, rest], light.deviation[..., rest]
        star = filled.star & ~samples.vain[rest]
        whole = replace(filled, color=color, alpha=ones, deviation=deviation, star=star)
        done.append(whole)
    if crossed.pixel.size:
        light = Shaded(light.color[:, own], light.deviation[..., own])
        light.deviation[STEPS] += (
            STRAY * task.goal.contrast * samples.lost[own] * (parts.half[:, own] > 0.0)
        )
        star = crossed.star.copy()
        star[found.box[hit]] &= ~samples.vain[own]
        crossed = replace(crossed, star=star)
        done.append(_assembled(plan, task, crossed, found, hit, light))
    pixel = np.concatenate([crossed.pixel[found.box[hit]], filled.pixel])
    shaded = np.bincount(np.repeat(pixel, samples.points), minlength=task.cut.size)
    return (merge(done) if len(done) > 1 else done[0]), shaded


def _find_regions(plan: Plan, task: Task, cells: Cells) -> Regions:
    """The regions of cells with outlines in them."""
    accuracy = EDGE_SHARE * task.goal.error / (task.goal.contrast * np.sqrt(cells.share))
    rivals = task.rivals.of(cells.pixel, task.cut.size)
    return find_regions(plan, Boxes(cells.low, cells.high), rivals, accuracy, LINES)


def _whole_parts(task: Task, cells: Cells, before: Cells, limits: _Limits, known: Mask) -> Parts:
    """Cells that one object fills, numbered after those `before`."""
    middle, half = 0.5 * (cells.low + cells.high), 0.5 * (cells.high - cells.low)
    spread = np.zeros((6, cells.pixel.size))
    spread[[0, 2, 5]] = half / np.sqrt(3.0)
    number = before.pixel.size + np.arange(cells.pixel.size)
    item, stakes = task.item[cells.pixel], limits.stakes(cells)
    turn, light = turns(middle), (columns(cells.color, known), columns(cells.deviation, known, -1))
    return Parts(middle, spread, half, item, number, cells.star, turn, *stakes, known, *light)


def _region_parts(cells: Cells, found: Regions, hit: Ints, limits: _Limits) -> Parts:
    """The regions of cells that show an object."""
    box, spread = found.box[hit], columns(found.spread, hit)
    half = np.minimum(0.5 * columns(cells.high - cells.low, box), _extent(spread))
    stake, crowd = limits.stakes(cells)
    stake = found.weight[hit] * stake[box]
    centroid, item = columns(found.place, hit), found.item[hit]
    turn = turns(0.5 * (cells.low + cells.high))[box]
    star, each, known = cells.star[box], (stake, crowd[box]), np.zeros(hit.size, dtype=np.bool_)
    light = np.zeros((3, 0)), no_variation(0)
    return Parts(centroid, spread, half, item, box, star, turn, *each, known, *light)


def _assembled(
    plan: Plan, task: Task, cells: Cells, found: Regions, hit: Ints, light: Shaded
) -> Cells:
    """Cells made of their regions, those that `hit` something with their light."""
    count = cells.pixel.size
    backdrop = np.zeros(3) if plan.transparent else plan.background
    color = np.empty((3, found.box.size))
    color[:] = backdrop[:, None]
    color[:, hit] = light.color
    mean = np.array([sums(found.box, found.weight * c, count) for c in color])
    box, weight = found.box[hit], found.weight[hit]
    deviation = np.array(
        [[sums(box, weight * row, count) for row in kind] for kind in light.deviation]
    )
    away = color - columns(mean, found.box)
    edge = sums(found.box, found.error * rms(away), count)
    edge += task.goal.contrast * found.missed
    deviation[STEPS, 2] += task.goal.contrast * found.late
    alpha = np.ones(count)
    if plan.transparent:
        alpha = sums(box, weight, count)
    return replace(cells, color=mean, alpha=alpha, deviation=deviation, edge=edge)


def _extent(spread: Array) -> Array:
    """Half the extents (3, m) of even regions with these roots of second moments."""
    xx, yx, yy, tx, ty, tt = spread * spread
    extent: Array = np.sqrt(3.0 * np.array([xx, yx + yy, tx + ty + tt]))
    return extent
