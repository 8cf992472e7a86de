# SPDX-License-Identifier: GPL-3.0-or-later
"""Where along lines objects may change places in depth: roots of polynomials.

A ray w meets the plane n.P = k at P = k w / f, f = n.w; it does so on a sphere of centre v and
radius r where

    Q = k^2 (w.w) - 2 k f (w.v) + f^2 (v.v - r^2) = 0.

Along x, y and t that is a quadratic for a quad's plane. Spheres meet in their radical plane, where
k = (power of one - power of the other) / 2 and n is the vector between their centres: a quadratic
along x and y, of degree four along t. Two planes have equal depth where k1 f2 = k2 f1. A sphere's
own depth jumps where the camera enters it. Roots that belong to hidden sides only cut a span in
two.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from ..numerics.arrays import Array, Mask
from ..numerics.gather import columns
from .line_intervals import FLAT_TERM, TIME, Lattice
from .unordered_pairs import Met

__all__ = ["by_candidate", "find_crossings"]

Polynomial: TypeAlias = list[Array]

DOUBLE = 2.0**-36
"""Of the terms of a quadratic's discriminant: so near to 0, two roots are one. An event where there
is none costs a span, no more."""
NOWHERE = 0.5
"""The end of a line: an event there changes nothing."""
LEAST_LEAD = 2.0**-48
"""Of the largest coefficient: a quartic's first is at least that, so that its roots are finite."""


def find_crossings(table: Array, is_ball: Mask, met: Met, lattice: Lattice) -> Array:
    """Places (events, rows, columns, n) along lines; spans between them keep their order.

    Parameters
    ----------
    table : (11, rows, columns, k n) of k candidates by item, all boxes' first ones first, as
        `line_intervals.depth_along` gives it.
    is_ball : (k n,).
    met : the pairs that may change places.

    Two spheres are left out along t, unless there is but one line: choose another axis where
    they may cross.
    """
    n, timed = met.boxes, lattice.axis == TIME
    parts = [*_roots(*table[8:])] if timed else []
    one, other = (each * n + met.box for each in (met.one, met.other))
    balls = is_ball[one].astype(np.int64) + is_ball[other]
    # as many for any two, or the boxes of a group were not alike
    most = 4 if timed and _single(lattice) else 2
    events = np.full((most, *table.shape[1:3], met.room * n), NOWHERE)
    for kind, find in enumerate((_flats, _ball_and_flat, _balls)):
        some = (balls == kind).nonzero()[0]
        if some.size:
            a, b = (columns(table, each[some], -1) for each in (one, other))
            for event, root in zip(events, find(a, b, lattice), strict=False):
                event[..., met.slot[some] * n + met.box[some]] = root
    return np.concatenate([by_candidate(part, n) for part in (*parts, *events)])


def by_candidate(values: Array, n: int) -> Array:
    """(rows, columns, k n), all boxes' first ones first, as (k, rows, columns, n)."""
    return values.reshape(*values.shape[:2], -1, n).transpose(2, 0, 1, 3)


def _single(lattice: Lattice) -> bool:
    return lattice.rows * lattice.columns == 1


def _flats(one: Array, other: Array, lattice: Lattice) -> Sequence[Array]:
    """Events of two quads."""
    timed = lattice.axis == TIME
    (k, f), (other_k, other_f) = _plane(one, timed), _plane(other, timed)
    first, second = _product(other_k, f), _product(k, other_f)
    return _roots(*(_at(first, power) - _at(second, power) for power in range(3)))


def _ball_and_flat(one: Array, other: Array, lattice: Lattice) -> Sequence[Array]:
    """Events of a sphere and a quad."""
    timed = lattice.axis == TIME
    quadratic = _on_sphere(one, *_plane(other, timed), timed)
    return _roots(*(_at(quadratic, power) for power in range(3)))


