# SPDX-License-Identifier: GPL-3.0-or-later
"""What is nearest along lines through boxes, span by span between exact events.

Where the order in depth of a box's candidates is settled, the nearest paints over what is behind.
Elsewhere depths are compared in each span between events, seams among them.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from .crossings import find_crossings
from .forms import Forms
from .lines import Lattice, depth, depth_along, intervals

__all__ = ["fold", "paint"]

Array: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Mask: TypeAlias = NDArray[np.bool_]

TWELFTH = 1.0 / 12.0
"""The second moment of a length of one about its middle."""
SLIVER = 2.0**-40
"""Of a box: spans too short to count, whichever object is nearest."""


def fold(values: Array) -> Array:
    """Sum over the first axis, in an order that no other axis has a say in (as it has in `sum`)."""
    while values.shape[0] > 1:
        half = values.shape[0] // 2
        folded = values[:half] + values[half : 2 * half]
        if values.shape[0] % 2:
            folded[0] += values[-1]
        values = folded
    total: Array = values[0]
    return total


def paint(
    forms: Forms, full: Mask, lattice: Lattice, k: int, settled: bool
) -> tuple[Array, Array, Array]:
    """Lengths of what is seen along lines, and their first two moments about the box's middle.

    Parameters
    ----------
    forms, full : k candidates of each of n boxes, (k n,), all boxes' first ones first: in order
        of depth where that is settled, else by item (of objects equally deep the first wins).

    Returns
    -------
    Three (k + 1, rows, columns, n): the candidates, then the background.
    """
    low, high = (
        np.moveaxis(end.reshape(lattice.rows, lattice.columns, k, -1), 2, 0)
        for end in intervals(forms, full, lattice)
    )
    length = np.zeros((k + 1, *low.shape[1:]))
    moment, second = np.zeros_like(length), np.zeros_like(length)
    sums = length, moment, second
    if k == 1 or (k == 2 and settled):
        _add(sums, 0, low[0], high[0])
        if k == 2:
            _add(sums, 1, low[1], np.maximum(np.minimum(high[1], low[0]), low[1]))
            _add(sums, 1, np.minimum(np.maximum(low[1], high[0]), high[1]), high[1])
        length[k] = 1.0 - fold(length[:k])
        moment[k] = -fold(moment[:k])
        second[k] = TWELFTH - fold(second[:k])
        return sums
    table = events = None
    if not settled:
        table = depth_along(forms, lattice)
        table = np.moveaxis(table.reshape(*table.shape[:3], k, -1), 3, 1)
        events = find_crossings(table, forms.is_ball.reshape(k, -1), lattice)
    start, end = _spans(low, high, events)
    nearest = _nearest(low, high, start, end, table)
    size, middle = end - start, 0.5 * (start + end)
    parts = size, size * middle, size * (middle * middle + TWELFTH * size * size)
    for j in range(k + 1):
        mine = nearest == j
        for total, part in zip(sums, parts, strict=True):
            total[j] += fold(np.where(mine, part, 0.0))
    return sums


def _add(sums: tuple[Array, Array, Array], j: int, low: Array, high: Array) -> None:
    size, middle = high - low, 0.5 * (low + high)
    for total, part in zip(
        sums, (size, size * middle, size * (middle * middle + TWELFTH * size * size)), strict=True
    ):
        total[j] += part


def _spans(low: Array, high: Array, events: Array | None) -> tuple[Array, Array]:
    """Starts and ends of the spans between all ends (k, ...) of intervals and other events."""
    side = np.full((1, *low.shape[1:]), 0.5)
    parts = [-side, low, high, side] if events is None else [-side, low, high, events, side]
    ends = np.concatenate(parts)
    ends.sort(axis=0)
    return ends[:-1], ends[1:]


def _nearest(low: Array, high: Array, start: Array, end: Array, table: Array | None) -> Ints:
    """Which of k candidates is nearest in spans; k where there is none.

    Without a table (see `lines.depth`) the first that is there, else the first of the least depth.
    """
    k, middle = low.shape[0], 0.5 * (start + end)
    nearest: Ints = np.full(middle.shape, k)
    rivals = np.zeros(middle.shape, dtype=np.int64)
    for j in range(k - 1, -1, -1):
        here = (low[j] <= middle) & (middle <= high[j]) & (low[j] < high[j])
        nearest[here] = j
        rivals += here
    if table is None:
        return nearest
    index = np.nonzero((rivals > 1) & (end - start > SLIVER))
    _, row, column, box = index
    at, place = middle[index], (row, column, box)
    best, winner = np.full(at.shape, np.inf), nearest[index]
    for j in range(k):
        distance = depth(table[:, j, row, column, box], at)
        closer = (low[j][place] <= at) & (at <= high[j][place]) & (distance < best)
        best = np.where(closer, distance, best)
        winner = np.where(closer, j, winner)
    nearest[index] = winner
    return nearest
