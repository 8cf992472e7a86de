# SPDX-License-Identifier: GPL-3.0-or-later
"""Candidates and nearest hits of whole random scenes, against plain formulas."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.scene.description import Sphere
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import (
    Pairs,
    Tile,
    cache_sized_chunks,
    curvature,
    find_candidates,
    intersect_pairs,
    nearest_hits,
    positions_in_runs,
    run_indices,
    screen_bounds,
    surface,
)
from oracle.camera import rays
from plain_hits import oracle_depth
from random_scenes import random_scene


def planned(seed, **settings):
    """A plan, and its shapes in its own order."""
    plan = make_plan(random_scene(seed), Settings(**settings))
    shapes = sorted(random_scene(seed).shapes, key=lambda shape: not isinstance(shape, Sphere))
    return plan, shapes, random_scene(seed).camera


def plain_depths(shapes, camera, x, y, t):
    """How far off each shape (rows) is hit through picture coordinates, over their rays' length."""
    origin, ray = rays(camera, x, y, t)
    return np.array([oracle_depth(shape, ray.T, t, origin.T) for shape in shapes])


@pytest.mark.parametrize("seed", range(24))
@pytest.mark.parametrize("time", [0.0, 0.3])
def test_nearest_hits_are_those_of_plain_formulas(seed, time):
    plan, shapes, camera = planned(seed)
    tile = Tile.make(plan, 0, 1)
    pairs = find_candidates(plan, screen_bounds(plan), tile)
    w = plan.lens.directions(tile.x, tile.y)
    t, item = nearest_hits(
        tile.x.size, pairs, intersect_pairs(plan, w[:, pairs.pixel], pairs.item, time)
    )
    times = np.full(tile.x.size, time)
    far = plain_depths(shapes, camera, tile.x, tile.y, times)
    order = np.sort(far, axis=0)
    # objects at one depth, and rays along outlines, say nothing
    clear = np.ones(t.size, dtype=bool)
    if len(shapes) > 1:
        with np.errstate(invalid="ignore"):
            clear = ~(order[1] - order[0] < 1e-9 * order[0])
    want = np.where(np.isfinite(order[0]), far.argmin(axis=0), -1)
    wrong = clear & (item != want)
    assert wrong.mean() < 1e-3, f"seed {seed}"
    same = (item == want) & (item >= 0)
    length = np.linalg.norm(w, axis=0)
    np.testing.assert_allclose((t * length)[same], order[0][same], rtol=1e-8)


@pytest.mark.parametrize("seed", range(12))
def test_screen_bounds_leave_nothing_out_over_the_shutter(seed):
    plan, shapes, camera = planned(seed)
    left, bottom, right, top = screen_bounds(plan)
    rng = np.random.default_rng(seed)
    x, y = rng.uniform((0.0, 0.0), plan.resolution, (20_000, 2)).T
    t = rng.uniform(-0.5, 0.5, x.size)
    met = np.isfinite(plain_depths(shapes, camera, x, y, t))
    for k in range(len(shapes)):
        inside = (left[k] <= x) & (x < right[k]) & (bottom[k] <= y) & (y < top[k])
        assert not (met[k] & ~inside).any(), f"seed {seed}, {shapes[k].name}"


def test_tiles_are_every_so_many_rows():
    plan, _, _ = planned(3)
    left, bottom, right, top = plan.region
    pixels = [Tile.make(plan, first, 3) for first in range(3)]
    found = np.sort(np.concatenate([tile.index for tile in pixels]))
    want = [y * plan.resolution[0] + x for y in range(bottom, top) for x in range(left, right)]
    np.testing.assert_array_equal(found, want)
    assert (np.floor(pixels[1].y) % 3 == (bottom + 1) % 3).all()


@pytest.mark.parametrize("first, step", [(0, 1), (1, 3)])
def test_candidates_are_the_pixels_within_bounds(first, step):
    plan, _, _ = planned(5)
    tile, bounds = Tile.make(plan, first, step), screen_bounds(plan)
    pairs = find_candidates(plan, bounds, tile)
    found = set(zip(pairs.pixel.tolist(), pairs.item.tolist(), strict=True))
    x, y = np.floor([tile.x, tile.y])
    want = {
        (pixel, item)
        for item, (left, bottom, right, top) in enumerate(bounds.T)
        for pixel in np.flatnonzero((left <= x) & (x < right) & (bottom <= y) & (y < top)).tolist()
    }
    assert found == want and len(found) == pairs.item.size
    assert (np.diff(pairs.item) >= 0).all()


def test_pairs_of_some_pixels():
    pairs = Pairs(np.array([0, 0, 2, 2, 2, 3]), np.array([5, 6, 5, 7, 8, 9]))
    found = pairs.for_pixels(np.array([3, 1, 2, 3]), 4)
    assert found.pixel.tolist() == [0, 2, 2, 2, 3]
    assert found.item.tolist() == [9, 5, 7, 8, 9]
    assert pairs.take(pairs.item > 6).item.tolist() == [7, 8, 9]


def test_runs():
    size = np.array([2, 0, 3])
    assert positions_in_runs(size).tolist() == [0, 1, 0, 1, 2]
    assert run_indices(np.array([7, 1, 4]), size).tolist() == [7, 8, 4, 5, 6]
    rows = np.arange(100_000)
    np.testing.assert_array_equal(np.concatenate(cache_sized_chunks(rows)), rows)


def test_of_equal_depths_the_lowest_number_wins():
    pairs = Pairs(np.array([0, 0, 1, 1]), np.array([4, 2, 3, 1]))
    t, item = nearest_hits(3, pairs, np.array([1.0, 1.0, np.inf, np.inf]))
    assert item.tolist() == [2, -1, -1] and t[0] == 1.0 and np.isinf(t[1:]).all()


@pytest.mark.parametrize("seed", range(8))
def test_surfaces_have_the_normals_of_their_shapes(seed):
    plan, shapes, _ = planned(seed)
    rng = np.random.default_rng(seed)
    x, y = rng.uniform((0.0, 0.0), plan.resolution, (400, 2)).T
    w = plan.lens.directions(x, y)
    many = len(shapes)
    pairs = Pairs(np.repeat(np.arange(400), many), np.tile(np.arange(many), 400))
    t, item = nearest_hits(400, pairs, intersect_pairs(plan, w[:, pairs.pixel], pairs.item))
    hit = item >= 0
    found = surface(plan, w[:, hit], t[hit], item[hit])
    eye = plan.lens.origin
    bend = curvature(plan, found)
    for k, own in enumerate(item[hit]):
        shape, point = shapes[own], found.point[:, k] + eye
        if isinstance(shape, Sphere):
            away = (point - shape.center) / shape.radius
            assert abs(np.linalg.norm(away) - 1.0) < 1e-6
            assert bend[k] == 1.0 / shape.radius
        else:
            away = np.cross(shape.edge_u, shape.edge_v)
            away = away / np.linalg.norm(away)
            assert bend[k] == 0.0
        assert abs(abs(away @ found.normal[:, k]) - 1.0) < 1e-6
        assert found.normal[:, k] @ w[:, hit][:, k] <= 0.0
        outside = isinstance(shape, Sphere) and away @ found.normal[:, k] < 0.0
        assert found.inside[k] == outside
