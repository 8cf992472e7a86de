# SPDX-License-Identifier: GPL-3.0-or-later
"""Elementary functions of arrays and of jets: one function serves both.

A jet's value is bitwise equal to the result for the array. Derivatives are computed only when
some partial needs them.

Domains. Arguments outside a function's domain are clamped to its boundary (sqrt and log
below 0, arcsin and arccos beyond 1), so finite arguments that rounding has moved out give no NaN.
At a singular point a partial is infinite where the inner partial is not 0, and 0 where it is.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias, overload

import numpy as np
from numpy.typing import NDArray

from .jet import Batch, Jet, Operand, as_matching_jets, quadratic
from .partials import Array, Partial, Partials, accumulate, hessian_axes

__all__ = [
    "absolute",
    "arccos",
    "arcsin",
    "arctan2",
    "cos",
    "exp",
    "hypot",
    "log",
    "patch_jump",
    "patch_kink",
    "sin",
    "sqrt",
    "square",
]

Thunk: TypeAlias = Callable[[], Array]


def sqrt(x: Batch) -> Batch:
    """Square root; arguments below 0 count as 0.

    At 0 the slope is infinite: first partials are +-inf with the sign of the inner one, second
    partials -inf * sign(x_i x_j), or +-inf with the sign of x_ij where x_i x_j is 0.
    """
    if isinstance(x, Jet):
        root = sqrt(x.value)
        return _chain(x, root, lambda: 0.5 / root, lambda: -0.25 / (root * root * root))
    result: Array = np.sqrt(np.maximum(x, 0.0))
    return result


def square(x: Batch) -> Batch:
    """x * x."""
    return quadratic(np.multiply, x) if isinstance(x, Jet) else np.multiply(x, x)


def sin(x: Batch) -> Batch:
    """Sine of radians."""
    if isinstance(x, Jet):
        value = np.sin(x.value)
        return _chain(x, value, lambda: np.cos(x.value), lambda: -value)
    return np.sin(x)


def cos(x: Batch) -> Batch:
    """Cosine of radians."""
    if isinstance(x, Jet):
        value = np.cos(x.value)
        return _chain(x, value, lambda: -np.sin(x.value), lambda: -value)
    return np.cos(x)


def exp(x: Batch) -> Batch:
    """Exponential; overflows to infinity, with NumPy's warning, beyond 709."""
    if isinstance(x, Jet):
        value = np.exp(x.value)
        return _chain(x, value, lambda: value, lambda: value)
    return np.exp(x)


def log(x: Batch) -> Batch:
    """Natural logarithm; -inf at 0 and below, where partials are as those of sqrt at 0."""
    if isinstance(x, Jet):
        inner = np.maximum(x.value, 0.0)
        return _chain(x, log(x.value), lambda: 1.0 / inner, lambda: -1.0 / (inner * inner))
    with np.errstate(divide="ignore"):  # log(0) = -inf is documented
        value: Array = np.log(np.maximum(x, 0.0))
    return value


def arcsin(x: Batch) -> Batch:
    """Angle in -pi/2..pi/2; arguments are clamped to +-1, where partials are infinite."""
    if isinstance(x, Jet):
        inner = np.clip(x.value, -1.0, 1.0)
        width = (1.0 - inner) * (1.0 + inner)
        root = np.sqrt(width)
        return _chain(x, np.arcsin(inner), lambda: 1.0 / root, lambda: inner / (width * root))
    return np.arcsin(np.clip(x, -1.0, 1.0))


def arccos(x: Batch) -> Batch:
    """Angle in 0..pi; arguments are clamped to +-1, where partials are infinite."""
    if isinstance(x, Jet):
        inner = np.clip(x.value, -1.0, 1.0)
        width = (1.0 - inner) * (1.0 + inner)
        root = np.sqrt(width)
        return _chain(x, np.arccos(inner), lambda: -1.0 / root, lambda: -inner / (width * root))
    return np.arccos(np.clip(x, -1.0, 1.0))


def absolute(x: Batch) -> Batch:
    """Absolute value.

    At 0 the partials are those of +x or -x, by the sign of the zero: |x_i| is the slope to
    either side, so |x_i| * r bounds the change within r, but the polynomial holds on one side only.
    """
    if isinstance(x, Jet):
        sign = np.copysign(1.0, x.value)
        flipped = x.map(lambda entry: entry * sign)
        return Jet(np.abs(x.value), flipped.gradient, flipped.hessian)
    return np.abs(x)


