# SPDX-License-Identifier: GPL-3.0-or-later
"""Nested occluders: circular outlines that, as seen from a point, lie within another one.

Their occluders hide nothing more of a light that is behind both. The area that k outlines enclose
costs k^2 arcs. In a heap of spheres most of those in front of a light are nested in larger or
nearer ones.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns, place
from ..numerics.vector import dot
from ..parallel.call_progress import progress_range, report_progress
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface

__all__ = ["find_nested"]


MIN_CIRCLES = 4
"""Number of circular outlines in front of a light from which the search pays: of so many a tenth is
nested."""
TWO_PASS_CIRCLES, LARGEST_CIRCLES = 24, 6
"""Numbers of circular outlines for the search in several passes.

From `TWO_PASS_CIRCLES` of them in front of a light, all are first compared with the
`LARGEST_CIRCLES` by apparent size, and then the remaining ones with each other: 2,000 that overlap
took half of a survey in pairs. Where many remain, they are first compared with `PASS_GROWTH` times
as many of the largest, and so on: of 15,000 balls before a light 18 remain in the end.
"""
PASS_GROWTH = 4
"""Factor on both numbers from one pass to the next."""
BATCH_PAIRS = 1 << 16
"""Approximate number of pairs of outlines in a batch."""
ROUNDING_ANGLE = 16.0 * 2.0**-53
"""Bound in radians on the sum of the rounding errors of directions, sines and cosines of
outlines."""


def find_nested(plan: Plan, surface: Surface, pairs: Pairs, time: Array | float) -> Mask:
    """Whether each occluder (m,) is nested in another one of the same point; conservative.

    It is marked only if that is certain under rounding.

    Parameters
    ----------
    pairs : points and occluders whose outlines are circles, sorted by point.
    time : shutter time, a number or (m,).
    """
    hidden = np.zeros(pairs.item.size, dtype=np.bool_)
    number = np.bincount(pairs.pixel, minlength=surface.item.size)
    if number.max(initial=0) < MIN_CIRCLES:
        return hidden
    start = np.cumsum(number) - number
    v, r = _outline_spheres(plan, surface, pairs, time)
    length = np.sqrt(dot(v, v))
    axis, sine = v / length, r / length
    cosine = np.sqrt(np.maximum((length - r) * (length + r), 0.0)) / length
    left, factor = np.where(number >= MIN_CIRCLES, number, 0), 1
    rows = np.arange(pairs.item.size)
    while left.max() >= factor * TWO_PASS_CIRCLES:
        largest, crowd = factor * LARGEST_CIRCLES, left >= factor * TWO_PASS_CIRCLES
        with progress_range(0.5 - 0.5 / factor, 0.5):
            for part in _batches_by_count(plan, np.where(crowd, left, 0), start, largest):
                index = rows[part]
                cones = columns(axis, index), sine[index], cosine[index]
                large = np.argpartition(cones[1], -largest, axis=0)[-largest:]
                hidden[index] = _nested_cones(*cones, large)
        # a nested cone need not be compared: a cone within it is also within the one that contains
        # both
        rows = (~hidden).nonzero()[0]
        many = np.bincount(pairs.pixel[rows], minlength=number.size)
        left, start = np.where(number >= MIN_CIRCLES, many, 0), np.cumsum(many) - many
        factor *= PASS_GROWTH
    with progress_range(0.5, 1.0):
        for part in _batches_by_count(plan, left, start, 0):
            index = rows[part]
            hidden[index] = _nested_cones(columns(axis, index), sine[index], cosine[index])
    return hidden


def _outline_spheres(
    plan: Plan, surface: Surface, pairs: Pairs, time: Array | float
) -> tuple[Array, Array]:
    """Centres (3, m) from the points, and radii (m,), of spheres with the occluders' outlines."""
    v, r = np.empty((3, pairs.item.size)), np.empty(pairs.item.size)
    for shapes, rows, index in plan.shapes.groups(pairs.item):
        when = time[rows] if isinstance(time, np.ndarray) else time
        point = columns(surface.point, pairs.pixel[rows])
        center, r[rows] = shapes.circular_outline(index, point, when)
        place(v, rows, center)
    return v, r


def _batches_by_count(plan: Plan, number: Ints, start: Ints, others: int) -> Iterator[Ints]:
    """Yield indices (k, n) of the outlines of points that have k of them each, in batches.

    Parameters
    ----------
    number, start : (points,) number of outlines of each point, and index of the first.
    others : number of outlines with which each is compared; 0 for all.
    """
    work = number * (others or number)
    done, most = 0, max(int(work.sum()), 1)
    for k in np.unique(number[number >= 2]).tolist():
        points = (number == k).nonzero()[0]
        step = max(1, BATCH_PAIRS // (k * (others or k)))
        for first in range(0, points.size, step):
            plan.raise_if_cancelled()
            report_progress(done / most)
            some = points[first : first + step]
            done += int(work[some].sum())
            yield start[some] + np.arange(k)[:, None]


def _nested_cones(axis: Array, sine: Array, cosine: Array, others: Ints | None = None) -> Mask:
    """Whether cones (k, n) lie within another cone of the same column.

    Parameters
    ----------
    others : (j, n) rows of the cones that may contain another; None for all.

    A cone of half angle a lies within one of half angle b if their axes are at most b - a apart.
    Compared is twice the sine of half of that angle, which is exact to rounding however small the
    angle is.
    """
    outer, size, long_ = axis, sine, cosine
    if others is not None:
        column = np.arange(sine.shape[1])
        outer, size, long_ = axis[:, others, column], sine[others, column], cosine[others, column]
    # thousands of cones of one point: all their pairs at once would take gigabytes
    step, found = max(1, BATCH_PAIRS // size.size), []
    for first in range(0, len(sine), step):
        rows = slice(first, first + step)
        inner, small, far = axis[:, rows, None], sine[rows, None], cosine[rows, None]
        turn = size[None] * far - long_[None] * small
        even = long_[None] * far + size[None] * small
        gap = inner - outer[:, None]
        within = np.sqrt(dot(gap, gap)) + ROUNDING_ANGLE <= turn * np.sqrt(2.0 / (1.0 + even))
        found.append(within.any(axis=1))
    return np.concatenate(found)
