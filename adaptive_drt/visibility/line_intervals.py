# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines through boxes: the interval in which each line hits an object, and the depth of the hit.

A line runs along one axis of the box (x, y or t); its parameter s runs from -1/2 to 1/2. The lines
lie on a lattice of positions (u, v) on the other two axes. A line meets an object in a single
interval: the directions that hit a sphere or a quad form a convex cone, and a point in linear
motion is within the capsule (sphere) or prism (quad) swept along the ray for a single interval of
time. The ends of the intervals are roots of polynomials of degree one or two.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Mask
from ..numerics.axes import TIME
from .polynomials import CandidatePolynomials, QuadPolynomials, SpherePolynomials

__all__ = [
    "LINE_ENDS",
    "TINY_COEFFICIENT",
    "Lattice",
    "SideLattice",
    "depth_coefficients",
    "evaluate_depth",
    "hit_intervals",
]


LINE_ENDS: Array = np.array([-0.5, 0.5])
"""Normalized coordinates of the two sides of a box along an axis."""
TINY_COEFFICIENT = 1e-300
"""Magnitude that replaces a leading coefficient of zero in a quadratic. It moves one root to
infinity, so that the linear case needs no branch."""


@dataclass(frozen=True)
class Lattice:
    """Lines along `axis`, through the middles of rows x columns cells over the other two axes.

    The other axes keep their order: rows divide the first of them, columns the second.
    """

    axis: int
    rows: int
    columns: int

    @property
    def u(self) -> Array:
        """Positions of the lines on the first of the other axes, (rows, 1, 1)."""
        return ((np.arange(self.rows) + 0.5) / self.rows - 0.5)[:, None, None]

    @property
    def v(self) -> Array:
        """Positions of the lines on the second of the other axes, (1, columns, 1)."""
        return ((np.arange(self.columns) + 0.5) / self.columns - 0.5)[None, :, None]


@dataclass(frozen=True)
class SideLattice(Lattice):
    """Lines on two opposite sides of the box along each axis that `rows` or `columns` of 2 stand
    for.

    Along the other axis the lines stay at the middles of the cells, of which there must not be two.
    """

    @property
    def u(self) -> Array:
        """Positions (rows, 1, 1): the sides of the box if there are two rows, else middles of
        cells."""
        return LINE_ENDS[:, None, None] if self.rows == 2 else super().u

    @property
    def v(self) -> Array:
        """Positions (1, columns, 1): the sides of the box if there are two columns, else middles of
        cells."""
        return LINE_ENDS[None, :, None] if self.columns == 2 else super().v


def restrict_to_lines(form: Array, lattice: Lattice) -> list[Array]:
    """Restrict polynomials to lines.

    Returns the coefficients of s^0, s^1, s^2; each broadcasts to (rows, columns, m).
    """
    u, v, axis = lattice.u, lattice.v, lattice.axis
    if axis == TIME:
        return [_evaluate_at(part, u, v) for part in form]
    part: list[Array] = [_horner(form[:, k], v) for k in range(form.shape[1])]
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


def _horner(coefficients: Array, v: Array) -> Array:
    """Value of polynomials in v with coefficients (T, m): (1, columns, m), or (m,) if T is 1."""
    value: Array = coefficients[-1]
    for coefficient in coefficients[-2::-1]:
        value = coefficient + v * value
    return value


def _evaluate_at(part: Array, u: Array, v: Array) -> Array:
    """Value at x = u, y = v of the coefficients (k, m) of one power of t."""
    value: Array = part[0]
    if part.shape[0] == 3:
        value = part[0] + u * part[1] + v * part[2]
    elif part.shape[0] == 6:
        rest = part[2] + v * part[5]
        value = part[0] + v * rest + u * (part[1] + v * part[4] + u * part[3])
    return value