@overload
def hypot(a: Jet, b: Operand) -> Jet: ...
@overload
def hypot(a: Operand, b: Jet) -> Jet: ...
@overload
def hypot(a: Array | float, b: Array | float) -> Array: ...
def hypot(a: Operand, b: Operand) -> Operand:
    """Euclidean length of (a, b).

    At (0, 0) there is a kink: the first partial is the slope to either side, hypot(a_i, b_i),
    which bounds the change; second partials are +inf where both slopes are not 0, else
    hypot(a_ij, b_ij).
    """
    if not isinstance(a, Jet) and not isinstance(b, Jet):
        return np.hypot(a, b)
    a, b = as_matching_jets(a, b)
    value = np.hypot(a.value, b.value)
    zero = value == 0.0
    r = np.where(zero, 1.0, value)
    u, w = a.value / r, b.value / r
    smooth = _bivariate_chain(a, b, value, (u, w), (w * w / r, -u * w / r, u * u / r))
    if not zero.any():
        return smooth
    return patch_kink(smooth, zero, *_lengths(a, b))


@overload
def arctan2(y: Jet, x: Operand) -> Jet: ...
@overload
def arctan2(y: Operand, x: Jet) -> Jet: ...
@overload
def arctan2(y: Array | float, x: Array | float) -> Array: ...
def arctan2(y: Operand, x: Operand) -> Operand:
    """Angle of (x, y) in -pi..pi.

    At (0, 0) it jumps: every partial is +inf unless the inner partials it depends on are 0.
    """
    if not isinstance(y, Jet) and not isinstance(x, Jet):
        return np.arctan2(y, x)
    y, x = as_matching_jets(y, x)
    value = np.arctan2(y.value, x.value)
    zero = (y.value == 0.0) & (x.value == 0.0)
    r = np.where(zero, 1.0, np.hypot(y.value, x.value))
    s, c = y.value / r, x.value / r
    twist = (s - c) * (s + c) / r / r
    bend = 2.0 * s * c / r / r
    smooth = _bivariate_chain(y, x, value, (c / r, -s / r), (-bend, twist, bend))
    if not zero.any():
        return smooth
    return patch_jump(smooth, zero, *_lengths(y, x))


def patch_kink(smooth: Jet, zero: NDArray[np.bool_], slopes: Partials, curves: Partials) -> Jet:
    """Replace the partials of a vector's length where the vector is 0, a kink.

    Parameters
    ----------
    smooth : the length by the formula for vectors other than 0; its value is kept.
    zero : (..., n) where the vector is 0.
    slopes : lengths of the vector's first partials, which become the first partials there.
    curves : lengths of its second partials, which become the second partials there; these are
        +inf where both slopes are not 0.
    """

    def kink(i: int, j: int, curve: Partial) -> Array:
        x, y = slopes[i], slopes[j]
        plain = np.zeros(1) if curve is None else curve
        if x is None or y is None:
            return plain
        return np.where((x != 0.0) & (y != 0.0), np.inf, plain)

    return _with_partials_at(smooth, zero, slopes, curves, kink)


def patch_jump(smooth: Jet, zero: NDArray[np.bool_], slopes: Partials, curves: Partials) -> Jet:
    """Replace the partials of a direction where its vector is 0, a jump.

    Parameters
    ----------
    smooth : the direction by the formula for vectors other than 0; its value is kept.
    zero : (..., n) where the vector is 0.
    slopes, curves : lengths of the vector's first and second partials. Partials there become
        +inf where those they depend on are not 0, and 0 where they are.
    """

    def jump(i: int, j: int, curve: Partial) -> Array:
        x, y = slopes[i], slopes[j]
        moves = np.zeros(1, dtype=np.bool_) if curve is None else curve != 0.0
        if x is not None and y is not None:
            moves = moves | ((x != 0.0) & (y != 0.0))
        return np.where(moves, np.inf, 0.0)

    steps = tuple(None if s is None else np.where(s != 0.0, np.inf, 0.0) for s in slopes)
    return _with_partials_at(smooth, zero, steps, curves, jump)


