# SPDX-License-Identifier: GPL-3.0-or-later
"""Vector algebra, components first: `(3, n)` float64 arrays, or jets of such.

Sums of three products are written out, without einsum: the order of operations, and so the last
bit, does not depend on the size of the batch.
"""

from __future__ import annotations

from typing import overload

import numpy as np

from .jet import Batch, Jet, Operand, bilinear, quadratic, where
from .jet_functions import patch_jump, patch_kink, sqrt
from .partials import Array, Partial, Partials, leading_component

__all__ = [
    "cross",
    "dot",
    "norm",
    "normalize",
    "perpendicular_pair",
    "rms",
    "scale",
    "squared_norm",
    "total",
]


SMALL_SIZE = 12_288
"""Number of elements below which a dot product multiplies all components in one call, which halves
the number of calls. Larger arrays would not fit the cache."""
SMALL_CROSS_SIZE = 6_144
"""Number of elements below which a cross product gathers its factors and multiplies them in one
call: half the time for 1,000 vectors, the same time for 2,000."""
NEXT_COMPONENT, PREVIOUS_COMPONENT = np.array([1, 2, 0]), np.array([2, 0, 1])
"""Cyclically next and previous component of each."""


@overload
def dot(a: Jet, b: Jet | Array) -> Jet: ...
@overload
def dot(a: Array, b: Jet) -> Jet: ...
@overload
def dot(a: Array, b: Array) -> Array: ...
@overload
def dot(a: Jet | Array, b: Jet | Array) -> Jet | Array: ...
def dot(a: Jet | Array, b: Jet | Array) -> Jet | Array:
    """Dot product of vectors, (3, ..., n) to (..., n). `dot(a, a)` of a jet costs half as much."""
    # a shorter way to what `_dot` does in most calls: a render of 30 x 30 pixels makes thousands
    if (
        type(a) is type(b) is np.ndarray
        and (shape := a.shape) == b.shape
        and len(shape) > 1
        and shape[0] == 3
        and a.size < SMALL_SIZE
    ):
        each = a * b
        few: Array = each[0] + each[1]
        few += each[2]
        return few
    if isinstance(a, Jet) or isinstance(b, Jet):
        if a is b:
            return squared_norm(a)
        ndim = max(a.ndim, b.ndim)
        return bilinear(lambda x, y: _dot(x, y, ndim), a, b)
    return _dot(a, b, 0)


@overload
def cross(a: Jet, b: Jet | Array) -> Jet: ...
@overload
def cross(a: Array, b: Jet) -> Jet: ...
@overload
def cross(a: Array, b: Array) -> Array: ...
@overload
def cross(a: Jet | Array, b: Jet | Array) -> Jet | Array: ...
def cross(a: Jet | Array, b: Jet | Array) -> Jet | Array:
    """Cross product of vectors, (3, ..., n)."""
    if isinstance(a, Jet) or isinstance(b, Jet):
        ndim = max(a.ndim, b.ndim)
        return bilinear(lambda x, y: _cross(x, y, ndim), a, b)
    return _cross(a, b, 0)


def squared_norm(a: Batch) -> Batch:
    """Squared length, (3, ..., n) to (..., n)."""
    if isinstance(a, Jet):
        ndim = a.ndim
        return quadratic(lambda x, y: _dot(x, y, ndim), a)
    return _dot(a, a, 0)


def norm(a: Batch) -> Batch:
    """Length, (3, ..., n) to (..., n).

    At the zero vector there is a kink: the first partial is the slope to either side, the length
    of the inner partial, which bounds the change; second partials are +inf where both slopes
    are not 0, else the length of the inner second partial.

    Valid for lengths of 1e-150 to 1e150; below about 1e-162 a vector counts as zero. The relative
    error is at most 4 u, u = 2^-53, also in the components of `normalize`.
    """
    if not isinstance(a, Jet):
        return np.sqrt(squared_norm(a))
    square = squared_norm(a)
    zero = square.value == 0.0
    if not zero.any():
        return sqrt(square)
    length = where(zero, 0.0, sqrt(where(zero, 1.0, square)))
    return patch_kink(length, zero, *_lengths(a))


def rms(a: Array) -> Array:
    """Root mean square over the components, (3, ..., n) to (..., n): the norm used for radiance."""
    size: Array = np.sqrt(_dot(a, a, 0) / 3.0)
    return size


def total(rows: Array) -> Array:
    """Sum (...) of rows (k, ...) in ascending order; the order in `np.sum` depends on the shape."""
    result: Array = np.zeros(rows.shape[1:])
    for row in rows:
        result += row
    return result


