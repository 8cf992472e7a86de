# SPDX-License-Identifier: GPL-3.0-or-later
"""Forward-mode automatic differentiation: a value, its gradient and its Hessian, in batches.

A jet is a truncated Taylor expansion. Let e stand for a step too small for e^3 to
matter. Then f(x) = x^2 at x = 10 + e is 100 + 20 e + e^2: the value, the derivative and half
the second derivative come out of plain algebra, to rounding, with no step size to choose. With
several axes (light x, y, z; time t; pixel x, y) a jet holds

    f(c + o) = value + sum_i gradient[i] o_i + 1/2 sum_ij hessian[ij] o_i o_j + ...

for an offset o from the centre c. Order 1 leaves the last sum out. Where f is a polynomial of
degree two, as the discriminants of spheres are, an order 2 jet represents f exactly.

Every rule below is one of four:

    linear       (a + b)_i = a_i + b_i
    bilinear     f(a, b)_i = f(a_i, b) + f(a, b_i)
                 f(a, b)_ij = f(a_ij, b) + f(a, b_ij) + f(a_i, b_j) + f(a_j, b_i)
    chain        f(a)_i = f' a_i,  f(a)_ij = f' a_ij + f'' a_i a_j
    quotient     q = a / b:  q_i = (a_i - q b_i) / b,
                 q_ij = (a_ij - q_i b_j - q_j b_i - q b_ij) / b

(`jet_functions.py` has sqrt, sin and other functions; `vector.py` has dot, cross and norm.)

Storage. A batch is an array whose last axis counts the points, `(..., n)`. Each partial is an
array that broadcasts against the value, or None, a structural zero, which is
never computed, stored or multiplied: a static light has no cost for time. That is why partials
are tuples with an entry for each axis and not one stacked array `(k, ..., n)`, which would have
to store its zeros. A linear variable stores its direction as `(3, 1)`.

Singularities. A zero partial stays zero whatever the function does there. Where a derivative
is unbounded (sqrt at 0), partials are infinite, never NaN and never 0, so a bound made of
them is unbounded and no test takes the value for constant. Each function documents what it
returns. Further arithmetic on an infinite partial can still make NaN (0 * inf, inf - inf): mask
such points out beforehand, or check `Jet.finite` before using a bound.

Every operation is elementwise and the order of each sum is fixed (no einsum, no reductions over
points), so results are bitwise equal for every batch size.

Source: Griewank and Walther 2008, chapters 3 and 13; the structure of this text follows Ceres'
jet.h.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar, TypeAlias, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .partials import (
    Array,
    Partial,
    Partials,
    accumulate,
    add,
    doubled_product,
    hessian_axes,
    leading_component,
    map_partials,
    product,
    subtract,
)

__all__ = [
    "Array",
    "Batch",
    "Jet",
    "Operand",
    "Partial",
    "Partials",
    "as_matching_jets",
    "bilinear",
    "hessian_axes",
    "quadratic",
    "take",
    "where",
]


@dataclass(frozen=True, slots=True, eq=False)
class Jet:
    """Value and partial derivatives of a batch of numbers or vectors. Immutable.

    Attributes
    ----------
    value : (..., n) float64.
    gradient : one entry for each axis; an array that broadcasts to the value's shape, or None.
    hessian : packed upper triangle in the order of `hessian_axes`, entries as in the gradient;
        None as a whole when the jet is of order 1.

    Jets in one formula must have the same axes and order (ValueError otherwise). The caller
    compares their `.value`.
    """

    value: Array
    gradient: Partials
    hessian: Partials | None = None

    __array_ufunc__: ClassVar[None] = None  # so that `array * jet` asks the jet

    @staticmethod
    def constant(value: ArrayLike, axes: int, order: int) -> Jet:
        """Return a jet that depends on no axis: every partial is a structural zero."""
        return Jet.linear(value, (None,) * axes, order)

    @staticmethod
    def variable(
        value: ArrayLike, axis: int, axes: int, order: int, direction: ArrayLike = 1.0
    ) -> Jet:
        """Return a jet that changes by `direction` (broadcasts to `value`) per unit of one axis."""
        directions: list[ArrayLike | None] = [None] * axes
        directions[axis] = direction
        return Jet.linear(value, directions, order)

    @staticmethod
    def linear(value: ArrayLike, directions: Sequence[ArrayLike | None], order: int) -> Jet:
        """Return a jet linear in every axis: one direction, or None, for each.

        Raises
        ------
        ValueError
            `order` is neither 1 nor 2, or a direction does not broadcast to the value's shape.
        """
        if order not in (1, 2):
            raise ValueError(f"order is {order!r}; a jet is of order 1 or 2")
        array = np.asarray(value, dtype=np.float64)
        gradient = tuple(
            None if entry is None else np.asarray(entry, dtype=np.float64) for entry in directions
        )
        for entry in gradient:
            if entry is not None and np.broadcast_shapes(entry.shape, array.shape) != array.shape:
                raise ValueError(f"direction {entry.shape} does not fit the value {array.shape}")
        none = (None,) * len(hessian_axes(len(gradient)))
        return Jet(array, gradient, none if order == 2 else None)

    @property
    def order(self) -> int:
        """Order of the jet: 1 with the gradient only, 2 with gradient and Hessian."""
        return 1 if self.hessian is None else 2

    @property
    def axes(self) -> int:
        """Number of axes along which partials are taken."""
        return len(self.gradient)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the value."""
        return self.value.shape

    @property
    def ndim(self) -> int:
        """Number of dimensions of the value."""
        return self.value.ndim

    @property
    def is_constant(self) -> bool:
        """Whether every partial is a structural zero."""
        return all(entry is None for entry in self.gradient + (self.hessian or ()))

    def second(self, i: int, j: int) -> Partial:
        """Second partial by axes i and j; None for a structural zero or a jet of order 1."""
        if self.hessian is None:
            return None
        return self.hessian[hessian_axes(self.axes).index((min(i, j), max(i, j)))]

    def finite(self) -> NDArray[np.bool_]:
        """Where value and partials are all finite; shape of the value."""
        result = np.isfinite(self.value)
        for entry in self.gradient + (self.hessian or ()):
            if entry is not None:
                result = result & np.isfinite(entry)
        return result

    def at(self, offsets: Sequence[ArrayLike]) -> Array:
        """Value of the Taylor polynomial at an offset from the centre, a coordinate for each axis.

        Offsets broadcast against the value. Exact, to rounding, for polynomials of degree
        `order`. Partials must be finite.
        """
        steps = [np.asarray(offset, dtype=np.float64) for offset in offsets]
        result = self.value
        for entry, step in zip(self.gradient, steps, strict=True):
            if entry is not None:
                result = result + entry * step
        if self.hessian is not None:
            for (i, j), entry in zip(hessian_axes(self.axes), self.hessian, strict=True):
                if entry is not None:
                    weight = 0.5 * steps[i] if i == j else steps[i]
                    result = result + entry * (weight * steps[j])
        return result

    def map(self, function: Callable[[Array], Array]) -> Jet:
        """Apply a linear function of arrays to the value and to each partial that is not None."""
        return Jet(
            function(self.value),
            map_partials(function, self.gradient),
            None if self.hessian is None else map_partials(function, self.hessian),
        )

    def __getitem__(self, component: int) -> Jet:
        """Leading component: `jet[0]` is the x component of a batch of vectors `(3, n)`."""

        def pick(entry: Array) -> Array:
            return (
                entry
                if entry is self.value
                else leading_component(entry, self.value.ndim, component)
            )

        part = self.map(pick)
        return Jet(self.value[component], part.gradient, part.hessian)

    def __len__(self) -> int:
        return len(self.value)

    def __neg__(self) -> Jet:
        return self.map(np.negative)

    def __add__(self, other: Operand) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.value + other, self.gradient, self.hessian)
        return _combine(self.value + other.value, add, self, other)

    __radd__ = __add__

    def __sub__(self, other: Operand) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.value - other, self.gradient, self.hessian)
        return _combine(self.value - other.value, subtract, self, other)

    def __rsub__(self, other: Array | float) -> Jet:
        return -self + other

    def __mul__(self, other: Operand) -> Jet:
        return quadratic(np.multiply, self) if self is other else bilinear(np.multiply, self, other)

    __rmul__ = __mul__

    def __truediv__(self, other: Operand) -> Jet:
        """Quotient. As with arrays, the caller has to mask divisors of 0 beforehand."""
        if isinstance(other, Jet):
            return _quotient(self, other)
        return self.map(lambda entry: entry / other)

    def __rtruediv__(self, other: Array | float) -> Jet:
        return _quotient(Jet.constant(other, self.axes, self.order), self)

    def __pow__(self, exponent: int) -> Jet:
        """Integer power by repeated squaring; x ** 0 is the constant 1, also at x = 0."""
        if not isinstance(exponent, int):
            raise TypeError(f"a jet's power must be an integer, not {exponent!r}")
        if exponent < 0:
            return 1.0 / self**-exponent
        if exponent == 0:
            return Jet.constant(np.ones_like(self.value), self.axes, self.order)
        if exponent == 1:
            return self
        half = self ** (exponent // 2)
        return half * half * self if exponent % 2 else half * half


Operand: TypeAlias = Jet | Array | float
Batch = TypeVar("Batch", Jet, Array, Jet | Array)


def bilinear(function: Callable[[Array, Array], Array], a: Operand, b: Operand) -> Jet:
    """Product rule for any bilinear function of two arrays: multiply, dot, cross.

    At least one operand is a jet; the other may be an array. `function` must return a new
    array: terms are summed in place.
    """
    a, b = as_matching_jets(a, b)
    gradient = tuple(
        accumulate(product(function, x, b.value), product(function, a.value, y))
        for x, y in zip(a.gradient, b.gradient, strict=True)
    )
    value = function(a.value, b.value)
    if a.hessian is None or b.hessian is None:
        return Jet(value, gradient)
    hessian = []
    for (i, j), xx, yy in zip(hessian_axes(a.axes), a.hessian, b.hessian, strict=True):
        total = accumulate(product(function, xx, b.value), product(function, a.value, yy))
        if i == j:  # both mixed terms are one product
            total = accumulate(total, doubled_product(function, a.gradient[i], b.gradient[i]))
        else:
            total = accumulate(total, product(function, a.gradient[i], b.gradient[j]))
            total = accumulate(total, product(function, a.gradient[j], b.gradient[i]))
        hessian.append(total)
    return Jet(value, gradient, tuple(hessian))


def quadratic(function: Callable[[Array, Array], Array], a: Jet) -> Jet:
    """Product rule for f(a, a), f bilinear and symmetric, at half the cost of `bilinear`.

    f_i = 2 f(a_i, a),  f_ij = 2 f(a_ij, a) + 2 f(a_i, a_j).
    """
    gradient = tuple(doubled_product(function, entry, a.value) for entry in a.gradient)
    value = function(a.value, a.value)
    if a.hessian is None:
        return Jet(value, gradient)
    hessian = tuple(
        accumulate(
            doubled_product(function, entry, a.value),
            doubled_product(function, a.gradient[i], a.gradient[j]),
        )
        for (i, j), entry in zip(hessian_axes(a.axes), a.hessian, strict=True)
    )
    return Jet(value, gradient, hessian)


def take(a: Batch, index: NDArray[np.intp] | NDArray[np.bool_]) -> Batch:
    """Return selected points of a batch, along the last axis, by index or by mask."""
    positions = index.nonzero()[0] if index.dtype == np.bool_ else index
    if isinstance(a, Jet):
        # An entry that is the same for all points stays as it is.
        return a.map(
            lambda entry: (
                entry
                if entry.ndim == 0 or (entry.shape[-1] == 1 and entry is not a.value)
                else np.take(entry, positions, axis=-1)
            )
        )
    return np.take(a, positions, axis=-1)


@overload
def where(mask: NDArray[np.bool_], a: Jet, b: Operand) -> Jet: ...
@overload
def where(mask: NDArray[np.bool_], a: Operand, b: Jet) -> Jet: ...
@overload
def where(mask: NDArray[np.bool_], a: Array | float, b: Array | float) -> Array: ...
def where(mask: NDArray[np.bool_], a: Operand, b: Operand) -> Operand:
    """Return `a` where the mask is set and `b` elsewhere, partials alike. The mask broadcasts."""
    if not isinstance(a, Jet) and not isinstance(b, Jet):
        return np.where(mask, a, b)

    def choose(x: Partial, y: Partial) -> Partial:
        if x is None and y is None:
            return None
        return np.where(mask, 0.0 if x is None else x, 0.0 if y is None else y)

    a, b = as_matching_jets(a, b)
    return _combine(np.where(mask, a.value, b.value), choose, a, b)


def as_matching_jets(a: Operand, b: Operand) -> tuple[Jet, Jet]:
    """Return both operands as jets of the same axes and order; at least one must be a jet.

    Raises
    ------
    ValueError
        Two jets differ in their axes or order.
    """
    if not isinstance(b, Jet):
        assert isinstance(a, Jet)
        return a, Jet.constant(b, a.axes, a.order)
    if not isinstance(a, Jet):
        return Jet.constant(a, b.axes, b.order), b
    if (a.axes, a.order) != (b.axes, b.order):
        raise ValueError(f"jets of {a.axes} and {b.axes} axes, order {a.order} and {b.order}")
    return a, b


def _combine(value: Array, function: Callable[[Partial, Partial], Partial], a: Jet, b: Jet) -> Jet:
    """A jet whose partials are `function` of the corresponding partials of two jets."""
    a, b = as_matching_jets(a, b)
    return Jet(
        value,
        tuple(map(function, a.gradient, b.gradient)),
        tuple(map(function, a.hessian, b.hessian)) if a.hessian and b.hessian else None,
    )


def _quotient(a: Jet, b: Jet) -> Jet:
    """a / b by the quotient rule of the module's docstring."""
    a, b = as_matching_jets(a, b)
    value = a.value / b.value
    multiply = np.multiply

    def divide(*terms: Partial) -> Partial:
        total, *rest = terms
        for term in rest:
            total = subtract(total, term)
        return None if total is None else total / b.value

    gradient = tuple(
        divide(x, product(multiply, value, y)) for x, y in zip(a.gradient, b.gradient, strict=True)
    )
    if a.hessian is None or b.hessian is None:
        return Jet(value, gradient)
    hessian = []
    for (i, j), xx, yy in zip(hessian_axes(a.axes), a.hessian, b.hessian, strict=True):
        mixed = (
            (doubled_product(multiply, gradient[i], b.gradient[i]),)
            if i == j
            else (
                product(multiply, gradient[i], b.gradient[j]),
                product(multiply, gradient[j], b.gradient[i]),
            )
        )
        hessian.append(divide(xx, *mixed, product(multiply, value, yy)))
    return Jet(value, gradient, tuple(hessian))
