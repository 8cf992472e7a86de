# SPDX-License-Identifier: GPL-3.0-or-later
"""Arithmetic on partials: what None stands for is zero, and it costs no arithmetic."""

from __future__ import annotations

from itertools import product as combinations

import numpy as np
import pytest

from adaptive_drt.numerics.partials import (
    accumulate,
    add,
    doubled_product,
    hessian_axes,
    leading_component,
    map_partials,
    product,
    subtract,
)


def dense(entry, shape=(3, 5)):
    return np.zeros(shape) if entry is None else np.broadcast_to(entry, shape)


def entries(seed):
    rng = np.random.default_rng(seed)
    return [None, rng.normal(size=(3, 5)), rng.normal(size=(1, 5)), rng.normal(size=5)]


@pytest.mark.parametrize("axes", range(1, 5))
def test_packed_hessians_are_upper_triangles_row_by_row(axes):
    assert list(hessian_axes(axes)) == list(zip(*map(list, np.triu_indices(axes)), strict=True))


@pytest.mark.parametrize("x, y", list(combinations(range(4), range(4))))
def test_sums_differences_and_products_are_those_of_dense_arrays(x, y):
    one, other = entries(1)[x], entries(2)[y]
    for found, want in (
        (add(one, other), dense(one) + dense(other)),
        (subtract(one, other), dense(one) - dense(other)),
        (product(np.multiply, one, other), dense(one) * dense(other)),
        (doubled_product(np.multiply, one, other), 2.0 * dense(one) * dense(other)),
        (accumulate(*(None if e is None else e.copy() for e in (one, other))),
         dense(one) + dense(other)),
    ):  # fmt: skip
        np.testing.assert_array_equal(dense(found), want)


def test_zeros_stay_structural():
    x = np.ones(4)
    assert add(None, None) is None and subtract(None, None) is None
    assert accumulate(None, None) is None
    assert add(None, x) is x and subtract(x, None) is x

    def never(a, b):
        raise AssertionError("arithmetic with None")

    for both in ((None, None), (x, None), (None, x)):
        assert product(never, *both) is None and doubled_product(never, *both) is None
    assert map_partials(np.negative, (None, x, None))[::2] == (None, None)
    np.testing.assert_array_equal(map_partials(np.negative, (None, x))[1], -x)


def test_sums_are_in_place_where_shapes_allow():
    total, term = np.ones((3, 4)), np.full((3, 4), 2.0)
    assert accumulate(total, term) is total and (total == 3.0).all() and (term == 2.0).all()
    small = np.ones((1, 4))
    assert accumulate(small, term).shape == (3, 4) and (small == 1.0).all()


def test_components_of_partials_that_broadcast():
    whole = np.arange(12.0).reshape(3, 4)
    for k in range(3):
        np.testing.assert_array_equal(leading_component(whole, 2, k), whole[k])
        np.testing.assert_array_equal(leading_component(whole[:1], 2, k), whole[0])
        np.testing.assert_array_equal(leading_component(whole[1], 2, k), whole[1])
