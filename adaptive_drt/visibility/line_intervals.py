# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines through boxes: the interval in which each line hits an object, and the depth of the hit.

A line meets an object in a single interval, whose ends are roots of polynomials of degree one or
two; the kinds of shapes find them.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Mask
from ..numerics.line_lattice import Lattice, restrict_to_lines
from .polynomials import CandidatePolynomials

__all__ = ["depth_coefficients", "evaluate_depth", "hit_intervals"]


def hit_intervals(forms: CandidatePolynomials, full: Mask, lattice: Lattice) -> tuple[Array, Array]:
    """Intervals in which lines hit candidates: low <= high within [-1/2, 1/2], (rows, columns, m).

    Parameters
    ----------
    full : (m,) candidates that cover their box; their interval is the whole line.

    A candidate that a line misses has low = high.
    """
    shape = (lattice.rows, lattice.columns, full.size)
    low, high = np.full(shape, -0.5), np.full(shape, 0.5)
    for group in forms.groups:
        index = (~full[group.rows]).nonzero()[0]
        if index.size:
            part = group
            if index.size < group.rows.size:
                part = group.take(index, group.rows[index])
            low[:, :, part.rows], high[:, :, part.rows] = part.intervals(lattice)
    np.clip(low, -0.5, 0.5, out=low)
    np.minimum(high, 0.5, out=high)
    np.maximum(high, low, out=high)
    return low, high


def depth_coefficients(forms: CandidatePolynomials, lattice: Lattice) -> Array:
    """Coefficients (11, rows, columns, m) from which `evaluate_depth` computes ray parameters.

    depth = (p0 + p1 s -+ sqrt(d0 + d1 s + d2 s^2)) / (q0 + q1 s + q2 s^2), where the sign of the
    root is plus if the camera is inside a solid, that is where g0 + g1 s + g2 s^2 < 0. The order
    in the table is p0, p1, d0, d1, d2, q0, q1, q2, g0, g1, g2.
    """
    table = np.zeros((11, lattice.rows, lattice.columns, forms.count))
    table[8] = 1.0
    for group in forms.groups:
        if group.rows.size:
            parts = group.depth_polynomials()
            for start, form in (
                (0, parts.numerator),
                (2, parts.discriminant),
                (5, parts.denominator),
                (8, parts.power),
            ):
                if form is not None:
                    for power, part in enumerate(restrict_to_lines(form, lattice)):
                        table[start + power][:, :, group.rows] = part
    return table


def evaluate_depth(table: Array, s: Array) -> Array:
    """Ray parameters of hits at s; valid for candidates that are hit there.

    The table (11, ...) of `depth_coefficients` broadcasts with s.
    """
    p0, p1, d0, d1, d2, q0, q1, q2, g0, g1, g2 = table
    root = np.sqrt(np.maximum(d0 + s * (d1 + s * d2), 0.0))
    inside = g0 + s * (g1 + s * g2) < 0.0
    top = p0 + s * p1 + np.where(inside, root, -root)
    bottom = q0 + s * (q1 + s * q2)
    with np.errstate(over="ignore"):
        found: Array = np.where(bottom == 0.0, np.inf, top) / np.where(bottom == 0.0, 1.0, bottom)
    return found