def hit_intervals(forms: CandidatePolynomials, full: Mask, lattice: Lattice) -> tuple[Array, Array]:
    """Intervals in which lines hit candidates: low <= high within [-1/2, 1/2], (rows, columns, m).

    Parameters
    ----------
    full : (m,) candidates that cover their box; their interval is the whole line.

    A candidate that a line misses has low = high.
    """
    shape = (lattice.rows, lattice.columns, full.size)
    low, high = np.full(shape, -0.5), np.full(shape, 0.5)
    index = (~full[forms.balls.row]).nonzero()[0]
    if index.size:
        balls = forms.balls.take(index, forms.balls.row[index])
        low[:, :, balls.row], high[:, :, balls.row] = _sphere_intervals(balls, lattice)
    index = (~full[forms.flats.row]).nonzero()[0]
    if index.size:
        flats = forms.flats.take(index, forms.flats.row[index])
        low[:, :, flats.row], high[:, :, flats.row] = _quad_intervals(flats, lattice)
    np.clip(low, -0.5, 0.5, out=low)
    np.minimum(high, 0.5, out=high)
    np.maximum(high, low, out=high)
    return low, high


def _sphere_intervals(balls: SpherePolynomials, lattice: Lattice) -> tuple[Array, Array]:
    """Ends of the intervals in which lines hit spheres, not yet clipped to the box."""
    first, last = _cone_intervals(balls, lattice)
    # a moving sphere may contain the camera for a part of the time
    low = balls.gap[0, 0].copy()
    if balls.gap.shape[0] > 1:
        low -= 0.5 * np.abs(balls.gap[1, 0])
    around = (low < 0.0).nonzero()[0]
    if around.size:
        part = balls.take(around, around)
        _extend_inside(part, lattice, first, last)
    return first, last


def _cone_intervals(balls: SpherePolynomials, lattice: Lattice) -> tuple[Array, Array]:
    """Interval where the discriminant is >= 0 and the sphere is ahead, for a camera outside it."""
    shape = (lattice.rows, lattice.columns, balls.row.size)
    d = restrict_to_lines(balls.discriminant, lattice)
    p = restrict_to_lines(balls.along, lattice)
    c = d[0]
    if len(d) == 1:
        ahead = np.broadcast_to((c >= 0.0) & (p[0] > 0.0), shape)
        return np.where(ahead, -np.inf, 0.0), np.where(ahead, np.inf, 0.0)
    b, a = 0.5 * d[1], np.where(d[2] == 0.0, -TINY_COEFFICIENT, d[2])
    square = b * b - a * c
    root = np.sqrt(np.maximum(square, 0.0))
    q = np.where(b < 0.0, root - b, -b - root)
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):  # see FLAT_TERM
        r0 = q / a
        r1 = np.where(q == 0.0, r0, c / q)
        first, last = np.minimum(r0, r1), np.maximum(r0, r1)
        middle = np.clip(-b / a, -0.5, 0.5)
    hollow = a > 0.0
    p1 = p[1] if len(p) > 1 else np.zeros(())
    keep = (square >= 0.0) & (p[0] + np.clip(middle, first, last) * p1 > 0.0) | hollow
    first, last = np.where(keep, first, 0.0), np.where(keep, last, 0.0)
    if hollow.any():
        # a branch of a hyperbola: the picture's plane cuts the cone on both sides
        right = hollow & (p1 > 0.0)
        first, last = (
            np.where(right, last, np.where(hollow, -np.inf, first)),
            np.where(right, np.inf, np.where(hollow, first, last)),
        )
    return first, last


