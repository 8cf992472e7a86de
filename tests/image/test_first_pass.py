# SPDX-License-Identifier: GPL-3.0-or-later
"""The first pass over whole pictures: hits, and point lights in closed form with plain shadows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.geometry.embree_library import native_library
from adaptive_drt.image import first_pass as first_pass_module
from adaptive_drt.image.chebyshev_blocks import SIDES, PixelBlocks, coarse_plan
from adaptive_drt.image.first_pass import trace_first_pass
from adaptive_drt.scene.description import PointLight, Sphere
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Tile, screen_bounds
from adaptive_drt.tracing.occluder_culling import Occluders
from detected import in_order, seen
from plain_hits import blocked
from random_scenes import random_scene
from sphere_heaps import sphere_heap


def passed(scene):
    """The plan, and the batches of pixels that are traced by a ray of their own."""
    plan = make_plan(scene, Settings(batch=500))
    rough = coarse_plan(plan, SIDES[0])
    blocks = PixelBlocks.of_tile(rough, SIDES[0], screen_bounds(rough), Tile.make(rough, 0, 1))
    told = []
    found = trace_first_pass(plan, Occluders(plan), screen_bounds(plan), blocks, told.append)
    assert not found.pixels or {"camera rays", "exact light"} <= set(told)
    covered = sum(block.side**2 * block.x.size for block in found.blocks)
    left, bottom, right, top = plan.region
    assert sum(x.size for x, _, _ in found.pixels) + covered >= (right - left) * (top - bottom)
    return plan, found.pixels


@pytest.mark.parametrize("seed", range(12))
def test_centres_are_lit_by_points_as_by_plain_formulas(seed):
    scene = random_scene(seed)
    power = (3.0, 2.0, 1.0)
    lights = tuple(PointLight(light.center, power) for light in scene.lights)
    scene = replace(scene, lights=lights, camera=replace(scene.camera, motion=None))
    plan, batches = passed(scene)
    for x, y, found in batches:
        check_batch(scene, plan, x + 0.5, y + 0.5, found, f"seed {seed}")


def check_batch(scene, plan, x, y, found, name):
    """Light of points at pixel centres, by plain formulas."""
    shapes, lights, power = in_order(scene), scene.lights, np.array(scene.lights[0].intensity)
    item, point = seen(scene, x, y, np.zeros(x.size))
    same = item == found.item
    assert (~same).sum() <= 2, name
    rows = np.flatnonzero(same & (item >= 0))
    want = np.zeros((3, rows.size))
    unsure = np.zeros(rows.size, dtype=bool)
    for own in np.unique(item[rows]):
        some = np.flatnonzero(item[rows] == own)
        p, n = point[:, rows[some]], found.normal[:, rows[some]]
        for light in lights:
            to = np.array(light.center)[:, None] - p
            square = (to * to).sum(axis=0)
            cosine = (n * to).sum(axis=0) / np.sqrt(square)
            # a sphere seen from within shadows itself
            skip = (
                ()
                if isinstance(shapes[own], Sphere) and found_inside(shapes[own], plan)
                else (own,)
            )
            away = blocked(shapes, p, p + to, np.zeros(some.size), skip)
            lit = np.maximum(cosine, 0.0) / square * ~away
            albedo = np.array(shapes[own].material.color)
            want[:, some] += np.outer(albedo / np.pi * power, lit)
            unsure[some] |= np.abs(cosine) < 1e-6
    ours = found.color[:, rows]
    size = max(want.max(initial=0.0), 1e-300)
    differ = (np.abs(ours - want) > 1e-6 * size).any(axis=0) & ~unsure
    # rays along outlines of occluders fall on either side
    assert differ.sum() <= 5e-3 * differ.size + 1, name


def found_inside(sphere, plan):
    return np.linalg.norm(np.array(sphere.center) - plan.lens.origin) < sphere.radius


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("transparent", [False, True])
def test_what_is_not_hit_is_background(seed, transparent):
    scene = replace(random_scene(seed), transparent=transparent)
    for _, _, found in passed(scene)[1]:
        none = found.item < 0
        assert np.isinf(found.depth[none]).all() and not found.normal[:, none].any()
        np.testing.assert_array_equal(found.alpha, np.where(none & transparent, 0.0, 1.0))
        want = np.zeros(3) if transparent else np.array(scene.background)
        np.testing.assert_array_equal(found.color[:, none], np.tile(want[:, None], none.sum()))
        np.testing.assert_allclose(found.error, found.deviation.sum(axis=(0, 1)), rtol=1e-12)
        assert (found.error >= 0.0).all() and np.isfinite(found.error).all()
        assert (np.diff(found.candidates.pixel) >= 0).all()
        plain = ~found.outline
        np.testing.assert_array_equal(found.visibility_key[plain], found.item[plain] + 1)


@pytest.mark.skipif(native_library() is None, reason="embree's library is not found")
def test_no_list_is_kept_of_the_balls_that_rays_find():
    """Of a million balls such lists take more memory than the picture. Other objects stay."""
    plan, batches = passed(sphere_heap(3, 300))
    traced, others = Occluders(plan).tracer.traced, 0
    for _, _, found in batches:
        pixel, item = found.candidates.pixel, found.candidates.item
        assert not (found.sampled[pixel] & traced[item]).any()
        others += int((found.sampled[pixel] & ~traced[item]).sum())
        kept = np.bincount(pixel, minlength=found.item.size) > 0
        assert kept[found.outline].all()
    assert sum(found.sampled.sum() for _, _, found in batches) > 100
    assert others > 0


def test_batches_are_smaller_where_objects_are_very_many(monkeypatch):
    """What is found of the pixels is the same."""
    scene = random_scene(5)
    _, large = passed(scene)
    monkeypatch.setattr(first_pass_module, "listed_pixels", lambda _: 50)
    _, small = passed(scene)
    assert max(x.size for x, _, _ in large) > 50 >= max(x.size for x, _, _ in small)
    for name in ("color", "error", "item"):
        whole, parts = (
            np.concatenate([getattr(found, name) for _, _, found in each], axis=-1)
            for each in (large, small)
        )
        np.testing.assert_array_equal(whole, parts)
