# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that are spheres, and those that are not; modifiers and Edit Mode."""

from __future__ import annotations

import collections
import math

import bmesh
import bpy
import numpy as np
import pytest
import things


@pytest.mark.parametrize("size", [(3, 3), (4, 3), (5, 4), (7, 9), (32, 16), (64, 64)])
@pytest.mark.parametrize("smooth", [False, True])
def test_uv_sphere(export, size, smooth):
    bpy.context.scene.adaptive_drt.spheres = "SPHERES"
    ball = things.uv_sphere(segments=size[0], rings=size[1], radius=1.5)
    ball.data.shade_smooth() if smooth else ball.data.shade_flat()
    ball.location = (1.0, 2.0, -3.0)
    scene = export()
    (sphere,) = scene.shapes
    assert sphere.center == pytest.approx((1.0, 2.0, -3.0), abs=1e-6)
    assert sphere.radius == pytest.approx(1.5, rel=1e-6)
    assert sphere.name == "Sphere" and sphere.motion is None
    assert not any(issue.missing for issue in scene.issues)


@pytest.mark.parametrize("level", [1, 2, 3, 4, 5, 6])
def test_icosphere(export, level):
    things.ico_sphere(subdivisions=level, radius=0.25)
    (sphere,) = export().shapes
    assert sphere.center == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
    assert sphere.radius == pytest.approx(0.25, rel=1e-5)  # its constants have six digits


@pytest.mark.parametrize("operator", ["uv", "ico"])
def test_spheres_of_the_add_menu(export, operator):
    add = {
        "uv": bpy.ops.mesh.primitive_uv_sphere_add,
        "ico": bpy.ops.mesh.primitive_ico_sphere_add,
    }[operator]
    bpy.context.scene.adaptive_drt.spheres = "SPHERES"
    add(radius=2.0, location=(1.0, 0.0, 0.0), rotation=(0.3, 0.2, 0.1))
    (sphere,) = export().shapes
    assert sphere.radius == pytest.approx(2.0, rel=1e-6)


def test_sphere_moved_within_its_mesh(export):
    ball = things.uv_sphere(radius=0.5)
    for vertex in ball.data.vertices:
        vertex.co.x += 100.0
    (sphere,) = export().shapes
    assert sphere.center == pytest.approx((100.0, 0.0, 0.0), abs=1e-4)
    assert sphere.radius == pytest.approx(0.5, rel=1e-4)


def test_loose_vertices_do_not_matter(export):
    ball = things.uv_sphere()
    ball.data.vertices.add(1)
    ball.data.vertices[-1].co = (9.0, 9.0, 9.0)
    assert len(export().shapes) == 1


def test_scale_turn_mirror_and_parents(export):
    parent = things.link(bpy.data.objects.new("Parent", None))
    parent.location, parent.scale = (0.0, 0.0, 5.0), (2.0, 2.0, 2.0)
    ball = things.uv_sphere()
    ball.parent = parent
    ball.location, ball.scale = (1.0, 0.0, 0.0), (-0.5, 0.5, 0.5)
    ball.rotation_euler = (0.5, 0.4, 0.3)
    (sphere,) = export().shapes
    assert sphere.center == pytest.approx((2.0, 0.0, 5.0), abs=1e-6)
    assert sphere.radius == pytest.approx(1.0, rel=1e-6)


NO_AXIS = "its scale is zero along one axis, which makes no sphere: scale all axes alike"


@pytest.mark.parametrize(
    "scale, said",
    [
        ((0.0, 0.0, 0.0), "its scale is zero"),
        ((0.0, 1.0, 0.0), "its scale is zero"),
        ((1.0, 1.0, 0.0), NO_AXIS),
        ((1.0, 0.0, 1.0), NO_AXIS),
        ((3.0, 1.0, 1e-9), NO_AXIS),
    ],
)
@pytest.mark.parametrize("inherited", [False, True])
def test_scales_that_leave_no_sphere(export, scale, said, inherited):
    ball = things.uv_sphere()
    if inherited:
        ball.parent = things.link(bpy.data.objects.new("Parent", None))
        ball.parent.scale = scale
    else:
        ball.scale = scale
    scene = export()
    assert scene.shapes == ()
    assert things.reasons(scene)["Sphere"] == [said] and scene.issues[0].missing


