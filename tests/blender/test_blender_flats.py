# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that are made of parallelograms: planes, cubes, rooms; and those that are not."""

from __future__ import annotations

import itertools
import math

import bmesh
import bpy
import numpy as np
import pytest
import things
from mathutils import Vector


def test_plane(export):
    floor = things.plane(size=2.0)
    floor.location, floor.scale = (1.0, 2.0, 3.0), (2.0, 3.0, 1.0)
    scene = export()
    (quad,) = scene.shapes
    corners = {
        tuple(round(quad.corner[i] + u * quad.edge_u[i] + v * quad.edge_v[i], 6) for i in range(3))
        for u in (0, 1)
        for v in (0, 1)
    }
    assert corners == {(-1, -1, 3), (3, -1, 3), (-1, 5, 3), (3, 5, 3)}
    assert scene.issues == ()


@pytest.mark.parametrize("change", ["grid", "triangles", "ngon", "sheared"])
def test_planes_of_other_makes(export, change):
    square = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    if change == "grid":
        things.plane(segments=7)
    elif change == "triangles":
        things.mesh_object("Plane", square, [(0, 1, 2), (0, 3, 2)])  # one faces down
    elif change == "ngon":
        things.mesh_object("Plane", [*square[:2], (1, 0, 0), *square[2:]], [(0, 1, 2, 3, 4)])
    else:
        things.mesh_object("Plane", [(0, 0, 0), (2, 0, 0), (3, 2, 0), (1, 2, 0)], [(0, 1, 2, 3)])
    scene = export()
    (quad,) = scene.shapes
    area = abs(quad.edge_u[0] * quad.edge_v[1] - quad.edge_u[1] * quad.edge_v[0])
    assert area == pytest.approx(4.0, rel=1e-6)


@pytest.mark.parametrize(
    "vertices, faces, count",
    [
        ([(0, 0, 0), (2, 0, 0), (1.5, 1, 0), (0, 1, 0)], [(0, 1, 2, 3)], 2),
        ([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)], 1),
        ([(0, 0, 0), (1, 0, 0), (1, 1, 0.2), (0, 1, 0)], [(0, 1, 2, 3)], 2),
        (
            [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 1.5, 0)],
            [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)],
            4,
        ),
    ],
)
def test_other_flat_faces_are_triangles(export, vertices, faces, count):
    things.mesh_object("Face", vertices, faces)
    scene = export()
    assert scene.issues == () and len(scene.shapes) == count
    assert {type(shape).__name__ for shape in scene.shapes} == {"Triangle"}


def test_no_area(export):
    corners = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0)]
    things.mesh_object("Face", corners, [(0, 1, 2, 3)])
    scene = export()
    assert scene.shapes == () and "no area" in things.reasons(scene)["Face"][0]


SIDES = (-1.0, 1.0)


def corners_of(quad):
    """The four corners of a shape, rounded, in any order."""
    q, u, v = (np.array(each) for each in (quad.corner, quad.edge_u, quad.edge_v))
    return frozenset(tuple(np.round(q + a * u + b * v, 5) + 0.0) for a in (0, 1) for b in (0, 1))


def sides_of_cube(turn=None, place=(0.0, 0.0, 0.0)):
    """The corners of each side of a cube of two metres, placed."""
    matrix = np.eye(3) if turn is None else np.array(turn)
    sides = set()
    for axis, side in itertools.product(range(3), SIDES):
        square = [np.insert(ends, axis, side) for ends in itertools.product(SIDES, SIDES)]
        sides.add(frozenset(tuple(np.round(matrix @ c + place, 5) + 0.0) for c in square))
    return sides


def _subdivide(work):
    bmesh.ops.subdivide_edges(work, edges=work.edges[:], cuts=3, use_grid_fill=True)


def _cut_at_random(work):
    """Edges cut unevenly, then triangles."""
    for count, edge in enumerate(work.edges[:]):
        bmesh.utils.edge_split(edge, edge.verts[0], 0.2 + 0.05 * count)
    bmesh.ops.triangulate(work, faces=work.faces[:])