def _balls(one: Array, other: Array, lattice: Lattice) -> Sequence[Array]:
    """Events of two spheres."""
    timed = lattice.axis == TIME
    if timed and not _single(lattice):
        return ()
    radical = _on_sphere(one, *_radical(one, other, timed), timed)
    return _quartic_roots(radical) if timed else _roots(*radical)


def _plane(table: Array, timed: bool) -> tuple[Polynomial, Polynomial]:
    """k and f of a quad's plane."""
    return ([table[0], table[1]], [table[5]]) if timed else ([table[0]], [table[5], table[6]])


def _radical(one: Array, other: Array, timed: bool) -> tuple[Polynomial, Polynomial]:
    """k and f of the plane in which two spheres meet."""
    powers = range(8, 11 if timed else 9)
    k = [0.5 * (other[p] - one[p]) for p in powers]
    return k, [other[0] - one[0], other[1] - one[1]]


def _on_sphere(table: Array, k: Polynomial, f: Polynomial, timed: bool) -> Polynomial:
    """Q of a plane with a sphere."""
    square = [table[5]] if timed else [table[5], table[6], table[7]]
    gap = [table[8], table[9], table[10]] if timed else [table[8]]
    mixed = _product(_product(k, f), [table[0], table[1]])
    terms = (_product(_product(k, k), square), mixed, _product(_product(f, f), gap))
    degree = max(len(term) for term in terms)
    a, b, c = ([_at(term, p) for p in range(degree)] for term in terms)
    return [a[p] - 2.0 * b[p] + c[p] for p in range(degree)]


def _product(a: Polynomial, b: Polynomial) -> Polynomial:
    total = [np.zeros(np.broadcast_shapes(a[0].shape, b[0].shape))] * (len(a) + len(b) - 1)
    for i, first in enumerate(a):
        for j, second in enumerate(b):
            total[i + j] = total[i + j] + first * second
    return total


def _at(polynomial: Polynomial, power: int) -> Array:
    return polynomial[power] if power < len(polynomial) else np.zeros(polynomial[0].shape)


def _roots(c: Array, slope: Array, a: Array) -> tuple[Array, Array]:
    """Roots of c + slope s + a s^2 within a line, `NOWHERE` for others."""
    # only their ratios count: of the size of one, they square without leaving float64's range
    largest = np.maximum(np.maximum(np.abs(a), np.abs(slope)), np.abs(c))
    largest = np.where(largest > 0.0, largest, 1.0)
    a, b, c = a / largest, 0.5 * slope / largest, c / largest
    a = np.where(a == 0.0, -FLAT_TERM, a)
    square = b * b - a * c
    root = np.sqrt(np.maximum(square, 0.0))
    q = np.where(b < 0.0, root - b, -b - root)
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):  # see FLAT_TERM
        roots = q / a, np.where(q == 0.0, 0.0, c / q)
    # seen from the plane in which two spheres meet, the seam is a double root
    real = square >= -DOUBLE * (b * b + np.abs(a * c))
    low, high = (np.where(real & (np.abs(r) < 0.5), r, NOWHERE) for r in roots)
    return low, high


def _quartic_roots(coefficients: Polynomial) -> list[Array]:
    """Real parts of a quartic's roots within a line, by its companion matrix: one line a box."""
    c = np.array(coefficients)
    largest = np.maximum(np.max(np.abs(c), axis=0), np.finfo(np.float64).tiny)
    c = c / largest
    lead = np.where(np.abs(c[4]) < LEAST_LEAD, LEAST_LEAD, c[4])
    companion = np.zeros((*lead.shape, 4, 4))
    companion[..., (1, 2, 3), (0, 1, 2)] = 1.0
    for power in range(4):
        companion[..., power, 3] = -c[power] / lead
    roots = np.linalg.eigvals(companion).real
    roots = np.where(np.abs(roots) < 0.5, roots, NOWHERE)
    return [roots[..., p] for p in range(4)]