def normalize(a: Batch) -> Batch:
    """Unit vector along `a`; the zero vector stays zero.

    A jet's partials at the zero vector are +inf in every component, along each axis whose inner
    partial is not 0: the direction jumps there. Valid range as for `norm`.
    """
    if not isinstance(a, Jet):
        length = norm(a)
        return a * (1.0 / np.where(length == 0.0, 1.0, length))
    square = squared_norm(a)
    zero = square.value == 0.0
    if not zero.any():
        return a * (1.0 / sqrt(square))
    unit = a * (1.0 / sqrt(where(zero, 1.0, square)))
    return patch_jump(unit, zero, *_lengths(a))


def perpendicular_pair(axis: Array) -> tuple[Array, Array]:
    """Unit vectors u, w (3, ...) that complete unit vectors to right-handed frames (axis, u, w).

    Source: Duff and others 2017, Building an orthonormal basis, revisited, JCGT 6(1).
    """
    x, y, z = axis
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    u = np.array([1.0 + sign * x * x * a, sign * b, -sign * x])
    w = np.array([b, sign + y * y * a, -y])
    return u, w


@overload
def scale(a: Jet, factor: Operand) -> Jet: ...
@overload
def scale(a: Array, factor: Jet) -> Jet: ...
@overload
def scale(a: Array, factor: Array | float) -> Array: ...
def scale(a: Jet | Array, factor: Operand) -> Jet | Array:
    """Vectors (3, ..., n) times numbers (..., n)."""
    return a * factor


def _rows(entry: Array, ndim: int) -> tuple[Array, Array, Array]:
    """Components of vectors, or of a partial that broadcasts to vectors of `ndim` axes."""
    if entry.ndim < ndim:
        entry = entry.reshape((1,) * (ndim - entry.ndim) + entry.shape)
    return (
        leading_component(entry, 0, 0),
        leading_component(entry, 0, 1),
        leading_component(entry, 0, 2),
    )


def _dot(a: Array, b: Array, ndim: int) -> Array:
    # three components each, and no broadcasting; `ndim` is 0 without partials
    alike = a.ndim > 1 if ndim == 0 else a.ndim == b.ndim == ndim
    if alike and len(a) == len(b) == 3:
        # saves 3 us a call; a render makes tens of thousands of calls
        if a.ndim == b.ndim and a.size < SMALL_SIZE and b.size < SMALL_SIZE:
            each = a * b
            few: Array = each[0] + each[1]
            few += each[2]
            return few
        plain: Array = a[0] * b[0]
        term = a[1] * b[1]
        plain += term
        plain += np.multiply(a[2], b[2], out=term)
        return plain
    a0, a1, a2 = _rows(a, ndim)
    b0, b1, b2 = _rows(b, ndim)
    total = np.asarray(a0 * b0)
    product = np.asarray(a1 * b1)
    total += product
    total += np.multiply(a2, b2, out=product)
    return total


def _cross(a: Array, b: Array, ndim: int) -> Array:
    # three components each, and no broadcasting; `ndim` is 0 without partials
    alike = a.ndim > 1 if ndim == 0 else a.ndim == b.ndim == ndim
    if alike and len(a) == len(b) == 3:
        if a.ndim == b.ndim and a.size < SMALL_CROSS_SIZE and b.size < SMALL_CROSS_SIZE:
            few: Array = a.take(NEXT_COMPONENT, 0) * b.take(PREVIOUS_COMPONENT, 0)
            few -= a.take(PREVIOUS_COMPONENT, 0) * b.take(NEXT_COMPONENT, 0)
            return few
        (a0, a1, a2), (b0, b1, b2) = a, b
    else:
        a0, a1, a2 = _rows(a, ndim)
        b0, b1, b2 = _rows(b, ndim)
    shape = a0.shape if a0.shape == b0.shape else np.broadcast_shapes(a0.shape, b0.shape)
    result, term = np.empty((3, *shape)), np.empty(shape)  # one temporary: fresh pages cost time
    for row, x, y, z, w in (
        (result[0, ...], a1, b2, a2, b1),
        (result[1, ...], a2, b0, a0, b2),
        (result[2, ...], a0, b1, a1, b0),
    ):
        np.multiply(x, y, out=row)
        row -= np.multiply(z, w, out=term)
    return result


def _lengths(a: Jet) -> tuple[Partials, Partials]:
    """Lengths of the inner partials of vectors: those of the gradient and those of the Hessian."""

    def length(entry: Partial) -> Partial:
        return None if entry is None else np.sqrt(_dot(entry, entry, a.ndim))

    return tuple(map(length, a.gradient)), tuple(map(length, a.hessian or ()))
