# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes, curves, Grease Pencil and hair: told where Cycles shows them, else not."""

from __future__ import annotations

import importlib

import bmesh
import bpy
import numpy as np
import pytest
import things
from node_chains import chain, on_points

VOLUME = "its volume is left out"


def _curve(name="Curve", closed=False, **settings):
    data = bpy.data.curves.new(name, "CURVE")
    data.dimensions = "3D"
    spline = data.splines.new("POLY")
    spline.points.add(2)
    corners = ((0, 0, 0), (2, 0, 0), (2, 2, 0))
    for point, corner in zip(spline.points, corners, strict=True):
        point.co = (*corner, 1.0)
    spline.use_cyclic_u = closed
    for key, value in settings.items():
        setattr(data, key, value)
    return things.link(bpy.data.objects.new(name, data))


def _text(name="Text", body="a"):
    data = bpy.data.curves.new(name, "FONT")
    data.body = body
    return things.link(bpy.data.objects.new(name, data))


def _volume(name="Volume"):
    return things.link(bpy.data.objects.new(name, bpy.data.volumes.new(name)))


def _hair_curves():
    bpy.ops.object.curves_random_add()
    return bpy.context.object


def _told(scene):
    """Whether each thing told is missing, by name and reason."""
    return {(i.name, i.reason): i.missing for i in scene.issues}


def _make(kind):
    return {
        "volume of a mesh": lambda: chain(
            things.uv_sphere("Thing"), "GeometryNodeMeshToVolume", Density=9.0
        ),
        "volumes on the points of a mesh": lambda: on_points(
            things.plane("Thing"), "GeometryNodeVolumeCube"
        ),
        "volume in a text": lambda: chain(_text("Thing"), "GeometryNodeVolumeCube"),
        "volume object": lambda: chain(_volume("Thing"), "GeometryNodeVolumeCube"),
    }[kind]()


@pytest.mark.parametrize(
    "kind",
    ["volume of a mesh", "volumes on the points of a mesh", "volume in a text", "volume object"],
)
def test_what_nodes_make_besides_a_mesh_is_told(rendered, kind):
    _make(kind)
    (scene,) = rendered()
    assert _told(scene) == {("Thing", VOLUME): True} and not scene.shapes


def test_instances_name_the_object_to_select(rendered):
    """The name says what repeats what; a click selects what repeats it."""
    inside = bpy.data.collections.new("Inside")
    source = things.uv_sphere("Molecule")
    bpy.context.scene.collection.objects.unlink(source)
    inside.objects.link(source)
    chain(source, "GeometryNodeMeshToVolume", Density=9.0)
    for name in ("A", "B"):
        empty = things.link(bpy.data.objects.new(name, None))
        empty.instance_type, empty.instance_collection = "COLLECTION", inside
    (scene,) = rendered()
    assert [(i.name, i.kind, i.target, i.missing) for i in scene.issues] == [
        (f"{name}/Molecule", "OBJECT", name, True) for name in "AB"
    ]
    assert len({i.reason for i in scene.issues}) == 1


def test_what_the_core_refuses_names_the_object_to_select(export):
    """The core knows the names of shapes alone."""
    field, ball = things.plane("Field"), things.uv_sphere("Ball")
    things.scatter(field, ball)
    ball.location.x = 1e32
    field.location.z = 1e32
    assert {(i.name, i.target, i.missing) for i in export().issues} >= {
        ("Field/Ball", "Field", True),
        ("Ball", "", True),
    }


def test_filters_of_the_view_layer_hide_hair_and_volumes_everywhere(rendered):
    _hair_curves(), _hairy()
    _make("volume object")
    layer = bpy.context.view_layer
    layer.use_strand = layer.use_volumes = False
    (scene,) = rendered()
    assert not any("hair" in i.reason or "its volume" in i.reason for i in scene.issues)


def _hairy(kind="HAIR", shown="PATH", count=40):
    field = things.plane("Field")
    field.modifiers.new("Particles", "PARTICLE_SYSTEM")
    system = field.particle_systems[0]
    system.name = "Grass"
    settings = system.settings
    settings.type, settings.count, settings.render_type = kind, count, shown
    if kind == "EMITTER":
        settings.frame_start, settings.frame_end = -10, 0
    else:
        settings.hair_length, settings.root_radius, settings.radius_scale = 2.0, 3.0, 0.05
    return field


