# SPDX-License-Identifier: GPL-3.0-or-later
"""Vector functions: arrays against NumPy, jets against 50-digit differences, the zero vector."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from adaptive_drt.numerics.jet import Jet, take
from adaptive_drt.numerics.vector import (
    cross,
    dot,
    norm,
    normalize,
    perpendicular_pair,
    scale,
    squared_norm,
)
from differences import AXES, densified, entries, partials, polynomial, random_jet

SAMPLES = 6


def mp_dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def mp_cross(a, b):
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def mp_normalize(a):
    length = mpmath.sqrt(mp_dot(a, a))
    return tuple(x / length for x in a)


RULES = {
    "dot": (dot, mp_dot, 2),
    "self dot": (lambda a: dot(a, a), lambda a: mp_dot(a, a), 1),
    "squared_norm": (squared_norm, lambda a: mp_dot(a, a), 1),
    "norm": (norm, lambda a: mpmath.sqrt(mp_dot(a, a)), 1),
    "cross": (cross, mp_cross, 2),
    "normalize": (normalize, mp_normalize, 1),
    "scale": (lambda a, b: scale(a, b[1]), lambda a, b: tuple(x * b[1] for x in a), 2),
}


@pytest.fixture(params=[1, 2], ids=["order1", "order2"])
def order(request):
    return request.param


def vectors(generator, count=SAMPLES):
    return generator.normal(size=(3, count)) * 10.0 ** generator.uniform(-3, 3, size=count)


def inner_jets(generator, count, order, **options):
    return [random_jet(generator, vectors(generator), order, **options) for _ in range(count)]


@pytest.mark.parametrize("name", RULES)
def test_rule_agrees_with_50_digit_differences(name, order):
    function, exact, count = RULES[name]
    seed = sum(map(ord, name))
    generator = np.random.default_rng(seed)
    inner = inner_jets(generator, count, order)
    got = [np.atleast_2d(entry) for entry in entries(function(*inner))]
    for index in range(SAMPLES):
        inside = [[polynomial(jet, (k, index)) for k in range(3)] for jet in inner]
        for component in range(len(got[0])):

            def formula(*offset, inside=inside, component=component):
                result = exact(*([p(*offset) for p in vector] for vector in inside))
                return result[component] if isinstance(result, tuple) else result

            expected = partials(formula, AXES, order)
            for have, want in zip(got, expected, strict=True):
                # Errors are relative to the largest component, and to what terms cancel: at
                # most four orders of magnitude with these vectors.
                size = max(float(abs(want)), np.abs(have[:, index]).max())
                error = abs(have[component, index] - float(want))
                assert error <= 1e-11 * size, f"{name}, seed {seed}, sample {index}"


@pytest.mark.parametrize("name", RULES)
def test_structural_zeros_give_the_same_numbers(name, order):
    function, _, count = RULES[name]
    generator = np.random.default_rng(1)
    inner = inner_jets(generator, count, order, missing=(1,))
    sparse, dense = function(*inner), function(*map(densified, inner))
    assert sparse.gradient[1] is None
    for have, want in zip(entries(sparse), entries(dense), strict=True):
        assert_array_equal(have, want)
    assert function(*(Jet.constant(jet.value, AXES, order) for jet in inner)).is_constant


@pytest.mark.parametrize("name", RULES)
def test_values_are_those_of_arrays_and_bits_do_not_depend_on_the_batch(name, order):
    function, _, count = RULES[name]
    generator = np.random.default_rng(2)
    batch = [vectors(generator, 100) for _ in range(count)]
    inner = [random_jet(generator, value, order) for value in batch]
    whole = function(*inner)
    assert_array_equal(whole.value, function(*batch))
    for start, stop in ((0, 1), (3, 10), (5, 64), (1, 98)):
        part = function(*(take(jet, np.arange(start, stop)) for jet in inner))
        for have, want in zip(entries(part), entries(whole), strict=True):
            assert_array_equal(have, want[..., start:stop])


def test_directions_in_every_broadcastable_shape(order):
    generator = np.random.default_rng(3)
    value, other = vectors(generator, 8), vectors(generator, 8)
    for shape in ((3, 8), (3, 1), (1, 8), (8,), (1,), ()):
        direction = generator.normal(size=shape)
        thin = Jet.variable(value, 0, 1, order, direction)
        full = Jet.variable(value, 0, 1, order, np.broadcast_to(direction, (3, 8)))
        for function in (lambda w: dot(w, other), lambda w: cross(other, w), normalize):
            for have, want in zip(entries(function(thin)), entries(function(full)), strict=True):
                assert_allclose(have, want, rtol=1e-14)
        assert_array_equal(entries(thin[1])[1], entries(full)[1][1])


def test_arrays_agree_with_numpy():
    generator = np.random.default_rng(4)
    a, b = vectors(generator, 50), vectors(generator, 50)
    assert_allclose(dot(a, b), (a * b).sum(axis=0), rtol=1e-12, atol=1e-9)
    assert_allclose(cross(a, b), np.cross(a.T, b.T).T, rtol=1e-15)
    assert_allclose(norm(a), np.linalg.norm(a, axis=0), rtol=1e-15)
    assert_allclose(norm(normalize(a)), 1.0, rtol=1e-15)
    single = np.array([3.0, 0.0, 4.0])
    assert norm(single) == 5.0
    assert_array_equal(cross(single, np.array([0.0, 1.0, 0.0])), [-4.0, 0.0, 3.0])


def test_lagrange_identity_of_the_discriminant(order):
    """dot(w, v)^2 + |cross(w, v)|^2 = |w|^2 |v|^2, for every partial."""
    generator = np.random.default_rng(5)
    w = Jet.linear(
        generator.normal(size=(3, 40)),
        (generator.normal(size=(3, 1)), None, [[1], [2], [3]]),
        order,
    )
    v = generator.normal(size=(3, 40))
    have = dot(w, v) ** 2 + squared_norm(cross(w, v))
    want = squared_norm(w) * squared_norm(v)
    for p, q in zip(entries(have), entries(want), strict=True):
        assert_allclose(p, q, rtol=1e-12, atol=1e-12)


def test_the_zero_vector(order):
    assert_array_equal(normalize(np.zeros((3, 2))), 0.0)
    value = np.array([[0.0, 3.0], [0.0, 0.0], [0.0, 4.0]])
    direction = np.array([[2.0], [0.0], [0.0]])
    jet = Jet.linear(value, (direction, np.zeros((3, 1)), None), order)
    length, unit = norm(jet), normalize(jet)
    assert_array_equal(length.value, [0.0, 5.0])
    assert_allclose(length.gradient[0], [2.0, 1.2], rtol=1e-15)
    assert_array_equal(length.gradient[1], 0.0)
    assert length.gradient[2] is None
    assert_allclose(unit.value, [[0.0, 0.6], [0.0, 0.0], [0.0, 0.8]], rtol=1e-15)
    assert_array_equal(unit.gradient[0][:, 0], np.inf)
    assert_array_equal(unit.gradient[1], 0.0)
    assert unit.gradient[2] is None
    assert_array_equal(unit.finite(), [[False, True]] * 3)
    if order == 2:
        assert_array_equal(length.second(0, 0)[0], np.inf)
        assert_array_equal(length.second(0, 1), 0.0)
        assert_array_equal(unit.second(0, 0)[:, 0], np.inf)
        assert_array_equal(unit.second(0, 1), 0.0)
        assert length.second(0, 2) is None
    still = normalize(Jet.constant(value, 3, order))
    assert still.is_constant
    for entry in entries(length) + entries(unit):
        assert not np.isnan(entry).any()


def test_perpendicular_pairs_complete_right_handed_frames():
    axis = np.random.default_rng(6).normal(size=(3, 500))
    axis[:, :6] = np.concatenate([np.eye(3), -np.eye(3)], axis=1)
    axis /= np.sqrt((axis * axis).sum(axis=0))
    frame = np.array([axis, *perpendicular_pair(axis)]).transpose(2, 0, 1)
    assert np.abs(frame @ frame.transpose(0, 2, 1) - np.eye(3)).max() < 1e-15
    assert np.abs(np.linalg.det(frame) - 1.0).max() < 1e-14
