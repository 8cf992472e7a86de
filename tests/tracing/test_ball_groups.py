# SPDX-License-Identifier: GPL-3.0-or-later
"""Groups of balls find the same pairs as a test of all of them."""

import numpy as np

from adaptive_drt.tracing.ball_groups import BallGroups


def test_groups_find_all_balls_that_touch_points():
    rng = np.random.default_rng(3)
    center, radius = rng.uniform(-1.0, 1.0, (3, 5_000)), rng.uniform(0.0, 0.05, 5_000)
    point, reach = rng.uniform(-1.2, 1.2, (3, 40)), rng.uniform(0.0, 0.2, 40)
    calls = []

    def near(balls, at, number):
        calls.append(number.size)
        gap = balls[0][:, number] - point[:, at]
        return (gap * gap).sum(axis=0) <= (balls[1][number] + reach[at]) ** 2

    found = np.array(BallGroups(center, radius).pairs(40, near))
    gap = np.sqrt(((center[:, None] - point[:, :, None]) ** 2).sum(axis=0))
    every = np.array((gap <= radius + reach[:, None]).nonzero())
    assert (np.diff(found[0]) >= 0).all()
    np.testing.assert_array_equal(found[:, np.lexsort(found[::-1])], every)
    assert sum(calls) < 0.5 * radius.size * reach.size


def test_groups_of_no_points_find_nothing():
    groups = BallGroups(np.zeros((3, 10)), np.ones(10))
    at, number = groups.pairs(0, lambda *_: np.zeros(0, dtype=bool))
    assert at.size == number.size == 0
