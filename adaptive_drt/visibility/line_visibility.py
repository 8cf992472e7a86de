# SPDX-License-Identifier: GPL-3.0-or-later
"""Nearest objects along lines through boxes, in each span between exactly computed events.

Where the depth order of a box's candidates is known and the same for all rays, the first candidate
that is present in a span is the nearest. Elsewhere depths are compared in each span; the events
then include those at which two candidates have equal depth.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.line_lattice import Lattice
from .depth_events import find_depth_events, split_by_candidate
from .line_intervals import depth_coefficients, evaluate_depth, hit_intervals
from .polynomials import CandidatePolynomials
from .unordered_pairs import GroupPairs

__all__ = ["pairwise_sum", "visible_moments"]


UNIT_SECOND_MOMENT = 1.0 / 12.0
"""Second moment of an interval of length 1 about its middle."""
WHOLE_LINE_MOMENTS = np.array([1.0, 0.0, UNIT_SECOND_MOMENT])[:, None, None, None]
"""Length, first and second moment of a whole line about the middle of the box."""
MIN_SPAN = 2.0**-40
"""Length, as a fraction of the box, up to which the depths of rivals in a span are not compared: it
is too short to matter which of them is nearest."""


def pairwise_sum(values: Array, axis: int = 0) -> Array:
    """Sum over an axis by repeated halving.

    The order of summation depends only on the length of that axis, unlike in `numpy.sum`, where the
    other axes influence it.
    """
    if axis:
        values = values.transpose(axis, *(other for other in range(values.ndim) if other != axis))
    while values.shape[0] > 1:
        half = values.shape[0] // 2
        folded = values[:half] + values[half : 2 * half]
        if values.shape[0] % 2:
            folded[0] += values[-1]
        values = folded
    total: Array = values[0]
    return total


def visible_moments(
    forms: CandidatePolynomials,
    full: Mask,
    lattice: Lattice,
    k: int,
    unordered: GroupPairs | None,
) -> Array:
    """Lengths of visible parts along lines, and first two moments about the middles of boxes.

    Parameters
    ----------
    forms, full : k candidates of each of n boxes, (k n,), the first candidates of all boxes first.
        The candidates of a box are in order of depth where that is known, else by item (of objects
        equally deep the first wins).
    unordered : pairs of candidates whose depth order is not known; None if every order is known.

    Returns
    -------
    (3, k + 1, rows, columns, n): length and moments of the candidates, then of the background.
    """
    low, high = (
        np.ascontiguousarray(split_by_candidate(end, full.size // k))
        for end in hit_intervals(forms, full, lattice)
    )
    sums = np.zeros((3, k + 1, *low.shape[1:]))
    if k == 1 or (k == 2 and unordered is None):
        sums[:, 0] = _interval_moments(low[0], high[0])
        rest = WHOLE_LINE_MOMENTS - sums[:, 0]
        if k == 2:
            sums[:, 1] = _interval_moments(low[1], np.maximum(np.minimum(high[1], low[0]), low[1]))
            behind = np.minimum(np.maximum(low[1], high[0]), high[1])
            sums[:, 1] += _interval_moments(behind, high[1])
            rest -= sums[:, 1]
        sums[:, k] = rest
        return sums
    # move the empty intervals of missed candidates to the end of the line, where they add no event
    missed = low >= high
    low[missed] = high[missed] = 0.5
    table = events = None
    if unordered is not None:
        table = depth_coefficients(forms, lattice)
        events = find_depth_events(table, forms, unordered, lattice)
    start, end = _spans(low, high, events)
    nearest = _nearest(low, high, start, end, table)
    # bincount adds the spans of a line in order, whatever other lines there are: the same bits
    lines = low[0].size
    place = (nearest.reshape(-1, lines) * lines + np.arange(lines)).ravel()
    for total, part in zip(sums, _interval_moments(start, end), strict=True):
        total[:] = np.bincount(place, part.ravel(), (k + 1) * lines).reshape(total.shape)
    return sums


def _interval_moments(low: Array, high: Array) -> Array:
    """Lengths of intervals (...) and their first two moments: (3, ...)."""
    moments = np.empty((3, *low.shape))
    size, middle = np.subtract(high, low, out=moments[0]), 0.5 * (low + high)
    np.multiply(size, middle, out=moments[1])
    np.multiply(size, middle * middle + UNIT_SECOND_MOMENT * size * size, out=moments[2])
    return moments


def _spans(low: Array, high: Array, events: Array | None) -> tuple[Array, Array]:
    """Starts and ends of the spans between consecutive events along each line.

    Events are the ends `low` and `high` (k, ...) of the intervals, `events` if given, and the ends
    of the line. Spans that are empty at the end of every line are left out.
    """
    side = np.full((1, *low.shape[1:]), 0.5)
    parts = [-side, low, high, side] if events is None else [-side, low, high, events, side]
    ends = np.concatenate(parts)
    ends.sort(axis=0)
    last = np.count_nonzero((ends < 0.5).any(axis=(1, 2, 3)))
    return ends[:last], ends[1 : last + 1]


def _nearest(low: Array, high: Array, start: Array, end: Array, table: Array | None) -> Ints:
    """Index of the nearest of k candidates in each span; k where there is none.

    Without a table (see `line_intervals.evaluate_depth`) the first candidate that is present wins.
    With one,
    the candidate of the least depth wins, and of those equally deep the first.
    """
    k, middle = low.shape[0], 0.5 * (start + end)
    nearest: Ints = np.full(middle.shape, k)
    rivals = np.zeros(middle.shape, dtype=np.int16)
    # missed candidates have empty intervals at the end of the line and are never present
    for j in range(k - 1, -1, -1):
        here = (low[j] <= middle) & (middle <= high[j])
        np.copyto(nearest, j, where=here)
        rivals += here
    if table is None:
        return nearest
    index = np.flatnonzero((rivals > 1) & (end - start > MIN_SPAN))
    n, size = low.shape[-1], low[0].size
    line, at = index % size, middle.take(index)
    # index into the table, which has the first candidates of all boxes first
    own = line // n * (k * n) + line % n
    best, winner, table = (
        np.full(at.shape, np.inf),
        nearest.take(index),
        table.reshape(len(table), -1),
    )
    for j in range(k):
        some = ((low[j].take(line) <= at) & (at <= high[j].take(line))).nonzero()[0]
        if some.size:
            distance, before = (
                evaluate_depth(columns(table, own[some] + j * n), at[some]),
                best[some],
            )
            closer = distance < before
            best[some] = np.where(closer, distance, before)
            winner[some[closer]] = j
    nearest.put(index, winner)
    return nearest
