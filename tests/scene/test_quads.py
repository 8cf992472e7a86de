# SPDX-License-Identifier: GPL-3.0-or-later
"""Parallelograms of one object as arrays: the same as a record for each of them."""

import pickle
from dataclasses import replace

import numpy as np

import shape_sets
from adaptive_drt.scene.description import (
    Camera,
    Material,
    Motion,
    Quad,
    Quads,
    Scene,
    Sphere,
    single_shapes,
    validate,
)
from adaptive_drt.scene.planar_facets import MAX_PARALLELOGRAMS, TOO_MANY
from adaptive_drt.scene.primitive_recognition import Facets, recognise_primitive
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan

RED, BLUE = Material((0.8, 0.1, 0.1)), Material((0.1, 0.1, 0.8))


def quads_of(count, seed=0, **fields):
    corner, u, v = np.random.default_rng(seed).normal(size=(3, 3, count))
    return Quads(corner, u, v, np.arange(count) % 2, (RED, BLUE), **fields)


def plans_of(*shapes):
    """The plans of a scene with records of many and of the same with records of one."""
    scene = Scene(Camera(), shapes)
    singles = replace(scene, shapes=single_shapes(shapes))
    return [
        (checked, make_plan(checked, Settings())) for checked in map(validate, (scene, singles))
    ]


def assert_same(many, single):
    for name in ("corner", "edge_u", "edge_v", "displacement", "boxes"):
        ours, theirs = (getattr(shape_sets.quads_of(plan), name) for plan in (many, single))
        np.testing.assert_array_equal(ours, theirs)
    for name in ("albedo", "is_moving"):
        np.testing.assert_array_equal(getattr(many, name), getattr(single, name))
    np.testing.assert_array_equal(
        shape_sets.spheres_of(many).center, shape_sets.spheres_of(single).center
    )
    assert many.skipped == single.skipped


def test_many_compile_as_singles_do():
    ball, plate = Sphere((0.0, 0.0, -5.0), 1.0), Quad((0.0,) * 3, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    moving = quads_of(5, 1, motion=Motion((0.0, 1.0, 0.0)), name="Moving")
    (_, many), (_, single) = plans_of(quads_of(7), ball, plate, moving)
    assert_same(many, single)
    assert shape_sets.quads_of(many).count == 13 and many.is_moving.sum() == 5


def test_duplicates_are_left_out_one_by_one():
    quads = quads_of(6)
    again = quads.take(np.array([4, 1]))
    other = replace(quads.take(np.array([2])), motion=Motion((0.0, 0.0, 0.0)))
    alone, ball = next(quads.take(np.array([3])).records()), Sphere((0.0, 0.0, -5.0), 1.0)
    mixed = quads_of(3, 2)
    pairs = zip(mixed.numbers().reshape(3, 3, 3), quads.numbers().reshape(3, 3, 6), strict=True)
    corner, u, v = (np.concatenate([a, b[:, :2]], axis=1) for a, b in pairs)
    mixed = replace(mixed, corner=corner, edge_u=u, edge_v=v, slot=np.zeros(5, dtype=np.int64))
    (_, many), (_, single) = plans_of(quads, ball, again, ball, alone, other, mixed)
    assert_same(many, single)
    reasons = [one for one in many.skipped if "very same place" in one["why"]]
    assert len(reasons) == 2 + 1 + 1 + 2 and shape_sets.quads_of(many).count == 6 + 1 + 3


def test_the_sign_of_zero_makes_no_other_place():
    quad = Quad((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    plan = make_plan(Scene(Camera(), (quad, replace(quad, corner=(-0.0, 0.0, -0.0)))), Settings())
    assert shape_sets.quads_of(plan).count == 1


def test_what_cannot_be_rendered_is_said_of_each():
    quads = quads_of(6, name="Mesh")
    bad = quads.corner.copy()
    bad[1, 4] = np.nan
    flat, tiny = quads.edge_v.copy(), quads.edge_u.copy()
    flat[:, 2], tiny[:, 0] = 2.0 * quads.edge_u[:, 2], 1e-70
    narrow = replace(quads, corner=bad, edge_u=tiny, edge_v=flat)
    (many_scene, many), (single_scene, single) = plans_of(narrow)
    assert many_scene.issues == single_scene.issues and len(many_scene.issues) == 3
    assert_same(many, single)
    dark = replace(quads, materials=(RED, Material((np.nan, 0.0, 0.0))))
    lost = replace(quads, motion=Motion((np.inf, 0.0, 0.0)))
    (many_scene, many), (single_scene, single) = plans_of(dark, lost)
    assert many_scene.issues == single_scene.issues and len(many_scene.issues) == 3 + 6
    assert_same(many, single)
    assert len(many_scene.shapes) == 1


def test_records_of_many_are_values():
    quads, same = quads_of(4), quads_of(4)
    assert quads == same and hash(quads) == hash(same) and repr(quads) == repr(same)
    assert pickle.loads(pickle.dumps(quads)) == quads
    for other in (
        replace(quads, corner=np.nextafter(quads.corner, 9.0)), replace(quads, name="Other"),
        replace(quads, materials=(BLUE, RED)), quads.take(np.arange(3)), quads_of(4, 1),
    ):  # fmt: skip
        assert other != quads and repr(other) != repr(quads)
    assert validate(Scene(Camera(), (quads,))).shapes[0] is quads


def squares(count):
    """Separate squares, each in a plane of its own."""
    k = np.arange(count)
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]).T
    points = np.stack([2.0 * k, np.zeros(count), k % 7])[:, :, None] + square[:, None]
    return points.reshape(3, -1), np.arange(4 * count), np.arange(0, 4 * count, 4)


def test_a_mesh_becomes_arrays_in_the_order_of_its_faces():
    points, corners, starts = squares(50)
    # two triangles that make one square, between the others
    corners = np.concatenate([corners[:40], corners[[40, 41, 42, 40, 42, 43]], corners[44:]])
    starts = np.concatenate([starts[:10], [40, 43], starts[11:] + 2])
    slots = np.arange(starts.size) // 2 % 3
    found = recognise_primitive(points, corners, starts, slots)
    assert isinstance(found, Facets) and not found.triangles.slot.size
    first = np.concatenate([np.arange(11), np.arange(12, 51)])
    flat = found.parallelograms
    np.testing.assert_array_equal(flat.slot, slots[first])
    np.testing.assert_array_equal(flat.corner[0], 2.0 * np.arange(50))
    np.testing.assert_array_equal(np.cross(flat.edge_u, flat.edge_v, axis=0)[2], np.ones(50))


def test_a_mesh_of_too_many_parts_says_so():
    points, corners, starts = squares(MAX_PARALLELOGRAMS + 1)
    none = np.zeros(starts.size, dtype=np.int64)
    assert recognise_primitive(points, corners, starts, none) == TOO_MANY
    most = recognise_primitive(points[:, :-4], corners[:-4], starts[:-1], none[:-1])
    assert most.slot.size == MAX_PARALLELOGRAMS


def test_records_of_whole_numbers_compile_to_floats():
    whole = Quad((0, 0, -5), (1, 0, 0), (0, 1, 0))
    for shapes in ((whole,), (whole, replace(whole, corner=(0, 2, -5)))):
        plan = make_plan(Scene(Camera(), shapes), Settings())
        found = shape_sets.quads_of(plan)
        assert found.corner.dtype == found.edge_u.dtype == found.edge_v.dtype == np.float64