def test_flattened_by_parents(export):
    parent = things.link(bpy.data.objects.new("Parent", None))
    parent.scale = (1.0, 1.0, 0.0)
    ball = things.uv_sphere()
    ball.parent, ball.rotation_euler = parent, (0.7, 0.0, 0.3)
    assert things.reasons(export())["Sphere"] == [NO_AXIS]


def _half_axes(shape):
    return np.array([shape.half_u, shape.half_v, shape.half_w]).T


@pytest.mark.parametrize("scale", [(1.0, 1.0, 2.0), (2.0, 3.0, -1.0)])
def test_a_stretched_sphere_is_an_ellipsoid(export, scale):
    ball = things.uv_sphere()
    ball.scale = scale
    other = things.link(bpy.data.objects.new("Round", ball.data))
    scene = export()
    kinds = {shape.name: type(shape).__name__ for shape in scene.shapes}
    assert kinds == {"Sphere": "Ellipsoid", "Round": "Sphere"} and scene.issues == ()
    (found,) = (shape for shape in scene.shapes if shape.name == "Sphere")
    np.testing.assert_allclose(_half_axes(found), np.diag(scale), atol=1e-5)
    assert other.data == ball.data


@pytest.mark.parametrize("why", ["shines", "turns"])
def test_a_stretched_sphere_stays_a_mesh(export, why):
    """Where it shines, and where it turns."""
    ball = things.uv_sphere()
    ball.scale = (1.0, 1.0, 2.0)
    if why == "shines":
        glow = things.material("Glow", "ShaderNodeEmission", Strength=1.0)
        ball.data.materials.append(glow)
    else:
        things.keyed(ball, "rotation_euler", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
        bpy.context.scene.render.use_motion_blur = True
        bpy.context.scene.frame_set(6)
    assert "Ellipsoid" not in {type(shape).__name__ for shape in export().shapes}


def test_the_normals_of_a_stretched_sphere_are_those_of_the_ellipsoid(export):
    ball, scale = things.uv_sphere(), (1.0, 1.0, 2.0)
    ball.scale = scale
    ball.data.materials.append(things.material("Glow", "ShaderNodeEmission", Strength=1.0))
    (mesh,) = export().shapes
    np.testing.assert_allclose(np.abs(mesh.vertices).max(axis=1), np.abs(scale), rtol=1e-2)
    at = mesh.vertices[:, mesh.faces].transpose(1, 0, 2) / np.square(scale)[None, :, None]
    at /= np.linalg.norm(at, axis=1, keepdims=True)
    assert (at * mesh.normals).sum(axis=1).min() > 0.99


def test_sheared_by_parents(export):
    parent = things.link(bpy.data.objects.new("Parent", None))
    parent.scale = (1.0, 3.0, 1.0)
    ball = things.uv_sphere()
    ball.parent, ball.rotation_euler = parent, (0.0, 0.0, 0.7)
    scene = export()
    assert [type(shape).__name__ for shape in scene.shapes] == ["Ellipsoid"]
    turn = np.array([[np.cos(0.7), -np.sin(0.7), 0.0], [np.sin(0.7), np.cos(0.7), 0.0], [0, 0, 1]])
    want = np.diag([1.0, 3.0, 1.0]) @ turn
    np.testing.assert_allclose(_half_axes(scene.shapes[0]), want, atol=1e-5)
    assert scene.issues == ()


def test_not_a_number(export):
    things.uv_sphere().location.x = math.nan
    scene = export()
    assert scene.shapes == () and "not finite" in things.reasons(scene)["Sphere"][0]


def _cylinder(work):
    bmesh.ops.create_cone(
        work, segments=32, radius1=1.0, radius2=1.0, depth=2.0, cap_ends=True, cap_tris=True
    )


def _cone(work):
    bmesh.ops.create_cone(
        work, segments=32, radius1=1.0, radius2=0.0, depth=2.0, cap_ends=True, cap_tris=True
    )


def _tetrahedron(work):
    corners = [work.verts.new(c) for c in ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))]
    for skipped in range(4):
        work.faces.new([c for i, c in enumerate(corners) if i != skipped])


