# SPDX-License-Identifier: GPL-3.0-or-later
"""Point clouds, as objects and as geometry nodes make them: a sphere for each point."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
import things
from node_chains import chain, on_points

TO_POINTS, TO_CURVE = "GeometryNodeMeshToPoints", "GeometryNodeMeshToCurve"
INSTANCE = "GeometryNodeGeometryToInstance"


def _curve(name):
    data = bpy.data.curves.new(name, "CURVE")
    data.dimensions = "3D"
    data.splines.new("POLY").points.add(2)
    for point, x in zip(data.splines[0].points, (0.0, 2.0, 5.0), strict=True):
        point.co = (x, 0.0, 0.0, 1.0)
    return things.link(bpy.data.objects.new(name, data))


def _volume(name):
    return things.link(bpy.data.objects.new(name, bpy.data.volumes.new(name)))


def _cloud(name="Thing"):
    """A point cloud object; nodes fill it: Python can do so in 5.2 alone."""
    cloud = things.link(bpy.data.objects.new(name, bpy.data.pointclouds.new(name)))
    chain(cloud, "GeometryNodePoints", Count=3)
    return cloud


def _points(places, name="Thing", radius=0.5):
    """Points that nodes make of the vertices of a mesh; returns the object and its node tree."""
    thing = things.mesh_object(name, places, [])
    return thing, chain(thing, TO_POINTS, Radius=radius)


def _placed(tree, kind, **inputs):
    """Put another node before a tree's output."""
    link = next(x for x in tree.links if x.to_node.bl_idname == "NodeGroupOutput")
    node, source, target = tree.nodes.new(kind), link.from_socket, link.to_socket
    first = next(s for s in node.inputs if s.type == "GEOMETRY")
    tree.links.new(source, first)
    tree.links.new(node.outputs[0], target)
    for key, value in inputs.items():
        node.inputs[key].default_value = value
    return node


def _stored(tree, name, color, kind="FLOAT_COLOR"):
    """Let nodes store a colour for each point."""
    node = _placed(tree, "GeometryNodeStoreNamedAttribute")
    node.data_type, node.domain = kind, "POINT"
    node.inputs["Name"].default_value = name
    next(s for s in node.inputs if s.name == "Value" and s.enabled).default_value = color
    return node


def _with_attribute(name, kind="ShaderNodeAttribute", node="ShaderNodeBsdfDiffuse"):
    """A material whose colour is an attribute."""
    made = things.material("Colored", node)
    tree = made.node_tree
    shader = next(n for n in tree.nodes if n.bl_idname == node)
    source = tree.nodes.new(kind)
    setattr(source, "attribute_name" if kind == "ShaderNodeAttribute" else "layer_name", name)
    tree.links.new(source.outputs["Color"], shader.inputs[0])
    return made


def _clothed(tree, material):
    _placed(tree, "GeometryNodeSetMaterial", Material=material)


KINDS = {
    "points of a mesh": (4, lambda: chain(things.plane("Thing"), TO_POINTS)),
    "points beside a mesh": (4 + 1, lambda: chain(things.plane("Thing"), TO_POINTS, keep=True)),
    "points of curves of a mesh": (
        10,
        lambda: chain(things.plane("Thing"), TO_CURVE, "GeometryNodeCurveToPoints"),
    ),
    "points in an instance in an instance": (
        4,
        lambda: chain(things.plane("Thing"), TO_POINTS, INSTANCE, INSTANCE),
    ),
    "points of a curve": (10, lambda: chain(_curve("Thing"), "GeometryNodeCurveToPoints")),
    "points on the points of a curve": (
        3,
        lambda: on_points(_curve("Thing"), "GeometryNodePoints"),
    ),
    "points in a volume object": (
        3,
        lambda: chain(_volume("Thing"), "GeometryNodePoints", Count=3),
    ),
    "point cloud object": (3, _cloud),
}


@pytest.mark.parametrize("kind", KINDS)
def test_points_are_spheres(rendered, core, kind):
    count, make = KINDS[kind]
    make()
    (scene,) = rendered()
    # nodes that put several points in one place: the tracer leaves all but one of them out
    assert scene.issues == () and len(scene.shapes) == count
    assert all(shape.name == "Thing" for shape in scene.shapes)
    assert sum(isinstance(shape, core.Sphere) for shape in scene.shapes) >= count - 1


def test_place_radius_and_material(export):
    thing, tree = _points([(1.0, 2.0, 3.0), (-1.0, 0.0, 0.5)])
    thing.location, thing.scale, thing.rotation_euler.z = (0, 0, 1), (-2, 2, 2), math.pi / 2
    _clothed(tree, things.matt("Red", 0.8, 0.1, 0.1))
    one, other = export().shapes
    assert one.center == pytest.approx((-4.0, -2.0, 7.0), abs=1e-5)
    assert other.center == pytest.approx((0.0, 2.0, 2.0), abs=1e-5)
    assert one.radius == other.radius == pytest.approx(1.0)
    assert one.material.color == other.material.color == pytest.approx((0.8, 0.1, 0.1))


