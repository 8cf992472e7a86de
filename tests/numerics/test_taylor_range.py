# SPDX-License-Identifier: GPL-3.0-or-later
"""Ranges of quadratics over intervals and rectangles, against exact rational arithmetic."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from adaptive_drt.numerics.floats import UNIT_ROUNDOFF
from adaptive_drt.numerics.jet import Jet
from adaptive_drt.numerics.taylor_range import clip_positive, interval_range, rectangle_range


def quadratics(seed, count=60):
    """Coefficients (6, count) of value, gradient and packed Hessian, many near a special case."""
    rng = np.random.default_rng(seed)
    c = rng.normal(size=(6, count)) * 10.0 ** rng.uniform(-2, 2, (6, count))
    c[1:, rng.random(count) < 0.1] = 0.0
    for k in range(1, 6):
        c[k, rng.random(count) < 0.15] = 0.0
    # parabolic cylinders, exact and nearly so: xy^2 = xx yy
    flat = rng.random(count) < 0.3
    c[5, flat] = c[4, flat] ** 2 / np.where(c[3, flat] == 0.0, 1.0, c[3, flat])
    tilt = rng.random(count) < 0.3  # the critical point inside
    c[1:3, tilt] *= 1e-2
    return c


def exact_interval(c, slope, bend, half):
    """Range of c + slope s + bend / 2 s^2 over |s| <= half, in fractions."""
    places = [-half, half]
    if bend and abs(slope / bend) <= half:
        places.append(-slope / bend)
    values = [c + slope * s + bend * s * s / 2 for s in places]
    return min(values), max(values)


def exact_rectangle(c, half_x, half_y):
    v, gx, gy, xx, xy, yy = c
    ranges = []
    for side in (-half_x, half_x):
        value = v + gx * side + xx * side * side / 2
        ranges.append(exact_interval(value, gy + xy * side, yy, half_y))
    for side in (-half_y, half_y):
        value = v + gy * side + yy * side * side / 2
        ranges.append(exact_interval(value, gx + xy * side, xx, half_x))
    det = xx * yy - xy * xy
    if det:
        x, y = (xy * gy - yy * gx) / det, (xy * gx - xx * gy) / det
        if abs(x) <= half_x and abs(y) <= half_y:
            ranges.append((v + (gx * x + gy * y) / 2,) * 2)
    return min(low for low, _ in ranges), max(high for _, high in ranges)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("halves", [(0.5, 0.5), (0.25, 2.0), (1.0, 0.125)])
def test_rectangles_are_exact_up_to_rounding(seed, halves):
    c = quadratics(seed)
    low, high = rectangle_range(Jet(c[0], (c[1], c[2]), (c[3], c[4], c[5])), *halves)
    largest = max(1.0, *halves) ** 2
    for k in range(c.shape[1]):
        exact = exact_rectangle([Fraction(x) for x in c[:, k]], *map(Fraction, halves))
        allowed = 8.0 * UNIT_ROUNDOFF * largest * np.abs(c[:, k]).sum()
        assert abs(low[k] - float(exact[0])) <= allowed, (seed, k)
        assert abs(high[k] - float(exact[1])) <= allowed, (seed, k)


@pytest.mark.parametrize("seed", range(5, 8))
@pytest.mark.parametrize("axis", [0, 1])
def test_intervals_are_exact_up_to_rounding(seed, axis):
    c = quadratics(seed)
    # packed with two axes the second derivatives are xx, xy, yy; an interval's jet has one a axis
    low, high = interval_range(
        Jet(c[0], (c[1], c[2])[: axis + 1], (c[3], c[5])[: axis + 1]), 0.5, axis=axis
    )
    slope, bend = c[1 + axis], c[5 if axis else 3]
    for k in range(c.shape[1]):
        exact = exact_interval(*(Fraction(x[k]) for x in (c[0], slope, bend)), Fraction(1, 2))
        allowed = 4.0 * UNIT_ROUNDOFF * (abs(c[0, k]) + abs(slope[k]) + abs(bend[k]))
        assert abs(low[k] - float(exact[0])) <= allowed, (seed, k)
        assert abs(high[k] - float(exact[1])) <= allowed, (seed, k)


def test_partials_that_are_structural_zeros_count_as_zero():
    c = quadratics(20)
    zero = np.zeros(c.shape[1])
    for missing in range(1, 6):
        full, part = c.copy(), list(c)
        full[missing], part[missing] = zero, None
        found, want = (
            rectangle_range(Jet(v[0], (v[1], v[2]), (v[3], v[4], v[5])), 0.5, 0.25)
            for v in (part, full)
        )
        np.testing.assert_array_equal(found, want)


def test_first_order_jets_are_linear_with_a_remainder():
    c, rest = quadratics(21), np.linspace(0.0, 3.0, 60)
    low, high = rectangle_range(Jet(c[0], (c[1], c[2]), None), 0.5, 2.0, rest)
    spread = 0.5 * np.abs(c[1]) + 2.0 * np.abs(c[2]) + rest
    np.testing.assert_allclose([low, high], [c[0] - spread, c[0] + spread], rtol=1e-14)
    low, high = interval_range(Jet(c[0], (c[1], None), None), 0.5, rest, axis=1)
    np.testing.assert_allclose([low, high], [c[0] - rest, c[0] + rest], rtol=1e-14)
    # along the first axis and without a remainder, if nothing else is said
    spread = 0.25 * np.abs(c[1])
    found = interval_range(Jet(c[0], (c[1], c[2]), None), 0.25)
    np.testing.assert_allclose(found, [c[0] - spread, c[0] + spread], rtol=1e-14)
    spread = spread + 2.0 * np.abs(c[2])
    found = rectangle_range(Jet(c[0], (c[1], c[2]), None), 0.25, 2.0)
    np.testing.assert_allclose(found, [c[0] - spread, c[0] + spread], rtol=1e-14)


@pytest.mark.parametrize("seed", range(40))
def test_the_part_of_an_interval_in_which_a_linear_function_is_positive(seed):
    rng = np.random.default_rng(seed)
    first, last = np.sort(rng.uniform(-0.5, 0.5, 2))
    start, end = rng.normal(size=2) if seed % 5 else np.full(2, rng.normal())
    low, high = (float(x) for x in clip_positive(*(np.array(x) for x in (first, last, start, end))))
    t = np.linspace(first, last, 1_001)
    positive = start + (t + 0.5) * (end - start) >= 0.0
    inside = (low - 1e-12 <= t) & (t <= high + 1e-12)
    assert (positive != inside).sum() <= 1, f"seed {seed}"
