# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines through boxes: where along each an object is hit, and how deep.

A line runs along one axis of the box (x, y or t), at a lattice of places (u, v) on the others, and
s from -1/2 to 1/2 along it. What a line meets of an object is one interval: the directions that
meet a sphere or a quad are a convex cone; and a point moving in a straight line stays for one
interval in a capsule (sphere) or a prism (quad) drawn out along the ray. The ends of the
intervals are roots of polynomials of degree one or two.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Mask
from .polynomials import Balls, Flats, Forms

__all__ = ["ENDS", "FLAT_TERM", "TIME", "Lattice", "Sides", "depth", "depth_along", "intervals"]


TIME = 2
"""The axis t."""
ENDS: Array = np.array([-0.5, 0.5])
"""Of a box's axis."""
FLAT_TERM = 1e-300
"""Stands in for a quadratic's leading coefficient of zero: sends one root to infinity."""


@dataclass(frozen=True)
class Lattice:
    """Lines along `axis` at the middles of rows x columns cells of the other axes, in order."""

    axis: int
    rows: int
    columns: int

    @property
    def u(self) -> Array:
        """(rows, 1, 1) places on the first of the other axes."""
        return ((np.arange(self.rows) + 0.5) / self.rows - 0.5)[:, None, None]

    @property
    def v(self) -> Array:
        """(1, columns, 1) places on the second of the other axes."""
        return ((np.arange(self.columns) + 0.5) / self.columns - 0.5)[None, :, None]


@dataclass(frozen=True)
class Sides(Lattice):
    """Of a lattice that has so many rows or columns otherwise, lines on two sides of the box."""

    @property
    def u(self) -> Array:
        """(2, 1, 1) the sides, if there are two rows."""
        return ENDS[:, None, None] if self.rows == 2 else super().u

    @property
    def v(self) -> Array:
        """(1, 2, 1) the sides, if there are two columns."""
        return ENDS[None, :, None] if self.columns == 2 else super().v


def restrict(form: Array, lattice: Lattice) -> list[Array]:
    """Coefficients of s^0, s^1, s^2 along the lines; each broadcasts to (rows, columns, m)."""
    u, v, axis = lattice.u, lattice.v, lattice.axis
    if axis == TIME:
        return [_at_place(part, u, v) for part in form]
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
    """A polynomial in v with coefficients (T, m): (1, columns, m), or (m,) if constant."""
    value: Array = coefficients[-1]
    for coefficient in coefficients[-2::-1]:
        value = coefficient + v * value
    return value


def _at_place(part: Array, u: Array, v: Array) -> Array:
    """A form's part (k, m) at x = u, y = v."""
    value: Array = part[0]
    if part.shape[0] == 3:
        value = part[0] + u * part[1] + v * part[2]
    elif part.shape[0] == 6:
        rest = part[2] + v * part[5]
        value = part[0] + v * rest + u * (part[1] + v * part[4] + u * part[3])
    return value


def intervals(forms: Forms, full: Mask, lattice: Lattice) -> tuple[Array, Array]:
    """Where each line meets each candidate: low <= high within [-1/2, 1/2], (rows, columns, m).

    full : (m,) candidates that cover their box. What is missed has low = high.
    """
    shape = (lattice.rows, lattice.columns, full.size)
    low, high = np.full(shape, -0.5), np.full(shape, 0.5)
    index = (~full[forms.balls.row]).nonzero()[0]
    if index.size:
        balls = forms.balls.take(index, forms.balls.row[index])
        low[:, :, balls.row], high[:, :, balls.row] = _meet_ball(balls, lattice)
    index = (~full[forms.flats.row]).nonzero()[0]
    if index.size:
        flats = forms.flats.take(index, forms.flats.row[index])
        low[:, :, flats.row], high[:, :, flats.row] = _meet_flat(flats, lattice)
    np.clip(low, -0.5, 0.5, out=low)
    np.minimum(high, 0.5, out=high)
    np.maximum(high, low, out=high)
    return low, high


def _meet_ball(balls: Balls, lattice: Lattice) -> tuple[Array, Array]:
    first, last = _meet_cone(balls, lattice)
    # around the camera: a moving sphere may hold it for a while
    low = balls.gap[0, 0].copy()
    if balls.gap.shape[0] > 1:
        low -= 0.5 * np.abs(balls.gap[1, 0])
    around = (low < 0.0).nonzero()[0]
    if around.size:
        part = balls.take(around, around)
        _add_inside(part, lattice, first, last)
    return first, last


