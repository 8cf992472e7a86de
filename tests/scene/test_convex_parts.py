# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles of one plane as convex polygons."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.scene.convex_parts import convex_parts
from adaptive_drt.scene.values import convexity_defect

TURNS = 2.0 * np.pi * np.arange(32) / 32
RIM = np.stack([np.cos(TURNS), np.sin(TURNS), 0.0 * TURNS], axis=1)
ARROW = ((0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2))


def triangles(points, *corners):
    """(3, 3, t) of triangles between points (n, 2 or 3)."""
    places = np.zeros((len(points), 3))
    places[:, : np.shape(points)[1]] = points
    return np.stack([places[[each[k] for each in corners]].T for k in range(3)])


def area(corners):
    local = corners - corners[0]
    return 0.5 * np.linalg.norm(np.cross(local[:-1], local[1:]).sum(axis=0))


def parts_of(vertices, group=None):
    """The parts, each of which is convex; together they have all triangles and all of the area."""
    count = vertices.shape[2]
    parts = convex_parts(vertices, np.zeros(count, dtype=int) if group is None else group)
    members = np.concatenate([part.members for part in parts])
    assert np.array_equal(np.sort(members), np.arange(count))
    a, b, c = vertices
    sizes = 0.5 * np.linalg.norm(np.cross(b - a, c - a, axis=0), axis=0)
    for part in parts:
        assert convexity_defect(part.corners) is None
        assert area(part.corners) == pytest.approx(sizes[part.members].sum())
    return parts


@pytest.mark.parametrize("middle", [True, False])
def test_a_disk_is_one_polygon(middle):
    if middle:
        corners = [(32, k, (k + 1) % 32) for k in range(32)]
        points = np.vstack([RIM, np.zeros((1, 3))])
    else:
        corners, points = [(0, k, k + 1) for k in range(1, 31)], RIM
    (part,) = parts_of(triangles(points, *corners))
    assert len(part.corners) == 32


def test_a_part_that_is_not_convex_is_several():
    corners = ((0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5))
    assert len(parts_of(triangles(ARROW, *corners))) == 2


def test_triangles_of_either_sense_are_joined():
    square = ((0, 0), (1, 0), (1, 1), (0, 1))
    assert len(parts_of(triangles(square, (0, 1, 2), (0, 3, 2)))) == 1


def test_groups_and_planes_stay_apart():
    square = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0.2))
    assert len(parts_of(triangles(square, (0, 1, 2), (0, 2, 3)))) == 2
    flat = triangles(ARROW, (0, 1, 2), (0, 2, 3))
    assert len(parts_of(flat, np.array([0, 1]))) == 2


@pytest.mark.parametrize("seed", range(5))
def test_random_fans(seed):
    """Of a star-shaped outline, seen from its middle, in a random plane."""
    rng = np.random.default_rng(seed)
    turns = np.sort(rng.uniform(0.0, 2.0 * np.pi, 12))
    flat = rng.uniform(0.3, 1.0, 12)[:, None] * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    points = np.vstack([flat, np.zeros((1, 2))]) @ rng.normal(size=(2, 3)) + rng.normal(size=3)
    kept = [k for k in range(12) if (turns[(k + 1) % 12] - turns[k]) % (2.0 * np.pi) < 3.0]
    parts = parts_of(triangles(points, *((12, k, (k + 1) % 12) for k in kept)))
    assert len(parts) < len(kept)