def _cut(make, cap):
    def cut(work):
        make(work)
        lowest = min(work.verts, key=lambda v: v.co.z)
        rim = [e for f in lowest.link_faces for e in f.edges if lowest not in e.verts]
        bmesh.ops.delete(work, geom=[lowest], context="VERTS")
        if cap:
            bmesh.ops.contextual_create(work, geom=[e for e in rim if e.is_valid])

    return cut


def _uv(work):
    bmesh.ops.create_uvsphere(work, u_segments=32, v_segments=16, radius=1.0)


def _ico(work):
    bmesh.ops.create_icosphere(work, subdivisions=3, radius=1.0)


def _hemisphere(work):
    _uv(work)
    below = [v for v in work.verts if v.co.z < -1e-4]
    bmesh.ops.delete(work, geom=below, context="VERTS")


def _hole(work):
    _uv(work)
    work.faces.ensure_lookup_table()
    bmesh.ops.delete(work, geom=[work.faces[40]], context="FACES")


def _dented(work):
    _ico(work)
    work.verts.ensure_lookup_table()
    work.verts[17].co *= 0.99


def _slid(work):
    """A ring moved along the sphere: every vertex is still on it."""
    _uv(work)
    for vertex in work.verts:
        if abs(vertex.co.z) < 1e-4:
            vertex.co.z = 0.15
            vertex.co.xy = vertex.co.xy.normalized() * math.sqrt(1.0 - 0.15**2)


def _two(work):
    _uv(work)
    bmesh.ops.create_uvsphere(work, u_segments=8, v_segments=4, radius=1.0)


def _subdivided(work):
    bmesh.ops.create_uvsphere(work, u_segments=20, v_segments=11, radius=1.0)
    bmesh.ops.subdivide_edges(work, edges=work.edges[:], cuts=1, use_grid_fill=True)


NO_SPHERES = {
    "cylinder": _cylinder,
    "cone": _cone,
    "tetrahedron": _tetrahedron,
    "uv sphere cut open": _cut(_uv, False),
    "uv sphere cut and capped": _cut(_uv, True),
    "icosphere cut open": _cut(_ico, False),
    "icosphere cut and capped": _cut(_ico, True),
    "hemisphere": _hemisphere,
    "hole": _hole,
    "dented": _dented,
    "ring slid": _slid,
    "two in one mesh": _two,
    "faceted by subdivision": _subdivided,
}


def area_of(shapes):
    """Total area of quads, triangles and meshes."""
    area = 0.0
    for shape in shapes:
        if type(shape).__name__ == "TriangleMesh":
            u, v = shape.edges()
            area += np.linalg.norm(np.cross(u, v, axis=0), axis=0).sum() / 2.0
            continue
        if type(shape).__name__ == "Triangle":
            a, b, c = map(np.array, shape.vertices)
            area += np.linalg.norm(np.cross(b - a, c - a)) / 2.0
        else:
            area += np.linalg.norm(np.cross(shape.edge_u, shape.edge_v))
    return area


def area_of_mesh(mesh):
    mesh.calc_loop_triangles()
    return sum(triangle.area for triangle in mesh.loop_triangles)


@pytest.mark.parametrize("kind", NO_SPHERES)
def test_no_sphere(export, kind):
    """It is rendered as the triangles, and parallelograms, that it is made of, or as a mesh."""
    thing = things.made("Thing", NO_SPHERES[kind])
    scene = export()
    assert area_of(scene.shapes) == pytest.approx(area_of_mesh(thing.data), rel=1e-6)
    assert not any(issue.missing for issue in scene.issues)
    assert {"Triangle", "TriangleMesh"} & {type(shape).__name__ for shape in scene.shapes}


def test_torus(export):
    bpy.ops.mesh.primitive_torus_add()
    scene = export()
    (mesh,) = scene.shapes
    assert mesh.faces.shape == (3, 2 * 48 * 12) and mesh.normals is None and scene.issues == ()
    bpy.context.object.data.shade_smooth()
    scene = export()
    (mesh,) = scene.shapes
    assert scene.issues == () and mesh.faces.shape == (3, 2 * 48 * 12)
    outwards = mesh.vertices[:, mesh.faces].transpose(1, 0, 2) * mesh.normals
    assert outwards[:, 2].min() > -1e-6  # normals of a torus point away from its middle plane


