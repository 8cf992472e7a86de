# SPDX-License-Identifier: GPL-3.0-or-later
"""Silhouettes at rest: none that many rays through a pixel see is left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.detection.edges import detect_edges
from detected import depths, detected, grid, seen
from random_scenes import random_scene


def still_scene(seed):
    scene = random_scene(seed)
    shapes = tuple(replace(shape, motion=None) for shape in scene.shapes)
    return replace(scene, camera=replace(scene.camera, motion=None), shapes=shapes, lights=())


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("seed", range(20))
def test_pixels_that_show_two_things_are_flagged_and_few_others(seed, order):
    scene = still_scene(seed)
    _, tile, _, flags = detected(scene, order=order)
    places = grid(9)
    x, y = (np.add.outer(part, places[:, k]) for k, part in enumerate((tile.x, tile.y)))
    item, _ = seen(scene, x.ravel(), y.ravel(), np.zeros(x.size))
    item = item.reshape(x.shape)
    differ = (item != item[:, :1]).any(axis=1)
    assert not (differ & ~flags.mask[2]).any(), f"seed {seed}"
    # rays through the pixel's inside miss outlines in its corners
    assert flags.mask[2].sum() <= (1.5 if order == 2 else 3.0) * differ.sum() + 20, f"seed {seed}"
    assert not flags.mask[1].any()


@pytest.mark.parametrize("seed", range(10))
def test_half_a_pixel_bounds_how_far_directions_differ(seed):
    plan, tile, center, _ = detected(still_scene(seed))
    corners = [
        np.linalg.norm(plan.lens.directions(tile.x + a, tile.y + b) - center.w, axis=0).max()
        for a in (-0.5, 0.5)
        for b in (-0.5, 0.5)
    ]
    assert max(corners) <= plan.lens.half_pixel * (1 + 1e-12) < 2.0 * max(corners)


@pytest.mark.parametrize("seed", range(8))
def test_depths_of_what_may_be_seen_are_bounded(seed):
    scene = still_scene(seed)
    plan, tile, center, flags = detected(scene)
    pairs, w = center.pairs, center.w[:, center.pairs.pixel]
    found = detect_edges(plan, tile.x.size, pairs, w, center.t)
    np.testing.assert_array_equal(found.edge, flags.mask[2])
    for a, b, _ in grid(4):
        far, _, _ = depths(scene, tile.x + a, tile.y + b, np.zeros(tile.x.size))
        t = far / np.linalg.norm(plan.lens.directions(tile.x + a, tile.y + b), axis=0)
        hit = np.isfinite(t[pairs.item, pairs.pixel])
        assert not (hit & ~found.may_hit).any(), f"seed {seed}"
        shown = hit & (t[pairs.item, pairs.pixel] == t.min(axis=0)[pairs.pixel])
        assert found.may_be_visible[shown].all(), f"seed {seed}"
        depth = t[pairs.item, pairs.pixel][shown]
        assert (depth >= found.near[shown] * (1 - 1e-9)).all(), f"seed {seed}"
        assert (depth <= found.far[shown] * (1 + 1e-9)).all(), f"seed {seed}"
        first = t.min(axis=0)
        assert (first <= found.covered_from * (1 + 1e-9)).all(), f"seed {seed}"
