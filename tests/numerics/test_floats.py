# SPDX-License-Identifier: GPL-3.0-or-later
"""Constants of float64, against what arithmetic does."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from adaptive_drt.numerics.floats import TINY, UNIT_ROUNDOFF


def test_unit_roundoff_bounds_one_operation():
    rng = np.random.default_rng(5)
    worst = Fraction(0)
    for a, b in (10.0 ** rng.uniform(-30, 30, (2_000, 2))).tolist():
        for computed, exact in (
            (a + b, Fraction(a) + Fraction(b)),
            (a * b, Fraction(a) * Fraction(b)),
            (a / b, Fraction(a) / Fraction(b)),
        ):
            worst = max(worst, abs(Fraction(computed) - exact) / abs(exact))
    assert 0.9 * UNIT_ROUNDOFF < worst <= UNIT_ROUNDOFF


def test_tiny_is_the_smallest_number_without_loss_of_digits():
    next_above = np.nextafter(TINY, 1.0)
    assert next_above / TINY == 1.0 + 2.0 * UNIT_ROUNDOFF
    assert 0.5 * next_above == 0.5 * TINY  # the last bit is lost below
    assert 0.0 / TINY == 0.0 and np.isfinite(1.0 / TINY)
