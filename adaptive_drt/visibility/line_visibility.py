# SPDX-License-Identifier: GPL-3.0-or-later
"""What is nearest along lines through boxes, span by span between exact events.

Where the order in depth of a box's candidates is settled, the nearest paints over what is behind.
Elsewhere depths are compared in each span between events, seams among them.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from .depth_events import by_candidate, find_crossings
from .line_intervals import Lattice, depth, depth_along, intervals
from .polynomials import Forms
from .unordered_pairs import Met

__all__ = ["fold", "paint"]


TWELFTH = 1.0 / 12.0
"""The second moment of a length of one about its middle."""
WHOLE = np.array([1.0, 0.0, TWELFTH])[:, None, None, None]
"""Length and moments of a whole line."""
SLIVER = 2.0**-40
"""Of a box: spans too short to count, whichever object is nearest."""


def fold(values: Array, axis: int = 0) -> Array:
    """Sum over an axis, in an order that no other axis has a say in (as it has in `sum`)."""
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


def paint(forms: Forms, full: Mask, lattice: Lattice, k: int, met: Met | None) -> Array:
    """Lengths of what is seen along lines, and their first two moments about the box's middle.

    Parameters
    ----------
    forms, full : k candidates of each of n boxes, (k n,), all boxes' first ones first: in order
        of depth where that is settled, else by item (of objects equally deep the first wins).
    met : the pairs of candidates that may change places; None where their order is settled.

    Returns
    -------
    (3, k + 1, rows, columns, n): length and moments of the candidates, then of the background.
    """
    low, high = (
        np.ascontiguousarray(by_candidate(end, full.size // k))
        for end in intervals(forms, full, lattice)
    )
    sums = np.zeros((3, k + 1, *low.shape[1:]))
    if k == 1 or (k == 2 and met is None):
        sums[:, 0] = _moments(low[0], high[0])
        rest = WHOLE - sums[:, 0]
        if k == 2:
            sums[:, 1] = _moments(low[1], np.maximum(np.minimum(high[1], low[0]), low[1]))
            sums[:, 1] += _moments(np.minimum(np.maximum(low[1], high[0]), high[1]), high[1])
            rest -= sums[:, 1]
        sums[:, k] = rest
        return sums
    # what is missed ends no span
    missed = low >= high
    low[missed] = high[missed] = 0.5
    table = events = None
    if met is not None:
        table = depth_along(forms, lattice)
        events = find_crossings(table, forms.is_ball, met, lattice)
    start, end = _spans(low, high, events)
    nearest = _nearest(low, high, start, end, table)
    # span after span in each line, whatever other lines there are
    lines = low[0].size
    place = (nearest.reshape(-1, lines) * lines + np.arange(lines)).ravel()
    for total, part in zip(sums, _moments(start, end), strict=True):
        total[:] = np.bincount(place, part.ravel(), (k + 1) * lines).reshape(total.shape)
    return sums


def _moments(low: Array, high: Array) -> Array:
    """Lengths of intervals (...) and their first two moments: (3, ...)."""
    moments = np.empty((3, *low.shape))
    size, middle = np.subtract(high, low, out=moments[0]), 0.5 * (low + high)
    np.multiply(size, middle, out=moments[1])
    np.multiply(size, middle * middle + TWELFTH * size * size, out=moments[2])
    return moments


def _spans(low: Array, high: Array, events: Array | None) -> tuple[Array, Array]:
    """Starts and ends of the spans between all ends (k, ...) of intervals and other events, but
    those without length at the ends of all lines."""
    side = np.full((1, *low.shape[1:]), 0.5)
    parts = [-side, low, high, side] if events is None else [-side, low, high, events, side]
    ends = np.concatenate(parts)
    ends.sort(axis=0)
    last = np.count_nonzero((ends < 0.5).any(axis=(1, 2, 3)))
    return ends[:last], ends[1 : last + 1]


def _nearest(low: Array, high: Array, start: Array, end: Array, table: Array | None) -> Ints:
    """Which of k candidates is nearest in spans; k where there is none.

    Without a table (see `line_intervals.depth`) the first that is there, else the first of the
    least depth.
    """
    k, middle = low.shape[0], 0.5 * (start + end)
    nearest: Ints = np.full(middle.shape, k)
    rivals = np.zeros(middle.shape, dtype=np.int16)
    # what is missed begins and ends at the end of the line
    for j in range(k - 1, -1, -1):
        here = (low[j] <= middle) & (middle <= high[j])
        np.copyto(nearest, j, where=here)
        rivals += here
    if table is None:
        return nearest
    index = np.flatnonzero((rivals > 1) & (end - start > SLIVER))
    n, size = low.shape[-1], low[0].size
    line, at = index % size, middle.take(index)
    # of the candidates' own lines: all boxes' first ones first
    own = line // n * (k * n) + line % n
    best, winner, table = np.full(at.shape, np.inf), nearest.take(index), table.reshape(11, -1)
    for j in range(k):
        some = ((low[j].take(line) <= at) & (at <= high[j].take(line))).nonzero()[0]
        if some.size:
            distance, before = depth(columns(table, own[some] + j * n), at[some]), best[some]
            closer = distance < before
            best[some] = np.where(closer, distance, before)
            winner[some[closer]] = j
    nearest.put(index, winner)
    return nearest
