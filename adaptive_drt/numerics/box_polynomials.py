# SPDX-License-Identifier: GPL-3.0-or-later
"""Polynomials over boxes in pixel x, y and shutter time t.

Within a box, the normalized coordinates x, y and t run from -1/2 to 1/2. A polynomial is stored as
an array of shape (T, k, m): for m boxes, the coefficients of t^0, t^1, ... (T of them) times those
of 1, x, y, xx, xy, yy (k = 1, 3 or 6 of them). The expansion about the middle of the box keeps
precision.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .arrays import Array, Ints, Mask
from .vector import dot

__all__ = [
    "BOX_ENDS",
    "Boxes",
    "absolute_slopes",
    "linear_coefficients",
    "linear_product",
    "polynomial_range",
    "product_coefficients",
    "signs_at_time_ends",
    "swap_axes",
    "unit_vectors",
    "value_at_time",
]


BOX_ENDS: Array = np.array([-0.5, 0.5])
"""Normalized coordinates of the two sides of a box along an axis."""
MONOMIAL_DEGREES = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
"""Degrees in (x, y) of the k monomials of a polynomial, in the order of storage."""
SWAPPED_COEFFICIENTS = ((1, 2), (3, 5))
"""Pairs of coefficients that are exchanged when x and y are exchanged: x with y and xx with yy. A
polynomial of three coefficients has only the first pair, a constant has none."""


@dataclass(frozen=True)
class Boxes:
    """Boxes in pixel x, y (picture coordinates) and shutter time t; a side may have length 0.

    Attributes
    ----------
    low, high : (3, n) lower and upper bounds on x, y, t.
    """

    low: Array
    high: Array

    @property
    def middle(self) -> Array:
        """Centers of the boxes, (3, n)."""
        middle: Array = 0.5 * (self.low + self.high)
        return middle

    @property
    def size(self) -> Array:
        """Lengths of the sides of the boxes, (3, n)."""
        size: Array = self.high - self.low
        return size


def linear_coefficients(a: tuple[Array, Array, Array], b: Array) -> Array:
    """Coefficients (3, m) of (a0 + a1 x + a2 y).b, for vectors (3, m)."""
    return np.array([dot(part, b) for part in a])


def linear_product(a: Array, b: Array) -> Array:
    """Coefficients (6, m) of the product of two linear functions of (x, y), (3, m) each."""
    mixed = (a[i] * b[j] + a[j] * b[i] for i, j in ((0, 1), (0, 2), (1, 2)))
    x, y, xy = mixed
    return np.array([a[0] * b[0], x, y, a[1] * b[1], xy, a[2] * b[2]])


def product_coefficients(a: tuple[Array, Array, Array], b: tuple[Array, Array, Array]) -> Array:
    """Coefficients (6, m) of (a0 + a1 x + a2 y).(b0 + b1 x + b2 y), for vectors (3, m)."""
    if a is b:
        pairs = ((0, 1), (0, 2), (1, 2))
        x, y, xy = (2.0 * dot(a[i], a[j]) for i, j in pairs)
        return np.array([dot(a[0], a[0]), x, y, dot(a[1], a[1]), xy, dot(a[2], a[2])])
    x, y, xy = (dot(a[i], b[j]) + dot(a[j], b[i]) for i, j in ((0, 1), (0, 2), (1, 2)))
    return np.array([dot(a[0], b[0]), x, y, dot(a[1], b[1]), xy, dot(a[2], b[2])])


def swap_axes(form: Array, index: Ints) -> None:
    """Exchange x and y in the polynomials selected by an index, in place."""
    for x, y in SWAPPED_COEFFICIENTS[: form.shape[1] // 3]:
        form[:, x, index], form[:, y, index] = form[:, y, index], form[:, x, index]


def polynomial_range(form: Array) -> tuple[Array, Array]:
    """Lower and upper bounds (m,) on polynomials over the box, term by term."""
    low, high = form[0, 0].copy(), form[0, 0].copy()
    for power in range(form.shape[0]):
        for k in range(form.shape[1]):
            i, j = MONOMIAL_DEGREES[k]
            if power + i + j == 0:
                continue
            change = form[power, k] * 0.5 ** (power + i + j)
            if power % 2 or i % 2 or j % 2:
                change = np.abs(change)
                low -= change
                high += change
            else:
                low += np.minimum(change, 0.0)
                high += np.maximum(change, 0.0)
    return low, high


def absolute_slopes(form: Array) -> Array:
    """Absolute changes (3, m) of polynomials across the box along x, y, t, at its middle."""
    time = form[1, 0] if form.shape[0] > 1 else np.zeros(form.shape[2])
    return np.array([np.abs(form[0, 1]), np.abs(form[0, 2]), np.abs(time)])


def unit_vectors(slopes: Array) -> Array:
    """Unit vectors along `slopes` (3, m); all components are 1 where a slope is zero."""
    length = np.sqrt(dot(slopes, slopes))
    unit: Array = np.where(length > 0.0, slopes, 1.0) / np.where(length > 0.0, length, 1.0)
    return unit


def value_at_time(form: Array, time: float) -> Array:
    """Restrict polynomials (T, k, m) to a time: (1, k, m)."""
    value = form[-1:]
    for power in range(form.shape[0] - 2, -1, -1):
        value = form[power : power + 1] + time * value
    return value


def signs_at_time_ends(form: Array) -> tuple[tuple[Mask, Mask], tuple[Mask, Mask]]:
    """Whether polynomials are positive everywhere, and negative everywhere, at each end of the
    time.

    Returns (positive at the start, at the end), (negative at the start, at the end), (m,) each.
    """
    ranges = [polynomial_range(value_at_time(form, end)) for end in BOX_ENDS]
    above = ranges[0][0] > 0.0, ranges[1][0] > 0.0
    return above, (ranges[0][1] < 0.0, ranges[1][1] < 0.0)
