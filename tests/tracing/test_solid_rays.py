# SPDX-License-Identifier: GPL-3.0-or-later
"""Spheres that are traced as one set block what they block one by one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.geometry.embree_library import native_library
from adaptive_drt.scene.description import Cylinder, Ellipsoid, Motion, Quad, Sphere
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Pairs, Surface, intersect_pairs, nearest_hits
from adaptive_drt.tracing.occluder_culling import Occluders
from adaptive_drt.tracing.shadow_rays import blocked_segments
from adaptive_drt.tracing.solid_rays import MAX_OTHERS, MIN_SOLIDS
from sphere_heaps import moving_heap, sphere_heap

pytestmark = pytest.mark.skipif(native_library() is None, reason="embree's library is not found")

SETTINGS = Settings(tolerance=0.01)


def test_the_spheres_of_a_heap_are_traced_and_its_floor_is_not():
    plan = make_plan(sphere_heap(0, 120), SETTINGS)
    assert plan.traced is not None and plan.may_sample
    assert plan.traced.sum() == 120 and not plan.traced[120:].any()
    assert plan.summary()["solid_rays"].startswith("embree")


@pytest.mark.parametrize("change", ["few", "rays", "arrays", "others", "visibility"])
def test_what_does_not_suit_is_not_traced(change):
    scene, settings = sphere_heap(0, 120), SETTINGS
    first = next(shape for shape in scene.shapes if isinstance(shape, Sphere))
    rest = tuple(shape for shape in scene.shapes if shape is not first)
    if change == "few":
        scene = sphere_heap(0, MIN_SOLIDS - 1)
    elif change == "rays":
        settings = Settings(method="RAYS")
    elif change == "arrays":
        settings = replace(settings, accelerator="ARRAYS")
    elif change == "others":
        walls = tuple(
            Quad((-9.0, 5.0 + k, 0.0), (18.0, 0.0, 0.0), (0.0, 0.0, 1.0))
            for k in range(MAX_OTHERS + 1)
        )
        scene = replace(scene, shapes=(*scene.shapes, *walls))
    else:
        hidden = replace(first, visibility=replace(first.visibility, shadow=False))
        scene = replace(scene, shapes=(hidden, *rest))
    plan = make_plan(scene, settings)
    assert plan.traced is None and plan.summary()["solid_rays"] == "none"


def test_a_tiny_sphere_is_tested_by_itself():
    scene = sphere_heap(0, 120)
    speck = Sphere((0.0, 0.0, 3.0), 1e-6)
    plan = make_plan(replace(scene, shapes=(*scene.shapes, speck)), SETTINGS)
    assert plan.traced is not None and plan.traced.sum() == 120


def test_a_huge_sphere_is_tested_by_itself():
    scene = sphere_heap(0, 120)
    ground = Sphere((0.0, 0.0, -5_000.0), 4_999.0)
    plan = make_plan(replace(scene, shapes=(*scene.shapes, ground)), SETTINGS)
    assert plan.traced is not None and plan.traced.sum() == 120
    assert (~plan.traced).sum() == 2


@pytest.mark.parametrize("change", [lambda scene: scene, moving_heap], ids=["still", "moving"])
def test_segments_are_blocked_as_by_each_object(change):
    plan = make_plan(change(sphere_heap(3, 150)), SETTINGS)
    assert plan.motion == (change is moving_heap)
    occluders = Occluders(plan)
    rng = np.random.default_rng(0)
    center, radius = plan.shapes.bounding_spheres
    item = rng.integers(0, 150, 60)
    normal = rng.normal(size=(3, 60))
    normal /= np.sqrt((normal**2).sum(axis=0))
    point = center[:, item] + radius[item] * normal
    surface = Surface(point, normal, item, np.zeros(60, dtype=bool))
    way = rng.normal(size=(3, 60, 16))
    to = 4.0 * (way / np.sqrt((way**2).sum(axis=0)) + 1.01 * normal[:, :, None])
    pairs = Pairs(*np.nonzero(np.arange(plan.object_count) != item[:, None]))
    time = rng.uniform(-0.5, 0.5, (60, 16)) if plan.motion else 0.0
    wanted = blocked_segments(plan, surface, to, pairs, time)
    few = occluders.find_ray_candidates(plan.lights[0], surface)
    floor = Pairs(np.arange(60), np.full(60, plan.object_count - 1))
    every = Pairs(np.concatenate([few.pixel, floor.pixel]), np.concatenate([few.item, floor.item]))
    order = np.argsort(every.pixel, kind="stable")
    found = blocked_segments(plan, surface, to, every.take(order), time, occluders.tracer)
    assert 0.1 < wanted.mean() < 0.9
    # points of moving balls are not on them at other times
    known = np.arange(60) if change is not moving_heap else (item % 2 == 1).nonzero()[0]
    assert (found != wanted)[known].mean() <= 2e-3


@pytest.mark.parametrize("change", [lambda scene: scene, moving_heap], ids=["still", "moving"])
def test_nearest_hits_are_those_of_all_pairs(change):
    plan = make_plan(change(sphere_heap(4, 150)), SETTINGS)
    tracer = Occluders(plan).tracer
    assert tracer is not None
    x, y = np.random.default_rng(0).uniform(0.0, (32.0, 24.0), (400, 2)).T
    w = plan.lens.directions(x, y)
    pairs = Pairs(np.repeat(np.arange(400), 150), np.tile(np.arange(150), 400))
    time = np.random.default_rng(1).uniform(-0.5, 0.5, 400)
    t = intersect_pairs(plan, w[:, pairs.pixel], pairs.item, time[pairs.pixel])
    wanted = nearest_hits(400, pairs, t)
    depth, item = tracer.nearest(w.reshape(3, 20, 20), time.reshape(20, 20))
    assert depth.shape == item.shape == (20, 20)
    same = item.ravel() == wanted[1]
    assert same.mean() > 0.995 and (item >= 0).mean() > 0.3
    np.testing.assert_allclose(depth.ravel()[same], wanted[0][same], rtol=1e-9)


def test_faces_at_rest_are_traced_with_the_spheres():
    plan = make_plan(sphere_heap(3, 150), SETTINGS)
    tracer = Occluders(plan).tracer
    assert tracer.holds_all
    rng = np.random.default_rng(0)
    center, radius = plan.shapes.bounding_spheres
    item = rng.integers(0, 150, 200)
    normal = rng.normal(size=(3, 200))
    normal /= np.sqrt((normal**2).sum(axis=0))
    surface = Surface(
        center[:, item] + radius[item] * normal, normal, item, np.zeros(200, dtype=bool)
    )
    free, way = tracer.open_rays(surface.point, normal, *rng.uniform(0.0, 1.0, (2, 200)), True)
    pairs = Pairs(*np.nonzero(np.arange(plan.object_count) != item[:, None]))
    to = 100.0 * np.moveaxis(way, 1, 2).astype(float)
    wanted = blocked_segments(plan, surface, to, pairs, 0.0)
    assert (free.T == ~wanted).mean() > 0.995 and 0.02 < free.mean() < 0.9
    # a floor that is very large, or that moves, is tested by itself
    far = 1e4
    floor = Quad((-far, -far, -0.5), (2.0 * far, 0.0, 0.0), (0.0, 2.0 * far, 0.0))
    scene = sphere_heap(3, 150)
    scene = replace(scene, shapes=(floor, *scene.shapes[1:]))
    assert not Occluders(make_plan(scene, SETTINGS)).tracer.holds_all


def crowd(count, motion=None):
    """Balls, sticks, cones and ellipsoids of a heap, over its floor."""
    scene = sphere_heap(6, count)
    rng = np.random.default_rng(6)
    floor, *balls = scene.shapes
    shapes = []
    for number, ball in enumerate(balls):
        center, axes = np.array(ball.center), np.linalg.qr(rng.normal(size=(3, 3)))[0] * ball.radius
        own = {"material": ball.material, "motion": motion}
        end = [float(each) for each in center + axes[0]]
        if number % 4 == 0:
            shapes.append(replace(ball, motion=motion))
        elif number % 4 == 1:
            shapes.append(Cylinder(ball.center, tuple(end), 0.3 * ball.radius, **own))
        elif number % 4 == 2:
            shapes.append(
                Cylinder(ball.center, tuple(end), 0.5 * ball.radius, end_radius=0.0, **own)
            )
        else:
            halves = axes * rng.uniform(0.3, 1.0, (3, 1))
            shapes.append(Ellipsoid(ball.center, *map(tuple, halves.tolist()), **own))
    return replace(scene, shapes=(floor, *shapes))


@pytest.mark.parametrize("motion", [None, Motion((0.05, 0.1, 0.0))], ids=["still", "moving"])
def test_solids_with_their_ends_are_met_and_block_as_one_by_one(motion):
    plan = make_plan(crowd(120, motion), SETTINGS)
    tracer = Occluders(plan).tracer
    # all but the floor: the solids, and the ends of sticks and cones
    assert tracer is not None and (~plan.traced).sum() == 1
    assert tracer.items.size == 120 < plan.traced.sum()
    rng, size = np.random.default_rng(0), 900
    x, y = rng.uniform(0.0, (32.0, 24.0), (size, 2)).T
    w, time = plan.lens.directions(x, y), rng.uniform(-0.5, 0.5, size)
    every = plan.traced.nonzero()[0]
    pairs = Pairs(np.repeat(np.arange(size), every.size), np.tile(every, size))
    t = intersect_pairs(plan, w[:, pairs.pixel], pairs.item, time[pairs.pixel])
    depth, item = nearest_hits(size, pairs, t)
    found = tracer.nearest(w, time)
    same = found[1] == item
    assert same.mean() > 0.99 and (item >= 0).mean() > 0.2
    kinds = {type(each).__name__ for each, _, _ in plan.shapes.groups(item[same])}
    assert {"SphereSet", "EllipseSet", "EllipsoidSet", "CylinderSet"} <= kinds
    np.testing.assert_allclose(found[0][same], depth[same], rtol=1e-9)
