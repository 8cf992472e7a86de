# SPDX-License-Identifier: GPL-3.0-or-later
"""Balls around blocks of consecutive points hold these and their reach."""

import numpy as np

from adaptive_drt.numerics.morton import morton_order
from adaptive_drt.tracing.point_blocks import BLOCK_BITS, group_balls


def test_balls_hold_the_points_of_their_blocks():
    rng = np.random.default_rng(5)
    point, reach = rng.normal(size=(3, 101)), rng.uniform(0.0, 0.1, 101)
    order = morton_order(point, BLOCK_BITS)
    assert sorted(order.tolist()) == list(range(101))
    sizes = 32, 8
    balls = group_balls(point[:, order], reach[order], sizes)
    for size, (middle, radius) in zip(sizes, balls, strict=True):
        block = np.arange(101) // size
        assert radius.size == block[-1] + 1
        gap = point[:, order] - middle[:, block]
        assert (np.sqrt((gap**2).sum(axis=0)) + reach[order] <= radius[block] + 1e-12).all()
