# SPDX-License-Identifier: GPL-3.0-or-later
"""Irradiance of an environment that nothing hides: a smooth function of the normal, as a table.

Its values at a grid of normals are interpolated by cubic polynomials. The difference from the
quadrature in the middle of each cell tells the error; where that is too large, as where a very
bright spot is near the horizon, the irradiance of each normal is integrated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Ints
from ..numerics.gather import columns
from ..numerics.vector import dot
from .environment_factor import Environment

__all__ = ["OpenIrradiance", "make_open_irradiance"]


ROWS, COLUMNS = 24, 48
"""Number of cells of the table along the colatitude and the longitude: 7.5 degrees each."""
MARGIN = 2.0
"""Factor by which the error within a cell may be above the one in its middle, and in those around
it: with equal fourth derivatives the middle has the largest."""


@dataclass(frozen=True)
class OpenIrradiance:
    """Irradiance factors by normal.

    Attributes
    ----------
    environment : the map.  accuracy : error up to which factors are right.
    table : (k, ROWS + 3, COLUMNS + 3) values at the grid, with a margin for the interpolation.
    good : (ROWS, COLUMNS) whether the interpolation is so accurate.
    """

    environment: Environment
    accuracy: float
    table: Array
    good: Array

    def factor(self, normal: Array) -> Array:
        """Irradiance factors (k, n) at unit normals (3, n)."""
        turned = self.environment.map.turned(normal)
        row, column, *shares = _place(turned)
        value = _interpolated(self.table, row, column, shares[0], shares[1])
        rows = (~self.good[row, column]).nonzero()[0]
        if rows.size:
            allowed = np.full(rows.size, 0.5 * self.accuracy)
            value[:, rows], _ = self.environment.open_factor(columns(normal, rows), allowed)
        return value

    @property
    def largest(self) -> float:
        """Largest factor of all normals and channels, approximately."""
        return float(self.table.max())


def make_open_irradiance(environment: Environment, accuracy: float) -> OpenIrradiance:
    """Return the irradiance of an environment, to an error relative to its mean over normals."""
    mean = float(environment.level.max(initial=0.0)) * np.pi
    absolute = accuracy * mean
    turn = environment.map.turn

    def at(row: Array, column: Array) -> Array:
        theta, psi = np.pi / ROWS * row, 2.0 * np.pi / COLUMNS * column
        own = np.array([np.sin(theta) * np.cos(psi), np.sin(theta) * np.sin(psi), np.cos(theta)])
        # the inverse of the rotation into the map
        x, y, z = own.reshape(3, -1)
        normal = np.array([c[0] * x + c[1] * y + c[2] * z for c in turn.T])
        normal = normal / np.sqrt(dot(normal, normal))
        value, _ = environment.open_factor(normal, np.full(normal.shape[1], 0.25 * absolute))
        return value.reshape(-1, *row.shape)

    nodes = at(*np.meshgrid(np.arange(ROWS + 1.0), np.arange(float(COLUMNS)), indexing="ij"))
    # beyond a pole the next meridian is half a turn away
    half = np.roll(nodes, COLUMNS // 2, axis=2)
    tall = np.concatenate([half[:, 1:2], nodes, half[:, -2:-1]], axis=1)
    table = np.concatenate([tall[:, :, -1:], tall, tall[:, :, :2]], axis=2)
    row, column = np.meshgrid(np.arange(ROWS), np.arange(COLUMNS), indexing="ij")
    share = np.full(row.size, 0.5)
    found = _interpolated(table, row.ravel(), column.ravel(), share, share)
    error = np.abs(found.reshape(-1, ROWS, COLUMNS) - at(row + 0.5, column + 0.5)).max(axis=0)
    # the largest of each cell and those beside it
    error = np.maximum(error, np.maximum(np.roll(error, 1, axis=1), np.roll(error, -1, axis=1)))
    padded = np.concatenate([error[:1], error, error[-1:]])
    error = np.maximum(error, np.maximum(padded[:-2], padded[2:]))
    return OpenIrradiance(environment, absolute, table, MARGIN * error <= absolute)


def _place(turned: Array) -> tuple[Ints, Ints, Array, Array]:
    """Row and column (n,) of the cells of normals in the map's frame, and the places in them."""
    x, y, z = turned
    u = np.arctan2(np.hypot(x, y), z) * (ROWS / np.pi)
    v = np.arctan2(y, x) * (COLUMNS / (2.0 * np.pi))
    v = v + COLUMNS * (v < 0.0)
    row = np.minimum(u.astype(np.int64), ROWS - 1)
    column = np.minimum(v.astype(np.int64), COLUMNS - 1)
    return row, column, u - row, v - column


def _interpolated(table: Array, row: Ints, column: Ints, u: Array, v: Array) -> Array:
    """Values (k, n) by cubic polynomials through 4 x 4 values around cells."""
    width = table.shape[2]
    flat = table.reshape(table.shape[0], -1)
    across, down = _cubic_weights(v), _cubic_weights(u)
    value: Array = np.zeros((table.shape[0], row.size))
    for i, weight in enumerate(down):
        line = np.zeros_like(value)
        for j, share in enumerate(across):
            line += share * flat.take((row + i) * width + column + j, axis=1)
        value += weight * line
    return value


def _cubic_weights(t: Array) -> tuple[Array, Array, Array, Array]:
    """Lagrange's weights (n,) of the values at -1, 0, 1 and 2, at places t from 0 to 1."""
    a, b, c = t + 1.0, t - 1.0, t - 2.0
    return -t * b * c / 6.0, a * b * c / 2.0, -a * t * c / 2.0, a * t * b / 6.0
