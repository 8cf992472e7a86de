# SPDX-License-Identifier: GPL-3.0-or-later
"""Hemispheres behind caps and polygons, against arcs of all pairs and against rays."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry import open_hemisphere as open_module
from adaptive_drt.geometry.open_hemisphere import (
    open_hemisphere_factor,
    polygons_in_general_position,
)
from adaptive_drt.geometry.silhouettes import Hemisphere, make_polygon_silhouettes
from adaptive_drt.lights.occluded_form_factor import visible_factor
from circle_outlines import KINDS, POINTS, outlines, unit


def caps_of(balls):
    """Axes, sines, cosines and points of balls (k, 3, n), (k, n), sorted by point."""
    v, r = balls[0].swapaxes(0, 1), balls[1]
    length = np.sqrt((v * v).sum(axis=0))
    cosine = np.sqrt((length - r) * (length + r)) / length
    point = np.repeat(np.arange(r.shape[1]), r.shape[0])
    axis = (v / length).swapaxes(1, 2).reshape(3, -1)
    return axis, (r / length).T.ravel(), cosine.T.ravel(), point


def faces_of(rng, faces, corners=4):
    corner, a, b = rng.normal(size=(3, faces, 3, POINTS))
    four = np.stack([corner, corner + a, corner + a + b, corner + b], axis=1)
    return four if corners == 4 else four[:, [0, 1, 2, 2]]


@pytest.mark.parametrize("faces", [0, 1, 3])
@pytest.mark.parametrize("k", [0, 1, 2, 3, 13, 40, 90])
@pytest.mark.parametrize("kind", KINDS)
def test_it_is_the_sum_over_all_arcs(kind, k, faces):
    if kind == "touching" and k < 2:
        return
    for seed in range(3):
        rng = np.random.default_rng([seed, k, faces])
        normal = unit(rng, POINTS)
        balls = outlines(rng, kind, k) if k else (np.zeros((0, 3, POINTS)), np.zeros((0, POINTS)))
        polygons = faces_of(rng, faces, 4 if seed else 3)
        want = visible_factor(Hemisphere(), normal, balls, polygons)
        seen = make_polygon_silhouettes(polygons, normal) if faces else None
        clear = np.ones(POINTS, dtype=bool)
        if seen is not None:
            clear = polygons_in_general_position(normal, seen)
        got = open_hemisphere_factor(normal, *caps_of(balls), seen)
        assert clear.mean() > 0.9
        assert got[clear] == pytest.approx(want[clear], abs=1e-12)


@pytest.mark.parametrize("faces", [0, 2])
@pytest.mark.parametrize("k", [13, 60])
@pytest.mark.parametrize("kind", KINDS)
def test_covered_circles_change_nothing(kind, k, faces, monkeypatch):
    """They are left out of large heaps only, which no kind of outlines here is."""
    rng = np.random.default_rng([k, faces])
    normal, balls, polygons = unit(rng, POINTS), outlines(rng, kind, k), faces_of(rng, faces)
    seen = make_polygon_silhouettes(polygons, normal) if faces else None
    want = open_hemisphere_factor(normal, *caps_of(balls), seen)
    monkeypatch.setattr(open_module, "MANY_CIRCLES", 4)
    monkeypatch.setattr(open_module, "LEAST_OVERLAPS", -2.0)
    got = open_hemisphere_factor(normal, *caps_of(balls), seen)
    assert got == pytest.approx(want, abs=1e-12)


def test_against_rays():
    """Directions that no cap and no polygon covers, counted: this shares nothing with arcs."""
    seed = 20261130
    print("seed", seed)
    rng = np.random.default_rng(seed)
    normal = unit(rng, POINTS)
    balls, polygons = outlines(rng, "packed", 12), faces_of(rng, 2)
    seen = make_polygon_silhouettes(polygons, normal)
    got = open_hemisphere_factor(normal, *caps_of(balls), seen)
    count = 40_000
    number = np.arange(count)
    a, b = (0.5 + number * 0.7548776662466927) % 1.0, (0.5 + number * 0.5698402909980532) % 1.0
    for i in range(POINTS):
        helper = np.eye(3)[np.abs(normal[:, i]).argmin()]
        u = np.cross(normal[:, i], helper)
        u /= np.linalg.norm(u)
        w = np.cross(normal[:, i], u)
        turn, s = 2.0 * np.pi * b, np.sqrt(a)
        way = np.outer(u, s * np.cos(turn)) + np.outer(w, s * np.sin(turn))
        way += np.outer(normal[:, i], np.sqrt(1.0 - a))
        hidden = np.zeros(count, dtype=bool)
        for v, r in zip(balls[0][..., i], balls[1][:, i], strict=True):
            along = v @ way
            hidden |= (along > 0.0) & (v @ v - along * along < r * r)
        for corners in polygons[..., i]:
            planes = np.array([np.cross(corners[j], corners[(j + 1) % 4]) for j in range(4)])
            turn = np.sign(planes @ corners.mean(axis=0))
            hidden |= ((planes @ way) * turn[:, None] > 0.0).all(axis=0)
        assert got[i] / np.pi == pytest.approx(1.0 - hidden.mean(), abs=2e-3)


def test_points_do_not_depend_on_each_other(monkeypatch):
    """The sums are the same bits whatever other points there are."""
    rng = np.random.default_rng(7)
    normal, balls = unit(rng, POINTS), outlines(rng, "packed", 50)
    axis, sine, cosine, point = caps_of(balls)
    # points with different numbers of caps, in groups of several sizes
    kept = rng.uniform(size=point.size) < np.linspace(0.1, 1.0, POINTS)[point]
    axis, sine, cosine, point = axis[:, kept], sine[kept], cosine[kept], point[kept]
    whole = open_hemisphere_factor(normal, axis, sine, cosine, point)
    for i in range(POINTS):
        own = point == i
        alone = open_hemisphere_factor(
            normal[:, i : i + 1], axis[:, own], sine[own], cosine[own], point[own] * 0
        )
        assert alone[0] == whole[i]
    monkeypatch.setattr(open_module, "BLOCK_PAIRS", 1)
    assert np.array_equal(open_hemisphere_factor(normal, axis, sine, cosine, point), whole)


def test_symmetric_lattices():
    """Caps around the normal of a sixfold lattice: many circles meet in the same points."""
    normal = np.array([[0.0], [0.0], [1.0]])
    grid = [(i + 0.5 * j, j * np.sqrt(0.75)) for i in range(-4, 5) for j in range(-4, 5)]
    for height in (0.6, 1.0, 1.7):
        for radius in (0.3, 0.5, 1.0 / np.sqrt(3.0), 0.59):
            v = np.array([(x, y, height) for x, y in grid])[..., None]
            r = np.minimum(radius, 0.999 * height) * np.ones((len(grid), 1))
            want = visible_factor(Hemisphere(), normal, (v, r), np.zeros((0, 4, 3, 1)))
            got = open_hemisphere_factor(normal, *caps_of((v, r)))
            assert got == pytest.approx(want, abs=1e-11)


def test_nothing_and_everything():
    normal = np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 1.0]])
    none = np.zeros(0)
    open_ = open_hemisphere_factor(normal, np.zeros((3, 0)), none, none, none.astype(np.int64))
    assert open_.tolist() == [np.pi, np.pi]
    # a cap about the normal hides sin^2 of its half angle; one below the horizon nothing
    axis = np.array([[0.0, 0.0], [0.0, 0.0], [1.0, -1.0]])
    sine = np.array([0.6, 0.6])
    found = open_hemisphere_factor(normal, axis, sine, np.sqrt(1.0 - sine**2), np.array([0, 1]))
    assert found == pytest.approx([np.pi * 0.64, np.pi])


def test_edges_in_the_horizon_are_not_in_general_position():
    normal = np.array([[0.0], [0.0], [1.0]])
    wall = np.array([(-1.0, 1.0, 0.0), (1.0, 1.0, 0.0), (1.0, 1.0, 1.0), (-1.0, 1.0, 1.0)])
    for lift, clear in ((0.0, False), (-0.1, True)):
        own = (wall + np.array([0.0, 0.0, lift]))[None, :, :, None]
        seen = make_polygon_silhouettes(own, normal)
        assert polygons_in_general_position(normal, seen).tolist() == [clear]
    twice = np.stack([wall - 0.1, wall - 0.1])[..., None]
    seen = make_polygon_silhouettes(twice, normal)
    assert not polygons_in_general_position(normal, seen).any()
