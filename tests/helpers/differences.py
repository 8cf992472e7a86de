# SPDX-License-Identifier: GPL-3.0-or-later
"""Derivatives by 50-digit finite differences, which share no code with the jets."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import mpmath
import numpy as np

from adaptive_drt.numerics.jet import Jet, hessian_axes

DIGITS = 50
AXES = 2


def random_jet(generator, value, order, axes=AXES, missing=()) -> Jet:
    """A jet with partials of all sizes around a value; the axes in `missing` are None."""
    shape = np.shape(value)

    def partial() -> np.ndarray:
        return generator.normal(size=shape) * 10.0 ** generator.uniform(-2, 2, size=shape)

    gradient = tuple(None if i in missing else partial() for i in range(axes))
    hessian = tuple(
        None if i in missing or j in missing else partial() for i, j in hessian_axes(axes)
    )
    return Jet(np.asarray(value, dtype=float), gradient, hessian if order == 2 else None)


def densified(jet: Jet) -> Jet:
    """The same jet with its structural zeros written down, and every partial in full shape."""

    def full(entry):
        return np.array(np.broadcast_to(0.0 if entry is None else entry, jet.shape))

    hessian = None if jet.hessian is None else tuple(map(full, jet.hessian))
    return Jet(jet.value, tuple(map(full, jet.gradient)), hessian)


def polynomial(jet: Jet, index) -> Callable[..., mpmath.mpf]:
    """One element of a jet as the polynomial it stands for, in extended precision."""
    dense = densified(jet)

    def number(entry) -> mpmath.mpf:
        return mpmath.mpf(float(entry[index]))

    value = number(dense.value)
    gradient = [number(entry) for entry in dense.gradient]
    hessian = [number(entry) for entry in dense.hessian or ()]

    def evaluate(*offset):
        total = value + sum(g * o for g, o in zip(gradient, offset, strict=True))
        for (i, j), h in zip(hessian_axes(len(gradient)), hessian, strict=len(hessian) > 0):
            total += h * offset[i] * offset[j] / (2 if i == j else 1)
        return total

    return evaluate


def partials(function: Callable[..., mpmath.mpf], axes: int, order: int) -> list[mpmath.mpf]:
    """Value, gradient and packed Hessian of a function at the origin."""
    with mpmath.workdps(DIGITS):
        origin = (mpmath.mpf(0),) * axes
        result = [function(*origin)]
        for i in range(axes):
            result.append(mpmath.diff(function, origin, tuple(int(k == i) for k in range(axes))))
        if order == 2:
            for i, j in hessian_axes(axes):
                orders = tuple(int(k == i) + int(k == j) for k in range(axes))
                result.append(mpmath.diff(function, origin, orders))
        return result


def entries(jet: Jet) -> list[np.ndarray]:
    """Value, gradient and packed Hessian of a jet, in full shape."""
    dense = densified(jet)
    return [dense.value, *dense.gradient, *(dense.hessian or ())]


def scales(function: Callable[..., mpmath.mpf], inner: Sequence[Jet], index) -> list[float]:
    """Sum of the magnitudes of the chain rule's terms: what rounding errors are relative to."""
    with mpmath.workdps(DIGITS):
        at = [mpmath.mpf(float(jet.value[index])) for jet in inner]
        count = range(len(inner))
        first = [abs(mpmath.diff(function, at, tuple(int(k == i) for k in count))) for i in count]
        second = {
            (i, j): abs(mpmath.diff(function, at, tuple(int(k == i) + int(k == j) for k in count)))
            for i in count
            for j in count
        }
        dense = [[abs(float(entry[index])) for entry in entries(jet)] for jet in inner]
        axes = inner[0].axes
        result = [abs(function(*at))]
        for i in range(axes):
            result.append(sum(first[k] * dense[k][1 + i] for k in count))
        if inner[0].order == 2:
            for position, (i, j) in enumerate(hessian_axes(axes)):
                result.append(
                    sum(first[k] * dense[k][1 + axes + position] for k in count)
                    + sum(
                        second[k, m] * dense[k][1 + i] * dense[m][1 + j]
                        for k in count
                        for m in count
                    )
                )
        return [float(scale) for scale in result]
