# SPDX-License-Identifier: GPL-3.0-or-later
"""Things that move before pixels: wherever a ray sees something else at another time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.detection.moving_silhouettes import moves_under_fixed_ray
from adaptive_drt.scene.description import Motion, Quad, Sphere, vector_of
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
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


def test_points_under_fixed_rays_move_on_balls_and_on_quads_that_leave_their_planes():
    way = Motion((0.3, 0.1, 0.0))
    floor = Quad((-3.0, -3.0, 0.0), (6.0, 0.0, 0.0), (0.0, 6.0, 0.0))
    shapes = (
        Sphere((0.0, 0.0, 1.0), 0.5), Sphere((0.0, 1.0, 1.0), 0.5, motion=way),
        floor, replace(floor, motion=way),
        replace(floor, motion=Motion((0.1, 0.0, 1e-3))),
    )  # fmt: skip
    plan = make_plan(replace(random_scene(1), shapes=shapes), Settings())
    found = moves_under_fixed_ray(plan, np.array([0, 1, 2, 3, 4, -1]))
    assert found.tolist() == [False, True, False, False, True, False]
