# SPDX-License-Identifier: GPL-3.0-or-later
"""Predicted errors are kept for the pixels that have any."""

import numpy as np

from adaptive_drt.image.traced_variation import TracedVariation


def test_what_is_entered_is_found_and_the_rest_is_zero():
    rng = np.random.default_rng(1)
    found, every = TracedVariation(50), np.zeros((4, 3, 50))
    for _ in range(3):
        rows, values = rng.permutation(50)[:20], rng.random((4, 3, 20))
        found.enter(rows, values)
        every[..., rows] = values
        np.testing.assert_array_equal(found.of(np.arange(50)), every)
    assert not found.values[..., 0].any()


def test_only_pixels_that_are_entered_take_a_place():
    found = TracedVariation(1_000)
    assert found.places(np.array([7, 3])).tolist() == [1, 2]
    assert found.places(np.array([3, 9, 7])).tolist() == [2, 3, 1]