def test_a_mesh_of_many_triangles_is_rendered_as_it_is(export):
    bpy.ops.mesh.primitive_torus_add(major_segments=96)
    scene = export()
    (mesh,) = scene.shapes
    assert scene.issues == () and mesh.faces.shape == (3, 2 * 96 * 12) and mesh.normals is None
    assert mesh.vertices.shape == (3, 96 * 12)


def test_meshes_are_placed_turned_and_mirrored(export):
    bpy.ops.mesh.primitive_monkey_add()
    head = bpy.context.object
    head.data.shade_smooth()
    (before,) = export().shapes
    head.location, head.scale = (1.0, 2.0, 3.0), (2.0, -2.0, 2.0)
    (mesh,) = export().shapes
    place = before.vertices * np.array([[2.0], [-2.0], [2.0]]) + np.array([[1.0], [2.0], [3.0]])
    np.testing.assert_allclose(mesh.vertices, place, atol=1e-6)
    # faces are turned over with the mirror, and normals still point out of them
    outwards = []
    for each in (before, mesh):
        a, b, c = (each.vertices[:, corner] for corner in each.faces)
        facing = (np.cross(b - a, c - a, axis=0) * each.normals).sum(axis=1) > 0.0
        outwards.append(facing.all(axis=0))
    assert outwards[0].mean() > 0.8
    np.testing.assert_array_equal(*outwards)
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-6)


def _heads(count):
    """So many objects of one mesh, side by side."""
    bpy.ops.mesh.primitive_monkey_add()
    first = bpy.context.object
    for number in range(1, count):
        other = things.link(bpy.data.objects.new(f"Head {number}", first.data))
        other.location.x = 3.0 * number
    return first


def test_many_copies_of_a_mesh_share_it(export):
    first = _heads(20)
    (record,) = export().shapes
    assert record.matrices.shape == (1, 3, 4, 20) and record.mesh.faces.shape[1] == 968
    np.testing.assert_allclose(np.sort(record.matrices[0, 0, 3]), 3.0 * np.arange(20), atol=1e-6)
    # what is worn, seen or flat otherwise is apart
    red = things.material("Red", "ShaderNodeBsdfDiffuse", Color=(1.0, 0.0, 0.0, 1.0))
    first.data.materials.append(None)
    other, unseen, flat = (bpy.data.objects[f"Head {number}"] for number in (1, 2, 3))
    other.material_slots[0].link = "OBJECT"
    other.material_slots[0].material = red
    unseen.visible_camera = False
    flat.scale.z = 0.0
    shapes = export().shapes
    kinds = collections.Counter(type(shape).__name__ for shape in shapes)
    assert kinds == {"MeshInstances": 1, "TriangleMesh": 3}
    (record,) = (shape for shape in shapes if type(shape).__name__ == "MeshInstances")
    assert record.matrices.shape[3] == 17
    first.data.vertices[0].co.x = math.nan
    assert export().shapes == ()


def test_few_copies_of_a_mesh_are_meshes_of_their_own(export):
    _heads(5)
    shapes = export().shapes
    assert [type(shape).__name__ for shape in shapes] == ["TriangleMesh"] * 5


def test_texture_coordinates_are_those_of_the_map_that_is_rendered(export):
    bpy.ops.mesh.primitive_torus_add()
    torus = bpy.context.object
    second = torus.data.uv_layers.new(name="Second")
    for each in second.data:
        each.uv = (0.25, 0.75)
    second.active_render = True
    (mesh,) = export().shapes
    assert mesh.uv.shape == (2, 3, mesh.faces.shape[1])
    np.testing.assert_array_equal(mesh.uv[0], 0.25)
    torus.data.uv_layers[0].active_render = True
    torus.scale.x = -1.0
    (mirrored,) = export().shapes
    torus.scale.x = 1.0
    (mesh,) = export().shapes
    # a corner keeps its coordinates where the mirror turns its face over
    np.testing.assert_array_equal(mirrored.uv, mesh.uv[:, ::-1])
    np.testing.assert_array_equal(mirrored.faces, mesh.faces[::-1])
    assert mesh.uv.min() >= 0.0 and mesh.uv.max() == 1.0


