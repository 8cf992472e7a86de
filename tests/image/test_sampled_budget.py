# SPDX-License-Identifier: GPL-3.0-or-later
"""The limits of sampled pixels, and their part of the tolerance."""

from __future__ import annotations

import numpy as np

from adaptive_drt.image.sampled_budget import sampled_limits, sampled_rise


def test_limits_grow_slowly_with_the_error_of_the_first_points():
    error = np.array([0.0, 0.5, 1.0, 10.0, 100.0])
    for motion in (False, True):
        limit = sampled_limits(error, 1.0, motion)
        assert (np.diff(limit) >= 0.0).all() and limit[0] == limit[1] > 0.0
        assert limit[-1] < 10.0 * limit[0]


def test_the_goal_rises_with_the_tolerance_between_its_ends():
    for motion in (False, True):
        found = [sampled_rise(tolerance, motion) for tolerance in (1e-5, 1e-3, 3e-3, 1e-2, 0.1)]
        assert found == sorted(found) and found[1] == 1.0 and found[3] == found[4] > found[2] > 1.0