CUTS = {
    "cube": lambda work: None,
    "triangles": lambda work: bmesh.ops.triangulate(work, faces=work.faces[:]),
    "subdivided": _subdivide,
    "cut at random": _cut_at_random,
}


def cube(cut="cube", name="Cube"):
    def make(work):
        bmesh.ops.create_cube(work, size=2.0)
        CUTS[cut](work)

    return things.made(name, make)


@pytest.mark.parametrize("cut", CUTS)
def test_cube(export, cut):
    """However it is cut up, and wherever it is: its six sides."""
    thing = cube(cut)
    thing.rotation_euler, thing.location = (0.4, -0.7, 1.9), (3.0, -2.0, 5.0)
    scene = export()
    turn = np.array(thing.matrix_world)[:3, :3]
    assert sides_of_cube(turn, (3.0, -2.0, 5.0)) == set(map(corners_of, scene.shapes))
    assert len(scene.shapes) == 6 and {q.name for q in scene.shapes} == {"Cube"}
    assert scene.issues == ()


def test_the_cube_of_the_add_menu(export):
    bpy.ops.mesh.primitive_cube_add(size=2.0)
    assert set(map(corners_of, export().shapes)) == sides_of_cube()


def test_two_planes_in_one_mesh(export):
    corners = [(x, y, 0) for a in (0, 3) for x, y in ((a, 0), (a + 1, 0), (a + 1, 1), (a, 1))]
    things.mesh_object("Planes", corners, [(0, 1, 2, 3), (4, 5, 6, 7)])
    scene = export()
    assert len(scene.shapes) == 2 and scene.issues == ()


def test_a_flat_part_of_another_outline_is_its_faces(export):
    """An L of three squares, as floors of buildings are."""
    corners = [(x, y, 0) for y in range(3) for x in range(3)]
    faces = [(a, a + 1, a + 4, a + 3) for a in (0, 1, 3)]
    things.mesh_object("L", corners, faces)
    scene = export()
    expected = {frozenset(tuple(map(float, corners[i])) for i in face) for face in faces}
    assert set(map(corners_of, scene.shapes)) == expected and scene.issues == ()


def test_each_side_wears_its_own_material(export):
    """Faces in one plane that wear different ones are parted."""
    room = cube("subdivided", "Room")
    for index in range(3):
        shade = things.material(
            f"Shade {index}", "ShaderNodeBsdfDiffuse", Color=(index / 4.0,) * 3 + (1.0,)
        )
        room.data.materials.append(shade)
    for face in room.data.polygons:
        if face.normal.z > 0.9:
            face.material_index = 1 if face.center.x > 0.0 else 2
    scene = export()
    found = sorted(
        (
            quad.material.color[0],
            round(float(np.linalg.norm(np.cross(quad.edge_u, quad.edge_v))), 5),
        )
        for quad in scene.shapes
    )
    assert found == [(0.0, 4.0)] * 5 + [(0.25, 2.0), (0.5, 2.0)]
    assert scene.issues == ()
    room.material_slots[1].link = "OBJECT"
    room.material_slots[1].material = bpy.data.materials["Shade 2"]
    assert {quad.material.color[0] for quad in export().shapes} == {0.0, 0.5}


def test_smooth_shading_makes_a_mesh(export):
    thing = cube()
    thing.data.shade_smooth()
    scene = export()
    (mesh,) = scene.shapes
    assert mesh.normals.shape == (3, 3, 12) and scene.issues == ()
    things.plane().data.shade_smooth()
    bpy.data.objects.remove(thing)
    assert export().issues == ()


def test_a_face_without_area_has_no_shading(export):
    """Its normal is whatever Blender takes."""
    corners = [(0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1), (0.5, 0, 1), (0.25, 0, 1)]
    things.mesh_object("Wall", corners, [(0, 1, 2, 3), (3, 5, 4)])
    scene = export()
    assert len(scene.shapes) == 1 and scene.issues == ()