@pytest.mark.parametrize("how", ["alone", "emitter hidden", "children", "two systems"])
def test_particle_hair_is_rendered(rendered, core, how):
    field = _hairy()
    hairs = [40]
    if how == "emitter hidden":
        field.show_instancer_for_render = False
    elif how == "children":
        settings = field.particle_systems[0].settings
        settings.child_type, settings.rendered_child_count = "SIMPLE", 3
        hairs = [120]
    elif how == "two systems":
        field.modifiers.new("More", "PARTICLE_SYSTEM")
        more = field.particle_systems[1]
        more.name, more.settings = "Weeds", field.particle_systems[0].settings
        hairs = [40, 40]
    (scene,) = rendered()
    assert _told(scene) == {}
    tubes = [shape for shape in scene.shapes if hasattr(shape, "faces")]
    assert len(scene.shapes) == len(tubes) + (how != "emitter hidden")
    # straight hairs of nine points have some eight walls of 16 sides, and end in a point
    for each, count in zip(tubes, hairs, strict=True):
        assert 15 <= each.faces.shape[1] / (16 * count) <= 17
        root = each.vertices[:, each.faces].min(axis=(1, 2))[2]
        assert root == pytest.approx(0.0, abs=1e-5)
        assert each.vertices[2].max() == pytest.approx(2.0, rel=1e-3)


def test_particle_hair_has_its_radii_and_material(export):
    field = _hairy(count=1)
    settings = field.particle_systems[0].settings
    settings.tip_radius, settings.use_close_tip, settings.shape = 1.0, False, 0.5
    settings.material = 2
    for name, red in (("Skin", 0.1), ("Fur", 0.8)):
        field.data.materials.append(things.matt(name, red, 0.1, 0.1))
    field.location, field.scale = (1.0, 2.0, 3.0), (2.0, 2.0, 2.0)
    (tube,) = [shape for shape in export().shapes if hasattr(shape, "faces")]
    assert tube.materials[0].color[0] == pytest.approx(0.8)
    rings = tube.vertices.reshape(3, -1, 16)
    center = rings.mean(axis=2, keepdims=True)
    radius = np.linalg.norm(rings - center, axis=0).mean(axis=1)
    height = (center[2, :, 0] - 3.0) / np.ptp(center[2, :, 0])
    rest = (1.0 - height) ** 2.0
    corner = np.pi / 16 / np.sin(np.pi / 16)
    ideal = 2.0 * corner * 0.025 * (1.0 + 2.0 * rest)
    keys = np.isin(np.arange(radius.size), np.linspace(0, radius.size - 1, 9).astype(int))
    np.testing.assert_allclose(radius[keys], ideal[keys], rtol=0.02)


def test_particle_hair_of_instances_is_rendered(rendered):
    field, carrier = _hairy(), things.plane("Carrier")
    things.scatter(carrier, field)
    field.hide_render = True
    (scene,) = rendered()
    tubes = [shape for shape in scene.shapes if hasattr(shape, "faces")]
    assert _told(scene) == {} and len(tubes) == 4
    corners = sorted(tuple(np.round(tube.vertices.mean(axis=1)[:2])) for tube in tubes)
    assert corners == [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)]


def _bare(kind):
    """Things that no renderer shows."""
    if kind == "loose edges":
        mesh = bpy.data.meshes.new("Thing")
        mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1), (1, 2)], [])
        things.link(bpy.data.objects.new("Thing", mesh))
    elif kind == "faces removed":
        thing = things.plane("Thing")
        group = thing.vertex_groups.new(name="None of them")
        mask = thing.modifiers.new("Mask", "MASK")
        mask.vertex_group = group.name
    elif kind == "curves of a mesh":
        chain(things.plane("Thing"), "GeometryNodeMeshToCurve")
    elif kind == "edges of a curve":
        chain(_curve("Thing"), "GeometryNodeCurveToMesh")
    elif kind == "path":
        _curve("Thing")
    elif kind == "empty text":
        _text("Thing", body="")
    elif kind == "empty volume":
        _volume("Thing")
    elif kind == "metaball of no elements":
        things.link(bpy.data.objects.new("Thing", bpy.data.metaballs.new("Thing")))
    elif kind == "helpers":
        for name, data in (
            ("Lattice", bpy.data.lattices.new("Lattice")),
            ("Armature", bpy.data.armatures.new("Armature")),
            ("Speaker", bpy.data.speakers.new("Speaker")),
            ("Empty", None),
        ):
            things.link(bpy.data.objects.new(name, data))
        bpy.ops.object.lightprobe_add(type="SPHERE")
    elif kind == "particles without hair":
        _hairy("EMITTER", "PATH").show_instancer_for_render = False
    elif kind == "halos":
        _hairy("EMITTER", "HALO").show_instancer_for_render = False
    elif kind == "no hair":
        _hairy(count=0).show_instancer_for_render = False
    elif kind == "hair switched off":
        field = _hairy()
        field.show_instancer_for_render = False
        field.modifiers[0].show_render = False