def _with_partials_at(
    smooth: Jet,
    zero: NDArray[np.bool_],
    steps: Partials,
    curves: Partials,
    second: Callable[[int, int, Partial], Array],
) -> Jet:
    """Replace a jet's partials where `zero` is set; None stays None."""
    gradient = tuple(
        entry if entry is None or step is None else np.where(zero, step, entry)
        for entry, step in zip(smooth.gradient, steps, strict=True)
    )
    if smooth.hessian is None:
        return Jet(smooth.value, gradient)
    hessian = tuple(
        None if entry is None else np.where(zero, second(i, j, curve), entry)
        for (i, j), entry, curve in zip(
            hessian_axes(smooth.axes), smooth.hessian, curves, strict=True
        )
    )
    return Jet(smooth.value, gradient, hessian)


def _lengths(a: Jet, b: Jet) -> tuple[Partials, Partials]:
    """Lengths of the inner partials of a pair: those of the gradients and those of the Hessians."""

    def length(x: Partial, y: Partial) -> Partial:
        if x is None or y is None:
            single = y if x is None else x
            return None if single is None else np.abs(single)
        return np.hypot(x, y)

    gradient = tuple(map(length, a.gradient, b.gradient))
    return gradient, tuple(map(length, a.hessian or (), b.hessian or ()))


def _chain(x: Jet, value: Array, first: Thunk, second: Thunk) -> Jet:
    """Chain rule for f(x); f' and f'' are computed only if they are needed."""
    if x.is_constant:
        return Jet(value, x.gradient, x.hessian)
    bends = x.hessian is not None and any(entry is not None for entry in x.gradient)
    with np.errstate(divide="ignore"):  # an infinite derivative is documented
        slope = first()
        bend = second() if bends else slope
    steep = not np.isfinite(bend).all()
    times: Callable[[Array, Array], Array] = _zero_preserving_product if steep else np.multiply
    gradient = tuple(None if entry is None else times(slope, entry) for entry in x.gradient)
    if x.hessian is None:
        return Jet(value, gradient)
    hessian = []
    for (i, j), entry in zip(hessian_axes(x.axes), x.hessian, strict=True):
        total = None if entry is None else times(slope, entry)
        a, b = x.gradient[i], x.gradient[j]
        if a is not None and b is not None:
            curve = times(times(bend, a), b)
            total = _infinity_preserving_sum(curve, total) if steep else accumulate(curve, total)
        hessian.append(total)
    return Jet(value, gradient, tuple(hessian))


def _zero_preserving_product(factor: Array, inner: Array) -> Array:
    """factor * inner, with 0 * inf = 0 where the inner partial is 0."""
    with np.errstate(invalid="ignore"):  # 0 * inf is replaced in the next line
        product = factor * inner
    return np.where(inner == 0.0, 0.0, product)


def _infinity_preserving_sum(curve: Array, slope: Partial) -> Array:
    """f'' x_i x_j + f' x_ij, where an infinite first term hides the second."""
    if slope is None:
        return curve
    with np.errstate(invalid="ignore"):  # inf - inf is not used
        return np.where(np.isinf(curve), curve, curve + slope)


def _bivariate_chain(
    a: Jet, b: Jet, value: Array, first: tuple[Array, Array], second: tuple[Array, Array, Array]
) -> Jet:
    """Chain rule for f(a, b): first = (f_a, f_b), second = (f_aa, f_ab, f_bb)."""

    def total(*products: tuple[Partial, ...]) -> Partial:
        result: Partial = None
        for factors in products:
            present = [factor for factor in factors if factor is not None]
            if len(present) == len(factors):
                term = present[0] * present[1]
                for factor in present[2:]:
                    term *= factor
                result = accumulate(result, term)
        return result

    (f_a, f_b), (f_aa, f_ab, f_bb) = first, second
    gradient = tuple(total((f_a, x), (f_b, y)) for x, y in zip(a.gradient, b.gradient, strict=True))
    if a.hessian is None or b.hessian is None:
        return Jet(value, gradient)
    hessian = tuple(
        total(
            (f_a, xx),
            (f_b, yy),
            (f_aa, a.gradient[i], a.gradient[j]),
            (f_ab, a.gradient[i], b.gradient[j]),
            (f_ab, b.gradient[i], a.gradient[j]),
            (f_bb, b.gradient[i], b.gradient[j]),
        )
        for (i, j), xx, yy in zip(hessian_axes(a.axes), a.hessian, b.hessian, strict=True)
    )
    return Jet(value, gradient, hessian)
