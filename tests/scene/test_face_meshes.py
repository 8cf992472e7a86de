# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that stand for flat faces are the same surfaces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from adaptive_drt.scene.description import (
    Material,
    Motion,
    Quad,
    Quads,
    Sphere,
    Triangle,
    Triangles,
    Visibility,
)
from adaptive_drt.scene.face_meshes import MOST_GROUPS, faces_as_meshes, flat_faces
from adaptive_drt.scene.triangle_mesh import TriangleMesh

RED, BLUE = Material((0.8, 0.1, 0.1)), Material((0.1, 0.1, 0.8))
MOVING = Motion((0.1, 0.0, 0.0))


def some_quads(rng, count, **rest):
    corner, u, v = rng.uniform(-1.0, 1.0, (3, 3, count))
    return Quads(corner, u, v, np.arange(count) % 2, (RED, BLUE), **rest)


def areas(mesh):
    u, v = mesh.edges()
    return 0.5 * np.linalg.norm(np.cross(u, v, axis=0), axis=0)


def test_a_mesh_has_the_faces_of_all_records_and_their_materials():
    seed = int(np.random.SeedSequence().entropy) % 2**32
    print("seed", seed)
    rng = np.random.default_rng(seed)
    quads = some_quads(rng, 7)
    triangles = Triangles(rng.uniform(-1.0, 1.0, (3, 3, 5)), np.zeros(5, dtype=int), (BLUE,))
    single = Triangle(((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), RED)
    ball = Sphere((0.0, 0.0, 0.0), 1.0)
    kept, mesh = faces_as_meshes((quads, ball, triangles, single))
    assert kept is ball and isinstance(mesh, TriangleMesh)
    assert flat_faces((quads, ball, triangles, single)) == 13
    assert mesh.faces.shape == (3, 2 * 7 + 5 + 1)
    whole = np.linalg.norm(np.cross(quads.edge_u, quads.edge_v, axis=0), axis=0)
    red = np.array([mesh.materials[each] == RED for each in mesh.face_slot])
    np.testing.assert_allclose(areas(mesh)[red].sum(), whole[quads.slot == 0].sum() + 0.5)


def test_corners_at_common_edges_are_one():
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    x, y, z = turn * 0.37
    place = np.array([0.1, 0.7, -0.3])
    sides = [
        (place, y, x),
        (place + z, x, y),
        (place, x, z),
        (place + y, z, x),
        (place, z, y),
        (place + x, y, z),
    ]
    corner, u, v = (np.array(each).T for each in zip(*sides, strict=True))
    box = Quads(corner, u, v, np.zeros(6, dtype=int), (RED,))
    (mesh,) = faces_as_meshes((box,))
    assert mesh.vertices.shape == (3, 8)
    np.testing.assert_allclose(areas(mesh).sum(), 6 * 0.37**2)


def test_what_shines_and_what_is_large_stays():
    rng = np.random.default_rng(1)
    lamp = Quad((0, 0, 2), (0.1, 0, 0), (0, 0.1, 0), Material((0, 0, 0), (1.0, 1.0, 1.0)))
    floor = Quad((-50, -50, 0), (100, 0, 0), (0, 100, 0), BLUE)
    quads = some_quads(rng, 9)
    made = faces_as_meshes((lamp, floor, quads))
    assert made[:2] == (lamp, floor) and len(made) == 3
    assert flat_faces((lamp, floor, quads)) == 9


def test_what_moves_or_is_seen_otherwise_is_a_mesh_of_its_own():
    rng = np.random.default_rng(2)
    still, moving = some_quads(rng, 4), some_quads(rng, 3, motion=MOVING)
    unseen = some_quads(rng, 2, visibility=Visibility(camera=False))
    made = faces_as_meshes((still, moving, unseen))
    assert [each.faces.shape[1] for each in made] == [8, 6, 4]
    assert [each.motion for each in made] == [None, MOVING, None]
    assert not made[2].visibility.camera


def test_faces_that_all_move_otherwise_stay():
    rng = np.random.default_rng(4)
    one = some_quads(rng, 2)
    many = [replace(one, motion=Motion((0.1 * k, 0.0, 0.0))) for k in range(MOST_GROUPS + 1)]
    assert faces_as_meshes(many) == tuple(many)
    assert flat_faces(many) == 0


def test_a_scene_without_faces_is_unchanged():
    ball = Sphere((0.0, 0.0, 0.0), 1.0)
    assert faces_as_meshes((ball,)) == (ball,)
    assert flat_faces(()) == 0
