# SPDX-License-Identifier: GPL-3.0-or-later
"""Closed boxes among quads are found, and of their faces only those are left that are needed."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from adaptive_drt.geometry.planar_faces import NO_SOLID
from adaptive_drt.scene.description import (
    DiskLight,
    Motion,
    PointLight,
    Quad,
    QuadLight,
    Scene,
    SphereLight,
    Visibility,
)
from adaptive_drt.scene.settings import Settings
from adaptive_drt.shading.direct_light import shade_with_candidates
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.face_planes import FacePlanes
from adaptive_drt.tracing.intersect import intersect_pairs, surface
from adaptive_drt.tracing.occluder_culling import Occluders
from random_scenes import look_at
from shape_sets import quads_of
from solid_boxes import box, turned

FLOOR = Quad((-9.0, -9.0, 0.0), (18.0, 0.0, 0.0), (0.0, 18.0, 0.0), name="Floor")
LAMP = SphereLight((3.0, -2.0, 9.0), 0.5, (10.0, 10.0, 10.0))
CAMERA = look_at((2.0, -7.0, 4.0), (0.0, 0.0, 0.3), resolution=(32, 24))
SIZE = 24


def plan_of(shapes, light=LAMP, camera=CAMERA):
    return make_plan(Scene(camera, tuple(shapes), (light,)), Settings(threads=1))


def some_box(rng, name="Box", motion=None):
    """Turned, sheared, of edges of any length."""
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0] + 0.2 * rng.uniform(-1.0, 1.0, (3, 3))
    u, v, w = axes * 10.0 ** rng.uniform(-1.0, 0.3, (3, 1))
    return box(rng.normal(size=3), u, v, w, name=name, motion=motion)


@pytest.mark.parametrize("seed", range(40))
def test_boxes_are_found_among_other_quads(seed):
    rng = np.random.default_rng(seed)
    one, two = some_box(rng, "One"), some_box(rng, "Two", Motion(tuple(rng.normal(size=3))))
    shapes = [FLOOR, *one, *two]
    order = rng.permutation(len(shapes))
    solid = plan_of([shapes[k] for k in order]).shapes.solid
    first, second = (solid[(order >= low) & (order < low + 6)] for low in (1, 7))
    assert solid[order == 0] == NO_SOLID
    assert (first == first[0]).all() and (second == second[0]).all()
    assert NO_SOLID not in (first[0], second[0]) and first[0] != second[0]


def test_what_is_no_closed_box_is_none():
    rng = np.random.default_rng(5)
    whole = some_box(rng)
    moved = Quad(whole[0].corner, whole[0].edge_u, whole[0].edge_v, motion=Motion((0.1, 0.0, 0.0)))
    shifted = Quad(tuple(np.array(whole[0].corner) + 1e-3), whole[0].edge_u, whole[0].edge_v)
    plate = box((0, 0, 0), (1, 0, 0), (0, 1, 0), (0.3, 0.2, 1e-4))
    for shapes in (
        [*whole[1:], FLOOR],
        [*whole[1:], moved],
        [*whole[1:], shifted],
        plate,
    ):
        assert (plan_of(shapes).shapes.solid == NO_SOLID).all()


def test_six_planes_of_any_names_are_a_box():
    rng = np.random.default_rng(6)
    one, two = some_box(rng), some_box(rng)
    faces = [Quad(q.corner, q.edge_u, q.edge_v, name=f"Plane.{k}") for k, q in enumerate(one + two)]
    solid = plan_of([faces[k] for k in rng.permutation(12)] + [FLOOR]).shapes.solid
    assert sorted(np.unique(solid, return_counts=True)[1]) == [1, 6, 6]


def test_boxes_of_rounded_corners_and_stacks_are_found():
    """As of meshes, whose coordinates are float32; objects of other names may touch."""
    size = (0.9, 0.8, 0.7)
    stack = [turned((0.1, 0.2, 0.7 * k), size, 0.3 * k, name=f"Cube {k}") for k in range(3)]
    rounded = [
        Quad(*(tuple(map(float, np.float32(part))) for part in (q.corner, q.edge_u, q.edge_v)),
             name=q.name)
        for cube in stack for q in cube
    ]  # fmt: skip
    solid = plan_of([FLOOR, *rounded]).shapes.solid[1:].reshape(3, 6)
    assert (solid == solid[:, :1]).all() and NO_SOLID not in solid
    assert all(a[0] != b[0] for a, b in pairwise(solid))


def light_of(rng):
    where, power = tuple(rng.uniform((-3, -3, 1), (3, 3, 6))), (1.0, 1.0, 1.0)
    u, v, _ = 10.0 ** rng.uniform(-1.0, 0.3) * np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return [
        QuadLight(where, tuple(u), tuple(v), power),
        SphereLight(where, float(10.0 ** rng.uniform(-1.5, 0.0)), power),
        DiskLight(where, float(10.0 ** rng.uniform(-1.5, 0.0)), power),
        PointLight(where, power),
    ][rng.integers(4)]


def hits_of(plan):
    """What the centres of pixels see."""
    y, x = (part.ravel() + 0.5 for part in np.mgrid[:SIZE, :SIZE])
    w = plan.lens.directions(x, y)
    far = np.array([intersect_pairs(plan, w, np.full(x.size, k)) for k in range(plan.object_count)])
    item = far.argmin(axis=0)
    seen = np.isfinite(far.min(axis=0))
    return surface(plan, w[:, seen], far.min(axis=0)[seen], item[seen])


@pytest.mark.parametrize("seed", range(60))
def test_the_light_is_the_same_without_the_faces_behind(seed, monkeypatch):
    """Cameras and points in boxes, boxes in each other and through the floor, lights in boxes."""
    rng = np.random.default_rng(seed)
    way = Motion(tuple(rng.normal(scale=0.3, size=3))) if rng.random() < 0.4 else None
    shapes = [FLOOR, *some_box(rng, "One", way), *some_box(rng, "Two")]
    if rng.random() < 0.2:
        shapes += box((-8, -8, -1), (16, 0, 0), (0, 16, 0), (0, 0, 10), name="Room")
    place = rng.normal(size=3) * 3.0
    place[2] = abs(place[2]) + 0.1
    camera = look_at(tuple(place), (0.0, 0.0, 0.2), resolution=(SIZE, SIZE))
    plan = plan_of(shapes, light_of(rng), camera)
    hits, time = hits_of(plan), float(rng.uniform(-0.5, 0.5))
    if way is not None:
        # points of what moves move with it
        moved = quads_of(plan).corners_at(hits.item, time) - quads_of(plan).corner[:, hits.item]
        hits = replace(hits, point=hits.point + moved)
    reach = 10.0 ** rng.uniform(-3.0, -0.5, hits.item.size)
    shape = plan.as_shadow_caster(plan.lights[0])
    few = Occluders(plan).find_candidates(shape, hits, reach)
    with monkeypatch.context() as patch:
        patch.setattr(FacePlanes, "without_redundant_faces", lambda self, sight, pairs: pairs)
        every = Occluders(plan).find_candidates(shape, hits, reach)
    one, other = (shade_with_candidates(plan, hits, time, [pairs])[0] for pairs in (few, every))
    print(f"seed {seed}: {few.item.size} of {every.item.size} pairs")
    np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9 * (other.max() or 1.0))


def test_half_the_faces_and_more_are_left_out(monkeypatch):
    plan = plan_of([FLOOR, *turned((-0.5, -0.5, 0.0), (1.0, 1.0, 1.0), 0.3, name="Cube")])
    hits = hits_of(plan)
    few = Occluders(plan).find_candidates(plan.lights[0], hits)
    monkeypatch.setattr(FacePlanes, "without_redundant_faces", lambda self, sight, pairs: pairs)
    every = Occluders(plan).find_candidates(plan.lights[0], hits)
    print(f"{few.item.size} of {every.item.size} pairs")
    assert few.item.size < 0.5 * every.item.size


def test_faces_that_hide_different_lights_are_no_box():
    """A face seen from behind hides a light that the faces before it let through: a pixel behind
    such a box was twice too bright."""
    rng = np.random.default_rng(8)
    faces = [replace(face, name=f"Plane {k}") for k, face in enumerate(some_box(rng))]
    passing = Visibility(passed_by=frozenset({"Lamp"}))
    for changed in (passing, Visibility(shadow=False), Visibility(camera=False)):
        mixed = [replace(faces[0], visibility=changed), *faces[1:]]
        assert (plan_of(mixed).shapes.solid == NO_SOLID).all()
        alike = [replace(face, visibility=changed) for face in faces]
        assert (plan_of(alike).shapes.solid != NO_SOLID).all()
