# SPDX-License-Identifier: GPL-3.0-or-later
"""Safety factors of pixels, learnt from how far their means move."""

from __future__ import annotations

import numpy as np

from adaptive_drt.cubature.safety_factor import MAX_FACTOR, update_factors


def test_means_that_move_farther_than_foreseen_raise_a_pixels_error():
    change = np.array([[0.03, 0.001, 9.0], [0.03, 0.001, 9.0], [0.03, 0.001, 9.0]])
    factor = update_factors(np.ones(3), change, np.full(3, 0.01))
    assert np.allclose(factor, [3.0, 1.0, MAX_FACTOR])
    # and it is forgotten by halves
    assert np.allclose(update_factors(factor, np.zeros((3, 3)), np.full(3, 0.01)), [1.5, 1.0, 4.0])


def test_an_error_of_nothing_is_no_error():
    assert np.array_equal(
        update_factors(np.ones(2), np.array([[0.0, 1.0]] * 3), np.zeros(2)), [1.0, MAX_FACTOR]
    )
