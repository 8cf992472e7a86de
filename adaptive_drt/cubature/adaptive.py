# SPDX-License-Identifier: GPL-3.0-or-later
"""Globally adaptive integration over pixel and shutter: the cells of largest error are subdivided.

A cell is a box in pixel x, pixel y and shutter time. Line samples with exact visibility events
divide it into visible regions, one for each object that is nearest somewhere in the cell. The mean
radiance of each region is estimated by a cubature rule, the simplest of which is one exact sample
at the centroid, correct for radiance linear in x, y and t. The error is predicted where the region
is shaded. Within each pixel the cells that contribute most are split until the error estimate of
the pixel meets its goal.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..lights.environment_backdrop import radiance_of_regions
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.floats import TINY
from ..numerics.gather import columns, place
from ..numerics.vector import rms
from ..parallel.call_progress import progress_range, report_progress
from ..shading.direct_light import DirectLight
from ..shading.sampled_occlusion import SAMPLING_ERROR_SHARE
from ..shading.variation import KINK_KIND, ROOT_KIND, SMOOTH_KIND, STEP_KIND, zero_variation
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs
from ..tracing.occluder_culling import Occluders
from ..visibility.fragments import Boxes, Fragments, empty_fragments, find_fragments
from .error_budget import Goal
from .evaluate import (
    SPLIT_ANYWAY_ERROR,
    Subdomains,
    concatenate_subdomains,
    estimate_means,
    multi_node_error,
)
from .nodes import rotation_index
from .regions import Cells, grouped_sums, merge, split
from .safety_factor import update_factors

__all__ = ["InitialCells", "RefinedPixels", "RefinementTask", "refine", "shade_initial_cells"]


MAX_ROUNDS = 32
"""Largest number of rounds, and so of successive splits of a cell."""
ROUND_WORK_SHARE = 0.3
"""Fraction of the remaining work of a call that one round does, roughly; for a progress bar."""
MAX_CELLS = 4096
"""Largest number of cells of a pixel ..."""
MAX_CELLS_NEAR_GOAL = 16_384
"""... and the same where that many will probably meet the goal. Moving hard shadows need them at
0.01 %."""
NEAR_GOAL = 5.0
"""Largest error of a pixel, as a multiple of its goal, that four times as many cells are expected
to bring below it (they leave a third of the error, and the goal grows by half)."""
MAX_ACTIVE_CELLS = 1 << 20
"""Approximate number of cells refined at a time; it bounds memory (some 300 bytes a cell)."""
SPLIT_THRESHOLD = 0.29
"""Cells are split if their error is at least this fraction of the largest of their pixel. The value
is no ratio that arises from equal parts (1/4, 1/8), or from a step that some nodes detected and
others did not (3/10), so that rounding does not decide."""
FOURFOLD_SPLIT_ERROR = 16.0
"""Error of a pixel, as a multiple of its goal, above which cells that are split along one axis are
split into four parts, not two. (Steps in time that the multi-node rule samples in halves are left
at 0.007 of their size before, and at 0.07 in one case of ten; thresholds of 7.3 and more take up to
8 % more points at 1 %.)"""
MOTION_SLACK = 1.25
"""Error of a pixel that has been split, as a multiple of its goal, at which refinement stops if
anything moves. A tenth of the pixels just miss their goals, and another round for so few takes a
time set by its number of calls. The goal accounts for it (see `ACHIEVED_ERROR`). Where nothing
moves, refinement takes only a round or two in any case."""
DOMINANT_CELL_SHARE = 0.5
"""Fraction of its pixel's error above which a single cell counts as dominant: then the pixel is
refined beyond `MAX_CELLS`, as a few more cells meet the goal. (A pixel whose last split revealed a
new feature: the estimate was 489 times the tolerance at 0.01 %, and is 10 times with this.)"""
AXIS_THRESHOLD = 0.4
"""A cell is split along each axis whose error is at least this fraction of that of its worst axis.
Chosen for cost, not fitted."""
HIDDEN_NODE_ERROR = 0.5
"""Error assigned to the fraction of a region's nodes that are hidden by another object, as a
fraction of the contrast. Chosen, not fitted: what is visible there instead may have any
radiance."""
MAX_LINES = 16
"""Largest number of line samples an axis for the shape of regions; instead of taking more, it is
better to split the cell."""
SHAPE_ERROR_SHARE = 0.7
"""Fraction of the goal that errors in the shape of regions may contribute to a pixel's error.
Chosen for cost, not fitted."""


@dataclass(frozen=True)
class RefinementTask:
    """Pixels to be refined.

    Attributes
    ----------
    cells : one initial cell for each pixel.
    unshaded : (n,) whether that cell has still to be shaded.
    item : (n,) object that fills a pixel which is not cut.
    cut : (n,) whether outlines or seams may pass through the pixel's domain.
    candidates : objects that may be visible in the pixels that are cut, sorted by pixel.
    goal : error goal of each pixel.
    growth : exponent of the number of a pixel's cells with which its goal grows.
    """

    cells: Cells
    unshaded: Mask
    item: Ints
    cut: Mask
    candidates: Pairs
    goal: Goal
    growth: float


@dataclass(frozen=True)
class RefinedPixels:
    """Refined pixels: `color` (3, n), `alpha` (n,), `samples` (n,) points shaded, `error` (n,)
    estimated, and `sampling` (n,), the part of it due to light that is not exact: see `Cells`.
    """

    color: Array
    alpha: Array
    samples: Ints
    error: Array
    sampling: Array


@dataclass(frozen=True)
class InitialCells:
    """Initial cells, shaded: `cells`, one a pixel; `samples` (n,) points shaded; `error` (n,)
    estimated.
    """

    cells: Cells
    samples: Ints
    error: Array


@dataclass(frozen=True)
class _PixelLimits:
    """Error limits of n pixels: `error` (n,), the goal at their present number of `cells` (n,)."""

    cells: Ints
    error: Array

    @classmethod
    def of(cls, task: RefinementTask, pixel: Ints) -> _PixelLimits:
        """Limits of a task's pixels, given the pixel index of every cell."""
        number = np.maximum(np.bincount(pixel, minlength=task.cut.size), 1)
        return cls(number, task.goal.error * number**task.growth)

    def error_weights(self, cells: Cells) -> tuple[Array, Ints]:
        """Pixel error, in units of the pixel's limit, per unit error of each cell, and the number
        of cells of its pixel: (c,) each.
        """
        most = np.maximum(self.error[cells.pixel], TINY)
        return cells.volume_fraction / most, self.cells[cells.pixel]


