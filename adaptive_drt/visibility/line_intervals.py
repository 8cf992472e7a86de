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


DEPTH_COEFFICIENTS, SLAB_COEFFICIENTS = 11, 8
"""Numbers of coefficients that tell the depth of a surface, and of two planes that cut it off."""


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
    in the table is p0, p1, d0, d1, d2, q0, q1, q2, g0, g1, g2. Where some surfaces are cut off by
    two planes, f0, f1, the two heights' h0, h1 and the radius' r0, r1 follow: (19, ...).
    """
    parts = [(group.rows, group.depth_polynomials()) for group in forms.groups if group.rows.size]
    cut = any(part.slab is not None for _, part in parts)
    count = DEPTH_COEFFICIENTS + (SLAB_COEFFICIENTS if cut else 0)
    table = np.zeros((count, lattice.rows, lattice.columns, forms.count))
    table[8] = 1.0
    if cut:
        table[13], table[15] = -1.0, 1.0  # planes on both sides of the camera, which no ray hits
        table[17] = 1.0
    for rows, part in parts:
        f, first, last, radius = part.slab or (None, None, None, None)
        for start, form in (
            (0, part.numerator),
            (2, part.discriminant),
            (5, part.denominator),
            (8, part.power),
            (11, f),
            (13, first),
            (15, last),
            (17, radius),
        ):
            if form is not None:
                for power, values in enumerate(restrict_to_lines(form, lattice)):
                    table[start + power][:, :, rows] = values
    return table


def evaluate_depth(table: Array, s: Array) -> Array:
    """Ray parameters of hits at s; valid for candidates that are hit there.

    The table (11, ...) or (19, ...) of `depth_coefficients` broadcasts with s.
    """
    p0, p1, d0, d1, d2, q0, q1, q2, g0, g1, g2 = table[:DEPTH_COEFFICIENTS]
    root = np.sqrt(np.maximum(d0 + s * (d1 + s * d2), 0.0))
    far = g0 + s * (g1 + s * g2) < 0.0
    middle = p0 + s * p1
    bottom = q0 + s * (q1 + s * q2)
    if len(table) > DEPTH_COEFFICIENTS:
        far &= table[17] + s * table[18] > 0.0
        opens, inside = bottom < 0.0, far
        with np.errstate(invalid="ignore"):  # a ray along the axis has no side to hit
            entry = bottom * _slab_entry(table[DEPTH_COEFFICIENTS:], s)
            far = far | np.where(opens, (middle - root) > entry, (middle - root) < entry)
    top = middle + np.where(far, root, -root)
    with np.errstate(over="ignore"):
        found: Array = np.where(bottom == 0.0, np.inf, top) / np.where(bottom == 0.0, 1.0, bottom)
    if len(table) > DEPTH_COEFFICIENTS:
        # a double cone is not left along rays that it opens along
        found = np.where(opens & far & (~inside | (found <= 0.0)), np.inf, found)
    return found


def _slab_entry(table: Array, s: Array) -> Array:
    """Ray parameters at which rays enter the slabs between planes; -inf for rays along them."""
    f0, f1, a0, a1, b0, b1 = table[:6]
    f, a, b = f0 + s * f1, a0 + s * a1, b0 + s * b1
    level = f == 0.0
    safe = np.where(level, 1.0, f)
    with np.errstate(over="ignore"):
        entry: Array = np.where(level, -np.inf, np.minimum(a / safe, b / safe))
    return entry
