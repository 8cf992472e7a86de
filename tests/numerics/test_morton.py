# SPDX-License-Identifier: GPL-3.0-or-later
"""Order along the Morton curve."""

import numpy as np

from adaptive_drt.numerics.morton import morton_order


def test_the_order_is_a_permutation_in_which_neighbours_are_near():
    points = np.random.default_rng(0).random((3, 4_096))
    order = morton_order(points)
    assert (np.sort(order) == np.arange(4_096)).all()
    step = np.linalg.norm(np.diff(points[:, order], axis=1), axis=0)
    # random pairs are 0.66 apart, and a cell for each point has a side of 1/16
    assert step.mean() < 0.12


def test_points_in_one_place_keep_their_order():
    assert (morton_order(np.ones((3, 5))) == np.arange(5)).all()