def test_points_without_a_radius_have_that_of_cycles(export):
    _, tree = _points([(0.0, 0.0, 0.0)])
    remove = _placed(tree, "GeometryNodeRemoveAttribute")
    remove.inputs["Name"].default_value = "radius"
    (ball,) = export().shapes
    assert ball.radius == pytest.approx(0.01)


def test_points_without_an_extent_are_not_there(export):
    _points([(0.0, 0.0, 0.0)], radius=0.0)
    scene = export()
    assert scene.shapes == scene.issues == ()


def test_points_that_are_no_numbers_are_told(export):
    thing, _ = _points([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)])
    thing.data.vertices[1].co.x = math.nan
    scene = export()
    assert len(scene.shapes) == 1
    (issue,) = scene.issues
    assert issue.missing and issue.reason.startswith("some of its points are left out")


@pytest.mark.parametrize(
    "scale, said", [((2, 1, 1), "its points are left out"), ((0, 0, 0), "its scale is zero")]
)
def test_ellipsoids_are_told(export, scale, said):
    thing, _ = _points([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)])
    thing.scale = scale
    scene = export()
    (issue,) = scene.issues
    assert not scene.shapes and issue.missing and issue.reason.startswith(said)


@pytest.mark.parametrize(
    "kind, value, color",
    [
        ("FLOAT_COLOR", (0.5, 0.25, 0.125, 1.0), (0.5, 0.25, 0.125)),
        ("BYTE_COLOR", (0.5, 0.25, 0.125, 1.0), (0.5, 0.25, 0.125)),
        ("FLOAT_VECTOR", (0.5, 0.25, 0.125), (0.5, 0.25, 0.125)),
        ("FLOAT", 0.5, (0.5, 0.5, 0.5)),
    ],
)
def test_each_point_has_the_colour_of_an_attribute(export, kind, value, color):
    _, tree = _points([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)])
    _stored(tree, "Color", value, kind)
    _clothed(tree, _with_attribute("Color"))
    scene = export()
    assert scene.issues == ()
    for ball in scene.shapes:
        assert ball.material.color == pytest.approx(color, abs=5e-3)


@pytest.mark.parametrize("node", ["ShaderNodeBsdfDiffuse", "ShaderNodeBsdfPrincipled"])
@pytest.mark.parametrize("kind", ["ShaderNodeAttribute", "ShaderNodeVertexColor"])
def test_nodes_that_read_a_colour(export, kind, node):
    _, tree = _points([(0.0, 0.0, 0.0)])
    _stored(tree, "tint", (0.5, 0.25, 0.125, 1.0))
    _clothed(tree, _with_attribute("tint", kind, node))
    scene = export()
    assert scene.shapes[0].material.color == pytest.approx((0.5, 0.25, 0.125))
    assert not any("one colour" in issue.reason for issue in scene.issues)


def test_a_colour_that_points_lack_is_told(export):
    _, tree = _points([(0.0, 0.0, 0.0)])
    _clothed(tree, _with_attribute("Color"))
    things.uv_sphere("Ball").data.materials.append(bpy.data.materials["Colored"])
    (issue,) = export().issues
    assert issue.name == 'Material "Colored"' and "one colour is used" in issue.reason


def test_the_layer_s_override_has_no_colours_of_points(export):
    _, tree = _points([(0.0, 0.0, 0.0)])
    _stored(tree, "Color", (0.5, 0.25, 0.125, 1.0))
    _clothed(tree, _with_attribute("Color"))
    bpy.context.view_layer.material_override = things.matt("Grey", 0.3, 0.3, 0.3)
    scene = export()
    assert scene.issues == ()
    assert scene.shapes[0].material.color == pytest.approx((0.3, 0.3, 0.3))


def test_visibility_and_holdout(export):
    thing, _ = _points([(0.0, 0.0, 0.0)])
    thing.visible_camera, thing.is_holdout = False, True
    (ball,) = export().shapes
    assert ball.visibility.holdout and not ball.visibility.camera


@pytest.mark.parametrize("count", [3, 65])
def test_points_that_shine_are_lights_up_to_a_number(export, count):
    _, tree = _points([(float(k), 0.0, 0.0) for k in range(count)], radius=0.2)
    _clothed(tree, things.material("Glow", "ShaderNodeEmission", Strength=2.0))
    scene = export()
    assert len(scene.shapes) == count and len(scene.lights) == (count if count < 65 else 0)
    assert [i.reason[:17] for i in scene.issues] == ["its points shine "] * (count == 65)


