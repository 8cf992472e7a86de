# SPDX-License-Identifier: GPL-3.0-or-later
"""Polynomials over boxes: values, products, ranges and exchanged axes, against plain sums."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.numerics.box_polynomials import (
    Boxes,
    linear_coefficients,
    polynomial_range,
    product_coefficients,
    swap_axes,
)

DEGREES = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))


def value_at(form, place):
    """Values (m,) of polynomials (T, k, m) at places (3, m) of a box, each from -1/2 to 1/2."""
    x, y, t = place
    return sum(
        form[power, k] * t**power * x ** DEGREES[k][0] * y ** DEGREES[k][1]
        for power in range(form.shape[0])
        for k in range(form.shape[1])
    )


@pytest.mark.parametrize("seed", range(10))
def test_ranges_hold_everywhere_in_the_box(seed):
    rng = np.random.default_rng(seed)
    form = rng.normal(size=(3, 6, 20))
    low, high = polynomial_range(form)
    place = rng.uniform(-0.5, 0.5, (3, 2_000, 1))
    values = value_at(form[:, :, None, :], place)
    assert (values >= low - 1e-12).all() and (values <= high + 1e-12).all()
    # the range of a linear one is exact
    form[1:], form[:, 3:] = 0.0, 0.0
    low, high = polynomial_range(form)
    corners = [
        value_at(form, np.array([[x], [y], [0.0]])) for x in (-0.5, 0.5) for y in (-0.5, 0.5)
    ]
    np.testing.assert_allclose(low, np.min(corners, axis=0), rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(high, np.max(corners, axis=0), rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("terms", [1, 3, 6])
def test_x_and_y_may_be_exchanged(terms):
    rng = np.random.default_rng(terms)
    form, place = rng.normal(size=(2, terms, 8)), rng.uniform(-0.5, 0.5, (3, 1))
    before = value_at(form, place)
    index = np.array([1, 5])
    swap_axes(form, index)
    after, turned = value_at(form, place), value_at(form, place[[1, 0, 2]])
    np.testing.assert_allclose(turned[index], before[index], rtol=1e-13)
    others = np.delete(np.arange(8), index)
    np.testing.assert_array_equal(after[others], before[others])


@pytest.mark.parametrize("same", [False, True])
def test_products_of_linear_vectors(same):
    rng = np.random.default_rng(7)
    a = tuple(rng.normal(size=(3, 3, 5)))
    b = a if same else tuple(rng.normal(size=(3, 3, 5)))
    place = rng.uniform(-0.5, 0.5, (3, 1))
    one, other = (part[0] + place[0] * part[1] + place[1] * part[2] for part in (a, b))
    found = value_at(product_coefficients(a, b)[None], place)
    np.testing.assert_allclose(found, (one * other).sum(axis=0), rtol=1e-12)
    found = value_at(linear_coefficients(a, b[0])[None], place)
    np.testing.assert_allclose(found, (one * b[0]).sum(axis=0), rtol=1e-12)


def test_boxes_have_a_middle_and_sides():
    boxes = Boxes(np.array([[0.0], [1.0], [-0.5]]), np.array([[2.0], [1.0], [0.5]]))
    assert boxes.middle.ravel().tolist() == [1.0, 1.0, 0.0]
    assert boxes.size.ravel().tolist() == [2.0, 0.0, 1.0]
