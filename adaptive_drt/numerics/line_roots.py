# SPDX-License-Identifier: GPL-3.0-or-later
"""Polynomials in the parameter s of lines through boxes, and their roots within a box.

A polynomial is the list of its coefficients, from that of s^0; they are arrays that broadcast. The
lines run from s = -1/2 to s = 1/2.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from .arrays import Array

__all__ = [
    "NO_ROOT",
    "TINY_COEFFICIENT",
    "LinePolynomial",
    "coefficient",
    "multiply",
    "polynomial_value",
    "quadratic_roots",
    "quartic_roots",
]

LinePolynomial: TypeAlias = list[Array]

TINY_COEFFICIENT = 1e-300
"""Magnitude that replaces a leading coefficient of zero in a quadratic. It moves one root to
infinity, so that the linear case needs no branch."""
DOUBLE_ROOT_TOLERANCE = 2.0**-36
"""Largest negative discriminant of a quadratic that still counts as zero, as a fraction of the
discriminant's terms: the two roots are then one double root. An event that is not real costs one
more span and nothing else."""
NO_ROOT = 0.5
"""Value that stands for a root that does not exist: the end of a line, where events have no
effect."""
MIN_LEADING_COEFFICIENT = 2.0**-48
"""Least leading coefficient of a quartic, as a fraction of its largest coefficient. It keeps the
roots finite."""


def multiply(a: LinePolynomial, b: LinePolynomial) -> LinePolynomial:
    """Coefficients of the product of two polynomials."""
    total = [np.zeros(np.broadcast_shapes(a[0].shape, b[0].shape))] * (len(a) + len(b) - 1)
    for i, first in enumerate(a):
        for j, second in enumerate(b):
            total[i + j] = total[i + j] + first * second
    return total


def coefficient(polynomial: LinePolynomial, power: int) -> Array:
    """Coefficient of a power; zeros beyond the degree."""
    return polynomial[power] if power < len(polynomial) else np.zeros(polynomial[0].shape)


def polynomial_value(polynomial: Sequence[Array] | Array, s: Array | float) -> Array:
    """Value of a polynomial at s, by the rule of Horner."""
    value: Array = polynomial[-1]
    for part in polynomial[-2::-1]:
        value = part + s * value
    return value


def quadratic_roots(c: Array, slope: Array, a: Array) -> tuple[Array, Array]:
    """Roots of c + slope s + a s^2 within a line; `NO_ROOT` where there is none."""
    # scale the coefficients to at most 1, so that their squares stay within float64's range
    largest = np.maximum(np.maximum(np.abs(a), np.abs(slope)), np.abs(c))
    largest = np.where(largest > 0.0, largest, 1.0)
    a, b, c = a / largest, 0.5 * slope / largest, c / largest
    a = np.where(a == 0.0, -TINY_COEFFICIENT, a)
    square = b * b - a * c
    root = np.sqrt(np.maximum(square, 0.0))
    q = np.where(b < 0.0, root - b, -b - root)
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):  # see TINY_COEFFICIENT
        roots = q / a, np.where(q == 0.0, 0.0, c / q)
    # from a camera in the radical plane of two spheres, their intersection is a double root
    real = square >= -DOUBLE_ROOT_TOLERANCE * (b * b + np.abs(a * c))
    low, high = (np.where(real & (np.abs(r) < 0.5), r, NO_ROOT) for r in roots)
    return low, high


def quartic_roots(coefficients: LinePolynomial) -> list[Array]:
    """Real parts of the roots of a quartic within a line; `NO_ROOT` outside it.

    They are eigenvalues of the companion matrix, which pays for few lines.
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
    roots = np.where(np.abs(roots) < 0.5, roots, NO_ROOT)
    return [roots[..., p] for p in range(4)]