def _bend(thing, height):
    """Let a plane's normals lean outwards as those of a dome do."""
    thing.data.shade_smooth()
    thing.data.normals_split_custom_set_from_vertices(
        [Vector((*vertex.co.xy, height)).normalized() for vertex in thing.data.vertices]
    )


@pytest.mark.parametrize("segments", [1, 3])
def test_custom_normals_of_a_plane_make_a_mesh(export, segments):
    thing = things.plane(segments=segments)
    _bend(thing, 1.0)
    scene = export()
    (mesh,) = scene.shapes
    assert scene.issues == () and mesh.normals.shape == (3, 3, 2 * segments**2)
    leaning = np.array([(*vertex.co.xy, 1.0) for vertex in thing.data.vertices])
    leaning /= np.linalg.norm(leaning, axis=1, keepdims=True)
    found = mesh.normals.transpose(0, 2, 1)
    np.testing.assert_allclose(found, leaning[mesh.faces], atol=1e-3)


def test_custom_normals_that_are_the_faces_own_are_not_told(export):
    _bend(things.plane(), 1e6)
    assert export().issues == ()


def test_a_cube_without_height_is_a_plane(export):
    thing = cube()
    thing.scale.z = 0.0
    scene = export()
    flat = frozenset((float(x), float(y), 0.0) for x in SIDES for y in SIDES)
    assert set(map(corners_of, scene.shapes)) == {flat} and scene.issues == ()
    thing.scale.x = 0.0
    assert "zero" in things.reasons(export())["Cube"][0]


def test_a_cube_moves_as_one(export):
    """Its sides stay joined; one that turns is a mesh."""
    scene = bpy.context.scene
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 1.0
    thing = cube()
    things.keyed(thing, "location", (0.0, 0.0, 0.0), (10.0, 0.0, 0.0))
    scene.frame_set(5)
    exported = export()
    assert len(exported.shapes) == 6
    assert {quad.motion.displacement for quad in exported.shapes} == {
        exported.shapes[0].motion.displacement
    }
    ends = [corner for quad in exported.shapes for corner in corners_of(quad)]
    assert len(set(ends)) == 8 and exported.issues == ()
    things.keyed(thing, "rotation_euler", (0.0, 0.0, 0.0), (0.0, 0.0, math.pi))
    scene.frame_set(5)
    exported = export()
    (mesh,) = exported.shapes
    assert exported.issues == () and mesh.mesh.faces.shape == (3, 12)
    np.testing.assert_allclose(np.diff(mesh.matrices[:, 0, 3, 0]), 0.5, atol=1e-5)


def test_a_wedge(export):
    """Its two ends are triangles of their own materials; its sides stay parallelograms."""
    corners = [(0, 0, 0), (1, 0, 0), (0, 0, 1), (0, 2, 0), (1, 2, 0), (0, 2, 1)]
    wedge = things.mesh_object(
        "Wedge", corners, [(0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)]
    )
    for name, color in (("Ends", (1.0, 0.0, 0.0, 1.0)), ("Sides", (0.0, 1.0, 0.0, 1.0))):
        wedge.data.materials.append(things.material(name, "ShaderNodeBsdfDiffuse", Color=color))
    for face in wedge.data.polygons:
        face.material_index = int(len(face.vertices) == 4)
    scene = export()
    assert scene.issues == ()
    found = [(type(shape).__name__, shape.material.color) for shape in scene.shapes]
    assert sorted(found) == 3 * [("Quad", (0.0, 1.0, 0.0))] + 2 * [("Triangle", (1.0, 0.0, 0.0))]


def _heap(work, count):
    """So many quads that stand apart."""
    for k in range(count):
        work.faces.new([work.verts.new((x + 2.0 * k, y, 0.0)) for x, y in PLAN])


PLAN = ((0, 0), (1, 0), (1, 1), (0, 1))


def test_more_flat_parts_than_are_rendered_as_such(export):
    things.made("Few", lambda work: _heap(work, 10_000))
    assert len(export().shapes) == 10_000
    things.made("Many", lambda work: _heap(work, 10_001))
    *_, mesh = export().shapes
    assert mesh.name == "Many" and mesh.faces.shape == (3, 2 * 10_001)
