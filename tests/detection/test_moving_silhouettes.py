# SPDX-License-Identifier: GPL-3.0-or-later
"""Things that move before pixels: wherever a ray sees something else at another time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.detection.moving_silhouettes import clip_positive
from adaptive_drt.scene.description import Motion, Sphere, vector_of
from detected import detected, grid, seen
from random_scenes import random_scene


def moving_scene(seed):
    """A random scene without lights in which every other thing moves."""
    scene, rng = random_scene(seed), np.random.default_rng(seed)
    size = max(np.abs(np.array(scene.camera.matrix)[:3, 3]).max() / 8.0, 1e-3)
    shapes = tuple(
        replace(shape, motion=Motion(vector_of(size * rng.normal(size=3))) if k % 2 else None)
        for k, shape in enumerate(scene.shapes)
    )
    return replace(scene, shapes=shapes, lights=(), camera=replace(scene.camera, motion=None))


@pytest.mark.parametrize("seed", range(16))
@pytest.mark.parametrize("edges", [True, False])
def test_rays_that_see_two_things_are_in_flagged_pixels(seed, edges):
    scene = moving_scene(seed)
    _, tile, _, flags = detected(scene, use_edges=edges)
    places = grid(4 if edges else 1, 9)
    x, y = (np.add.outer(part, places[:, k]) for k, part in enumerate((tile.x, tile.y)))
    t = np.broadcast_to(places[:, 2], x.shape)
    item, _ = seen(scene, x.ravel(), y.ravel(), t.ravel())
    item = item.reshape(tile.x.size, -1, 9)
    differ = (item != item[:, :, :1]).any(axis=(1, 2))
    assert not (differ & ~flags.mask[1]).any(), f"seed {seed}"
    # what moves and is seen moves under a fixed ray, if it is no quad in its own plane
    shapes = [*sorted(scene.shapes, key=lambda shape: not isinstance(shape, Sphere)), None]
    moves = np.array([isinstance(s, Sphere) and s.motion is not None for s in shapes])
    shown = moves[item].any(axis=(1, 2))
    assert not (shown & ~flags.mask[1]).any(), f"seed {seed}"
    still = np.array([s is None or s.motion is None for s in shapes])
    assert (still[item].all(axis=(1, 2)) & flags.mask[1]).mean() < 0.3, f"seed {seed}"


@pytest.mark.parametrize("seed", range(40))
def test_the_part_of_an_interval_in_which_a_linear_function_is_positive(seed):
    rng = np.random.default_rng(seed)
    first, last = np.sort(rng.uniform(-0.5, 0.5, 2))
    start, end = rng.normal(size=2) if seed % 5 else np.full(2, rng.normal())
    low, high = (float(x) for x in clip_positive(*(np.array(x) for x in (first, last, start, end))))
    t = np.linspace(first, last, 1_001)
    positive = start + (t + 0.5) * (end - start) >= 0.0
    inside = (low - 1e-12 <= t) & (t <= high + 1e-12)
    assert (positive != inside).sum() <= 1, f"seed {seed}"
