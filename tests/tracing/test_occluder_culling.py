# SPDX-License-Identifier: GPL-3.0-or-later
"""Candidate occluders: whatever blocks a ray to a light is among them, by plain formulas."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from adaptive_drt.geometry.mesh.bvh import FaceTree
from adaptive_drt.scene.description import (
    DiskLight,
    Material,
    PointLight,
    Quad,
    QuadLight,
    Scene,
    Sphere,
    SphereLight,
)
from adaptive_drt.scene.settings import Settings
from adaptive_drt.scene.sphere_batch import Spheres
from adaptive_drt.tracing import occluder_culling as culling_module
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Pairs, Surface
from adaptive_drt.tracing.occluder_culling import Occluders, merge_pairs
from mesh_shapes import bumpy_mesh
from plain_hits import oracle_depth
from random_scenes import look_at

LIGHTS = {
    "quad": QuadLight((0.5, 0.2, 6.0), (0.8, 0.0, 0.1), (0.0, -0.6, 0.0), (1.0, 1.0, 1.0)),
    "sphere": SphereLight((0.5, 0.2, 6.0), 0.6, (1.0, 1.0, 1.0)),
    "disk": DiskLight((0.5, 0.2, 6.0), 0.6, (1.0, 1.0, 1.0)),
    "point": PointLight((0.5, 0.2, 6.0), (1.0, 1.0, 1.0)),
}
FLOOR = Quad((-9.0, -9.0, 0.0), (18.0, 0.0, 0.0), (0.0, 18.0, 0.0))


def crowd(rng, spheres, quads):
    """Things between floor and light, some beside and some beyond it."""
    shapes = [
        Sphere(tuple(rng.uniform((-4, -4, 0.2), (4, 4, 9)).tolist()), float(rng.uniform(0.05, 0.7)))
        for _ in range(spheres)
    ]
    for _ in range(quads):
        corner = rng.uniform((-4, -4, 0.2), (4, 4, 8))
        u, v = rng.normal(size=(2, 3)) * 0.7
        shapes.append(Quad(*(tuple(part.tolist()) for part in (corner, u, v))))
    return [*shapes, FLOOR]


def floor_points(rng, plan, count):
    """Points of the floor, which is the last object, seen from the camera."""
    point = np.stack([*rng.uniform(-6.0, 6.0, (2, count)), np.zeros(count)])
    normal = np.tile([[0.0], [0.0], [1.0]], count)
    item = np.full(count, plan.object_count - 1)
    return Surface(point - plan.lens.origin[:, None], normal, item, np.zeros(count, dtype=bool))


@pytest.mark.parametrize("kind", LIGHTS)
@pytest.mark.parametrize("spheres, quads", [(6, 6), (40, 10), (300, 0)])
@pytest.mark.parametrize("accelerator", ["ARRAYS", "EMBREE"])
def test_nothing_that_blocks_a_ray_is_left_out(kind, spheres, quads, accelerator):
    if accelerator == "EMBREE":
        pytest.importorskip("embreex")
    rng = np.random.default_rng(spheres)
    shapes = crowd(rng, spheres, quads)
    scene = Scene(look_at((0.0, -9.0, 7.0), (0.0, 0.0, 0.0)), tuple(shapes), (LIGHTS[kind],))
    plan = make_plan(scene, Settings(accelerator=accelerator))
    light = plan.lights[0]
    points = floor_points(rng, plan, 500)
    pairs = Occluders(plan).find_candidates(light, points)
    assert (np.diff(pairs.pixel) >= 0).all()
    found = np.zeros((500, len(shapes)), dtype=bool)
    found[pairs.pixel, pairs.item] = True
    eye, zero = plan.lens.origin[:, None], np.zeros(500)
    blocks = np.zeros_like(found)
    for _ in range(24):
        center = light.to_center(points.point, 0.0)
        if kind == "point":
            to = center
        else:
            spot = rng.random((2, 500, 1))
            to, _ = light.sample(
                center[:, :, None], points.point[:, :, None], points.normal[:, :, None], *spot
            )
            to = to[:, :, 0]
        length = np.linalg.norm(to, axis=0)
        for k, shape in enumerate(shapes[:-1]):
            far = oracle_depth(shape, to / length, zero, points.point + eye)
            blocks[:, k] |= far < length * (1 - 1e-9)
    assert not (blocks & ~found).any()
    assert found.sum() < 6 * blocks.sum() + 500  # and few others are candidates
    assert not found[:, -1].any()


def test_lights_that_cast_no_shadow_have_no_occluders():
    light = SphereLight((0.5, 0.2, 6.0), 0.6, (1.0, 1.0, 1.0), casts_shadow=False)
    rng = np.random.default_rng(1)
    plan = make_plan(
        Scene(look_at((0, -9, 7), (0, 0, 0)), tuple(crowd(rng, 5, 0)), (light,)), Settings()
    )
    assert (
        Occluders(plan).find_candidates(plan.lights[0], floor_points(rng, plan, 10)).item.size == 0
    )


def test_they_are_made_again_from_the_plan_in_another_process():
    rng = np.random.default_rng(2)
    scene = Scene(look_at((0, -9, 7), (0, 0, 0)), tuple(crowd(rng, 9, 3)), (LIGHTS["quad"],))
    plan = make_plan(scene, Settings())
    first, points = Occluders(plan), floor_points(rng, plan, 50)
    again = pickle.loads(pickle.dumps(first))
    one, two = (each.find_candidates(plan.lights[0], points) for each in (first, again))
    np.testing.assert_array_equal(one.item, two.item)


@pytest.mark.parametrize("name", sorted(LIGHTS))
@pytest.mark.parametrize("reach", [0.0, 0.2])
def test_no_mesh_that_hides_some_light_is_dropped(name, reach):
    """A mesh is dropped where none of its clusters of faces may hide light, and only there."""
    rng = np.random.default_rng(4)
    mesh = bumpy_mesh(60, 40, radius=0.5, center=(0.0, 0.0, 3.0))
    floor = Quad((-9.0, -9.0, 0.0), (18.0, 0.0, 0.0), (0.0, 18.0, 0.0))
    scene = Scene(look_at((0.0, -8.0, 4.0), (0.0, 0.0, 0.0)), (floor, mesh), (LIGHTS[name],))
    plan = make_plan(scene, Settings())
    light, eye = plan.lights[0], plan.lens.origin[:, None]
    place = np.concatenate([rng.uniform(-2.5, 2.5, (2, 3_000)), np.zeros((1, 3_000))])
    up = np.zeros_like(place)
    up[2] = 1.0
    point = Surface(place - eye, up, np.zeros(3_000, dtype=int), np.zeros(3_000, dtype=bool))
    found = Occluders(plan).find_candidates(light, point, np.full(3_000, reach))
    kept = np.zeros(3_000, dtype=bool)
    kept[found.pixel[found.item == 1]] = True
    near = place + reach * np.array([[1.0], [-0.5], [0.0]]) / 2.0
    to, _ = light.sample(
        light.to_center((near - eye)[:, :, None], 0.0), (near - eye)[:, :, None],
        up[:, :, None], *rng.random((2, 3_000, 20)),
    ) if light.extended else (light.to_center((near - eye)[:, :, None], 0.0), None)  # fmt: skip
    rays = to.shape[2]
    start = np.repeat(near, rays, axis=1)
    tree = FaceTree(mesh.vertices, mesh.faces)
    blocked = tree.blocked(start, to.reshape(3, -1), np.ones(start.shape[1])).reshape(-1, rays)
    hidden = blocked.any(axis=1)
    assert hidden.sum() > 30
    assert not (hidden & ~kept).any()
    assert kept.mean() < 3.0 * hidden.mean() + 0.3


def test_very_many_objects_are_found_in_groups_without_proxies():
    rng, count = np.random.default_rng(3), 5_000
    center = rng.uniform((-9.0, -9.0, 0.0), (9.0, 9.0, 6.0), (count, 3)).T
    balls = Spheres(center, rng.uniform(0.1, 0.2, count), np.zeros(count, int), (Material(),))
    light = SphereLight((0.0, 0.0, 12.0), 0.2, (9.0, 9.0, 9.0))
    scene = Scene(look_at((0.0, -20.0, 9.0), (0.0, 0.0, 3.0)), (balls, FLOOR), (light,))
    plan = make_plan(scene, Settings())
    assert not plan.may_use_embree
    proxied = make_plan(scene, Settings(accelerator="EMBREE"))
    assert proxied.uses_embree(proxied.lights[0])
    points = floor_points(rng, plan, 200)
    ours, theirs = (
        Occluders(each).find_candidates(each.lights[0], points) for each in (plan, proxied)
    )
    assert ours.item.size > 200
    np.testing.assert_array_equal(ours.pixel, theirs.pixel)
    np.testing.assert_array_equal(ours.item, theirs.item)


@pytest.mark.parametrize("most", [0, 1 << 30])
def test_lists_of_pairs_are_merged_by_flags_or_comparisons(monkeypatch, most):
    """Flags of all possible pairs are only used while they are few: they are memory."""
    monkeypatch.setattr(culling_module, "MOST_FLAGS", most)
    rng = np.random.default_rng(most + 5)
    points, objects = 40, 30
    lists = [(rng.integers(points, size=200), rng.integers(objects, size=200)) for _ in range(3)]
    merged = merge_pairs([Pairs(*each) for each in lists], points, objects)
    wanted = {tuple(pair) for each in lists for pair in np.transpose(each).tolist()}
    found = np.transpose([merged.pixel, merged.item]).tolist()
    assert found == sorted(map(list, wanted))
