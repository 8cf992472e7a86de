# SPDX-License-Identifier: GPL-3.0-or-later
"""What the samples of a rule say of the errors that were predicted."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.cubature.posteriori import (
    UNDETECTED_SHARE,
    UNPREDICTED_RATIO,
    UNPREDICTED_SHARE,
    correct_errors,
)
from adaptive_drt.shading.variation import KINK_KIND, SMOOTH_KIND, STEP_KIND, zero_variation


def star(colors, center, foreseen):
    """Deviations of one star along x and y, of samples' grey values, and what is made of them."""
    away = np.array(colors) - np.mean(colors)
    offset = np.array([[0.8, -0.8, 0.0, 0.0], [0.0, 0.0, 0.8, -0.8], [0.0] * 4])
    deviation = 0.5 * foreseen
    off = np.full((3, 1), center - np.mean(colors))
    return correct_errors(
        deviation, foreseen, off, np.zeros(4, dtype=int), np.tile(away, (3, 1)), offset
    )


def test_what_no_sample_met_counts_for_less():
    foreseen = zero_variation(1)
    foreseen[KINK_KIND, 0], foreseen[STEP_KIND, 1], foreseen[SMOOTH_KIND, 0] = 0.02, 0.08, 0.01
    same = star([0.5, 0.5, 0.5, 0.5], 0.5, foreseen)
    assert np.allclose(same[SMOOTH_KIND], 0.5 * foreseen[SMOOTH_KIND])
    assert np.allclose(same[1:], 0.5 * UNDETECTED_SHARE * foreseen[1:])
    met = star([0.5, 0.5, 0.5, 0.1], 0.5, foreseen)
    assert np.allclose(met, 0.5 * foreseen)


def test_what_was_not_foreseen_counts_along_the_axis_that_shows_it():
    foreseen = zero_variation(1)
    foreseen[STEP_KIND, 0] = 0.01
    found = star([0.5, 0.5, 0.5, 0.1], 0.5, foreseen) - 0.5 * foreseen
    assert found.sum() == pytest.approx(UNPREDICTED_SHARE * (0.1 - UNPREDICTED_RATIO * 0.01))
    assert found[STEP_KIND, 1] > 2.0 * found[STEP_KIND, 0]
    assert not found[:STEP_KIND].any()
    assert not found[STEP_KIND, 2].any()
