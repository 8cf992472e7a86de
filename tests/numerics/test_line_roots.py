# SPDX-License-Identifier: GPL-3.0-or-later
"""Roots of polynomials on lines, against polynomials made from their roots."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.numerics.line_roots import (
    NO_ROOT,
    coefficient,
    multiply,
    quadratic_roots,
    quartic_roots,
)

COUNT = 300


def within(roots):
    """Roots on the line, in order; those beyond it count as none."""
    return np.sort(np.where(np.abs(roots) < 0.5, roots, NO_ROOT), axis=0)


@pytest.mark.parametrize("seed", range(5))
def test_quadratics_have_the_roots_that_they_are_made_of(seed):
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(-0.8, 0.8, (2, COUNT))
    size = 10.0 ** rng.uniform(-200, 200, COUNT) * rng.choice([-1, 1], COUNT)
    found = np.sort(quadratic_roots(size * a * b, -size * (a + b), size), axis=0)
    clear = (np.abs(np.abs([a, b]) - 0.5) > 1e-6).all(axis=0) & (np.abs(a - b) > 1e-3)
    np.testing.assert_allclose(found[:, clear], within(np.array([a, b]))[:, clear], atol=1e-12)


def test_quadratics_that_are_linear_constant_or_without_a_root():
    c, slope, a = (
        np.array(x) for x in ([0.1, 0.0, 1.0, 1.0], [-0.5, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 2.0])
    )
    found = np.array(quadratic_roots(c, slope, a))
    assert np.isclose(found[:, 0], 0.2).sum() == 1
    assert (found[:, 2:] == NO_ROOT).all()
    # a double root counts, though rounding may put it off the line of real numbers
    low, high = quadratic_roots(np.array([0.01 * (1 + 1e-15)]), np.array([-0.2]), np.array([1.0]))
    assert low[0] == pytest.approx(0.1) and high[0] == pytest.approx(0.1)


@pytest.mark.parametrize("seed", range(5))
def test_quartics_have_the_roots_that_they_are_made_of(seed):
    rng = np.random.default_rng(seed)
    roots = rng.uniform(-0.8, 0.8, (4, COUNT))
    form = [np.ones(COUNT)]
    for root in roots:
        form = multiply(form, [-root, np.ones(COUNT)])
    size = 10.0 ** rng.uniform(-5, 5)
    found = np.sort(quartic_roots([size * part for part in form]), axis=0)
    apart = np.diff(np.sort(roots, axis=0), axis=0).min(axis=0) > 0.02
    clear = apart & (np.abs(np.abs(roots) - 0.5) > 1e-6).all(axis=0)
    assert clear.sum() > 50
    np.testing.assert_allclose(found[:, clear], within(roots)[:, clear], atol=1e-7)


def test_products_and_coefficients():
    a, b = [np.array([1.0]), np.array([2.0])], [np.array([3.0]), np.array([0.0]), np.array([4.0])]
    product = multiply(a, b)
    assert [float(part[0]) for part in product] == [3.0, 6.0, 4.0, 8.0]
    assert coefficient(product, 3)[0] == 8.0 and coefficient(product, 4)[0] == 0.0
