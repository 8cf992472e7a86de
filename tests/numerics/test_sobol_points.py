# SPDX-License-Identifier: GPL-3.0-or-later
"""Sobol' points are nets, in each dimension and in planes, whatever their shift is."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from adaptive_drt.numerics.sobol_points import MOST_POINTS, net_points, stratified_copies

PIXELS = np.array([0, 7, 123_456])


@pytest.mark.parametrize("count", [16, 256, 4_096])
def test_each_interval_of_each_dimension_holds_one_point(count):
    points = net_points(3, PIXELS, 40, np.arange(count), (0, 1, 2, 3, 4))
    assert points.shape == (5, 3, count) and points.min() >= 0.0 and points.max() < 1.0
    cells = np.sort((points * count).astype(int), axis=2)
    np.testing.assert_array_equal(cells, np.broadcast_to(np.arange(count), cells.shape))


def test_the_first_two_dimensions_are_a_net_of_all_shapes_of_boxes():
    a, b = net_points(0, PIXELS, 41, np.arange(64), (0, 1))
    for power in range(7):
        cell = (a * 2**power).astype(int) * 2 ** (6 - power) + (b * 2 ** (6 - power)).astype(int)
        np.testing.assert_array_equal(np.sort(cell, axis=1), np.tile(np.arange(64), (3, 1)))


def test_all_planes_are_covered_evenly():
    points = net_points(0, PIXELS, 41, np.arange(1_024), (0, 1, 2, 3, 4))
    for a, b in combinations(points, 2):
        cell = (a * 8).astype(int) * 8 + (b * 8).astype(int)
        assert all(np.bincount(one, minlength=64).min() >= 12 for one in cell)


def test_points_extend_and_depend_on_pixel_stream_and_seed():
    few = net_points(1, PIXELS, 40, np.arange(8), (0, 3))
    many = net_points(1, PIXELS, 40, np.arange(64), (0, 3))
    np.testing.assert_array_equal(few, many[..., :8])
    np.testing.assert_array_equal(few[:, 1:2], net_points(1, PIXELS[1:2], 40, np.arange(8), (0, 3)))
    np.testing.assert_array_equal(
        few[..., :2], net_points(1, PIXELS, 40, np.tile([0, 1], (3, 1)), (0, 3))
    )
    for seed, stream in ((2, 40), (1, 41)):
        assert (net_points(seed, PIXELS, stream, np.arange(8), (0, 3)) != few).all()
    assert net_points(1, PIXELS, 40, np.array([MOST_POINTS - 1]), (4,)).size == 3


@pytest.mark.parametrize("number", [1, 2, 4])
def test_copies_lie_in_different_strata(number):
    points = net_points(1, PIXELS, 40, np.arange(8), (0, 1))
    copies = stratified_copies(points, number)
    assert copies.shape == (2, 3, 8, number)
    np.testing.assert_array_equal(copies[..., 0], points)
    strata = (copies * 2).astype(int)
    if number == 2:
        np.testing.assert_array_equal(strata[1].sum(axis=-1), 1)
    if number == 4:
        cell = np.sort(2 * strata[0] + strata[1], axis=-1)
        np.testing.assert_array_equal(cell, np.broadcast_to(np.arange(4), cell.shape))