SEEN_NOWHERE = [
    "loose edges",
    "faces removed",
    "curves of a mesh",
    "edges of a curve",
    "path",
    "empty text",
    "empty volume",
    "metaball of no elements",
    "helpers",
    "particles without hair",
    "halos",
    "no hair",
    "hair switched off",
]


@pytest.mark.parametrize("kind", SEEN_NOWHERE)
def test_what_no_renderer_shows_is_not_told(rendered, tmp_path, kind):
    _bare(kind)
    (scene,) = rendered()
    assert scene.issues == () and scene.shapes == ()
    assert not _shows_in_cycles(tmp_path)


@pytest.mark.parametrize("kind", ["volume of a mesh", "hair"])
def test_what_is_told_or_rendered_shows_in_cycles(rendered, tmp_path, kind):
    """The check by which the others are found to show nothing does find something."""
    if kind == "hair":
        _hairy().show_instancer_for_render = False
    else:
        _make(kind)
    (scene,) = rendered()
    assert [i.missing for i in scene.issues] == [True] * (kind != "hair")
    assert bool(scene.shapes) == (kind == "hair")
    assert _shows_in_cycles(tmp_path)


def _shows_in_cycles(folder):
    """Whether anything stands before a white world."""
    from peer import render_cycles

    world = bpy.context.scene.world = bpy.data.worlds.new("White")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = 1.0
    render = bpy.context.scene.render
    render.resolution_x = render.resolution_y = 32
    picture = render_cycles(folder, samples=16)
    return bool(np.abs(picture - 1.0).max() > 1e-3)


def test_a_parent_that_repeats_its_children(rendered):
    """Its own mesh has vertices alone."""
    parent = things.mesh_object("Parent", [(0, 0, 0), (3, 0, 0)], [])
    child = things.uv_sphere("Child")
    child.parent, parent.instance_type = parent, "VERTS"
    (scene,) = rendered()
    assert [s.name for s in scene.shapes] == ["Parent/Child"] * 2 and scene.issues == ()


@pytest.mark.parametrize("how", ["bevel_depth", "extrude", "fill"])
def test_a_curve_with_faces_is_rendered(rendered, how):
    """As the mesh that it becomes, and what it is not is not told."""
    if how == "fill":
        _curve(closed=True, dimensions="2D", fill_mode="BOTH")
    else:
        _curve(**{how: 0.2})
    (scene,) = rendered()
    assert scene.shapes and not any(i.missing for i in scene.issues)


def test_texts_metaballs_and_surfaces_are_rendered(rendered):
    _text()
    for name in ("Meta", "Meta.001"):  # the second is part of the first one's surface
        data = bpy.data.metaballs.new(name)
        data.elements.new()
        things.link(bpy.data.objects.new(name, data)).location.z = 0.5 * len(name)
    bpy.ops.surface.primitive_nurbs_surface_torus_add()
    (scene,) = rendered()
    assert {shape.name for shape in scene.shapes} == {"Text", "Meta", "SurfTorus"}
    assert _told(scene) == {}


def test_a_gas_is_told_and_its_domain_is_no_box(rendered):
    box = things.made("Domain", lambda work: bmesh.ops.create_cube(work, size=2.0))
    fluid = box.modifiers.new("Fluid", "FLUID")
    fluid.fluid_type = "DOMAIN"
    (scene,) = rendered()
    assert scene.shapes == ()
    assert _told(scene) == {("Domain", "its smoke and fire are left out"): True}
    fluid.show_render = False
    (scene,) = rendered()
    assert len(scene.shapes) == 6 and scene.issues == ()


def _stroke():
    if bpy.app.version >= (4, 3, 0):
        bpy.ops.object.grease_pencil_add(type="STROKE", radius=4.0)
    else:
        bpy.ops.object.gpencil_add(type="STROKE", radius=4.0)
    bpy.context.object.name = "Drawing"


def test_grease_pencil_is_told_where_blender_does_not_draw_it(addon, file):
    """Blender draws it over what F12 renders; nothing draws it over an image of our own."""
    _stroke()
    module = importlib.import_module(f"{addon.__name__}.operators.export")
    graph = bpy.context.evaluated_depsgraph_get()
    assert module.export_scene(graph).issues == ()
    scene = module.export_scene(graph, draws_strokes=False)
    ((name, reason),) = _told(scene)
    assert name == "Drawing" and "Grease Pencil" in reason and scene.issues[0].missing
