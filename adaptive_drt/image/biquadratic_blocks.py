# SPDX-License-Identifier: GPL-3.0-or-later
"""Biquadratic interpolation of pixel means over blocks of pixels under motion.

A block has 3 x 3 nodes at pixel centres, whose values are means over the shutter. Four more pixels
between them measure the error of the interpolating polynomial: a cubic term along each axis
corrects what they have in common, and the residual gives the error estimate. Blocks that are not
smooth enough are left to smaller ones.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Ints
from ..numerics.error_coefficients import DIFFERENCE_FACTOR, RESIDUAL_FACTOR
from ..numerics.gather import columns
from .node_values import NodeValues

__all__ = [
    "CHECK_POINTS",
    "SIDES",
    "BiquadraticBlocks",
    "cubic_means",
    "cubic_terms",
    "node_means",
    "node_weights",
    "tensor_sums",
]


SIDES = (8, 4)
"""Sides of blocks in pixels, the larger first. Nodes lie at pixel centres."""
CHECK_POINTS: Array = np.array([0.5, 1.5])
"""Positions at which the polynomial is compared with computed values; nodes are at 0, 1 and 2.
There the cubic x (x - 1) (x - 2) is 0.375 and -0.375, almost its extrema."""


class BiquadraticBlocks:
    """Blocks of one side that contain pixels to be resolved and have a uniform visibility key."""

    def __init__(self, points: NodeValues, side: int) -> None:
        """Find the candidate blocks; no node values are requested yet."""
        self.points, self.side = points, side
        # (b,) first pixel of each block that may be smooth
        self._origin = np.zeros(0, dtype=np.int64)
        if points.wanted.any():
            self._origin = self._candidates()

    @property
    def pixels(self) -> Ints:
        """Indices of all pixels of the blocks, row by row: (side * side, b)."""
        y, x = np.divmod(np.arange(self.side**2), self.side)
        rows: Ints = self._origin + (y * self.points.frame.width + x)[:, None]
        return rows

    def missing_pixels(self) -> Ints:
        """Pixels whose values these blocks need and that are not yet known: ascending indices."""
        self._origin = self._origin[self.points.wanted[self.pixels].any(axis=0)]
        return self.points.unknown(self._nodes, self._checks)

    def settle(self) -> None:
        """Interpolate the blocks whose estimated error is small enough."""
        points = self.points
        if not self._origin.size:
            return
        at = self._nodes
        nodes = points.values(at)
        weights = node_weights(CHECK_POINTS)
        miss = points.values(self._checks) - tensor_sums(nodes, weights, weights)
        up, across, left = cubic_terms(miss)
        off = np.maximum(
            RESIDUAL_FACTOR * points.size(left).max(axis=0),
            DIFFERENCE_FACTOR * points.size(miss).max(axis=0),
        )
        smooth = (off <= points.allowed).nonzero()[0]
        if not smooth.size:
            return
        whole = bool(points.frame.plan.edges)
        means = node_means(columns(nodes, smooth, -1), self.side, whole)
        means += cubic_means(columns(up, smooth), columns(across, smooth), self.side, whole)
        chosen = columns(at, smooth)
        error = np.hypot(points.error[chosen].max(axis=0), off[smooth])
        rows = columns(self.pixels, smooth)
        mine = points.wanted[rows]
        each = (error, points.sampling[chosen].max(axis=0))
        errors = (np.broadcast_to(values, rows.shape)[mine] for values in each)
        points.settle(rows[mine], means[:, mine], *errors)

    @property
    def _nodes(self) -> Ints:
        """Pixel indices of the nodes, row by row: (9, b)."""
        y, x = np.divmod(np.arange(9), 3)
        rows: Ints = self._origin + self.side // 2 * (y * self.points.frame.width + x)[:, None]
        return rows

    @property
    def _checks(self) -> Ints:
        """Pixel indices of the check points, centred between nodes, row by row: (4, b)."""
        y, x = np.divmod(np.arange(4), 2)
        place = (2 * y + 1) * self.points.frame.width + 2 * x + 1
        rows: Ints = self._origin + self.side // 4 * place[:, None]
        return rows

    def _candidates(self) -> Ints:
        """Index of the first pixel (b,) of each block that may be smooth."""
        points, side = self.points, self.side
        frame = points.frame
        first_x, first_y, columns, rows = frame.grid(side)
        if columns <= 0 or rows <= 0:
            return np.zeros(0, dtype=np.int64)

        own = frame.block_windows(points.wanted, side, side).any(axis=(2, 3))
        at_y, at_x = np.nonzero(own)
        sight = frame.block_windows(frame.visibility_key, side, side + 1)[at_y, at_x]
        low, high = sight.min(axis=(1, 2)), sight.max(axis=(1, 2))
        rough = points.predicted_deviation(side // 2)
        fine = (
            frame.block_windows(rough, side, side + 1)[at_y, at_x].max(axis=(1, 2))
            <= points.allowed
        )
        keep = ((low == high) & (low >= 0) & fine).nonzero()[0]
        origin: Ints = (first_y + side * at_y[keep]) * frame.width + first_x + side * at_x[keep]
        return origin


def cubic_terms(miss: Array) -> tuple[Array, Array, Array]:
    """Cubic terms along y and along x, by their values at the first of `CHECK_POINTS`: (k, b) each.

    miss : (k, 4, b) values less the biquadratic polynomial at the check points, row by row.

    Returns with them the residual after subtracting the cubic terms: (k, 4, b).
    """
    grid = miss.reshape(miss.shape[0], 2, 2, -1)
    up = 0.5 * (grid[:, 0] - grid[:, 1]).mean(axis=1)
    across = 0.5 * (grid[:, :, 0] - grid[:, :, 1]).mean(axis=1)
    sign = np.array([1.0, -1.0])
    left = grid - up[:, None, None] * sign[:, None, None] - across[:, None, None] * sign[:, None]
    return up, across, left.reshape(miss.shape)


def cubic_means(up: Array, across: Array, side: int, whole: bool) -> Array:
    """Means over pixels (k, side * side, b) of cubic terms along y and x: see `node_means`."""
    x = np.arange(side, dtype=np.float64) / (0.5 * side)
    size = CHECK_POINTS[0] * (CHECK_POINTS[0] - 1.0) * (CHECK_POINTS[0] - 2.0)
    cubic = x * (x - 1.0) * (x - 2.0)
    if whole:
        # the mean over a pixel adds half the second derivative times a twelfth of the squared side
        cubic = cubic + (3.0 * x - 3.0) * (2.0 / side) ** 2 / 12.0
    cubic = (cubic / size)[:, None]
    table = up[:, None, None] * cubic[:, None] + across[:, None, None] * cubic
    means: Array = table.reshape(up.shape[0], side * side, -1)
    return means


def node_means(values: Array, side: int, whole: bool) -> Array:
    """Means over pixels (k, side * side, b) of the biquadratic polynomials through nodes (k, 9, b).

    Parameters
    ----------
    whole : whether to average over the pixels' squares; if not, values at their centres are given.
    """
    # x from 0 to 2 over the block; the mean of x^2 over a pixel adds a twelfth of its squared side
    x: Array = np.arange(side, dtype=np.float64) / (0.5 * side)
    weights = node_weights(x, (2.0 / side) ** 2 / 12.0 if whole else 0.0)
    return tensor_sums(values, weights, weights)


def node_weights(x: Array, more: float = 0.0) -> Array:
    """Weights (3, p) of the nodes at 0, 1 and 2 in quadratic interpolation at x.

    `more` is added to x^2: the variance of x, for means over pixels.
    """
    square = x * x + more
    return np.array([0.5 * square - 1.5 * x + 1.0, 2.0 * x - square, 0.5 * (square - x)])


def tensor_sums(values: Array, up: Array, across: Array) -> Array:
    """Tensor-product sums (k, p * p, b) of nodes (k, 9, b), with weights (3, p) for rows and
    columns.
    """
    grid = values.reshape(values.shape[0], 3, 3, -1)
    w = up[:, None, :, None, None]
    by_row = w[0] * grid[:, None, 0] + w[1] * grid[:, None, 1] + w[2] * grid[:, None, 2]
    w = across[:, None, None, :, None]
    total = w[0] * by_row[:, :, :1] + w[1] * by_row[:, :, 1:2] + w[2] * by_row[:, :, 2:]
    sums: Array = total.reshape(values.shape[0], up.shape[1] * across.shape[1], -1)
    return sums
