# SPDX-License-Identifier: GPL-3.0-or-later
"""Silhouettes at rest: none that many rays through a pixel see is left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.detection.edges import half_pixel
from detected import detected, grid, seen
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
    assert max(corners) <= half_pixel(plan) * (1 + 1e-12) < 2.0 * max(corners)
