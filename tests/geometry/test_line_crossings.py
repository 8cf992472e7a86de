# SPDX-License-Identifier: GPL-3.0-or-later
"""Crossings of lines across a parallelogram by single edges."""

import numpy as np

from adaptive_drt.geometry.line_crossings import LightLines


def lines_over(point, count=5):
    """Lines across the square of side 2 about the z axis at height 4."""
    corner, along, across = (-1.0, -1.0, 4.0), (2.0, 0.0, 0.0), (0.0, 2.0, 0.0)
    vectors = (np.array(each)[:, None] for each in (corner, along, across))
    return LightLines(*vectors, count, np.array(point, dtype=float).reshape(3, -1))


def crossings(lines, a, b, change=2.0):
    ends = tuple(np.array(each, dtype=float)[:, None] - lines.point[:, :1] for each in (a, b))
    return lines.crossings(np.array([0]), ends, np.array([change]))


def test_an_edge_at_half_the_height_is_seen_at_twice_its_place():
    found = crossings(lines_over((0.0, 0.0, 0.0)), (0.1, -1.0, 2.0), (0.1, 1.0, 2.0))
    assert found.line.tolist() == [0, 1, 2, 3, 4]
    np.testing.assert_allclose(found.place, 0.5 * (0.2 + 1.0))
    assert found.change.tolist() == [-2.0] * 5 and not found.unknown.size


def test_the_change_turns_with_the_edge_and_with_the_side_of_the_light():
    low = lines_over((0.0, 0.0, 0.0))
    assert (crossings(low, (0.1, 1.0, 2.0), (0.1, -1.0, 2.0)).change == 2.0).all()
    high = lines_over((0.0, 0.0, 8.0))
    found = crossings(high, (0.1, -1.0, 6.0), (0.1, 1.0, 6.0))
    assert found.line.size == 5 and (found.change == 2.0).all()


def test_edges_behind_the_point_or_beyond_the_light_cross_no_line():
    lines = lines_over((0.0, 0.0, 0.0))
    for height in (-1.0, 0.0, 5.0):
        found = crossings(lines, (0.1, -9.0, height), (0.1, 9.0, height))
        assert not found.line.size and not found.unknown.size


def test_an_edge_through_the_plane_of_the_point_is_cut():
    found = crossings(lines_over((0.0, 0.0, 0.0)), (0.2, -1.0, 2.0), (0.2, 3.0, -2.0))
    # it ends far beyond all lines, in the direction in which it rises from the point's plane
    assert found.line.tolist() == [0, 1, 2, 3, 4]


def test_an_edge_through_the_plane_of_the_light_is_unknown():
    found = crossings(lines_over((0.0, 0.0, 0.0)), (0.2, -1.0, 2.0), (0.2, 1.0, 6.0))
    assert found.unknown.tolist() == [0] and not found.line.size


def test_edges_that_share_an_end_cross_each_line_once():
    lines = lines_over((0.1, 0.2, 0.0), 9)
    rng = np.random.default_rng(0)
    spots = np.concatenate([np.linspace(-1.3, 1.3, 30), lines.positions * 1.0 - 0.4])
    spots = np.unique(spots)
    corners = np.array([rng.uniform(-0.2, 0.2, spots.size), spots, np.full(spots.size, 2.0)])
    ends = corners[:, :-1] - lines.point, corners[:, 1:] - lines.point
    found = lines.crossings(np.zeros(spots.size - 1, dtype=int), ends, np.ones(spots.size - 1))
    assert np.bincount(found.line, minlength=9).tolist() == [1] * 9
