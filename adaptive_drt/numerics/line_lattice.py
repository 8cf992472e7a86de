# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines through boxes in pixel x, y and shutter time t, and polynomials restricted to them.

A line runs along one axis of the box (x, y or t); its parameter s runs from -1/2 to 1/2. The lines
lie on a lattice of positions (u, v) on the other two axes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .arrays import Array
from .axes import TIME
from .box_polynomials import BOX_ENDS
from .line_roots import polynomial_value

__all__ = ["Lattice", "SideLattice", "restrict_to_lines"]


@dataclass(frozen=True)
class Lattice:
    """Lines along `axis`, through the middles of rows x columns cells over the other two axes.

    The other axes keep their order: rows divide the first of them, columns the second.
    """

    axis: int
    rows: int
    columns: int

    @cached_property
    def u(self) -> Array:
        """Positions of the lines on the first of the other axes, (rows, 1, 1)."""
        return ((np.arange(self.rows) + 0.5) / self.rows - 0.5)[:, None, None]

    @cached_property
    def v(self) -> Array:
        """Positions of the lines on the second of the other axes, (1, columns, 1)."""
        return ((np.arange(self.columns) + 0.5) / self.columns - 0.5)[None, :, None]


@dataclass(frozen=True)
class SideLattice(Lattice):
    """Lines on two opposite sides of the box along each axis that `rows` or `columns` of 2 stand
    for.

    Along the other axis the lines stay at the middles of the cells, of which there must not be two.
    """

    @cached_property
    def u(self) -> Array:
        """Positions (rows, 1, 1): the sides of the box if there are two rows, else middles of
        cells."""
        return BOX_ENDS[:, None, None] if self.rows == 2 else super().u

    @cached_property
    def v(self) -> Array:
        """Positions (1, columns, 1): the sides of the box if there are two columns, else middles of
        cells."""
        return BOX_ENDS[None, :, None] if self.columns == 2 else super().v


def restrict_to_lines(form: Array, lattice: Lattice) -> list[Array]:
    """Restrict polynomials to lines.

    Returns the coefficients of s^0, s^1, s^2; each broadcasts to (rows, columns, m).
    """
    u, v, axis = lattice.u, lattice.v, lattice.axis
    if axis == TIME:
        return [_evaluate_at(part, u, v) for part in form]
    part: list[Array] = [polynomial_value(form[:, k], v) for k in range(form.shape[1])]
    if len(part) == 1:
        return part
    own, other = (1, 2) if axis == 0 else (2, 1)
    if len(part) == 3:
        return [part[0] + u * part[other], part[own]]
    squares = (0, 3, 5)
    return [
        part[0] + u * (part[other] + u * part[squares[other]]),
        part[own] + u * part[4],
        part[squares[own]],
    ]


def _evaluate_at(part: Array, u: Array, v: Array) -> Array:
    """Value at x = u, y = v of the coefficients (k, m) of one power of t."""
    value: Array = part[0]
    if part.shape[0] == 3:
        value = part[0] + u * part[1] + v * part[2]
    elif part.shape[0] == 6:
        rest = part[2] + v * part[5]
        value = part[0] + v * rest + u * (part[1] + v * part[4] + u * part[3])
    return value
