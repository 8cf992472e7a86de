# SPDX-License-Identifier: GPL-3.0-or-later
"""Blocks of pixels whose means are interpolated between points.

Three by three nodes have a quadratic through them. Between them, four more points tell how far it
is off there: a cubic along each axis accounts for what they have in common, and what is left of
it tells how far that may be off. Blocks that are not smooth enough are left to smaller ones.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from ..numerics.arrays import Array, Ints
from ..numerics.gather import columns
from .node_values import Points

__all__ = ["SIDES", "Blocks"]


SIDES = (8, 4)
"""Pixels: sides of blocks, the larger first. Points are at the middles of pixels."""
CHECKED: Array = np.array([0.5, 1.5])
"""Places where the quadratic is held against the truth, nodes being at 0, 1 and 2: there a cubic
is 0.375 of its factor, the first up and the second down, all but its most."""
LEFT = 1.2
"""Times what the cubics leave at those places: how far means may be off."""
MADE_UP = 0.2
"""Of what the quadratic is off there: the same, however well cubics make up for it. Four places
say little of what has a kink. (Blocks' means at 0.01 to 1 %, benchmark and random scenes: off by
0.1 to 0.7 of these, RMS, most by 0.2 to 0.5; at 2 and 1/3 by 0.1 to 0.4, for 2 % more points.)"""


class Blocks:
    """The blocks of one side that hold wanted pixels, and are alike in what they see."""

    def __init__(self, points: Points, side: int) -> None:
        """Nothing is asked yet."""
        self.points, self.side = points, side
        # the first pixels (b,) of blocks that may be smooth
        self._origin = np.zeros(0, dtype=np.int64)
        if points.wanted.any():
            self._origin = self._candidates()

    @property
    def pixels(self) -> Ints:
        """All pixels (side * side, b) of the blocks, row by row."""
        y, x = np.divmod(np.arange(self.side**2), self.side)
        rows: Ints = self._origin + (y * self.points.frame.width + x)[:, None]
        return rows

    def ask(self) -> Ints:
        """Pixels whose values blocks of this side need and that are not known: ascending."""
        self._origin = self._origin[self.points.wanted[self.pixels].any(axis=0)]
        return self.points.unknown(self._nodes, self._checks)

    def settle(self) -> None:
        """Interpolate the blocks that are smooth enough."""
        points = self.points
        if not self._origin.size:
            return
        at = self._nodes
        nodes = points.values(at)
        weights = _weights(CHECKED)
        miss = points.values(self._checks) - _through(nodes, weights, weights)
        up, across, left = _cubics(miss)
        off = np.maximum(
            LEFT * points.size(left).max(axis=0), MADE_UP * points.size(miss).max(axis=0)
        )
        smooth = (off <= points.allowed).nonzero()[0]
        if not smooth.size:
            return
        whole = bool(points.frame.plan.edges)
        means = _means(columns(nodes, smooth, -1), self.side, whole)
        means += _cubic_means(columns(up, smooth), columns(across, smooth), self.side, whole)
        error = np.hypot(points.error[columns(at, smooth)].max(axis=0), off[smooth])
        rows = columns(self.pixels, smooth)
        mine = points.wanted[rows]
        points.settle(rows[mine], means[:, mine], np.broadcast_to(error, rows.shape)[mine])

    @property
    def _nodes(self) -> Ints:
        """(9, b) row by row."""
        y, x = np.divmod(np.arange(9), 3)
        rows: Ints = self._origin + self.side // 2 * (y * self.points.frame.width + x)[:, None]
        return rows

    @property
    def _checks(self) -> Ints:
        """(4, b) pixels in the middles of the nodes' squares, row by row."""
        y, x = np.divmod(np.arange(4), 2)
        place = (2 * y + 1) * self.points.frame.width + 2 * x + 1
        rows: Ints = self._origin + self.side // 4 * place[:, None]
        return rows

    def _candidates(self) -> Ints:
        """The first pixels (b,) of blocks that may be smooth."""
        points, side = self.points, self.side
        frame = points.frame
        first_x, first_y, columns, rows = frame.grid(side)
        if columns <= 0 or rows <= 0:
            return np.zeros(0, dtype=np.int64)

        def windows(values: NDArray[np.generic], size: int) -> NDArray[np.generic]:
            table = values.reshape(frame.height, frame.width)[first_y:, first_x:]
            seen: NDArray[np.generic] = sliding_window_view(table, (size, size))
            return seen[::side, ::side][:rows, :columns]

        own = windows(points.wanted, side).any(axis=(2, 3))
        at_y, at_x = np.nonzero(own)
        sight = windows(frame.sight, side + 1)[at_y, at_x]
        low, high = sight.min(axis=(1, 2)), sight.max(axis=(1, 2))
        rough = points.rough(side // 2)
        fine = windows(rough, side + 1)[at_y, at_x].max(axis=(1, 2)) <= points.allowed
        keep = ((low == high) & (low >= 0) & fine).nonzero()[0]
        origin: Ints = (first_y + side * at_y[keep]) * frame.width + first_x + side * at_x[keep]
        return origin


def _cubics(miss: Array) -> tuple[Array, Array, Array]:
    """Cubics along y and along x, what they are at the first of `CHECKED`: (k, b) each.

    miss : (k, 4, b) what quadratics leave at those places, row by row.

    Returns with them what the cubics leave of it: (k, 4, b).
    """
    grid = miss.reshape(miss.shape[0], 2, 2, -1)
    up = 0.5 * (grid[:, 0] - grid[:, 1]).mean(axis=1)
    across = 0.5 * (grid[:, :, 0] - grid[:, :, 1]).mean(axis=1)
    sign = np.array([1.0, -1.0])
    left = grid - up[:, None, None] * sign[:, None, None] - across[:, None, None] * sign[:, None]
    return up, across, left.reshape(miss.shape)


def _cubic_means(up: Array, across: Array, side: int, whole: bool) -> Array:
    """Means over pixels (k, side * side, b) of cubics along y and along x: see `_means`."""
    x = np.arange(side, dtype=np.float64) / (0.5 * side)
    size = CHECKED[0] * (CHECKED[0] - 1.0) * (CHECKED[0] - 2.0)
    cubic = x * (x - 1.0) * (x - 2.0)
    if whole:
        # a mean adds a twelfth of half the second derivative, times the square of the side
        cubic = cubic + (3.0 * x - 3.0) * (2.0 / side) ** 2 / 12.0
    cubic = (cubic / size)[:, None]
    table = up[:, None, None] * cubic[:, None] + across[:, None, None] * cubic
    means: Array = table.reshape(up.shape[0], side * side, -1)
    return means


def _means(values: Array, side: int, whole: bool) -> Array:
    """Means over pixels (k, side * side, b) of the quadratics through nodes (k, 9, b).

    Parameters
    ----------
    whole : whether pixels are squares; else they are their middles.
    """
    # x from 0 to 2 over the block; a square's mean is that of its middle and a twelfth
    x: Array = np.arange(side, dtype=np.float64) / (0.5 * side)
    weights = _weights(x, (2.0 / side) ** 2 / 12.0 if whole else 0.0)
    return _through(values, weights, weights)


def _weights(x: Array, more: float = 0.0) -> Array:
    """(3, p) of the nodes at 0, 1 and 2 in the quadratic at x, whose square is `more`."""
    square = x * x + more
    return np.array([0.5 * square - 1.5 * x + 1.0, 2.0 * x - square, 0.5 * (square - x)])


def _through(values: Array, up: Array, across: Array) -> Array:
    """Sums (k, p * p, b) of nodes (k, 9, b) by weights (3, p) of rows and columns."""
    grid = values.reshape(values.shape[0], 3, 3, -1)
    w = up[:, None, :, None, None]
    by_row = w[0] * grid[:, None, 0] + w[1] * grid[:, None, 1] + w[2] * grid[:, None, 2]
    w = across[:, None, None, :, None]
    total = w[0] * by_row[:, :, :1] + w[1] * by_row[:, :, 1:2] + w[2] * by_row[:, :, 2:]
    sums: Array = total.reshape(values.shape[0], up.shape[1] * across.shape[1], -1)
    return sums
