# SPDX-License-Identifier: GPL-3.0-or-later
"""Arithmetic on partial derivatives as jets store them: arrays, or None for a structural zero.

No function here does any arithmetic with None.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TypeAlias

from .arrays import Array

__all__ = [
    "Array",
    "Partial",
    "Partials",
    "accumulate",
    "add",
    "doubled_product",
    "hessian_axes",
    "leading_component",
    "map_partials",
    "product",
    "subtract",
]

Partial: TypeAlias = Array | None
Partials: TypeAlias = tuple[Partial, ...]


@cache
def hessian_axes(axes: int) -> tuple[tuple[int, int], ...]:
    """Axes (i, j), i <= j, of each entry of a packed Hessian: row by row, xx xy yy for two axes."""
    return tuple((i, j) for i in range(axes) for j in range(i, axes))


def accumulate(total: Partial, term: Partial) -> Partial:
    """Sum of two arrays that the caller owns, in place where shapes allow; None counts as zero."""
    if total is None or term is None:
        return term if total is None else total
    if total.shape != term.shape:
        return total + term
    total += term
    return total


def leading_component(entry: Array, ndim: int, component: int) -> Array:
    """One leading component of a partial that broadcasts to an array of `ndim` axes."""
    if entry.ndim < ndim:
        return entry
    part: Array = entry[0] if entry.shape[0] == 1 else entry[component]
    return part


def map_partials(function: Callable[[Array], Array], partials: Partials) -> Partials:
    """Apply a function to each partial that is not None."""
    return tuple(None if entry is None else function(entry) for entry in partials)


def add(x: Partial, y: Partial) -> Partial:
    """x + y."""
    if x is None or y is None:
        return y if x is None else x
    return x + y


def subtract(x: Partial, y: Partial) -> Partial:
    """x - y."""
    if y is None:
        return x
    return -y if x is None else x - y


def product(function: Callable[[Array, Array], Array], x: Partial, y: Partial) -> Partial:
    """`function(x, y)` for a bilinear function: None if either factor is None."""
    return None if x is None or y is None else function(x, y)


def doubled_product(function: Callable[[Array, Array], Array], x: Partial, y: Partial) -> Partial:
    """2 `function(x, y)` for a bilinear function that returns a new array; None with a None."""
    if x is None or y is None:
        return None
    result = function(x, y)
    result *= 2.0
    return result
