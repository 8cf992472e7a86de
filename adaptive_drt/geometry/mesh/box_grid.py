# SPDX-License-Identifier: GPL-3.0-or-later
"""A regular grid over boxes, which finds those near points in a few operations for each."""

from __future__ import annotations

import numpy as np

from ...numerics.arrays import Array, Ints
from ...numerics.gather import columns

__all__ = ["BoxGrid"]


MOST_CELLS, MOST_ENTRIES = 8, 16
"""Largest mean numbers of cells of the grid for each box, and of cells that a box lies in."""


class BoxGrid:
    """A grid over n boxes, of cells about as large as they are."""

    def __init__(self, low: Array, high: Array) -> None:
        """Take boxes (3, n), at least one."""
        self._low, self._high = low, high
        self._origin = low.min(axis=1, keepdims=True)
        extent = high.max(axis=1, keepdims=True) - self._origin
        count, sides = low.shape[1], (high - low).max(axis=0)
        self._side = float(max(np.median(sides), extent.max() * 1e-6)) or 1.0
        while True:
            shape = (extent / self._side).astype(np.int64) + 1
            self._shape = shape[:, 0]
            self._first, last = self._cells(low), self._cells(high)
            size = (last - self._first + 1).prod(axis=0)
            few = float(np.prod(shape.astype(np.float64))) <= MOST_CELLS * count + 64
            if few and size.sum() <= MOST_ENTRIES * count + 64:
                break
            self._side *= 2.0
        box, cell = self._listed(self._first, last)
        self._box = box[np.argsort(cell, kind="stable")]
        ends = np.cumsum(np.bincount(cell, minlength=int(np.prod(self._shape))))
        self._start = np.concatenate([[0], ends])

    def overlapping(self, least: Array, most: Array) -> tuple[Ints, Ints]:
        """Pairs of m boxes, from `least` to `most` (3, m), and boxes of the grid that overlap:
        indices of both, each pair once."""
        met = (least <= self._high.max(axis=1, keepdims=True)).all(axis=0)
        inside = (met & (most >= self._origin).all(axis=0)).nonzero()[0]
        least, most = columns(least, inside), columns(most, inside)
        first, last = self._cells(least), self._cells(most)
        query, cell = self._listed(first, last)
        start = self._start[cell]
        size = self._start[cell + 1] - start
        entry = np.repeat(start - np.cumsum(size) + size, size) + np.arange(size.sum())
        box, cell, query = self._box[entry], np.repeat(cell, size), np.repeat(query, size)
        # a pair that shares several cells counts in the one at the low corner of the overlap
        corner = np.maximum(columns(self._first, box), columns(first, query))
        kept = (self._number(corner) == cell).nonzero()[0]
        box, query = box[kept], query[kept]
        for axis in range(3):
            meets = (self._low[axis, box] <= most[axis, query]) & (
                self._high[axis, box] >= least[axis, query]
            )
            box, query = box[meets], query[meets]
        return inside[query], box

    def _cells(self, point: Array) -> Ints:
        """Columns, rows and layers (3, m) of the cells that points lie in, or of the nearest."""
        place = np.clip((point - self._origin) / self._side, 0.0, (self._shape - 1)[:, None])
        found: Ints = place.astype(np.int64)
        return found

    def _number(self, cell: Ints) -> Ints:
        """Numbers (m,) of cells by their columns, rows and layers (3, m)."""
        number: Ints = (cell[0] * self._shape[1] + cell[1]) * self._shape[2] + cell[2]
        return number

    def _listed(self, first: Ints, last: Ints) -> tuple[Ints, Ints]:
        """All cells from `first` to `last` (3, m): indices of the ranges, and numbers of cells."""
        span = last - first + 1
        size = span.prod(axis=0)
        if (size == 1).all():
            return np.arange(size.size), self._number(first)
        one = np.repeat(np.arange(size.size), size)
        rest = np.arange(one.size) - np.repeat(np.cumsum(size) - size, size)
        rest, layer = np.divmod(rest, span[2, one])
        column, row = np.divmod(rest, span[1, one])
        cell = self._number(columns(first, one) + np.array([column, row, layer]))
        return one, cell
