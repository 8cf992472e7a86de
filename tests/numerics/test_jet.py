# SPDX-License-Identifier: GPL-3.0-or-later
"""Jets: every rule against 50-digit differences, identities, structural zeros, singularities."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from adaptive_drt.numerics.jet import Jet, bilinear, quadratic, take, where
from adaptive_drt.numerics.jet_functions import (
    absolute,
    arccos,
    arcsin,
    arctan2,
    cos,
    exp,
    hypot,
    log,
    sin,
    sqrt,
    square,
)
from differences import AXES, densified, entries, partials, polynomial, random_jet, scales

SAMPLES = 12
ROUNDING = 64 * np.finfo(float).eps
"""A rule is about ten operations, each within one unit in the last place, and libm's own few."""


def signed(generator):
    return generator.choice([-1.0, 1.0], SAMPLES) * 10.0 ** generator.uniform(-6, 6, SAMPLES)


def positive(generator):
    return np.abs(signed(generator))


def angle(generator):
    return generator.uniform(-1e3, 1e3, SAMPLES)


def exponent(generator):
    return generator.uniform(-100, 100, SAMPLES)


def cosine(generator):
    """-1..1, some as near to the ends as 1e-12."""
    return generator.choice([-1, 1], SAMPLES) * (1 - 10.0 ** generator.uniform(-12, 0, SAMPLES))


RULES = {
    "add": (lambda a, b: a + b, lambda a, b: a + b, (signed, signed)),
    "subtract": (lambda a, b: a - b, lambda a, b: a - b, (signed, signed)),
    "multiply": (lambda a, b: a * b, lambda a, b: a * b, (signed, signed)),
    "divide": (lambda a, b: a / b, lambda a, b: a / b, (signed, signed)),
    "negative": (lambda a: -a, lambda a: -a, (signed,)),
    "reciprocal": (lambda a: 2.5 / a, lambda a: 2.5 / a, (signed,)),
    "scaled": (lambda a: 3.0 - a * 0.5, lambda a: 3 - a / 2, (signed,)),
    "self product": (lambda a: a * a, lambda a: a * a, (signed,)),
    "square": (square, lambda a: a * a, (signed,)),
    "cube": (lambda a: a**3, lambda a: a**3, (signed,)),
    "seventh": (lambda a: a**7, lambda a: a**7, (signed,)),
    "power -2": (lambda a: a**-2, lambda a: a**-2, (signed,)),
    "sqrt": (sqrt, mpmath.sqrt, (positive,)),
    "sin": (sin, mpmath.sin, (angle,)),
    "cos": (cos, mpmath.cos, (angle,)),
    "exp": (exp, mpmath.exp, (exponent,)),
    "log": (log, mpmath.log, (positive,)),
    "arcsin": (arcsin, mpmath.asin, (cosine,)),
    "arccos": (arccos, mpmath.acos, (cosine,)),
    "arctan2": (arctan2, mpmath.atan2, (signed, signed)),
    "hypot": (hypot, mpmath.hypot, (signed, signed)),
    "absolute": (absolute, lambda a: a if a > 0 else -a, (signed,)),
}
PARTS = [(), (0,), (1,), (0, 1)]
"""Axes that are structural zeros."""


@pytest.fixture(params=[1, 2], ids=["order1", "order2"])
def order(request):
    return request.param


@pytest.mark.parametrize("name", RULES)
def test_rule_agrees_with_50_digit_differences(name, order):
    function, exact, domains = RULES[name]
    seed = sum(map(ord, name))
    generator = np.random.default_rng(seed)
    inner = [random_jet(generator, domain(generator), order) for domain in domains]
    got = entries(function(*inner))
    for index in range(SAMPLES):
        inside = [polynomial(jet, index) for jet in inner]
        expected = partials(lambda *o, f=inside: exact(*(p(*o) for p in f)), AXES, order)
        for have, want, scale in zip(got, expected, scales(exact, inner, index), strict=True):
            error = abs(float(mpmath.mpf(float(have[index])) - want))
            assert error <= ROUNDING * scale, f"{name}, seed {seed}, sample {index}"


@pytest.mark.parametrize("name", RULES)
@pytest.mark.parametrize("missing", PARTS, ids=str)
def test_structural_zeros_give_the_same_numbers(name, missing, order):
    function, _, domains = RULES[name]
    generator = np.random.default_rng(3)
    inner = [
        random_jet(generator, domain(generator), order, missing=missing if k == 0 else (0,))
        for k, domain in enumerate(domains)
    ]
    sparse, dense = function(*inner), function(*map(densified, inner))
    for have, want in zip(entries(sparse), entries(dense), strict=True):
        assert_array_equal(have, want)


