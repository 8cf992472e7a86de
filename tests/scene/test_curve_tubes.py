# SPDX-License-Identifier: GPL-3.0-or-later
"""Tubes of triangles around curves: where they are, closed, and their normals."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from adaptive_drt.scene.curve_tubes import FLATNESS, curve_tubes


def random_curves(seed, count=6):
    """Points (3, n), radii (n,) and offsets of curves of 2 to 7 points."""
    rng = np.random.default_rng(seed)
    size = rng.integers(2, 8, count)
    offsets = np.concatenate([[0], np.cumsum(size)])
    points = np.cumsum(rng.normal(size=(3, offsets[-1])), axis=1)
    return points, rng.uniform(0.05, 0.1, offsets[-1]), offsets


def spline(points, radii, steps):
    """A Catmull-Rom spline by its basis, as textbooks write it: (4, spans * steps)."""
    keys = np.vstack([points, radii])
    keys = np.concatenate([keys[:, :1], keys, keys[:, -1:]], axis=1)
    u = np.linspace(0.0, 1.0, steps)
    basis = 0.5 * np.array(
        [-u + 2 * u**2 - u**3, 2 - 5 * u**2 + 3 * u**3, u + 4 * u**2 - 3 * u**3, -(u**2) + u**3]
    )
    return np.concatenate([keys[:, k : k + 4] @ basis for k in range(keys.shape[1] - 3)], axis=1)


@pytest.mark.parametrize("seed", range(4))
def test_vertices_are_a_radius_from_the_spline(seed):
    points, radii, offsets = random_curves(seed)
    for first, last in itertools.pairwise(offsets):
        own = slice(first, last)
        tubes = curve_tubes(points[:, own], radii[own], np.array([0, last - first]), 12, 32)
        ideal = spline(points[:, own], radii[own], 2_000)
        gap = np.linalg.norm(tubes.points[:, :, None] - ideal[:3, None], axis=0)
        nearest = gap.argmin(axis=1)
        off = gap.min(axis=1) / ideal[3, nearest]
        # polygons of 12 sides as wide as circles are 1 % larger at their corners; where a curve
        # bends more than a tube can, its walls come nearer to other parts of it, and beyond its
        # ends and where the radius changes a wall is farther
        assert np.quantile(off, 0.95) < 1.05 and 1.0 < np.median(off) < 1.02


@pytest.mark.parametrize("seed", range(4))
def test_chords_are_near_the_spline(seed):
    points, radii, offsets = random_curves(seed)
    own = slice(offsets[0], offsets[1])
    tubes = curve_tubes(points[:, own], radii[own], np.array([0, offsets[1]]), 8, 32)
    centers = tubes.points.reshape(3, -1, 8).mean(axis=2)
    ideal = spline(points[:, own], radii[own], 500)
    a, way = centers[:, :-1], np.diff(centers, axis=1)
    rest = ideal[:3, :, None] - a[:, None]
    u = np.clip((rest * way[:, None]).sum(axis=0) / (way**2).sum(axis=0), 0.0, 1.0)
    gap = np.linalg.norm(rest - u * way[:, None], axis=0).min(axis=1)
    assert (gap <= 2.5 * FLATNESS * ideal[3]).all()
    assert np.mean(gap <= FLATNESS * ideal[3]) > 0.9


def test_tubes_are_open_at_their_ends_alone_and_look_outwards():
    points, radii, offsets = random_curves(9)
    tubes = curve_tubes(points, radii, offsets, 10, 32)
    a, b, c = tubes.corners
    edges = np.concatenate([[a, b], [b, c], [c, a]], axis=1)
    number = edges[0] * tubes.points.shape[1] + edges[1]
    back = edges[1] * tubes.points.shape[1] + edges[0]
    assert np.unique(number).size == number.size
    assert np.setdiff1d(number, back).size == 2 * 10 * (offsets.size - 1)
    p, q, r = (tubes.points[:, each] for each in tubes.corners)
    np.testing.assert_allclose(np.linalg.norm(tubes.normals, axis=1), 1.0, rtol=1e-12)
    flat = np.cross(q - p, r - p, axis=0)
    for corner in tubes.normals:
        assert np.mean((flat * corner).sum(axis=0) > 0.0) > 0.97


def test_mean_width_is_that_of_circles():
    points = np.array([[0.0, 0.0], [0.0, 0.0], [0.0, 1.0]])
    for sides in (8, 16):
        tubes = curve_tubes(points, np.array([0.5, 0.5]), np.array([0, 2]), sides, 32)
        turn = np.arange(4_000) / 4_000 * np.pi
        reach = tubes.points[0, :, None] * np.cos(turn) + tubes.points[1, :, None] * np.sin(turn)
        assert np.mean(2.0 * reach.max(axis=0)) == pytest.approx(1.0, rel=1e-5)


def test_a_tapering_tube_is_a_cone_with_its_normals():
    points = np.array([[0.0, 0.0], [0.0, 0.0], [0.0, 2.0]])
    tubes = curve_tubes(points, np.array([1.0, 0.0]), np.array([0, 2]), 64, 32, straight=True)
    np.testing.assert_allclose(tubes.normals[:, 2], 1.0 / np.sqrt(5.0), rtol=1e-12)
    # each side comes to a point
    assert tubes.corners.shape[1] == 64


def test_what_has_no_length_or_radius_has_no_tube():
    points, radii = np.zeros((3, 7)), np.ones(7)
    points[0] = np.arange(7)
    radii[1:3] = 0.0
    tubes = curve_tubes(points, radii, np.array([0, 1, 3, 3, 7]), 8, 1)
    assert tubes.points.shape[1] == 4 * 8 and tubes.points[0].min() == 3.0
    assert curve_tubes(points[:, :0], radii[:0], np.array([0]), 8, 1).corners.shape == (3, 0)


def test_points_in_one_place_make_no_nonsense():
    points = np.array([[0.0, 0.0, 1.0, 1.0, 1.0], [0.0] * 5, [0.0] * 5])
    tubes = curve_tubes(points, np.full(5, 0.1), np.array([0, 5]), 8, 32)
    assert np.isfinite(tubes.points).all() and np.isfinite(tubes.normals).all()
    assert np.abs(tubes.points[1:]).max() < 0.11


def test_rings_do_not_twist():
    """Along a straight line the same corner of each ring is on the same side."""
    points = np.zeros((3, 9))
    points[2] = np.arange(9)
    radii = np.array([0.1, 0.5] * 4 + [0.1])
    tubes = curve_tubes(points, radii, np.array([0, 9]), 8, 32)
    angle = np.arctan2(tubes.points[1], tubes.points[0]).reshape(-1, 8)
    np.testing.assert_allclose(angle, angle[:1].repeat(len(angle), axis=0), atol=1e-9)