def shade_initial_cells(plan: Plan, occluders: Occluders, task: RefinementTask) -> InitialCells:
    """Shade the initial cells that are still blank, without refinement."""
    cells, samples = _initial_cells(plan, occluders, task)
    count = task.cut.size
    error = _pixel_errors(cells, count) + _sampling_errors(cells, count)
    return InitialCells(cells, samples, error)


def _initial_cells(plan: Plan, occluders: Occluders, task: RefinementTask) -> tuple[Cells, Ints]:
    """Initial cells, all shaded, and the number of points (n,) shaded so far."""
    plan.raise_if_cancelled()
    count = task.cut.size
    samples = np.ones(count, dtype=np.int64)
    cells = task.cells
    blank = task.unshaded.nonzero()[0]
    if blank.size:
        limits = _PixelLimits.of(task, cells.pixel)
        blanks, known = cells.take(blank), np.zeros(blank.size, dtype=np.bool_)
        done, points = _shade_cells(plan, occluders, task, blanks, limits, known)
        cells = merge([cells.take(~task.unshaded), done])
        samples += points
    return cells, samples


def refine(plan: Plan, occluders: Occluders, task: RefinementTask) -> RefinedPixels:
    """Refine pixels to their goal."""
    count = task.cut.size
    with progress_range(0.0, ROUND_WORK_SHARE):
        cells, samples = _initial_cells(plan, occluders, task)
    refined = RefinedPixels(np.zeros((3, count)), np.zeros(count), samples, *np.zeros((2, count)))
    safety, settled = np.ones(count), 0
    batches = [(cells, 0)]
    while batches:
        cells, rounds = batches.pop()
        limits, mean = _PixelLimits.of(task, cells.pixel), _pixel_means(cells, count)
        for turn in range(rounds, MAX_ROUNDS):
            plan.raise_if_cancelled()
            off = _pixel_errors(cells, count)
            slack = MOTION_SLACK if turn and plan.motion else 1.0
            chosen, parts = _choose_splits(limits, cells, off * safety, slack)
            split_up = np.unique(cells.pixel[chosen])
            kept = np.isin(cells.pixel, split_up)
            _add_pixels(refined, cells.take(~kept))
            settled += np.unique(cells.pixel[~kept]).size
            report_progress(settled / count)
            if not chosen.size:
                break
            kept[chosen] = False
            cells, (finer, known) = cells.take(kept), _replacement_cells(cells.take(chosen), parts)
            limits = _PixelLimits.of(task, np.concatenate([cells.pixel, finer.pixel]))
            part = (count - settled) / count
            with progress_range(1.0 - part, 1.0 - (1.0 - ROUND_WORK_SHARE) * part):
                done, points = _shade_cells(plan, occluders, task, finer, limits, known)
            samples += points
            cells = merge([cells, done])
            before, mean = mean, _pixel_means(cells, count)
            change = columns(mean - before, split_up)
            safety[split_up] = update_factors(safety[split_up], change, off[split_up])
            later = cells.pixel > cells.pixel[cells.pixel.size // 2]
            if cells.pixel.size > MAX_ACTIVE_CELLS and later.any():
                # pixels are independent: one half is refined after the other
                batches.append((cells.take(later), turn + 1))
                cells = cells.take(~later)
        else:
            _add_pixels(refined, cells)
    return refined


def _add_pixels(refined: RefinedPixels, cells: Cells) -> None:
    """Add the results of pixels all of whose cells are given."""
    count = refined.alpha.size
    refined.color[:] += _pixel_means(cells, count)
    refined.alpha[:] += grouped_sums(cells.pixel, cells.volume_fraction * cells.alpha, count)
    sampling = _sampling_errors(cells, count)
    refined.error[:] += _pixel_errors(cells, count) + sampling
    refined.sampling[:] += sampling


def _pixel_means(cells: Cells, count: int) -> Array:
    """Mean radiance of pixels: (3, count)."""
    return np.array(
        [grouped_sums(cells.pixel, cells.volume_fraction * c, count) for c in cells.color]
    )


def _pixel_errors(cells: Cells, count: int) -> Array:
    """Errors of pixels that subdivision reduces, estimated: (count,). Bends have one sign and are
    added; roots, kinks, steps and errors of shape have random signs, and their squares are added.
    """
    by_kind = cells.deviation.sum(axis=1)
    bends = grouped_sums(cells.pixel, cells.volume_fraction * by_kind[SMOOTH_KIND], count)
    rest = cells.volume_fraction * (
        by_kind[ROOT_KIND] + by_kind[KINK_KIND] + by_kind[STEP_KIND] + cells.shape_error
    )
    error: Array = bends + np.sqrt(grouped_sums(cells.pixel, rest * rest, count))
    return error


def _sampling_errors(cells: Cells, count: int) -> Array:
    """Errors of pixels due to estimates of light that are not exact: (count,).

    All points use the same rays to a light, so that the errors of a pixel's cells have one sign.
    """
    return grouped_sums(cells.pixel, cells.volume_fraction * cells.sampling, count)


def _choose_splits(
    limits: _PixelLimits, cells: Cells, error: Array, slack: float
) -> tuple[Ints, Ints]:
    """Choose the cells to split (k,) and the number of parts along each axis (3, k).

    Parameters
    ----------
    limits : of the pixels.
    error : (count,) errors of the pixels that subdivision reduces, times their safety factors.
    slack : multiple of its limit up to which the error of a pixel is accepted.
    """
    limit, own = limits.error, cells.error
    worst = np.zeros(error.size)
    np.maximum.at(worst, cells.pixel, own)
    likely = (error < NEAR_GOAL * limit) | (worst > DOMINANT_CELL_SHARE * error)
    open_ = (error > slack * limit) & (
        limits.cells < np.where(likely, MAX_CELLS_NEAR_GOAL, MAX_CELLS)
    )
    chosen = (
        open_[cells.pixel] & (own >= SPLIT_THRESHOLD * worst[cells.pixel]) & (own > 0.0)
    ).nonzero()[0]
    part = cells.take(chosen)
    wide = part.high > part.low
    by_axis = part.deviation.sum(axis=0) * wide
    # errors of shape: split across the picture, or in time if the cell extends only in time
    flat = wide[0] | wide[1]
    by_axis[:2] += part.shape_error * wide[:2]
    by_axis[2] += part.shape_error * (wide[2] & ~flat)
    largest = by_axis.max(axis=0, initial=0.0)
    cut = (by_axis >= AXIS_THRESHOLD * largest) & (by_axis > 0.0)
    with np.errstate(over="ignore"):  # lights of 1e30 next to a picture of 1e-214
        excess = (error / limit)[part.pixel]
    far = (excess > FOURFOLD_SPLIT_ERROR) & (cut.sum(axis=0) == 1)
    # the multi-node rule gains more than a split, unless its error would still exceed the limit
    gone = part.multi_node | (part.shape_error > part.deviation.sum(axis=(0, 1)))
    left = part.volume_fraction * multi_node_error(part.deviation, wide.sum(axis=0))
    cut &= gone | (left > SPLIT_ANYWAY_ERROR * limit[part.pixel])
    parts = np.where(cut, np.where(far, 4, 2), 1)
    some = cut.any(axis=0) | ~part.multi_node
    return chosen[some], columns(parts, some)


def _replacement_cells(cells: Cells, parts: Ints) -> tuple[Cells, Mask]:
    """Cells that replace given ones: their children, or where there is one part the same cell, for
    which the multi-node rule may then be used.

    Returns with them (c,) which are the same cells: unless outlines cut them, their centroids have
    been shaded.
    """
    finer = split(replace(cells, multi_node=np.ones(cells.pixel.size, dtype=np.bool_)), parts)
    size = parts.prod(axis=0)
    same = (size == 1).nonzero()[0]
    rows = np.cumsum(size)[same] - 1
    place(finer.color, rows, columns(cells.color, same))
    place(finer.deviation, rows, columns(cells.deviation, same, -1))
    finer.sampling[rows] = cells.sampling[same]
    known = np.zeros(finer.pixel.size, dtype=np.bool_)
    known[rows] = True
    return finer, known


def _shade_cells(
    plan: Plan,
    occluders: Occluders,
    task: RefinementTask,
    cells: Cells,
    limits: _PixelLimits,
    known: Mask,
) -> tuple[Cells, Ints]:
    """Shade cells; returns them with colours and errors, and the number of points (n,) shaded a
    pixel.

    known : (c,) cells that hold the colour and predicted error of their centroid, unless outlines
    cut them.

    Cells filled by one object and the visible regions of the other cells are shaded in one batch.
    """
    cut = task.cut[cells.pixel]
    crossed, filled = cells.take(cut.nonzero()[0]), cells.take((~cut).nonzero()[0])
    found = _find_regions(plan, task, crossed) if crossed.pixel.size else empty_fragments()
    hit = (found.item >= 0).nonzero()[0]
    parts = concatenate_subdomains(
        _region_subdomains(crossed, found, hit, limits),
        _whole_subdomains(task, filled, crossed, limits, known[~cut]),
    )
    allowed = SAMPLING_ERROR_SHARE * task.goal.error
    samples = estimate_means(plan, occluders, parts, found, hit, allowed)
    light = samples.light
    own, rest = slice(hit.size), slice(hit.size, None)
    done = []
    if filled.pixel.size:
        opacity = plan.opacity(parts.item[rest])
        done.append(_whole_cells(filled, light, rest, ~samples.split_anyway[rest], opacity))
    if crossed.pixel.size:
        light = DirectLight(light.color[:, own], light.deviation[..., own], light.error[own])
        light.deviation[STEP_KIND] += (
            HIDDEN_NODE_ERROR
            * task.goal.contrast
            * samples.hidden_fraction[own]
            * (parts.half_extent[:, own] > 0.0)
        )
        star = crossed.multi_node.copy()
        star[found.box[hit]] &= ~samples.split_anyway[own]
        crossed = replace(crossed, multi_node=star)
        done.append(_cells_from_regions(plan, task, crossed, found, hit, light))
    pixel = np.concatenate([crossed.pixel[found.box[hit]], filled.pixel])
    shaded = np.bincount(np.repeat(pixel, samples.shaded_count), minlength=task.cut.size)
    return (merge(done) if len(done) > 1 else done[0]), shaded


def _whole_cells(cells: Cells, light: DirectLight, part: slice, star: Mask, alpha: Array) -> Cells:
    """Cells that one object fills, shaded: their light is a part of that of all subdomains.

    star : (c,) whether the multi-node rule is not in vain.  alpha : (c,) coverage.
    """
    color, deviation, sampling = light.color[:, part], light.deviation[..., part], light.error[part]
    star = cells.multi_node & star
    return replace(
        cells, color=color, alpha=alpha, deviation=deviation, multi_node=star, sampling=sampling
    )


def _find_regions(plan: Plan, task: RefinementTask, cells: Cells) -> Fragments:
    """Visible regions of cells that are cut by outlines."""
    accuracy = (
        SHAPE_ERROR_SHARE * task.goal.error / (task.goal.contrast * np.sqrt(cells.volume_fraction))
    )
    candidates = task.candidates.for_pixels(cells.pixel, task.cut.size)
    return find_fragments(plan, Boxes(cells.low, cells.high), candidates, accuracy, MAX_LINES)


def _whole_subdomains(
    task: RefinementTask, cells: Cells, before: Cells, limits: _PixelLimits, known: Mask
) -> Subdomains:
    """Subdomains for cells that are filled by one object, numbered after the cells `before`."""
    middle, half = 0.5 * (cells.low + cells.high), 0.5 * (cells.high - cells.low)
    spread = np.zeros((6, cells.pixel.size))
    spread[[0, 2, 5]] = half / np.sqrt(3.0)
    number = before.pixel.size + np.arange(cells.pixel.size)
    item, error_weights = task.item[cells.pixel], limits.error_weights(cells)
    turn, light = (
        rotation_index(middle),
        (
            columns(cells.color, known),
            columns(cells.deviation, known, -1),
            cells.sampling[known],
        ),
    )
    return Subdomains(
        middle, spread, half, item, number, cells.multi_node, turn, *error_weights, known, *light
    )


def _region_subdomains(
    cells: Cells, found: Fragments, hit: Ints, limits: _PixelLimits
) -> Subdomains:
    """Subdomains for the visible regions that show an object."""
    box, spread = found.box[hit], columns(found.cholesky, hit)
    half = np.minimum(0.5 * columns(cells.high - cells.low, box), _half_extents(spread))
    error_weight, cell_count = limits.error_weights(cells)
    error_weight = found.weight[hit] * error_weight[box]
    centroid, item = columns(found.centroid, hit), found.item[hit]
    turn = rotation_index(0.5 * (cells.low + cells.high))[box]
    star, each, known = (
        cells.multi_node[box],
        (error_weight, cell_count[box]),
        np.zeros(hit.size, dtype=np.bool_),
    )
    light = np.zeros((3, 0)), zero_variation(0), np.zeros(0)
    return Subdomains(centroid, spread, half, item, box, star, turn, *each, known, *light)


def _cells_from_regions(
    plan: Plan, task: RefinementTask, cells: Cells, found: Fragments, hit: Ints, light: DirectLight
) -> Cells:
    """Cells composed of their visible regions.

    hit : the regions that show an object.  light : radiance and errors of those.
    """
    count = cells.pixel.size
    backdrop = np.zeros(3) if plan.transparent else plan.background
    color = np.empty((3, found.box.size))
    color[:] = backdrop[:, None]
    color[:, hit] = light.color
    unsure = _show_backdrop(plan, cells, found, color)
    mean = np.array([grouped_sums(found.box, found.weight * c, count) for c in color])
    box, weight = found.box[hit], found.weight[hit]
    deviation = np.array(
        [[grouped_sums(box, weight * row, count) for row in kind] for kind in light.deviation]
    )
    away = rms(color - columns(mean, found.box))
    edge = grouped_sums(found.box, found.error * away, count)
    edge += task.goal.contrast * found.missed_weight
    if unsure is not None:
        off = grouped_sums(found.box, found.weight * unsure, count)
        wide = cells.high[:2] > cells.low[:2]
        deviation[KINK_KIND, :2] += off / np.maximum(wide.sum(axis=0), 1) * wide
    deviation[STEP_KIND, 2] += _contrasts(task, cells, found, away) * found.motion_error
    alpha = np.ones(count)
    if plan.holdout is not None:
        alpha = grouped_sums(found.box, found.weight * plan.opacity(found.item), count)
    elif plan.transparent:
        alpha = grouped_sums(box, weight, count)
    sampling = grouped_sums(box, weight * light.error, count)
    return replace(
        cells, color=mean, alpha=alpha, deviation=deviation, shape_error=edge, sampling=sampling
    )


def _show_backdrop(plan: Plan, cells: Cells, found: Fragments, color: Array) -> Array | None:
    """Enter the colours (3, m) of regions that show an environment; returns their errors (m,)."""
    if plan.backdrop is None or plan.transparent:
        return None
    rows, error = (found.item < 0).nonzero()[0], np.zeros(found.item.size)
    low, high = (columns(ends[:2], found.box[rows]) for ends in (cells.low, cells.high))
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    centroid = columns(found.centroid[:2], rows)
    color[:, rows], error[rows] = radiance_of_regions(
        plan.backdrop, plan.lens, middle, half, centroid
    )
    return error


def _contrasts(task: RefinementTask, cells: Cells, found: Fragments, away: Array) -> Array:
    """Contrasts (c,) that scale errors of areas which fast outlines sweep between the lines.

    A cell's own regions do not show what its lines missed: all cells of the pixel count, and at
    least the contrast of the picture. (A spot of 72 times that contrast, which a sphere covers
    after a twentieth of the shutter: 2,000 cells kept the whole shutter, with the same lines in
    time, and the pixel was off by 11 times its estimate.)

    away : (m,) differences between the radiance of visible regions and the means of their cells.
    """
    contrast = np.full(task.cut.size, task.goal.contrast)
    np.maximum.at(contrast, cells.pixel[found.box], away)
    return contrast[cells.pixel]


def _half_extents(spread: Array) -> Array:
    """Half extents (3, m) of boxes with given roots of second moments."""
    xx, yx, yy, tx, ty, tt = spread * spread
    extent: Array = np.sqrt(3.0 * np.array([xx, yx + yy, tx + ty + tt]))
    return extent
