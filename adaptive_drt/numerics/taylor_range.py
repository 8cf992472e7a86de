# SPDX-License-Identifier: GPL-3.0-or-later
"""Ranges of a jet's Taylor polynomial over an interval or a rectangle.

A second-order jet of a quadratic is the whole polynomial, so its range over a rectangle or an
interval is exact: the extremes lie at corners, on edges or at the critical point. A first-order
jet is a linear function, to which the caller adds a bound on the remainder. `clip_positive` is the
inverse for linear functions: it finds where the range is not negative.

The ranges hold in exact arithmetic; the caller widens them by the rounding error of the jet.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from .arrays import Array
from .jet import Jet

__all__ = ["Range", "clip_positive", "interval_range", "rectangle_range"]

Range: TypeAlias = tuple[Array, Array]
Bound: TypeAlias = Array | float


def interval_range(jet: Jet, half: float, remainder: Bound = 0.0, axis: int = 0) -> Range:
    """Return the least and greatest value of a jet along one axis, over [-half, half].

    Parameters
    ----------
    jet : value (n,). Order 2: taken as the exact quadratic. Order 1: a linear function.
    half : half the length of the interval, in the axis' unit.
    remainder : (n,) bound on the absolute value of the Taylor remainder of an order 1 jet; unused
        at order 2.

    Returns
    -------
    (low, high) : (n,) each.
    """
    slope = jet.gradient[axis]
    if jet.hessian is None:
        spread = np.abs(_or_zero(slope)) * half + remainder
        return jet.value - spread, jet.value + spread
    return _quadratic_range(jet.value, _or_zero(slope), _or_zero(jet.hessian[axis]), half)


def rectangle_range(jet: Jet, half_x: float, half_y: float, remainder: Bound = 0.0) -> Range:
    """Return the least and greatest value of a two-axis jet over a rectangle about 0.

    The rectangle is [-half_x, half_x] x [-half_y, half_y]. Other parameters and returns as
    `interval_range`. At order 2 the four edges are quadratics of one
    variable (their ends are the corners), and the critical point counts where it lies inside.
    Rounding moves low and high by at most 8 u (|f| + |f_x| + |f_y| + |f_xx| + |f_xy| + |f_yy|),
    derivatives for half sides of 1, u = 2^-53.
    """
    gx, gy = (_or_zero(g) for g in jet.gradient)
    if jet.hessian is None:
        spread = np.abs(gx) * half_x + np.abs(gy) * half_y + remainder
        return jet.value - spread, jet.value + spread
    xx, xy, yy = (_or_zero(h) for h in jet.hessian)
    value = jet.value
    low, high = _critical_value(value, gx, gy, xx, xy, yy, half_x, half_y)
    for side in (-half_x, half_x):
        edge = _quadratic_range(value + side * (gx + 0.5 * side * xx), gy + side * xy, yy, half_y)
        low, high = np.minimum(low, edge[0]), np.maximum(high, edge[1])
    for side in (-half_y, half_y):
        edge = _quadratic_range(value + side * (gy + 0.5 * side * yy), gx + side * xy, xx, half_x)
        low, high = np.minimum(low, edge[0]), np.maximum(high, edge[1])
    return low, high


def _or_zero(part: Array | None) -> Array | float:
    return 0.0 if part is None else part


def _quadratic_range(value: Array, slope: Bound, bend: Bound, half: float) -> Range:
    """Range of value + slope * s + bend / 2 * s^2 over |s| <= half."""
    middle = value + 0.5 * half * half * bend
    steep = np.abs(slope)
    swing = steep if half == 1.0 else steep * half
    # the vertex lies inside where |slope| < half * |bend|; there the value is v - slope^2 / 2 bend
    inside = steep < (np.abs(bend) if half == 1.0 else half * np.abs(bend))
    safe = np.where(inside, bend, 1.0)
    vertex = np.where(inside, value - 0.5 * slope * (slope / safe), middle)
    low = np.minimum(middle - swing, vertex)
    high = np.maximum(middle + swing, vertex)
    return low, high


def _critical_value(
    value: Array, gx: Bound, gy: Bound, xx: Bound, xy: Bound, yy: Bound, hx: float, hy: float
) -> Range:
    """Value at the extremal critical point where it lies inside the rectangle, else at the centre.

    Completes the square, first along the axis of the greater second derivative: Cramer's rule would
    lose all digits of g.H^-1 g where the quadratic is nearly a parabolic cylinder. Saddle points
    are no extremes and are left out.
    """
    first = np.abs(xx) >= np.abs(yy)
    p, q = _select(first, xx, yy), _select(first, yy, xx)
    gp, gq = _select(first, gx, gy), _select(first, gy, gx)
    with np.errstate(over="ignore", invalid="ignore"):  # nearly singular: lands outside
        safe = np.where(p != 0.0, p, 1.0)
        ratio = xy / safe
        slope, bend = gq - ratio * gp, q - ratio * xy
        definite = np.asarray(p * bend > 0.0)
        t = -slope / np.where(definite, bend, 1.0)
        s = -(gp + xy * t) / safe
        inside = definite & (np.abs(s) <= np.where(first, hx, hy))
        inside &= np.abs(t) <= np.where(first, hy, hx)
        critical = np.where(inside, value - 0.5 * gp * (gp / safe) + 0.5 * slope * t, value)
    return critical, critical.copy()


def _select(choice: NDArray[np.bool_] | np.bool_, a: Bound, b: Bound) -> Array:
    chosen: Array = np.where(choice, a, b)
    return chosen


def clip_positive(first: Array, last: Array, start: Array, end: Array) -> tuple[Array, Array]:
    """Return the parts of intervals [first, last] (n,) on which linear functions are >= 0.

    Parameters
    ----------
    start, end : (n,) values of the functions at -1/2 and 1/2.

    Returns
    -------
    The ends (n,) of the intervals; an interval is empty if its first end exceeds its last.
    """
    slope = end - start
    safe = np.where(slope != 0.0, slope, 1.0)
    root = -0.5 - start / safe
    first = np.where(slope > 0.0, np.maximum(first, root), first)
    last = np.where(slope < 0.0, np.minimum(last, root), last)
    never = (slope == 0.0) & (start < 0.0)
    return np.where(never, np.inf, first), last
