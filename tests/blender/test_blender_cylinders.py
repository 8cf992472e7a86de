# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes in the form of a cylinder: which are rendered as cylinders, and what is told of them."""

from __future__ import annotations

import importlib
import itertools
import math

import bmesh
import bpy
import numpy as np
import pytest
import things


def tube(name="Bond", sides=32, fans=False, smooth=True, radius2=1.0):
    """A primitive as Blender's menu makes it, with smooth sides and flat ends."""
    thing = things.made(
        name,
        lambda b: bmesh.ops.create_cone(
            b, cap_ends=True, cap_tris=fans, segments=sides, radius1=1.0, radius2=radius2, depth=2.0
        ),
    )
    for face in thing.data.polygons:
        face.use_smooth = smooth and len(face.vertices) == 4
    things.light("POINT", energy=100.0).location = (0.0, 0.0, 9.0)
    return thing


@pytest.mark.parametrize("fans", [False, True])
@pytest.mark.parametrize("sides", [12, 32])
def test_smooth_primitives_are_cylinders(export, core, sides, fans):
    thing = tube(sides=sides, fans=fans)
    thing.scale, thing.rotation_euler, thing.location = (0.2, 0.2, 1.5), (0.4, 1.1, -0.3), (1, 2, 3)
    scene = export()
    (shape,) = scene.shapes
    assert isinstance(shape, core.Cylinder) and shape.radius == pytest.approx(0.2, rel=1e-5)
    bpy.context.view_layer.update()
    ends = [thing.matrix_world @ thing.data.vertices[0].co.__class__((0, 0, z)) for z in (-1, 1)]
    found = sorted([shape.start, shape.end])
    np.testing.assert_allclose(found, sorted(tuple(end) for end in ends), atol=1e-5)
    told = [issue for issue in scene.issues if "outline" in issue.reason]
    assert len(told) == (sides == 12)


@pytest.mark.parametrize("radius2", [0.3, 0.9, 2.0])
@pytest.mark.parametrize("fans", [False, True])
def test_smooth_rings_of_two_sizes_are_truncated_cones(export, core, fans, radius2):
    thing = tube(fans=fans, radius2=radius2)
    thing.scale = (0.5, 0.5, 1.5)
    (shape,) = export().shapes
    assert isinstance(shape, core.Cylinder)
    assert sorted(shape.radii) == pytest.approx(sorted((0.5, 0.5 * radius2)), rel=1e-5)


def as_a_cone_is(thing):
    """Give the corners at the apex the normals of a cone, which smooth shading does not."""
    mesh = thing.data
    normals = np.empty((len(mesh.loops), 3), dtype=np.float32)
    mesh.corner_normals.foreach_get("vector", normals.ravel())
    for face in mesh.polygons:
        for loop in face.loop_indices:
            if len(face.vertices) == 3 and mesh.vertices[mesh.loops[loop].vertex_index].co.z > 0.9:
                x, y, _ = face.center
                out = np.array([x, y]) / math.hypot(x, y)
                normals[loop] = np.array([*(2.0 * out), 1.0]) / math.sqrt(5.0)
    mesh.normals_split_custom_set(normals.tolist())


@pytest.mark.parametrize("own", [False, True])
def test_cones_are_those_that_are_shaded_as_cones(export, core, own):
    """Blender's smooth shading gives the apex the axis' normal, which bends the whole side."""
    thing = tube(radius2=0.0)
    for face in thing.data.polygons:
        face.use_smooth = len(face.vertices) == 3
    if own:
        as_a_cone_is(thing)
    cones = [shape for shape in export().shapes if isinstance(shape, core.Cylinder)]
    assert len(cones) == own
    assert not own or (cones[0].end_radius == 0.0 and cones[0].end[2] == pytest.approx(1.0))


@pytest.mark.parametrize("change", ["flat", "all smooth", "few", "stretched", "open"])
def test_others_stay_meshes(export, core, change):
    thing = tube(
        smooth=change != "flat",
        sides=10 if change == "few" else 32,
    )
    if change == "all smooth":
        thing.data.shade_smooth()
    if change == "stretched":
        thing.scale = (1.0, 1.1, 1.0)
    if change == "open":
        work = bmesh.new()
        work.from_mesh(thing.data)
        ends = [face for face in work.faces if len(face.verts) > 4]
        bmesh.ops.delete(work, geom=ends[:1], context="FACES_ONLY")
        work.to_mesh(thing.data)
        work.free()
    assert not any(isinstance(shape, core.Cylinder) for shape in export().shapes)


def test_what_shines_stays_as_it_was(export, core):
    glow = things.material("Glow", "ShaderNodeEmission", Strength=2.0)
    tube().data.materials.append(glow)
    assert not any(isinstance(shape, core.Cylinder) for shape in export().shapes)


def test_the_setting_of_spheres_is_that_of_cylinders(export, core):
    tube()
    bpy.context.scene.adaptive_drt.spheres = "FACES"
    assert not any(isinstance(shape, core.Cylinder) for shape in export().shapes)


def test_a_cylinder_may_spin_about_its_axis_and_move(export, core):
    thing = tube()
    scene = bpy.context.scene
    scene.render.use_motion_blur = True
    for frame, turn in ((0, 0.0), (2, math.pi / 2)):
        thing.rotation_euler = (0.0, 0.0, turn)
        thing.location = (0.5 * frame, 0.0, 0.0)
        thing.keyframe_insert("rotation_euler", frame=frame)
        thing.keyframe_insert("location", frame=frame)
    for curve in things.curves(thing):
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    scene.frame_set(1)
    (shape,) = export().shapes
    assert isinstance(shape, core.Cylinder) and shape.motion is not None
    thing.rotation_euler = (1.0, 0.0, 0.0)
    thing.keyframe_insert("rotation_euler", frame=2)
    scene.frame_set(1)
    assert not any(isinstance(shape, core.Cylinder) for shape in export().shapes)


