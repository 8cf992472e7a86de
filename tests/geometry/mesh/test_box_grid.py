# SPDX-License-Identifier: GPL-3.0-or-later
"""Boxes of a grid that overlap others are those of brute force."""

import numpy as np
import pytest

from adaptive_drt.geometry.mesh.box_grid import BoxGrid


@pytest.mark.parametrize("sizes", [(0.1, 0.3), (1e-4, 3.0), (0.0, 0.0)])
def test_overlapping_boxes_are_those_of_brute_force(sizes):
    rng = np.random.default_rng(1)
    low = rng.uniform(-2.0, 2.0, size=(3, 300)) * np.array([[1.0], [2.0], [0.1]])
    high = low + rng.uniform(*sizes, size=(3, 300))
    least = rng.uniform(-3.0, 3.0, size=(3, 500))
    most = least + rng.choice([0.0, 0.05, 1.0], size=(3, 500))
    query, box = BoxGrid(low, high).overlapping(least, most)
    meets = (least[:, :, None] <= high[:, None]) & (most[:, :, None] >= low[:, None])
    expected = np.argwhere(meets.all(axis=0))
    found = np.stack([query, box], axis=1)
    np.testing.assert_array_equal(found[np.lexsort(found.T[::-1])], expected)
    assert expected.size or not any(sizes)


def test_one_box_and_no_queries():
    grid = BoxGrid(np.zeros((3, 1)), np.ones((3, 1)))
    query, box = grid.overlapping(np.zeros((3, 0)), np.zeros((3, 0)))
    assert query.size == box.size == 0
    np.testing.assert_array_equal(grid.overlapping(np.ones((3, 1)), np.ones((3, 1)))[1], [0])
