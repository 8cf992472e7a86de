# SPDX-License-Identifier: GPL-3.0-or-later
"""Irradiance of an environment that nothing hides: a smooth function of the normal, as a table.

Its values at a grid of normals are interpolated by cubic polynomials. The difference from the
quadrature in the middle of each cell tells the error; where that is too large, as where a very
bright spot is near the horizon, the irradiance of each normal is integrated, and so it is for
normals that many points share. Values are computed when they are first asked for; they do not
depend on what else is.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Ints
from ..numerics.gather import columns
from ..numerics.vector import dot
from .environment_factor import Environment

__all__ = ["OpenIrradiance"]


ROWS, COLUMNS = 48, 96
"""Number of cells of the table along the colatitude and the longitude: 3.75 degrees each."""
MARGIN = 2.0
"""Factor by which the error within a cell may be above the one in its middle: with equal fourth
derivatives the middle has the largest."""
SHARED_BY = 8
"""Number of points a normal, on average, from which each normal is integrated."""
UNKNOWN, GOOD, BAD = 0, 1, 2
"""What is known of a cell: nothing yet, or whether its interpolation is accurate."""


class OpenIrradiance:
    """Irradiance factors by normal, of an environment, to an accuracy relative to their mean."""

    def __init__(self, environment: Environment, accuracy: float) -> None:
        """Start with an empty table."""
        self.environment = environment
        self.accuracy = accuracy * float(environment.level.max(initial=0.0)) * np.pi
        k = environment.map.channel_count
        self._nodes = np.full((k, (ROWS + 1) * COLUMNS), np.nan)
        self._cells = np.full(ROWS * COLUMNS, UNKNOWN)

    def factor(self, normal: Array) -> Array:
        """Irradiance factors (k, n) at unit normals (3, n)."""
        first, group = _distinct(normal)
        if first.size * SHARED_BY <= group.size:
            return columns(self._integrated(columns(normal, first)), group)
        row, column, u, v = _place(self.environment.map.turned(normal))
        cell = row * COLUMNS + column
        self._learn(np.unique(cell[self._cells[cell] == UNKNOWN]))
        value = _interpolated(self._nodes, row, column, u, v)
        rows = (self._cells[cell] == BAD).nonzero()[0]
        if rows.size:
            value[:, rows] = self._integrated(columns(normal, rows))
        return value

    def _integrated(self, normal: Array) -> Array:
        """Factors (k, n) by quadrature."""
        allowed = np.full(normal.shape[1], 0.5 * self.accuracy)
        return self.environment.open_factor(normal, allowed)[0]

    def _learn(self, cell: Ints) -> None:
        """Compute what interpolation in some cells needs, and how accurate it is."""
        if not cell.size:
            return
        row, column = np.divmod(cell, COLUMNS)
        node = np.unique(_corners(row, column))
        node = node[np.isnan(self._nodes[0, node])]
        y, x = np.divmod(node, COLUMNS)
        self._nodes[:, node] = self._integrated(self._normals(y, x))
        half = np.full(cell.size, 0.5)
        found = _interpolated(self._nodes, row, column, half, half)
        error = np.abs(found - self._integrated(self._normals(row + half, column + half)))
        good = MARGIN * error.max(axis=0) <= self.accuracy
        self._cells[cell] = np.where(good, GOOD, BAD)

    def _normals(self, row: Array | Ints, column: Array | Ints) -> Array:
        """Normals (3, n) in the tracer's axes at places of the grid."""
        theta, psi = np.pi / ROWS * row, 2.0 * np.pi / COLUMNS * column
        x, y, z = np.sin(theta) * np.cos(psi), np.sin(theta) * np.sin(psi), np.cos(theta)
        turn = self.environment.map.turn
        # the inverse of the rotation into the map
        normal = np.array([c[0] * x + c[1] * y + c[2] * z for c in turn.T])
        unit: Array = normal / np.sqrt(dot(normal, normal))
        return unit


def _distinct(normal: Array) -> tuple[Ints, Ints]:
    """Indices of the first of each of the distinct vectors (3, n), and which of them each is."""
    rows = np.ascontiguousarray(normal.T) + 0.0
    keys = rows.view(np.dtype((np.void, rows.itemsize * 3)))[:, 0]
    _, first, group = np.unique(keys, return_index=True, return_inverse=True)
    return first, group


def _place(turned: Array) -> tuple[Ints, Ints, Array, Array]:
    """Row and column (n,) of the cells of normals in the map's frame, and the places in them."""
    x, y, z = turned
    u = np.arctan2(np.hypot(x, y), z) * (ROWS / np.pi)
    v = np.arctan2(y, x) * (COLUMNS / (2.0 * np.pi))
    v = v + COLUMNS * (v < 0.0)
    row = np.minimum(u.astype(np.int64), ROWS - 1)
    column = np.minimum(v.astype(np.int64), COLUMNS - 1)
    return row, column, u - row, v - column


def _corners(row: Ints, column: Ints) -> list[list[Ints]]:
    """Indices (n,) of the 4 x 4 nodes around cells."""
    rows: list[list[Ints]] = []
    for i in range(-1, 3):
        # beyond a pole the next meridian is half a turn away
        y = row + i
        beyond = (y < 0) | (y > ROWS)
        y = np.where(y < 0, -y, np.where(y > ROWS, 2 * ROWS - y, y))
        turn = np.where(beyond, COLUMNS // 2, 0)
        rows.append([y * COLUMNS + (column + j + turn) % COLUMNS for j in range(-1, 3)])
    return rows


def _interpolated(table: Array, row: Ints, column: Ints, u: Array, v: Array) -> Array:
    """Values (k, n) by cubic polynomials through 4 x 4 values around cells."""
    across, down = _cubic_weights(v), _cubic_weights(u)
    value: Array = np.zeros((table.shape[0], row.size))
    for weight, places in zip(down, _corners(row, column), strict=True):
        line = np.zeros_like(value)
        for share, place in zip(across, places, strict=True):
            line += share * table.take(place, axis=1)
        value += weight * line
    return value


def _cubic_weights(t: Array) -> tuple[Array, Array, Array, Array]:
    """Lagrange's weights (n,) of the values at -1, 0, 1 and 2, at places t from 0 to 1."""
    a, b, c = t + 1.0, t - 1.0, t - 2.0
    return -t * b * c / 6.0, a * b * c / 2.0, -a * t * c / 2.0, a * t * b / 6.0