@pytest.mark.parametrize("name", RULES)
def test_structural_zeros_stay_structural(name, order):
    function, _, domains = RULES[name]
    generator = np.random.default_rng(4)
    inner = [random_jet(generator, domain(generator), order, missing=(0,)) for domain in domains]
    result = function(*inner)
    assert result.gradient[0] is None and result.gradient[1] is not None
    if order == 2:
        assert result.hessian[:2] == (None, None)
    constants = [Jet.constant(jet.value, AXES, order) for jet in inner]
    assert function(*constants).is_constant


@pytest.mark.parametrize("name", RULES)
def test_values_are_those_of_arrays_and_bits_do_not_depend_on_the_batch(name, order):
    function, _, domains = RULES[name]
    generator = np.random.default_rng(5)
    batch = [np.tile(domain(generator), 9) for domain in domains]
    inner = [random_jet(generator, value, order) for value in batch]
    whole = function(*inner)
    if "power" not in name and name not in ("cube", "seventh"):
        assert_array_equal(whole.value, function(*batch))
    for start, stop in ((0, 1), (3, 10), (5, 64), (1, 102)):
        index = np.arange(start, stop)
        part = function(*(take(jet, index) for jet in inner))
        for have, want in zip(entries(part), entries(whole), strict=True):
            assert_array_equal(have, want[start:stop])


def test_arrays_and_numbers_on_either_side(order):
    generator = np.random.default_rng(6)
    values = signed(generator)
    x, other = random_jet(generator, values, order), signed(generator)
    lifted = Jet.constant(other, AXES, order)
    for function in (RULES[name][0] for name in ("add", "subtract", "multiply", "divide")):
        for have, want in (
            (function(x, other), function(x, lifted)),
            (function(other, x), function(lifted, x)),
            (function(x, 2.0), function(x, 0.0 * lifted + 2.0)),
            (function(2.0, x), function(0.0 * lifted + 2.0, x)),
        ):
            assert isinstance(have, Jet)
            for a, b in zip(entries(have), entries(want), strict=True):
                assert_array_equal(a, b)
    for function in (arctan2, hypot):
        for have, want in (
            (function(x, other), function(x, lifted)),
            (function(other, x), function(lifted, x)),
        ):
            for a, b in zip(entries(have), entries(want), strict=True):
                assert_array_equal(a, b)


nonzero = st.floats(1e-100, 1e100) | st.floats(-1e100, -1e-100)


@settings(deadline=None)
@given(a=nonzero, b=nonzero, x=st.floats(-1e5, 1e5), order=st.sampled_from([1, 2]))
def test_identities(a, b, x, order):
    u = Jet.variable([a], 0, 2, order, abs(a))
    w = Jet.variable([b], 1, 2, order, abs(b))
    v = Jet.variable([x], 0, 2, order)
    for have, want in (
        (sqrt(u * u), absolute(u)),
        (u / w * w, u),
        ((u + w) - w, u),
        (sin(v) ** 2 + cos(v) ** 2, 0.0 * v + 1.0),
        (exp(log(absolute(u))), absolute(u)),
        (square(hypot(u, w)), u * u + w * w),
    ):
        size = max(np.abs(have.value).max(), abs(b) if want is u and have is not want else 0.0)
        for p, q in zip(entries(have), entries(want), strict=True):
            assert_allclose(p, q, rtol=1e-12, atol=2e-13 * max(size, 1e-300))


def test_taylor_polynomial_is_the_whole_of_a_quadratic():
    generator = np.random.default_rng(8)
    x, y, t = (Jet.variable(generator.normal(size=20), k, 3, 2) for k in range(3))

    def formula(x, y, t):
        return (x * 2.0 - y * t + 1.0) * 3.0 + square(x + y - t) - x * y

    jet = formula(x, y, t)
    for _ in range(20):
        offset = generator.normal(size=3)
        expected = formula(*(v.value + o for v, o in zip((x, y, t), offset, strict=True)))
        assert_allclose(jet.at(offset), expected, rtol=1e-12, atol=1e-12)
    assert jet.second(2, 0) is jet.second(0, 2) is jet.hessian[2]


