# SPDX-License-Identifier: GPL-3.0-or-later
"""Few candidates tell of penumbrae and of contact what all candidates tell."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.detection.occlusion import classify_light_visibility
from adaptive_drt.detection.shadow_discontinuities import detect_shadow_edges
from adaptive_drt.geometry.embree_library import native_library
from adaptive_drt.scene.description import Material, QuadLight
from adaptive_drt.scene.settings import Settings
from adaptive_drt.scene.sphere_batch import Spheres
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.few_occluders import FewOccluders
from adaptive_drt.tracing.intersect import Surface, surface
from adaptive_drt.tracing.occluder_culling import Occluders
from random_scenes import look_at
from sphere_heaps import sphere_heap

pytestmark = pytest.mark.skipif(native_library() is None, reason="embree's library is not found")


def hits(plan, occluders):
    """What pixels of the picture show, and reaches of their patches."""
    x, y = np.random.default_rng(1).uniform(0.0, (32.0, 24.0), (500, 2)).T
    w = plan.lens.directions(x, y)
    t, item = occluders.tracer.nearest(w, 0.0)
    rows = (item >= 0).nonzero()[0]
    shown = surface(plan, w[:, rows], t[rows], item[rows])
    floor = np.random.default_rng(2).uniform(-3.0, 3.0, (3, 100))
    floor[2] = -0.5
    up = np.zeros((3, 100))
    up[2] = 1.0
    points = Surface(
        np.concatenate([shown.point, floor - plan.lens.origin[:, None]], axis=1),
        np.concatenate([shown.normal, up], axis=1),
        np.concatenate([shown.item, np.full(100, plan.object_count - 1)]),
        np.concatenate([shown.inside, np.zeros(100, dtype=bool)]),
    )
    return points, np.random.default_rng(3).uniform(0.0, 0.1, points.item.size)


@pytest.mark.parametrize("seed", range(3))
def test_the_mask_is_that_of_all_candidates(seed):
    plan = make_plan(sphere_heap(seed, 150), Settings())
    occluders, light = Occluders(plan), plan.lights[0]
    points, reach = hits(plan, occluders)
    every = occluders.find_candidates(light, points, reach)
    few = FewOccluders(occluders).find(light, points, reach)
    assert few.item.size < 0.5 * every.item.size
    pairs = set(zip(every.pixel.tolist(), every.item.tolist(), strict=True))
    assert (np.diff(few.pixel) >= 0).all()
    seen = [classify_light_visibility(plan, points, light, each) for each in (every, few)]
    np.testing.assert_array_equal(seen[0].partial, seen[1].partial)
    assert seen[0].partial.any()
    edges = [detect_shadow_edges(plan, points, light, each, reach) for each in (every, few)]
    np.testing.assert_array_equal(*edges)
    # others hide what is in the one list only
    extra = [pair for pair in zip(few.pixel, few.item, strict=True) if pair not in pairs]
    assert len(extra) < 0.2 * few.item.size


def test_spheres_above_horizons_are_counted():
    plan = make_plan(sphere_heap(5, 900), Settings())
    occluders = Occluders(plan)
    points, _ = hits(plan, occluders)
    few = FewOccluders(occluders)
    center, radius = plan.shapes.bounding_spheres
    height = points.normal.T @ center[:, :900] + radius[:900]
    wanted = (height > (points.normal * points.point).sum(axis=0)[:, None]).sum(axis=1)
    assert few.items.size == 900
    one = np.ones(plan.object_count)
    np.testing.assert_allclose(few.count_above_horizons(points, one), wanted, atol=90.0)
    np.testing.assert_allclose(
        few.count_above_horizons(points, 3.0 * one), 3.0 * wanted, atol=270.0
    )


def large_heap(count):
    """So many balls of one object on a floor under a square light."""
    scene, rng = sphere_heap(4, 8, "square"), np.random.default_rng(count)
    half = 0.35 * count ** (1.0 / 3.0)
    center = rng.uniform(-half, half, (3, count)) + np.array([[0.0], [0.0], [half]])
    balls = Spheres(center, rng.uniform(0.2, 0.5, count), np.zeros(count, int), (Material(),))
    light = QuadLight((0.0, 0.0, 4.0 * half), (0.0, half, 0.0), (half, 0.0, 0.0), (9.0,) * 3)
    camera = look_at((0.0, -5.0 * half, 3.0 * half), (0.0, 0.0, half), resolution=(32, 24))
    return replace(scene, shapes=(scene.shapes[0], balls), lights=(light,), camera=camera)


def test_few_of_very_many_spheres_tell_of_penumbrae():
    plan = make_plan(large_heap(20_000), Settings())
    occluders, light = Occluders(plan), plan.lights[0]
    points, reach = hits(plan, occluders)
    every = occluders.find_candidates(light, points, reach)
    few = FewOccluders(occluders).find(light, points, reach)
    assert few.item.size < 0.1 * every.item.size
    whole, found = (classify_light_visibility(plan, points, light, each) for each in (every, few))
    # what only all candidates tell is that one of them hides the whole light
    np.testing.assert_array_equal(whole.partial, found.partial & ~whole.hidden)
    assert whole.partial.sum() > 100


def test_spheres_before_a_light_are_counted():
    plan = make_plan(large_heap(60_000), Settings())
    occluders, light = Occluders(plan), plan.lights[0]
    points, reach = hits(plan, occluders)
    for within in (np.zeros(points.item.size), reach):
        every = occluders.find_candidates(light, points, within)
        wanted = np.bincount(every.pixel, minlength=points.item.size)
        one = np.ones(plan.object_count)
        found = FewOccluders(occluders).count_before(light, points, one, within)
        rows = wanted >= 50
        # by one of 32; by 512 spheres in all it is one of 118
        off = (found - wanted)[rows] / np.sqrt(wanted[rows])
        assert rows.sum() > 100 and np.sqrt((off**2).mean()) < 1.3 * np.sqrt(32.0)