def _extend_inside(balls: SpherePolynomials, lattice: Lattice, first: Array, last: Array) -> None:
    """Extend intervals by those in which the camera is inside the sphere, in place."""
    rows = balls.row
    g = restrict_to_lines(balls.gap, lattice)
    shape = (lattice.rows, lattice.columns, rows.size)
    if len(g) == 1:
        inside = np.broadcast_to(g[0] < 0.0, shape)
        first[:, :, rows] = np.where(inside, -np.inf, first[:, :, rows])
        last[:, :, rows] = np.where(inside, np.inf, last[:, :, rows])
        return
    a, b, c = g[2], 0.5 * g[1], g[0]
    still = a <= 0.0
    root = np.sqrt(np.maximum(b * b - a * c, 0.0))
    safe = np.where(still, 1.0, a)
    enter = np.where(still, np.where(c < 0.0, -np.inf, np.inf), (-b - root) / safe)
    leave = np.where(still, np.where(c < 0.0, np.inf, -np.inf), (-b + root) / safe)
    held = np.broadcast_to(leave > enter, shape)
    # on a line that enters the sphere, the part ahead ends where the center passes the camera
    p0, p1 = restrict_to_lines(balls.along, lattice)
    d0, d1, d2 = restrict_to_lines(balls.discriminant, lattice)
    half = -0.5 * d1
    turn = np.where(d2 < 0.0, d2, -TINY_COEFFICIENT)
    spread = np.sqrt(np.maximum(half * half - turn * d0, 0.0))
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):  # zero p1 or d2: no end
        cut = -p0 / p1
        low, high = (half + spread) / turn, (half - spread) / turn
    low = np.where(p1 > 0.0, np.fmax(low, cut), low)
    high = np.where(p1 < 0.0, np.fmin(high, cut), high)
    ahead = (high > low) & ((p1 != 0.0) | (p0 > 0.0))
    low, high = np.where(ahead, low, np.inf), np.where(ahead, high, -np.inf)
    first[:, :, rows] = np.where(held, np.minimum(low, enter), first[:, :, rows])
    last[:, :, rows] = np.where(held, np.maximum(high, leave), last[:, :, rows])


def _quad_intervals(flats: QuadPolynomials, lattice: Lattice) -> tuple[Array, Array]:
    """Interval where all edge functions have the sign of the side of the quad that the camera is
    on.

    Along t that side follows from the ray: for a hit in front of the camera, q.normal has the sign
    of w.normal.
    """
    shape = (lattice.rows, lattice.columns, flats.row.size)
    first, last = np.full(shape, -np.inf), np.full(shape, np.inf)
    height = restrict_to_lines(flats.height, lattice)
    facing = restrict_to_lines(flats.facing, lattice)
    side = np.where((facing[0] if lattice.axis == TIME else height[0]) < 0.0, -1.0, 1.0)
    bounds = [restrict_to_lines(edge, lattice) for edge in flats.edges]
    if lattice.axis == TIME:
        bounds.append(height)
    for bound in bounds:
        start = side * bound[0]
        if len(bound) == 1:
            np.copyto(first, np.inf, where=start < 0.0)
            continue
        slope = side * bound[1] + 0.0  # turn -0 into +0, so that `end` has a definite sign
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # zero slope: no end
            end = -start / slope
        rising = slope >= 0.0
        first = np.fmax(first, np.where(rising, end, -np.inf))
        last = np.fmin(last, np.where(rising, np.inf, end))
    if lattice.axis != TIME:
        first = np.where(height[0] == 0.0, np.inf, first)
    return first, last


def depth_coefficients(forms: CandidatePolynomials, lattice: Lattice) -> Array:
    """Coefficients (11, rows, columns, m) from which `evaluate_depth` computes ray parameters.

    depth = (p0 + p1 s -+ sqrt(d0 + d1 s + d2 s^2)) / (q0 + q1 s + q2 s^2), where the sign of the
    root is plus if the camera is inside a sphere, that is where g0 + g1 s + g2 s^2 < 0. The order
    in the table is p0, p1, d0, d1, d2, q0, q1, q2, g0, g1, g2.
    """
    shape = (lattice.rows, lattice.columns, forms.place.size)
    table = np.zeros((11, *shape))
    table[8] = 1.0
    balls, flats = forms.balls, forms.flats
    for row, start, form in (
        (balls.row, 0, balls.along),
        (balls.row, 2, balls.discriminant),
        (balls.row, 5, balls.square),
        (balls.row, 8, balls.gap),
        (flats.row, 0, flats.height),
        (flats.row, 5, flats.facing),
    ):
        if row.size:
            for power, part in enumerate(restrict_to_lines(form, lattice)):
                table[start + power][:, :, row] = part
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
