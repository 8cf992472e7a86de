# SPDX-License-Identifier: GPL-3.0-or-later
"""The profile of flat lights of limited spread, against numerical integrals."""

from __future__ import annotations

import math

import numpy as np
import pytest

from adaptive_drt.geometry.spread_profile import SpreadProfile, spread_gain

AXIS = np.array([[0.0], [0.0], [1.0]])
NODES, WEIGHTS = np.polynomial.legendre.leggauss(80)


@pytest.mark.parametrize("spread", [3.0, 1.5, 0.4, 0.02])
def test_integrals_over_the_cosine(spread):
    half = spread / 2.0
    profile = SpreadProfile(AXIS, math.cos(half), 1.0)
    for share in (0.0, 0.1, 0.5, 0.99, 1.0):
        t = share * half
        angles = t + (half - t) * (NODES + 1.0) / 2.0
        f = 1.0 - np.tan(angles) / math.tan(half)
        weights = WEIGHTS * (half - t) / 2.0 * np.sin(angles)
        want = (f * weights).sum(), (f * np.cos(angles) * weights).sum()
        got = profile.integrals(np.array([math.cos(t)]))
        assert np.allclose(np.ravel(got), want, rtol=1e-6, atol=1e-14)


@pytest.mark.parametrize("spread", [3.0, 1.5, 0.4])
def test_values(spread):
    profile = SpreadProfile(AXIS, math.cos(spread / 2.0), 1.0)
    t = np.array([0.0, 0.1, 0.5, 0.9, 1.0, 1.1]) * spread / 2.0
    want = np.maximum(1.0 - np.tan(t) / math.tan(spread / 2.0), 0.0)
    want[np.cos(t) <= 0.0] = 0.0
    assert np.allclose(profile.value(np.cos(t)), want, atol=1e-12)
    assert (profile.value(np.array([-1.0, 0.0])) == 0.0).all()


def test_the_gain_is_continuous():
    """Where Cycles takes the series, that is as good as the formula."""
    before, after = spread_gain(0.0999999), spread_gain(0.1000001)
    assert before == pytest.approx(after, rel=2e-3)
    assert spread_gain(math.pi - 1e-6) == pytest.approx(1.0, abs=1e-5)