def test_materials_of_a_mesh_and_vertices_that_are_no_numbers(export):
    bpy.ops.mesh.primitive_monkey_add()
    head = bpy.context.object
    head.modifiers.new("Smooth", "SUBSURF").levels = 2
    for name, color in (("Red", (1.0, 0.0, 0.0, 1.0)), ("Blue", (0.0, 0.0, 1.0, 1.0))):
        head.data.materials.append(things.material(name, Base_Color=color))
    for face in head.data.polygons:
        face.material_index = int(face.center.x > 0.0)
    (mesh,) = {shape.name: shape for shape in export().shapes}.values()
    shapes = export().shapes
    assert sorted(shape.materials[shape.slot[0]].color[0] for shape in shapes) == [0.0, 1.0]
    assert sum(shape.faces.shape[1] for shape in shapes) > 10_000 and mesh.name == "Suzanne"
    head.modifiers.clear()
    head.data.shade_smooth()
    head.data.vertices[7].co.x = math.nan
    scene = export()
    assert scene.shapes == () and "finite" in things.reasons(scene)["Suzanne"][0]


def test_modifiers_are_heeded(export):
    ball = things.uv_sphere()
    ball.data.shade_flat()
    ball.modifiers.new("Triangulate", "TRIANGULATE")
    bpy.context.scene.adaptive_drt.spheres = "FACES"
    (mesh,) = export().shapes
    assert mesh.faces.shape == (3, 2 * 32 * 15)
    ball.modifiers.new("Again", "SUBSURF").subdivision_type = "SIMPLE"
    (mesh,) = export().shapes
    assert mesh.faces.shape[1] > 8 * 32 * 15


def test_n_gons_and_slivers(export):
    """Faces are cut as Blender draws them; what has no area is dropped."""
    outline = [(0, 0), (4, 0), (4, 1), (1, 1), (1, 3), (4, 3), (4, 4), (0, 4)]
    points = [(x, y, 0.0) for x, y in outline] + [(0, 0, 1), (1, 0, 1), (2, 0, 1)]
    thing = things.mesh_object("Bracket", points, [tuple(range(8)), (8, 9, 10), (0, 1, 8)])
    scene = export()
    assert len(scene.shapes) == 6 + 1 and scene.issues == ()
    assert area_of(scene.shapes) == pytest.approx(10.0 + 2.0, rel=1e-6)
    thing.scale = (1.0, 1.0, 0.0)
    assert area_of(export().shapes) == pytest.approx(10.0, rel=1e-6)


def test_triangles_share_their_points(export):
    """What is placed far away and turned has no gaps either."""
    bpy.ops.mesh.primitive_torus_add(major_segments=4, minor_segments=3)
    torus = bpy.context.object
    for vertex in torus.data.vertices:  # no face stays flat
        vertex.co *= 1.0 + 0.1 * math.sin(7.0 * vertex.index)
    torus.location, torus.rotation_euler = (1234.5, -987.6, 55.5), (0.3, 0.4, 0.5)
    edges = collections.Counter()
    for shape in export().shapes:
        a, b, c = shape.vertices
        edges.update([(a, b), (b, c), (c, a)])
    assert len(edges) == 3 * 24 and set(edges.values()) == {1}
    assert all((b, a) in edges for a, b in edges)


def test_in_edit_mode(export):
    """What is being edited is rendered as it stands: the evaluated mesh has no faces then."""
    red = things.material("Red", "ShaderNodeBsdfDiffuse", Color=(1.0, 0.0, 0.0, 1.0))
    floor = things.plane(size=4.0)
    floor.data.materials.append(red)
    before = export().shapes
    bpy.context.view_layer.objects.active = floor
    bpy.ops.object.mode_set(mode="EDIT")
    try:
        scene = export()
        assert scene.shapes == before and scene.issues == ()
        work = bmesh.from_edit_mesh(floor.data)
        for vertex in work.verts:
            vertex.co.z += 3.0
        bmesh.update_edit_mesh(floor.data)
        (quad,) = export().shapes
        assert quad.corner[2] == 3.0 and quad.material == before[0].material
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")
    assert export().shapes == (quad,)