def _shutter():
    scene = bpy.context.scene
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 1.0
    scene.frame_set(6)


def test_a_cloud_moves_as_a_whole(export):
    thing, _ = _points([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)])
    things.keyed(thing, "location", (0.0, 0.0, 0.0), (10.0, 0.0, 0.0))
    _shutter()
    scene = export()
    assert scene.issues == ()
    for ball, x in zip(scene.shapes, (5.0, 6.0), strict=True):
        assert ball.motion.displacement == pytest.approx((1.0, 0.0, 0.0), abs=1e-5)
        assert ball.center[0] == pytest.approx(x, abs=1e-5)


@pytest.mark.parametrize("places", [[(0.0, 0.0, 0.0)], [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)]])
def test_a_cloud_that_turns_is_told(export, places):
    thing, _ = _points(places)
    things.keyed(thing, "rotation_euler", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    _shutter()
    (issue,) = export().issues
    assert issue.reason.startswith("it turns")


@pytest.mark.parametrize("socket", ["Position", "Radius", "velocity"])
def test_points_that_move_by_themselves_are_told(export, socket):
    _, tree = _points([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)])
    if socket == "velocity":
        _stored(tree, "velocity", (1.0, 0.0, 0.0), "FLOAT_VECTOR")
    else:
        node = next(n for n in tree.nodes if n.bl_idname == TO_POINTS)
        value = node.inputs["Radius"]
        if socket == "Position":
            value = _placed(tree, "GeometryNodeSetPosition").inputs["Offset"]
        for frame, size in ((1, 1.0), (11, 3.0)):
            value.default_value = size if socket == "Radius" else (size, 0.0, 0.0)
            value.keyframe_insert("default_value", frame=frame)
    _shutter()
    (issue,) = export().issues
    said = 'its "velocity" attribute' if socket == "velocity" else "it deforms"
    assert issue.reason.startswith(said) and issue.name == "Thing"
    bpy.data.objects["Thing"].cycles.use_deform_motion = False
    assert export().issues == ()


def test_a_view_layer_without_surfaces_has_no_points(export):
    _points([(0.0, 0.0, 0.0)])
    bpy.context.view_layer.use_solid = False
    scene = export()
    assert scene.shapes == scene.issues == ()


def test_points_beyond_the_clip_are_told_once(export):
    _points([(0.0, 0.0, -2000.0), (1.0, 0.0, -2000.0), (0.0, 0.0, 0.0)])
    (issue,) = export().issues
    assert "Clip End" in issue.reason


def _coloured_places():
    generator = np.random.default_rng(5)
    return generator.uniform((-2.6, -1.5, 0.3), (2.6, 1.5, 1.6), (24, 3))


@pytest.mark.parametrize("colored", [False, True])
@pytest.mark.slow
def test_agrees_with_cycles(file, addon, tmp_path, colored):
    """Spheres of one colour, or each of its own."""
    from peer import render_cycles

    pytest.importorskip("embreex")
    scene = things.balls_on_a_floor((60, 40), 5.0, 62.0, (), 256)
    lamp = things.light("AREA", energy=300.0, shape="RECTANGLE", size=1.6, size_y=1.0)
    lamp.location, lamp.rotation_euler = (-1.5, -1.0, 5.0), (0.2, -0.3, 0.1)
    thing, tree = _points(_coloured_places().tolist(), radius=0.3)
    thing.location, thing.scale = (0.1, 0.2, 0.1), (1.1, 1.1, 1.1)
    if colored:
        node = _stored(tree, "Color", (0.0, 0.0, 0.0, 1.0))
        position, scaled = (
            tree.nodes.new(kind) for kind in ("GeometryNodeInputPosition", "ShaderNodeVectorMath")
        )
        scaled.operation = "MULTIPLY_ADD"
        scaled.inputs[1].default_value, scaled.inputs[2].default_value = (0.15,) * 3, (0.45,) * 3
        value = next(s for s in node.inputs if s.name == "Value" and s.enabled)
        tree.links.new(position.outputs[0], scaled.inputs[0])
        tree.links.new(scaled.outputs[0], value)
        _clothed(tree, _with_attribute("Color"))
    else:
        _clothed(tree, things.matt("Points", 0.8, 0.3, 0.2))
    chosen = scene.adaptive_drt
    chosen.method = "EXACT"
    bpy.ops.adaptive_drt.render()
    image = bpy.data.images["Adaptive Render"]
    flat = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(flat)
    ours = flat.reshape(image.size[1], image.size[0], 4)[..., :3]
    theirs = render_cycles(tmp_path)
    difference = math.sqrt(((ours - theirs) ** 2).mean()) / theirs.mean()
    assert difference < 0.01
    assert ours.mean() == pytest.approx(theirs.mean(), rel=3e-3)