def test_balls_and_bonds_render(export, core):
    """The ends within the atoms are no shapes of their own."""
    thing = tube()
    thing.scale = (0.2, 0.2, 1.0)
    for z in (-1.0, 1.0):
        things.uv_sphere(f"Atom {z}", radius=0.5).location = (0.0, 0.0, z)
    scene = export()
    root = core.__package__.rpartition(".")[0]
    plan, settings = (
        importlib.import_module(f"{root}.{name}") for name in ("tracing.compile", "scene.settings")
    )
    table = plan.make_plan(scene, settings.Settings(threads=1)).shapes
    assert table.count == 3


def opened(name, start, end, radius=0.1):
    """A smooth tube without ends along z, as the menu's cylinder of fill type Nothing is."""
    thing = things.made(
        name,
        lambda b: bmesh.ops.create_cone(
            b, cap_ends=False, segments=32, radius1=radius, radius2=radius, depth=end - start
        ),
    )
    thing.location = (0.0, 0.0, (start + end) / 2.0)
    thing.data.shade_smooth()
    return thing


def atoms_and_bond(*cuts):
    """Balls at -1 and 1, and open tubes from one to the other, cut at some places."""
    things.light("POINT", energy=100.0).location = (0.0, 0.0, 9.0)
    for z in (-1.0, 1.0):
        things.uv_sphere(f"Atom {z}", radius=0.5).location = (0.0, 0.0, z)
    places = (-1.0, *cuts, 1.0)
    return [opened(f"Bond {k}", *ends) for k, ends in enumerate(itertools.pairwise(places))]


def cylinders(export, core):
    return [shape for shape in export().shapes if isinstance(shape, core.Cylinder)]


@pytest.mark.parametrize("cuts", [(), (0.1,), (-0.2, 0.3)])
def test_open_tubes_between_balls_are_cylinders(export, core, cuts):
    atoms_and_bond(*cuts)
    found = cylinders(export, core)
    assert len(found) == 1 + len(cuts)
    assert {shape.name for shape in found} == {f"Bond {k}" for k in range(1 + len(cuts))}


@pytest.mark.parametrize(
    "change", ["short", "thick", "hidden ball", "camera inside", "moves", "shines", "linked"]
)
def test_other_open_tubes_keep_their_faces(export, core, change):
    (bond,) = atoms_and_bond()
    atom = bpy.data.objects["Atom 1.0"]
    if change == "short":
        bond.location.z -= 0.6
    if change == "thick":
        bond.scale = (6.0, 6.0, 1.0)
    if change == "hidden ball":
        atom.visible_shadow = False
    if change == "camera inside":
        bpy.context.scene.camera.location = (0.3, 0.0, 1.0)
    if change == "moves":
        bpy.context.scene.render.use_motion_blur = True
        for frame in (0, 2):
            atom.location.x = 0.1 * frame
            atom.keyframe_insert("location", frame=frame)
        bpy.context.scene.frame_set(1)
    if change == "shines":
        bond.data.materials.append(things.material("Glow", "ShaderNodeEmission", Strength=2.0))
    if change == "linked":
        lamp = next(thing for thing in bpy.data.objects if thing.type == "LIGHT")
        lit = lamp.light_linking.receiver_collection = bpy.data.collections.new("Lit")
        lit.objects.link(bond)
    assert not cylinders(export, core)


@pytest.mark.parametrize("lit", [False, True], ids=["dark", "lit"])
def test_a_world_changes_no_form(export, core, lit):
    """Sticks, cut and open ones, and stretched balls under a world that lights from all sides."""
    atoms_and_bond()
    ball = things.uv_sphere()
    ball.location, ball.scale = (0.0, 5.0, 0.0), (1.0, 0.5, 0.4)
    world = bpy.context.scene.world = bpy.data.worlds.new("Grey")
    world.use_nodes = True
    level = 1.0 if lit else 0.0
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = level
    assert len(cylinders(export, core)) == 1
    assert any(isinstance(shape, core.Ellipsoid) for shape in export().shapes)


def test_a_chain_of_open_tubes_that_ends_outside_keeps_its_faces(export, core):
    atoms_and_bond(0.1)
    bpy.data.objects["Atom 1.0"].location.x = 3.0
    assert not cylinders(export, core)


@pytest.mark.parametrize("taper", [1.0, 0.5])
def test_a_straight_curve_with_a_round_bevel_is_a_cylinder(export, core, taper):
    """Two points, no caps, and its ends within balls: the mesh that Blender makes is a tube."""
    curve = bpy.data.curves.new("Bond", "CURVE")
    curve.dimensions, curve.bevel_depth, curve.bevel_resolution = "3D", 0.1, 6
    spline = curve.splines.new("POLY")
    spline.points.add(1)
    for point, z in zip(spline.points, (-1.0, 1.0), strict=True):
        point.co = (0.0, 0.0, z, 1.0)
    spline.points[1].radius = taper
    things.link(bpy.data.objects.new("Bond", curve))
    bpy.data.objects.remove(atoms_and_bond()[0])
    (found,) = cylinders(export, core)
    assert sorted(found.radii) == pytest.approx([0.1 * taper, 0.1], rel=1e-5)
