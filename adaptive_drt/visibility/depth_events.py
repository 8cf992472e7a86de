# SPDX-License-Identifier: GPL-3.0-or-later
"""Events along lines at which two objects may exchange their depth order: roots of polynomials.

A ray w meets the plane n.P = k at P = k w / f with f = n.w. That point lies on a sphere of center v
and radius r where

    Q = k^2 (w.w) - 2 k f (w.v) + f^2 (v.v - r^2) = 0.

Along x, y and t this is quadratic for the plane of a quad. Two spheres intersect in their radical
plane, for which k = (power of one - power of the other) / 2 and n is the vector between their
centers; Q is then quadratic along x and y and of degree four along t. Two planes have equal depth
where k1 f2 = k2 f1. The depth of a sphere is discontinuous where the camera enters it. Roots on
hidden sides of an object are not removed: they only split a span in two.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from ..numerics.arrays import Array, Mask
from ..numerics.axes import TIME
from ..numerics.gather import columns
from .line_intervals import TINY_COEFFICIENT, Lattice
from .unordered_pairs import GroupPairs

__all__ = ["find_depth_events", "split_by_candidate"]

Polynomial: TypeAlias = list[Array]

DOUBLE_ROOT_TOLERANCE = 2.0**-36
"""Largest negative discriminant of a quadratic that still counts as zero, as a fraction of the
discriminant's terms: the two roots are then one double root. An event that is not real costs one
more span and nothing else."""
NO_EVENT = 0.5
"""Position of an event that does not exist: the end of a line, where an event has no effect."""
MIN_LEADING_COEFFICIENT = 2.0**-48
"""Least leading coefficient of a quartic, as a fraction of its largest coefficient. It keeps the
roots finite."""


def find_depth_events(table: Array, is_ball: Mask, met: GroupPairs, lattice: Lattice) -> Array:
    """Events (events, rows, columns, n) along lines; between them depth orders do not change.

    Parameters
    ----------
    table : (11, rows, columns, k n) of k candidates by item, the first candidates of all boxes
    first, from `line_intervals.depth_coefficients`.
    is_ball : (k n,) whether a candidate is a sphere.
    met : the pairs of candidates whose depth order is not known.

    Pairs of spheres are left out along t unless there is a single line: choose another axis where
    spheres may intersect.
    """
    n, timed = met.boxes, lattice.axis == TIME
    parts = [*_quadratic_roots(*table[8:])] if timed else []
    one, other = (each * n + met.box for each in (met.one, met.other))
    balls = is_ball[one].astype(np.int64) + is_ball[other]
    # each pair has room for the same number of events, whichever its kinds: boxes stay alike
    most = 4 if timed and _is_single_line(lattice) else 2
    events = np.full((most, *table.shape[1:3], met.room * n), NO_EVENT)
    for kind, find in enumerate((_quad_quad_events, _sphere_quad_events, _sphere_sphere_events)):
        some = (balls == kind).nonzero()[0]
        if some.size:
            a, b = (columns(table, each[some], -1) for each in (one, other))
            for event, root in zip(events, find(a, b, lattice), strict=False):
                event[..., met.slot[some] * n + met.box[some]] = root
    return np.concatenate([split_by_candidate(part, n) for part in (*parts, *events)])


def split_by_candidate(values: Array, n: int) -> Array:
    """Reshape (rows, columns, k n), the first candidates of all boxes first, to (k, rows, columns,
    n)."""
    return values.reshape(*values.shape[:2], -1, n).transpose(2, 0, 1, 3)


def _is_single_line(lattice: Lattice) -> bool:
    """Whether the lattice is a single line."""
    return lattice.rows * lattice.columns == 1


def _quad_quad_events(one: Array, other: Array, lattice: Lattice) -> Sequence[Array]:
    """Events of two quads."""
    timed = lattice.axis == TIME
    (k, f), (other_k, other_f) = _quad_plane(one, timed), _quad_plane(other, timed)
    first, second = _product(other_k, f), _product(k, other_f)
    return _quadratic_roots(
        *(_coefficient(first, power) - _coefficient(second, power) for power in range(3))
    )


def _sphere_quad_events(one: Array, other: Array, lattice: Lattice) -> Sequence[Array]:
    """Events of a sphere and a quad."""
    timed = lattice.axis == TIME
    quadratic = _plane_sphere_polynomial(one, *_quad_plane(other, timed), timed)
    return _quadratic_roots(*(_coefficient(quadratic, power) for power in range(3)))


def _sphere_sphere_events(one: Array, other: Array, lattice: Lattice) -> Sequence[Array]:
    """Events of two spheres."""
    timed = lattice.axis == TIME
    if timed and not _is_single_line(lattice):
        return ()
    radical = _plane_sphere_polynomial(one, *_radical_plane(one, other, timed), timed)
    return _quartic_roots(radical) if timed else _quadratic_roots(*radical)


def _quad_plane(table: Array, timed: bool) -> tuple[Polynomial, Polynomial]:
    """k and f of the plane of a quad."""
    return ([table[0], table[1]], [table[5]]) if timed else ([table[0]], [table[5], table[6]])


def _radical_plane(one: Array, other: Array, timed: bool) -> tuple[Polynomial, Polynomial]:
    """k and f of the radical plane of two spheres."""
    powers = range(8, 11 if timed else 9)
    k = [0.5 * (other[p] - one[p]) for p in powers]
    return k, [other[0] - one[0], other[1] - one[1]]


def _plane_sphere_polynomial(table: Array, k: Polynomial, f: Polynomial, timed: bool) -> Polynomial:
    """Coefficients of Q for a plane and a sphere; see the module."""
    square = [table[5]] if timed else [table[5], table[6], table[7]]
    gap = [table[8], table[9], table[10]] if timed else [table[8]]
    mixed = _product(_product(k, f), [table[0], table[1]])
    terms = (_product(_product(k, k), square), mixed, _product(_product(f, f), gap))
    degree = max(len(term) for term in terms)
    a, b, c = ([_coefficient(term, p) for p in range(degree)] for term in terms)
    return [a[p] - 2.0 * b[p] + c[p] for p in range(degree)]


def _product(a: Polynomial, b: Polynomial) -> Polynomial:
    """Coefficients of the product of two polynomials."""
    total = [np.zeros(np.broadcast_shapes(a[0].shape, b[0].shape))] * (len(a) + len(b) - 1)
    for i, first in enumerate(a):
        for j, second in enumerate(b):
            total[i + j] = total[i + j] + first * second
    return total


def _coefficient(polynomial: Polynomial, power: int) -> Array:
    """Coefficient of a power; zeros beyond the degree."""
    return polynomial[power] if power < len(polynomial) else np.zeros(polynomial[0].shape)


def _quadratic_roots(c: Array, slope: Array, a: Array) -> tuple[Array, Array]:
    """Roots of c + slope s + a s^2 within a line; `NO_EVENT` where there is none."""
    # scale the coefficients to at most 1, so that their squares stay within float64's range
    largest = np.maximum(np.maximum(np.abs(a), np.abs(slope)), np.abs(c))
    largest = np.where(largest > 0.0, largest, 1.0)
    a, b, c = a / largest, 0.5 * slope / largest, c / largest
    a = np.where(a == 0.0, -TINY_COEFFICIENT, a)
    square = b * b - a * c
    root = np.sqrt(np.maximum(square, 0.0))
    q = np.where(b < 0.0, root - b, -b - root)
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):  # see FLAT_TERM
        roots = q / a, np.where(q == 0.0, 0.0, c / q)
    # from a camera in the radical plane of two spheres, their intersection is a double root
    real = square >= -DOUBLE_ROOT_TOLERANCE * (b * b + np.abs(a * c))
    low, high = (np.where(real & (np.abs(r) < 0.5), r, NO_EVENT) for r in roots)
    return low, high


def _quartic_roots(coefficients: Polynomial) -> list[Array]:
    """Real parts of the roots of a quartic within a line; `NO_EVENT` outside it.

    They are eigenvalues of the companion matrix, which pays for a single line a box.
    """
    c = np.array(coefficients)
    largest = np.maximum(np.max(np.abs(c), axis=0), np.finfo(np.float64).tiny)
    c = c / largest
    lead = np.where(np.abs(c[4]) < MIN_LEADING_COEFFICIENT, MIN_LEADING_COEFFICIENT, c[4])
    companion = np.zeros((*lead.shape, 4, 4))
    companion[..., (1, 2, 3), (0, 1, 2)] = 1.0
    for power in range(4):
        companion[..., power, 3] = -c[power] / lead
    roots = np.linalg.eigvals(companion).real
    roots = np.where(np.abs(roots) < 0.5, roots, NO_EVENT)
    return [roots[..., p] for p in range(4)]