def _meet_cone(balls: Balls, lattice: Lattice) -> tuple[Array, Array]:
    """Interval of D >= 0 where the sphere is ahead, from outside it."""
    shape = (lattice.rows, lattice.columns, balls.row.size)
    d = restrict(balls.discriminant, lattice)
    p = restrict(balls.along, lattice)
    c = d[0]
    if len(d) == 1:
        ahead = np.broadcast_to((c >= 0.0) & (p[0] > 0.0), shape)
        return np.where(ahead, -np.inf, 0.0), np.where(ahead, np.inf, 0.0)
    b, a = 0.5 * d[1], np.where(d[2] == 0.0, -FLAT_TERM, d[2])
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


def _add_inside(balls: Balls, lattice: Lattice, first: Array, last: Array) -> None:
    """Widen intervals by where the camera is inside the sphere, in place."""
    rows = balls.row
    g = restrict(balls.gap, lattice)
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
    # on a line that enters the sphere, what is ahead is cut where the centre passes the camera
    p0, p1 = restrict(balls.along, lattice)
    d0, d1, d2 = restrict(balls.discriminant, lattice)
    half = -0.5 * d1
    turn = np.where(d2 < 0.0, d2, -FLAT_TERM)
    spread = np.sqrt(np.maximum(half * half - turn * d0, 0.0))
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):  # not turning: no end
        cut = -p0 / p1
        low, high = (half + spread) / turn, (half - spread) / turn
    low = np.where(p1 > 0.0, np.fmax(low, cut), low)
    high = np.where(p1 < 0.0, np.fmin(high, cut), high)
    ahead = (high > low) & ((p1 != 0.0) | (p0 > 0.0))
    low, high = np.where(ahead, low, np.inf), np.where(ahead, high, -np.inf)
    first[:, :, rows] = np.where(held, np.minimum(low, enter), first[:, :, rows])
    last[:, :, rows] = np.where(held, np.maximum(high, leave), last[:, :, rows])


def _meet_flat(flats: Flats, lattice: Lattice) -> tuple[Array, Array]:
    """Interval where all edge functions have the sign of the side that the camera is on.

    Along t that side is settled by the ray: a hit ahead has q.normal on the side of w.normal.
    """
    shape = (lattice.rows, lattice.columns, flats.row.size)
    first, last = np.full(shape, -np.inf), np.full(shape, np.inf)
    height = restrict(flats.height, lattice)
    facing = restrict(flats.facing, lattice)
    side = np.where((facing[0] if lattice.axis == TIME else height[0]) < 0.0, -1.0, 1.0)
    bounds = [restrict(edge, lattice) for edge in flats.edges]
    if lattice.axis == TIME:
        bounds.append(height)
    for bound in bounds:
        start = side * bound[0]
        if len(bound) == 1:
            np.copyto(first, np.inf, where=start < 0.0)
            continue
        slope = side * bound[1] + 0.0  # no -0
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # parallel: no end
            end = -start / slope
        rising = slope >= 0.0
        first = np.fmax(first, np.where(rising, end, -np.inf))
        last = np.fmin(last, np.where(rising, np.inf, end))
    if lattice.axis != TIME:
        first = np.where(height[0] == 0.0, np.inf, first)
    return first, last


def depth_along(forms: Forms, lattice: Lattice) -> Array:
    """What `depth` needs of the candidates along the lines: (11, rows, columns, m).

    depth = (p0 + p1 s -+ sqrt(d0 + d1 s + d2 s^2)) / (q0 + q1 s + q2 s^2), plus inside a sphere,
    where g0 + g1 s + g2 s^2 < 0.
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
            for power, part in enumerate(restrict(form, lattice)):
                table[start + power][:, :, row] = part
    return table


def depth(table: Array, s: Array) -> Array:
    """Ray parameters at s, of candidates that are hit there; table (11, ...) broadcasts with s."""
    p0, p1, d0, d1, d2, q0, q1, q2, g0, g1, g2 = table
    root = np.sqrt(np.maximum(d0 + s * (d1 + s * d2), 0.0))
    inside = g0 + s * (g1 + s * g2) < 0.0
    top = p0 + s * p1 + np.where(inside, root, -root)
    bottom = q0 + s * (q1 + s * q2)
    with np.errstate(over="ignore"):
        found: Array = np.where(bottom == 0.0, np.inf, top) / np.where(bottom == 0.0, 1.0, bottom)
    return found
