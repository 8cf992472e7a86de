# SPDX-License-Identifier: GPL-3.0-or-later
"""Functions of jets: identities, steep points, kinks and the ends of domains.

Their rules are held against 50 digits in `test_jet.py`."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from adaptive_drt.numerics.jet import Jet, hessian_axes
from adaptive_drt.numerics.jet_functions import (
    absolute,
    arccos,
    arcsin,
    arctan2,
    cos,
    hypot,
    log,
    sin,
    sqrt,
)
from differences import entries, random_jet

SAMPLES = 12


def signed(generator):
    return generator.choice([-1.0, 1.0], SAMPLES) * 10.0 ** generator.uniform(-6, 6, SAMPLES)


def positive(generator):
    return np.abs(signed(generator))


@pytest.fixture(params=[1, 2], ids=["order1", "order2"])
def order(request):
    return request.param


def test_arc_identities(order):
    generator = np.random.default_rng(7)
    x = random_jet(generator, generator.uniform(-0.9, 0.9, 50), order)
    for have, want in (
        (sin(arcsin(x)), x),
        (cos(arccos(x)), x),
        (arcsin(x) + arccos(x), 0.0 * x + np.pi / 2),
        (arctan2(sin(x), cos(x)), x),
    ):
        for p, q in zip(entries(have), entries(want), strict=True):
            assert_allclose(p, q, rtol=1e-11, atol=1e-8)


def steep(order, value, slopes, curve):
    """One point, two axes: first partials `slopes`, every second partial `curve`."""
    gradient = tuple(np.array([slope]) for slope in slopes)
    hessian = tuple(np.array([curve]) for _ in hessian_axes(2)) if order == 2 else None
    return Jet(np.array([value]), gradient, hessian)


@pytest.mark.parametrize(
    ("function", "at", "first", "second"),
    [
        (sqrt, 0.0, 1, -1),
        (sqrt, -1e-18, 1, -1),
        (log, 0.0, 1, -1),
        (arcsin, 1.0, 1, 1),
        (arcsin, -1.0, 1, -1),
        (arccos, 1.0, -1, -1),
        (arccos, -1.0, -1, 1),
    ],
)
def test_steep_points_are_infinite_never_nan(function, at, first, second, order):
    inf = np.inf
    result = function(steep(order, at, (2.0, -3.0), 5.0))
    assert [g[0] for g in result.gradient] == [first * inf, -first * inf]
    if order == 2:  # f'' x_i x_j outgrows f' x_ij
        assert [h[0] for h in result.hessian] == [second * inf, -second * inf, second * inf]
    result = function(steep(order, at, (0.0, -3.0), 5.0))
    assert [g[0] for g in result.gradient] == [0.0, -first * inf]
    if order == 2:
        assert [h[0] for h in result.hessian] == [first * inf, first * inf, second * inf]
    result = function(steep(order, at, (0.0, 0.0), 0.0))
    assert all(entry[0] == 0.0 for entry in entries(result)[1:])
    constant = function(Jet.constant([at], 2, order))
    assert constant.is_constant and not np.isnan(constant.value).any()
    assert not function(steep(order, at, (1.0, 1.0), 0.0)).finite().any()


def test_a_steep_point_changes_no_other_point(order):
    generator = np.random.default_rng(10)
    values = positive(generator)
    x = random_jet(generator, values, order)
    values[3] = 0.0
    y = Jet(values, x.gradient, x.hessian)
    others = np.arange(SAMPLES) != 3
    for have, want in zip(entries(sqrt(y)), entries(sqrt(x)), strict=True):
        assert_array_equal(have[others], want[others])
    assert_array_equal(sqrt(y).finite(), others)


def test_kinks_and_jumps_at_the_origin(order):
    a, b = steep(order, 0.0, (3.0, 0.0), 5.0), steep(order, 0.0, (-4.0, 0.0), 12.0)
    length = hypot(a, b)
    assert [g[0] for g in length.gradient] == [5.0, 0.0] and length.value[0] == 0.0
    angle = arctan2(a, b)
    assert [g[0] for g in angle.gradient] == [np.inf, 0.0]
    if order == 2:
        assert [h[0] for h in length.hessian] == [np.inf, 13.0, 13.0]
        assert [h[0] for h in angle.hessian] == [np.inf] * 3
    still = arctan2(Jet.constant([0.0], 2, order), Jet.constant([0.0], 2, order))
    assert still.is_constant and still.value[0] == 0.0
    for zero, sign in ((0.0, 1.0), (-0.0, -1.0)):
        assert absolute(steep(order, zero, (2.0, -3.0), 1.0)).gradient[1][0] == -3.0 * sign


def test_arguments_past_the_end_of_a_domain():
    assert_array_equal(sqrt(np.array([-1.0, 0.0, 4.0])), [0.0, 0.0, 2.0])
    assert_array_equal(log(np.array([-1.0, 0.0, 1.0])), [-np.inf, -np.inf, 0.0])
    assert_array_equal(arcsin(np.array([-1.1, 1.1])), [-np.pi / 2, np.pi / 2])
    assert_array_equal(arccos(np.array([-1.1, 1.1])), [np.pi, 0.0])