def test_central_differences_of_a_long_formula(order):
    def formula(x, y):
        r = sqrt(1.0 + x * x + exp(-y * y))
        return arctan2(sin(x) * r, 2.0 + cos(y)) / hypot(r, y) - log(r) * arcsin(x / r)

    step = 1e-5
    x0, y0 = np.linspace(-2, 2, 41), np.linspace(-1, 3, 41)
    jet = formula(Jet.variable(x0, 0, 2, order), Jet.variable(y0, 1, 2, order))
    slope_x = (formula(x0 + step, y0) - formula(x0 - step, y0)) / (2 * step)
    slope_y = (formula(x0, y0 + step) - formula(x0, y0 - step)) / (2 * step)
    assert_allclose(jet.gradient[0], slope_x, atol=1e-8)
    assert_allclose(jet.gradient[1], slope_y, atol=1e-8)
    if order == 2:
        above = formula(Jet.variable(x0 + step, 0, 2, 1), Jet.variable(y0, 1, 2, 1))
        below = formula(Jet.variable(x0 - step, 0, 2, 1), Jet.variable(y0, 1, 2, 1))
        for k in range(2):
            difference = (above.gradient[k] - below.gradient[k]) / (2 * step)
            assert_allclose(jet.second(0, k), difference, atol=1e-8)


def test_products_of_structural_zeros_are_never_formed(order):
    calls = []

    def multiply(a, b):
        calls.append(1)
        return np.multiply(a, b)

    constant = Jet.constant(np.ones(4), 3, order)
    along = [Jet.variable(np.ones(4), axis, 3, order) for axis in range(3)]
    for a, b, count in (
        (constant, constant, 1),
        (along[0], constant, 2),
        (along[0], along[1], 3 + (order == 2)),  # one mixed second partial
        (along[0], along[0] + 0.0, 3 + (order == 2)),  # one second partial: both terms are one
        (along[0], np.ones(4), 2),
    ):
        calls.clear()
        bilinear(multiply, a, b)
        assert len(calls) == count
    calls.clear()
    quadratic(multiply, along[2])
    assert len(calls) == 2 + (order == 2)


def test_linear_directions_are_not_spread_out(order):
    w = Jet.variable(np.ones((3, 1000)), 1, 2, order, np.ones((3, 1)))
    moved = 2.0 * (w + np.ones((3, 1000))) - 1.0
    assert moved.gradient[1].shape == (3, 1)
    assert moved[2].gradient[1].shape == (1,) and moved[2].gradient[0] is None
    assert take(moved, np.arange(7)).gradient[1].shape == (3, 1)
    assert take(moved, np.arange(1000) < 5).shape == (3, 5)
    components = [*moved]
    assert len(components) == 3
    assert_array_equal(components[2].value, moved.value[2])


def test_where_and_take_select_partials_too(order):
    generator = np.random.default_rng(9)
    a = random_jet(generator, signed(generator), order, missing=(0,))
    b = random_jet(generator, signed(generator), order)
    mask = generator.random(SAMPLES) < 0.5
    for have, p, q in zip(entries(where(mask, a, b)), entries(a), entries(b), strict=True):
        assert_array_equal(have, np.where(mask, p, q))
    for have, p in zip(entries(where(mask, 1.0, a)), entries(a), strict=True):
        assert_array_equal(have, np.where(mask, 1.0 if p is a.value else 0.0, p))
    assert where(mask, a, 1.0).gradient[0] is None
    for have, p in zip(entries(take(b, mask)), entries(b), strict=True):
        assert_array_equal(have, p[mask])
    assert_array_equal(where(mask, a.value, 0.0), np.where(mask, a.value, 0.0))
    assert_array_equal(take(a.value, mask), a.value[mask])


def test_powers_at_zero(order):
    zero = Jet.variable([0.0], 0, 1, order)
    assert (zero**0).value[0] == 1.0 and (zero**0).is_constant
    assert (zero**1) is zero
    assert entries(zero**3)[1][0] == 0.0
    if order == 2:
        assert entries(zero**2)[2][0] == 2.0


def test_mistakes_raise():
    one = Jet.variable([1.0], 0, 1, 1)
    for other in (Jet.variable([1.0], 0, 2, 1), Jet.variable([1.0], 0, 1, 2)):
        for name in ("add", "subtract", "multiply", "divide"):
            with pytest.raises(ValueError, match="axes"):
                RULES[name][0](one, other)
    with pytest.raises(ValueError, match="order"):
        Jet.constant([1.0], 1, 3)
    with pytest.raises(ValueError, match="direction"):
        Jet.variable([1.0], 0, 1, 1, np.ones((3, 1)))
    with pytest.raises(TypeError):
        one**0.5
    with pytest.raises(AttributeError):
        one.value = np.zeros(1)
    with pytest.raises(TypeError):
        np.ones(1) < one  # noqa: B015
