# SPDX-License-Identifier: GPL-3.0-or-later
"""Centre rays and flags of whole pictures, against many rays through each pixel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.detection.detect import detect
from adaptive_drt.tracing.occluder_culling import Occluders
from detected import depths, detected, grid, seen, traced
from random_scenes import random_scene


@pytest.mark.parametrize("seed", range(16))
def test_centre_rays_hit_what_is_nearest(seed):
    scene = random_scene(seed)
    _, tile, center = traced(scene)
    far, _, _ = depths(scene, tile.x, tile.y, np.zeros(tile.x.size))
    nearest = far.min(axis=0)
    same = np.isfinite(nearest) == np.isfinite(center.depth)
    assert same.mean() > 0.999, f"seed {seed}"
    hit = same & np.isfinite(nearest)
    length = np.linalg.norm(center.w, axis=0)
    np.testing.assert_allclose((center.depth * length)[hit], nearest[hit], rtol=1e-7)
    at = center.rows
    np.testing.assert_allclose(center.hits.point, center.depth[at] * center.w[:, at], rtol=1e-11)
    still = np.array([shape.motion is None for shape in sorted_shapes(scene)])
    if scene.camera.motion is None and still.any():
        front = np.where(still[:, None], far, np.inf).min(axis=0)
        same = np.isfinite(front) & np.isfinite(center.depth_at_rest)
        np.testing.assert_allclose((center.depth_at_rest * length)[same], front[same], rtol=1e-7)


def sorted_shapes(scene):
    return sorted(scene.shapes, key=lambda shape: not hasattr(shape, "radius"))


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("seed", range(8))
def test_pixels_without_outlines_show_one_thing_at_all_times(seed, order):
    scene = random_scene(seed)
    _, tile, _, flags = detected(scene, order=order)
    places = grid(5, 3)
    x, y = (np.add.outer(part, places[:, k]) for k, part in enumerate((tile.x, tile.y)))
    t = np.broadcast_to(places[:, 2], x.shape)
    item, _ = seen(scene, x.ravel(), y.ravel(), t.ravel())
    item = item.reshape(x.shape)
    alike = (item == item[:, :1]).all(axis=1)
    assert not (~alike & ~flags.silhouette).any(), f"seed {seed}"
    assert not (~alike & ~(flags.mask[1] | flags.mask[2])).any(), f"seed {seed}"
    # what is seen in a pixel with outlines is among its rivals
    rivals = set(
        zip(
            flags.visible_candidates.pixel.tolist(),
            flags.visible_candidates.item.tolist(),
            strict=True,
        )
    )
    for pixel in np.flatnonzero(flags.silhouette):
        for one in np.unique(item[pixel]):
            assert one < 0 or (pixel, one) in rivals, (seed, pixel, one)
    assert alike[flags.silhouette].mean() < 0.9 or flags.silhouette.sum() < 50


def test_stages_are_told_and_lights_have_their_shadows():
    scene = random_scene(4)
    plan, _, center = traced(scene)
    told = []
    flags = detect(plan, Occluders(plan), center, told.append)
    assert told and len(flags.visibilities) == len(flags.candidates) == len(plan.lights)
    for shadow in flags.visibilities:
        assert shadow.dark.size == center.rows.size
        assert not (shadow.hidden & shadow.partial).any()


def test_effects_that_are_switched_off_are_flagged_nowhere():
    for name, channel in (("use_penumbra", 0), ("use_motion", 1), ("use_edges", 2)):
        for seed in range(4):
            flags = detected(random_scene(seed), **{name: False})[3]
            assert not flags.mask[channel].any()
    still = replace(random_scene(0), lights=())
    assert not detected(still)[3].mask[0].any()
