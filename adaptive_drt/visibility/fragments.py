# SPDX-License-Identifier: GPL-3.0-or-later
"""Visible fragments: the parts of boxes in pixel and time in which each object is the nearest.

Lines run through a box along the axis that is most nearly normal to the outlines in it, and are
divided at exactly computed events (outlines, and points where two objects have equal depth). Only
the other axes are sampled, at the middles of the cells of a lattice. Along those axes the visible
length is continuous with kinks, so that the error falls with the square of the number of lines an
axis (Billen and Dutre 2016; Gribel, Barringer and Akenine-Moller 2011).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..geometry.line_forms import BoxCoverage
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.axes import TIME
from ..numerics.box_polynomials import Boxes
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.line_lattice import Lattice, SideLattice
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs
from .depth_order import find_depth_order
from .event_smoothness import find_smooth_boxes
from .line_intervals import depth_coefficients, evaluate_depth
from .line_visibility import visible_moments
from .moments import KINK_ERROR, MIN_WEIGHT, SQUARE_INDICES, MomentSums
from .polynomials import CandidatePolynomials, make_polynomials
from .unordered_pairs import UnorderedPairs

__all__ = ["MAX_REFINED_CANDIDATES", "Boxes", "Fragments", "empty_fragments", "find_fragments"]


BACKGROUND = -1
"""Item of the fragment in which nothing is hit."""
MIN_LINES = 4
"""Least number of lines an axis: fewer have no second differences, from which errors are
estimated."""
MAX_REFINED_CANDIDATES = 4
"""Number of candidates above which a box gets no more than the least number of lines. The cost
grows with the square of the number of candidates, and parts of the box have fewer (25 moving
spheres that overlap, 1 %: 9.7 s, and 4.6 s)."""
MAX_SLOPE = 4.0
"""Largest slope of outlines against the lines that is assumed in advance, as change along the lines
per change across them. Errors of steeper outlines are left to what the lines measure."""
MIN_SLOPE = 0.05
"""Least slope of outlines against the lines that is assumed, even if they seem normal to the
lines."""
EQUAL_AXIS_RATIO = 1.0 - 2.0**-20
"""Fraction of the best axis' component from which another axis counts as equally good. The first of
them is taken, so that rounding does not decide."""
STEP_DEVIATION = 0.3
"""Standard deviation of a step at a random position, as a fraction of the step in a cell between
lines. Derived: 1 / sqrt(12) = 0.2887, rounded up."""
MAX_STANDARD_DEVIATION = 0.5
"""Largest standard deviation of points in a box, as a fraction of its size."""
DEPTH_PROBES = (np.full((1, 1, 1), -0.25), np.full((1, 1, 1), 0.25))
"""Normalized coordinates at which the depths of two objects are compared, to find along which axis
the difference changes most."""
BATCH_SIZE = 1 << 18
"""Number of candidates times lines times spans in one batch. It bounds memory; with smaller
batches, threads wait for each other."""


@dataclass(frozen=True)
class Fragments:
    """Visible fragments, sorted by box, then item.

    Attributes
    ----------
    box, item : (m,) the box, and the nearest object, -1 where nothing is hit.
    weight : (m,) fraction of the box; the weights in a box sum to 1.
    centroid : (3, m) centroids in x, y, t.
    cholesky : (6, m) lower triangular Cholesky factor of the central second moments: xx, yx, yy,
        tx, ty, tt.
    error : (m,) estimate of the absolute error of the weight.
    missed_weight : (n,) estimate of the largest weight, in each box, of an object that no line met.
    motion_error : (n,) the same for objects that appear and disappear sooner than they cross the
        box, and at least the error from outlines that move too fast for lines in the picture plane.
    """

    box: Ints
    item: Ints
    weight: Array
    centroid: Array
    cholesky: Array
    error: Array
    missed_weight: Array
    motion_error: Array


def empty_fragments() -> Fragments:
    """Empty fragments, of no box."""
    none, index = np.zeros(0), np.zeros(0, dtype=np.int64)
    return Fragments(index, index, none, np.zeros((3, 0)), np.zeros((6, 0)), none, none, none)


@dataclass(frozen=True)
class _Candidates:
    """The m candidates that may be visible in n boxes.

    They are sorted by box and then by depth or, where the depth order is not known, by item. In
    boxes with lines along y, x and y are exchanged, so that lines run along the first axis.

    Attributes
    ----------
    count, start : (n,) number of candidates of each box, and index of the first.
    ordered : (n,) whether the depth order is the same for all rays.
    unordered : the pairs whose depth order is not known.
    covered : (n,) whether a candidate covers the box, so that the background is not visible.
    extended : (3, n) axes along which the box extends; t only where a candidate moves.
    swapped : (n,) whether x and y are exchanged.
    along_time : (n,) whether lines run along t and not along the first axis.
    slope : (n,) slope of outlines against the lines, from `MIN_SLOPE` to `MAX_SLOPE`.
    motion_slope : (n,) slope of outlines against the lines by their motion alone, where lines along
        t are not allowed; else 0.
    """

    pairs: Pairs
    forms: CandidatePolynomials
    cover: BoxCoverage
    count: Ints
    start: Ints
    ordered: Mask
    unordered: UnorderedPairs
    covered: Mask
    extended: Mask
    swapped: Mask
    along_time: Mask
    slope: Array
    motion_slope: Array


def find_fragments(
    plan: Plan, boxes: Boxes, pairs: Pairs, accuracy: Array | float, most: int = 32
) -> Fragments:
    """Find which object is the nearest in each part of each box.

    Parameters
    ----------
    pairs : candidates (box, object) in any order: at least all objects that may be visible.
    accuracy : absolute error of a weight to aim at, a number or (n,). Boxes with more than
    `MAX_REFINED_CANDIDATES` candidates are not refined to it.
    most : largest number of lines an axis, of the axes that lines do not run along; at least 4 are
    taken.

    The fragments of a box do not depend on what other boxes there are, to the last bit.
    """
    count = boxes.low.shape[1]
    found = _candidates(plan, boxes, pairs)
    m = found.pairs.item.size
    sums = MomentSums.zeros(m + count)
    alone = (found.covered & (found.count == 1)).nonzero()[0]
    empty = (found.count == 0).nonzero()[0]
    sums.weight[found.start[alone]] = 1.0
    sums.weight[m + empty] = 1.0
    whole = np.concatenate([found.start[alone], m + empty])
    for k in (0, 1, 2):
        sums.second[SQUARE_INDICES[k], whole] = 1.0 / 12.0
    todo = np.ones(count, dtype=np.bool_)
    todo[alone] = todo[empty] = False
    goal = np.broadcast_to(np.asarray(accuracy, dtype=np.float64), (count,))
    _refine_lines(plan, found, goal, most, todo.nonzero()[0], sums)
    finest = np.where(found.count > MAX_REFINED_CANDIDATES, MIN_LINES, max(most, MIN_LINES))
    error = np.minimum(KINK_ERROR * found.motion_slope / finest, STEP_DEVIATION) / finest
    error = np.where(found.motion_slope > MAX_SLOPE, error, 0.0)
    return _make_fragments(boxes, found, sums, error)


def _candidates(plan: Plan, boxes: Boxes, pairs: Pairs) -> _Candidates:
    """Remove hidden candidates, find the depth order and choose the axis of the lines."""
    forms, cover, pairs = _unhidden_candidates(plan, boxes, pairs)
    n, box = boxes.low.shape[1], pairs.pixel
    count = np.bincount(box, minlength=n)
    rank, ordered, curved, unsure = find_depth_order(plan, boxes, pairs, cover, count)
    covered, moving = np.zeros((2, n), dtype=np.bool_)
    covered[box[cover.all_hit]] = True
    moving[box[plan.is_moving[pairs.item]]] = True
    extended = boxes.size > 0.0
    extended[TIME] &= moving
    overlap = ((box[1:] == box[:-1]) & ~ordered[box[1:]]).nonzero()[0]
    # along t the equal-depth events of two solids have degree four: only where there is no other
    # axis
    allowed = extended.copy()
    allowed[TIME] &= ~curved | ~(extended[0] | extended[1])
    axis, slope = _choose_axis(forms, cover, box, overlap, allowed)
    # by item where the order is not known: of objects equally deep the first wins
    order = np.lexsort((np.where(ordered[box], rank, pairs.item), box))
    forms, cover, pairs = forms.take(order), cover.take(order), pairs.take(order)
    now = np.empty(order.size, dtype=np.int64)
    now[order] = np.arange(order.size)
    unordered = UnorderedPairs.from_pairs((now[unsure[0]], now[unsure[1]]), box, count)
    motion_slope = _motion_slope(cover, box, axis, extended[TIME] & ~allowed[TIME])
    # exchange x and y, so that boxes with lines along x and along y are in one group
    swapped, along_time = axis == 1, axis == TIME
    own = swapped[box].nonzero()[0]
    if own.size:
        forms.swap_axes(swapped[box])
        for pair in (cover.outline_normal, cover.apparent_size):
            pair[0, own], pair[1, own] = pair[1, own], pair[0, own]
        extended[0, swapped], extended[1, swapped] = extended[1, swapped], extended[0, swapped]
    return _Candidates(
        pairs, forms, cover, count, np.cumsum(count) - count, ordered, unordered, covered, extended,
        swapped, along_time, slope, motion_slope,
    )  # fmt: skip


def _unhidden_candidates(
    plan: Plan, boxes: Boxes, pairs: Pairs
) -> tuple[CandidatePolynomials, BoxCoverage, Pairs]:
    """Candidates that are not hidden in their whole boxes, sorted by box and then by depth."""
    forms, cover = make_polynomials(plan, boxes, pairs)
    front = np.full(boxes.low.shape[1], np.inf)
    full = cover.all_hit.nonzero()[0]
    np.minimum.at(front, pairs.pixel[full], cover.far[full])
    kept = (cover.may_hit & (cover.near <= front[pairs.pixel])).nonzero()[0]
    # of equal lower bounds the candidate with the lesser upper bound is first, whatever the order
    # in the scene
    by = (pairs.item, cover.far, cover.near, pairs.pixel)
    kept = kept[np.lexsort([key[kept] for key in by])]
    return forms.take(kept), cover.take(kept), pairs.take(kept)


def _motion_slope(cover: BoxCoverage, box: Ints, axis: Ints, barred: Mask) -> Array:
    """Slopes (n,) of outlines against lines along `axis` (n,) by their motion alone.

    They are 0 outside the boxes `barred` (n,), in which something moves but lines may not run along
    t.
    """
    slope = np.zeros(axis.size)
    rows = barred[box].nonzero()[0]
    normal = columns(cover.outline_normal, rows)
    along = normal[axis[box[rows]], np.arange(rows.size)]
    np.maximum.at(slope, box[rows], normal[TIME] / np.maximum(along, MIN_WEIGHT))
    return slope


def _choose_axis(
    forms: CandidatePolynomials, cover: BoxCoverage, box: Ints, overlap: Ints, allowed: Mask
) -> tuple[Ints, Array]:
    """Choose the axis of the lines in each box, and estimate the slope of outlines against them.

    It is the axis whose least component, over the normals of outlines and of surfaces of equal
    depth, is largest. Returns the axis (n,) and the slope (n,); see `_Candidates.slope`.

    Parameters
    ----------
    overlap : (p,) candidates whose depth order against the next one may change.
    allowed : (3, n) whether lines may run along the axis.
    """
    normal = np.where(allowed, 1.0, -1.0)
    for k in range(3):
        np.minimum.at(normal[k], box, cover.outline_normal[k])
    if overlap.size:
        one, other = forms.take(overlap), forms.take(overlap + 1)
        slopes = np.zeros((3, overlap.size))
        for k in range(3):
            lattice = Lattice(k, 1, 1)
            tables = depth_coefficients(one, lattice), depth_coefficients(other, lattice)
            with np.errstate(invalid="ignore", over="ignore"):  # infinite depths: see `near`
                gaps = [
                    evaluate_depth(tables[0], s) - evaluate_depth(tables[1], s)
                    for s in DEPTH_PROBES
                ]
                slopes[k] = np.abs(gaps[1] - gaps[0])[0, 0] / (DEPTH_PROBES[1] - DEPTH_PROBES[0])
                middle = np.abs(gaps[0] + gaps[1])[0, 0] / 2.0
        total = slopes[0] + slopes[1] + slopes[2]
        near = (middle <= 0.5 * total) & (total > 0.0) & np.isfinite(total)
        for k in range(3):
            share = np.where(near, slopes[k], 1.0) / np.where(near, total, 1.0)
            np.minimum.at(normal[k], box[overlap], share)
    normal = np.where(allowed, normal, -1.0)
    best = normal.max(axis=0)
    axis: Ints = np.argmax(normal >= EQUAL_AXIS_RATIO * best, axis=0)
    return axis, _outline_slope(cover, box, best)


def _outline_slope(cover: BoxCoverage, box: Ints, best: Array) -> Array:
    """Slope (n,) of outlines against lines along an axis; `best` is the least component of their
    normals.

    The normals are known at the middles of boxes. The outlines turn towards the sides, and where
    two outlines cross there is a corner.
    """
    straight = np.sqrt(np.maximum(1.0 - best * best, 0.0)) / np.maximum(best, TINY)
    turn = np.zeros(best.size)
    np.maximum.at(turn, box, cover.outline_turn)
    turn[np.bincount(box[~cover.all_hit], minlength=turn.size) > 1] = 1.0
    # 1 for an outline with equal components along all three axes; with several outlines no axis may
    # suit all of them
    slope: Array = np.clip(straight / np.sqrt(2.0) + turn, MIN_SLOPE, MAX_SLOPE)
    return slope


def _refine_lines(
    plan: Plan, found: _Candidates, goal: Array, most: int, todo: Ints, sums: MomentSums
) -> None:
    """Measure the boxes `todo` along lines; double the number of lines an axis until `goal` is
    met."""
    m, box = found.pairs.item.size, found.pairs.pixel
    key = (found.count * 2 + found.along_time) * 2 + found.ordered
    key = ((key * 2 + found.extended[0]) * 2 + found.extended[1]) * 2 + found.extended[2]
    key = key * (1 + found.unordered.capacity.max(initial=0)) + found.unordered.capacity
    lines = MIN_LINES
    crowded = found.count > MAX_REFINED_CANDIDATES
    # one sampled axis at most, or no kinks: few lines are enough
    few = (found.extended.sum(axis=0) < 2) | crowded | _smooth_boxes(found, todo, goal)
    while todo.size:
        last = 2 * lines > most
        # with fewer lines a kink next to the side of the box could remain undetected
        ready = goal[todo] * (lines * lines) >= KINK_ERROR * found.slope[todo]
        ready |= few[todo] | last
        for some in _groups_by_key(key, todo[ready]):
            plan.raise_if_cancelled()
            _measure_group(found, some, goal, lines, sums)
        if last:
            return
        worst = sums.error[m:].copy()
        np.maximum.at(worst, box, sums.error[:m])
        todo = todo[~ready | (worst[todo] > goal[todo]) & ~crowded[todo]]
        lines *= 2


def _smooth_boxes(found: _Candidates, todo: Ints, goal: Array) -> Mask:
    """Boxes (n,) in which visible lengths along t have no kinks, among those where that saves
    lines."""
    count = found.count.size
    asked = np.zeros(count, dtype=np.bool_)
    asked[todo] = goal[todo] * MIN_LINES**2 < KINK_ERROR * found.slope[todo]
    asked &= found.along_time & found.ordered
    rows = asked[found.pairs.pixel].nonzero()[0]
    if not rows.size:
        return asked
    box, full = found.pairs.pixel[rows], found.cover.all_hit[rows]
    return asked & find_smooth_boxes(found.forms.take(rows), full, box, count)


def _groups_by_key(key: Ints, some: Ints) -> Iterator[Ints]:
    """Split the boxes `some` into groups of equal keys."""
    order = some[np.argsort(key[some], kind="stable")]
    if order.size:
        yield from np.split(order, np.diff(key[order]).nonzero()[0] + 1)


def _measure_group(
    found: _Candidates, group: Ints, goal: Array, lines: int, sums: MomentSums
) -> None:
    """Measure boxes with the same number of candidates, axis, kind of order and extended sides."""
    first = int(group[0])
    k, ordered = int(found.count[first]), bool(found.ordered[first])
    axis = TIME if found.along_time[first] else 0
    wide, m = found.extended[:, first], found.pairs.item.size
    rows, columns = (lines if wide[other] else 1 for other in range(3) if other != axis)
    lattice = Lattice(axis, rows, columns)
    spans = 1 if ordered and k < 3 else 2 * (k + int(found.unordered.capacity[first])) + 1
    step = max(BATCH_SIZE // (k * rows * columns * spans), 1)
    for at in range(0, group.size, step):
        some = group[at : at + step]
        index = found.start[some] + np.arange(k)[:, None]
        flat = index.ravel()
        part, full = found.forms.take(flat), found.cover.all_hit[flat]
        unordered = None if ordered else found.unordered.for_boxes(some, index[0])
        seen = visible_moments(part, full, lattice, k, unordered)
        place = np.concatenate([index, m + some[None]])
        sums.add(seen, lattice, place)
        if rows * columns > 1:
            sums.raise_errors(found.cover, index, wide, axis, lines)
        # an outline at a random position is beyond the outermost lines in one case of `lines`
        along = (found.slope[some] >= MAX_SLOPE) & (goal[some] < STEP_DEVIATION / lines**1.5)
        along &= sums.error[place].max(axis=0) <= goal[some]
        along = along.nonzero()[0]
        if along.size:
            _check_sides(found, some[along], place[:, along], seen[0][..., along], lattice, sums)
        none = m + some[found.covered[some]]
        sums.weight[none] = sums.error[none] = 0.0


def _check_sides(
    found: _Candidates, some: Ints, place: Ints, length: Array, lattice: Lattice, sums: MomentSums
) -> None:
    """Detect outlines parallel to the lines, between the outermost lines and the sides of the box.

    Such an outline shows as a jump between the outermost line and one on the side. Errors are
    increased in place.

    Parameters
    ----------
    place : (k + 1, n) entries of the candidates in `sums`, and of the background.
    length : (k + 1, rows, columns, n) visible lengths.
    """
    k, flat = len(place) - 1, place[:-1].ravel()
    part, full = found.forms.take(flat), found.cover.all_hit[flat]
    unordered = None if found.ordered[some[0]] else found.unordered.for_boxes(some, place[0])
    axis, rows, columns = lattice.axis, lattice.rows, lattice.columns
    for size, sides, direction in ((rows, (2, columns), 1), (columns, (rows, 2), 2)):
        if size == 1:
            continue
        beside = visible_moments(part, full, SideLattice(axis, *sides), k, unordered)[0]
        last = np.take(length, (0, -1), axis=direction)
        jump = np.abs(beside - last).mean(axis=3 - direction).max(axis=1)
        sums.error[place] = np.maximum(sums.error[place], STEP_DEVIATION / size * jump)


def _make_fragments(
    boxes: Boxes, found: _Candidates, sums: MomentSums, motion_error: Array
) -> Fragments:
    """Fragments with a weight, sorted, with weights normalized to a sum of 1 in each box.

    motion_error : (n,) error from outlines that move too fast for the lines; changed in centroid.
    """
    count, pairs = boxes.low.shape[1], found.pairs
    every = np.concatenate([pairs.pixel, np.arange(count)])
    item = np.concatenate([pairs.item, np.full(count, BACKGROUND)])
    kept = (sums.weight > MIN_WEIGHT).nonzero()[0]
    kept = kept[np.lexsort((item[kept], every[kept]))]
    box, item, weight = every[kept], item[kept], sums.weight[kept]
    moment, second = columns(sums.moment, kept), columns(sums.second, kept)
    swapped = found.swapped[box].nonzero()[0]
    for values, one, other in ((moment, 0, 1), (second, 0, 2), (second, 3, 4)):
        values[one, swapped], values[other, swapped] = values[other, swapped], values[one, swapped]
    centroid = np.clip(moment / weight, -0.5, 0.5)
    cholesky = _cholesky_factor(second / weight, centroid)
    for k, axis in enumerate((0, 1, 1, 2, 2, 2)):
        cholesky[k] *= boxes.size[axis, box]
    centroid = columns(boxes.middle, box) + columns(boxes.size, box) * centroid
    total = np.bincount(box, weight, minlength=count)
    missed_weight = np.zeros(count)
    unseen = (sums.weight <= MIN_WEIGHT).nonzero()[0]
    # an object that appears and disappears sooner than it crosses the box is resolved by shorter
    # times
    own = (unseen < pairs.item.size).nonzero()[0]
    x, y, t = columns(found.cover.outline_normal, unseen[own])
    soon = np.zeros(unseen.size, dtype=np.bool_)
    soon[own] = (t > np.maximum(x, y)) & found.extended[TIME, every[unseen[own]]]
    for error, some in ((missed_weight, unseen[~soon]), (motion_error, unseen[soon])):
        np.maximum.at(error, every[some], sums.error[some])
    weight, error = weight / total[box], sums.error[kept]
    return Fragments(box, item, weight, centroid, cholesky, error, missed_weight, motion_error)


def _cholesky_factor(second: Array, centroid: Array) -> Array:
    """Cholesky factors (6, m) of central second moments, from centroids and moments about 0."""
    x, y, t = centroid
    xx, yx, yy, tx, ty, tt = second - np.array([x * x, x * y, y * y, t * x, t * y, t * t])
    out = np.zeros_like(second)
    out[0] = np.sqrt(np.maximum(xx, 0.0))
    a = np.maximum(out[0], MIN_WEIGHT)
    out[1], out[3] = yx / a, tx / a
    out[2] = np.sqrt(np.maximum(yy - out[1] ** 2, 0.0))
    b = np.maximum(out[2], MIN_WEIGHT)
    out[4] = (ty - out[1] * out[3]) / b
    out[5] = np.sqrt(np.maximum(tt - out[3] ** 2 - out[4] ** 2, 0.0))
    # rounding in thin fragments must not give a deviation that the box does not allow
    return np.clip(out, -MAX_STANDARD_DEVIATION, MAX_STANDARD_DEVIATION)
