# SPDX-License-Identifier: GPL-3.0-or-later
"""Events along lines at which two surfaces may exchange their depth order: roots of polynomials.

A ray w meets the plane n.P = k at P = k w / f with f = n.w. That point lies on a surface of degree
two, q t^2 - 2 p t + g = 0 with the ray parameter t (see `line_forms.DepthPolynomials`), where

    Q = k^2 q - 2 k f p + f^2 g = 0.

Along x, y and t this is quadratic for the plane of a polygon. Two spheres intersect in their
radical plane, for which k = (power of one - power of the other) / 2 and n is the vector between
their centers; Q is then quadratic along x and y and of degree four along t. Two planes have equal
depth where k1 f2 = k2 f1. Any other two surfaces of degree two have a common root t where their
resultant

    (q1 g2 - q2 g1)^2 - 4 (q1 p2 - q2 p1) (p1 g2 - p2 g1) = 0,

which is of degree four along x, y and t. Roots on hidden sides of an object are not removed: they
only split a span in two.

`DEPTH_PAIRS` names the rule of each pair of surfaces; pairs that it does not name use the
resultant, which is right for all surfaces of degree two.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ..numerics.arrays import Array
from ..numerics.line_roots import (
    LinePolynomial,
    coefficient,
    multiply,
    quadratic_roots,
    quartic_roots,
)
from .line_forms import DepthSurface

__all__ = ["DEPTH_PAIRS", "DepthPair", "depth_pair"]


@dataclass(frozen=True)
class DepthPair:
    """Rule for the events of pairs of two surfaces.

    Attributes
    ----------
    find : function of the depth coefficients (11 or more, ...) of the first and of the second
        surface (see `visibility.line_intervals.depth_coefficients`) and of whether lines run along
        t. It returns positions (...) of events, `line_roots.NO_ROOT` where there is none.
    degree, degree_in_time : greatest number of events along x or y, and along t.
    """

    find: Callable[[Array, Array, bool], Sequence[Array]]
    degree: int
    degree_in_time: int


def depth_pair(first: DepthSurface, second: DepthSurface) -> DepthPair:
    """The rule for two surfaces, of which the first has the lower number."""
    return DEPTH_PAIRS.get((first, second), QUADRICS)


def _planes(one: Array, other: Array, timed: bool) -> Sequence[Array]:
    """Events of two planes."""
    (k, f), (other_k, other_f) = _plane(one, timed), _plane(other, timed)
    first, second = multiply(other_k, f), multiply(k, other_f)
    return quadratic_roots(
        *(coefficient(first, power) - coefficient(second, power) for power in range(3))
    )


def _quadric_and_plane(one: Array, other: Array, timed: bool) -> Sequence[Array]:
    """Events of a surface of degree two and a plane."""
    quadratic = _points_on_quadric(one, *_plane(other, timed), timed)
    return quadratic_roots(*(coefficient(quadratic, power) for power in range(3)))


def _spheres(one: Array, other: Array, timed: bool) -> Sequence[Array]:
    """Events of two spheres."""
    radical = _points_on_quadric(one, *_radical_plane(one, other, timed), timed)
    return quartic_roots(radical) if timed else quadratic_roots(*radical)


def _quadrics(one: Array, other: Array, timed: bool) -> Sequence[Array]:
    """Events of any two surfaces of degree two."""
    (p1, q1, g1), (p2, q2, g2) = _quadric(one, timed), _quadric(other, timed)
    qg, qp, pg = (_minor(*each) for each in ((q1, g2, q2, g1), (q1, p2, q2, p1), (p1, g2, p2, g1)))
    square, mixed = multiply(qg, qg), multiply(qp, pg)
    return quartic_roots([square[power] - 4.0 * mixed[power] for power in range(5)])


def _minor(
    a: LinePolynomial, d: LinePolynomial, b: LinePolynomial, c: LinePolynomial
) -> LinePolynomial:
    """Coefficients of a d - b c, whose two products have equal degrees."""
    return [one - other for one, other in zip(multiply(a, d), multiply(b, c), strict=True)]


def _plane(table: Array, timed: bool) -> tuple[LinePolynomial, LinePolynomial]:
    """k and f of a plane."""
    return ([table[0], table[1]], [table[5]]) if timed else ([table[0]], [table[5], table[6]])


def _quadric(table: Array, timed: bool) -> tuple[LinePolynomial, LinePolynomial, LinePolynomial]:
    """p, q and g of a surface of degree two."""
    p = [table[0], table[1]]
    if timed:
        return p, [table[5]], [table[8], table[9], table[10]]
    return p, [table[5], table[6], table[7]], [table[8]]


def _radical_plane(one: Array, other: Array, timed: bool) -> tuple[LinePolynomial, LinePolynomial]:
    """k and f of the radical plane of two spheres."""
    powers = range(8, 11 if timed else 9)
    k = [0.5 * (other[p] - one[p]) for p in powers]
    return k, [other[0] - one[0], other[1] - one[1]]


def _points_on_quadric(
    table: Array, k: LinePolynomial, f: LinePolynomial, timed: bool
) -> LinePolynomial:
    """Coefficients of Q for a plane and a surface of degree two; see the module."""
    p, q, g = _quadric(table, timed)
    mixed = multiply(multiply(k, f), p)
    terms = (multiply(multiply(k, k), q), mixed, multiply(multiply(f, f), g))
    degree = max(len(term) for term in terms)
    a, b, c = ([coefficient(term, power) for power in range(degree)] for term in terms)
    return [a[power] - 2.0 * b[power] + c[power] for power in range(degree)]


QUADRICS = DepthPair(_quadrics, 4, 4)
"""Rule for any two surfaces of degree two."""
DEPTH_PAIRS: dict[tuple[DepthSurface, DepthSurface], DepthPair] = {
    (DepthSurface.SPHERE, DepthSurface.SPHERE): DepthPair(_spheres, 2, 4),
    (DepthSurface.SPHERE, DepthSurface.PLANE): DepthPair(_quadric_and_plane, 2, 2),
    (DepthSurface.QUADRIC, DepthSurface.PLANE): DepthPair(_quadric_and_plane, 2, 2),
    (DepthSurface.PLANE, DepthSurface.PLANE): DepthPair(_planes, 2, 2),
}
"""Rules by pair of surfaces, the lower number first."""
