# SPDX-License-Identifier: GPL-3.0-or-later
"""Means over pixels from the middles of those around them, and how far they may be off."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.numerics.midpoint import FALLBACK_ERROR_FRACTION, SECOND_DIFFERENCE_WEIGHT, left


def size(values):
    return np.abs(values[0])


def around(function):
    """Values (5, n) at the middles of a pixel and two to each side."""
    return np.stack([function(float(k)) for k in range(-2, 3)])


def found(value):
    """The mean that is made of them, and how far it may be off, by all of them or three alone."""
    before, bend, after = (value[k - 1] - 2.0 * value[k] + value[k + 1] for k in (1, 2, 3))
    off = left(size, before[None], bend[None], after[None])
    return value[2] + SECOND_DIFFERENCE_WEIGHT * bend, off, FALLBACK_ERROR_FRACTION * np.abs(bend)


def test_means_of_cubics_are_exact():
    rng = np.random.default_rng(3)
    c = rng.normal(size=(4, 50))
    mean, _, _ = found(around(lambda x: c[0] + c[1] * x + c[2] * x**2 + c[3] * x**3))
    np.testing.assert_allclose(mean, c[0] + c[2] / 12.0, rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize(("power", "most"), [(1.0, 1.0), (1.5, 0.7), (2.0, 0.6)])
def test_what_begins_at_a_random_place_is_off_by_what_is_said(power, most):
    """Root mean square over places in the pixel and in those beside it."""
    place = np.random.default_rng(4).uniform(-1.5, 1.5, 20_000)

    def mean(x):
        return (np.maximum(x + 0.5 - place, 0.0) ** (power + 1.0)) / (power + 1.0) - (
            np.maximum(x - 0.5 - place, 0.0) ** (power + 1.0)
        ) / (power + 1.0)

    guess, off, near = found(around(lambda x: np.maximum(x - place, 0.0) ** power))
    wrong = np.abs(guess - mean(0.0))
    assert np.sqrt((wrong**2).mean()) < most * np.sqrt((off**2).mean())
    within = np.abs(place) < 0.5
    assert np.sqrt((wrong[within] ** 2).mean()) < 1.2 * np.sqrt((near[within] ** 2).mean())
    # none is far beyond what is said
    assert (wrong < 2.5 * off + 0.01).all()
