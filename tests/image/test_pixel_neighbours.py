# SPDX-License-Identifier: GPL-3.0-or-later
"""What the pixels around each one tell of it."""

from __future__ import annotations

import numpy as np

from adaptive_drt.image.pixel_neighbours import (
    UNKNOWN,
    agreeing_neighbours,
    agrees_around,
    largest_around,
)
from adaptive_drt.shading.center_light import MIXED


def test_pixels_agree_with_all_around_or_not_at_all():
    seen = np.full((9, 12), 5)
    seen[4, 3] = 6
    found = agreeing_neighbours(seen.ravel(), 12).reshape(9, 12)
    alike = np.ones((9, 12), dtype=bool)
    alike[2:7, 1:6] = False
    np.testing.assert_array_equal(found > 1.0, alike)
    assert found[4, 8] == 25.0 and found[0, 11] == 9.0
    seen[4, 3], seen[0, 11] = UNKNOWN, MIXED
    found = agreeing_neighbours(seen.ravel(), 12).reshape(9, 12)
    assert found[4, 4] == 24.0 and found[4, 3] == 1.0
    assert (found[:3, 9:] == 1.0).all()


def test_the_largest_value_around_is_one_of_nine():
    values = np.zeros((4, 5))
    values[0, 0], values[2, 3] = 2.0, 7.0
    expected = np.zeros((4, 5))
    expected[:2, :2], expected[1:, 2:] = 2.0, 7.0
    np.testing.assert_array_equal(largest_around(values.ravel(), 5).reshape(4, 5), expected)


def test_which_pixels_agree_with_all_around():
    seen = np.ones((5, 6), dtype=int)
    seen[2, 4] = MIXED
    seen[0, 0] = UNKNOWN
    found = agrees_around(seen.ravel(), 6).reshape(5, 6)
    assert found[1, 1] and found[4, 0] and not found[1:4, 3:6].any()
    assert found[:, :3].sum() == 14  # all but the unknown one itself
