# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings that change during the shutter are rendered as at its middle, and that is told."""

from __future__ import annotations

import bpy
import pytest
import things


@pytest.fixture
def shutter(file):
    scene = bpy.context.scene
    scene.render.use_motion_blur = True
    scene.render.motion_blur_shutter = 2.0
    return scene


def _told(export, kind):
    """Export at frame 6, between two keys; what is told of changes, and of which datablock."""
    bpy.context.scene.frame_set(6)
    found = [i for i in export().issues if "during the shutter" in i.reason]
    assert all(i.kind == kind and not i.missing for i in found)
    return [i.reason.partition(" during")[0] for i in found]


CAMERA = {
    "lens": ((30.0, 90.0), "its focal length changes"),
    "shift_x": ((0.0, 0.5), "its shift x changes"),
    "shift_y": ((0.0, 0.5), "its shift y changes"),
    "sensor_width": ((20.0, 40.0), "its sensor width changes"),
    "sensor_height": ((20.0, 40.0), "its sensor height changes"),
}


@pytest.mark.parametrize("path", CAMERA)
def test_a_camera_s(export, shutter, path):
    values, said = CAMERA[path]
    things.uv_sphere()
    things.keyed(shutter.camera.data, path, *values)
    assert _told(export, "CAMERA") == [said]


def test_both_of_a_camera_s_are_in_one_line(export, shutter):
    things.keyed(shutter.camera.data, "lens", 30.0, 90.0)
    things.keyed(shutter.camera.data, "shift_x", 0.0, 0.5)
    (reason,) = _told(export, "CAMERA")
    assert "focal length" in reason and "shift x" in reason and reason.endswith("change")


def test_the_middle_is_what_is_rendered(export, shutter):
    things.keyed(shutter.camera.data, "lens", 30.0, 90.0)
    shutter.frame_set(6)
    assert export().camera.focal_length == pytest.approx(60.0)


def test_a_render_tells_it_too(rendered, shutter):
    """Its depsgraph is another one than the viewport's, and the engine moves it."""
    things.keyed(shutter.camera.data, "lens", 30.0, 90.0)
    node = _ball()
    _key_input(node.inputs["Color"], RED, BLUE)
    shutter.frame_set(6)
    (scene,) = rendered()
    found = {i.kind: i.reason for i in scene.issues if "during the shutter" in i.reason}
    assert "focal length" in found["CAMERA"] and "colour" in found["MATERIAL"]


LIGHTS = {
    "energy": ("POINT", (10.0, 50.0)),
    "color": ("POINT", ((1.0, 1.0, 1.0), (1.0, 0.0, 0.0))),
    "shadow_soft_size": ("POINT", (0.1, 0.5)),
    "size": ("AREA", (0.1, 0.5)),
    "spot_size": ("SPOT", (0.3, 0.9)),
    "spot_blend": ("SPOT", (0.1, 0.9)),
}


@pytest.mark.parametrize("path", LIGHTS)
def test_a_light_s(export, shutter, path):
    kind, values = LIGHTS[path]
    lamp = things.light(kind).data
    things.keyed(lamp, path, *values)
    label = lamp.bl_rna.properties[path].name.lower()
    assert _told(export, "LIGHT") == [f"its {label} changes"]


def test_a_light_s_nodes(export, shutter):
    lamp = things.light("POINT").data
    lamp.use_nodes = True
    node = next(n for n in lamp.node_tree.nodes if n.type == "EMISSION")
    _key_input(node.inputs["Strength"], 1.0, 3.0)
    assert _told(export, "LIGHT") == ["its nodes' emission changes"]


def test_a_portal_is_not_rendered_at_the_middle(export, shutter):
    lamp = things.light("AREA").data
    things.keyed(lamp, "energy", 1.0, 5.0)
    if hasattr(lamp, "cycles"):  # Cycles is an add-on, and may be switched off
        lamp.cycles.is_portal = True
        assert _told(export, "LIGHT") == []


def _key_input(socket, *values):
    for index, value in enumerate(values):
        socket.default_value = value
        socket.keyframe_insert("default_value", frame=1 + 10 * index)


def _ball():
    made = things.material(node="ShaderNodeBsdfDiffuse", Roughness=0.0)
    things.uv_sphere().data.materials.append(made)
    return next(n for n in made.node_tree.nodes if n.outputs)


RED, BLUE = (1.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 1.0)


def test_a_material_s_colour(export, shutter):
    _key_input(_ball().inputs["Color"], RED, BLUE)
    assert _told(export, "MATERIAL") == ["its colour changes"]


def test_a_value_that_drives_a_colour(export, shutter):
    node = _ball()
    tree = node.id_data
    value = tree.nodes.new("ShaderNodeValue")
    tree.links.new(value.outputs[0], node.inputs["Color"])
    curve = value.outputs[0].driver_add("default_value")
    curve.driver.expression = "frame / 20"
    assert _told(export, "MATERIAL") == ["its colour changes"]


def test_a_handler_that_changes_a_colour(export, shutter):
    node = _ball()

    def change(scene, _):
        node.inputs["Color"].default_value = (scene.frame_current / 20, 0.0, 0.0, 1.0)

    bpy.app.handlers.frame_change_pre.append(change)
    try:
        assert _told(export, "MATERIAL") == ["its colour changes"]
    finally:
        bpy.app.handlers.frame_change_pre.remove(change)


def test_a_colour_in_a_group_of_a_group(export, shutter):
    node = _ball()
    trees = [node.id_data]
    for name in ("Outer", "Inner"):
        tree = bpy.data.node_groups.new(name, "ShaderNodeTree")
        tree.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
        group = trees[-1].nodes.new("ShaderNodeGroup")
        group.node_tree = tree
        into = (
            node.inputs["Color"] if len(trees) == 1 else trees[-1].nodes["Group Output"].inputs[0]
        )
        trees[-1].links.new(group.outputs[0], into)
        tree.nodes.new("NodeGroupOutput")
        trees.append(tree)
    color = trees[-1].nodes.new("ShaderNodeRGB")
    trees[-1].links.new(color.outputs[0], trees[-1].nodes["Group Output"].inputs[0])
    _key_input(color.outputs[0], RED, BLUE)
    assert _told(export, "MATERIAL") == ["its colour changes"]


def test_a_material_that_nothing_wears(export, shutter):
    node = _ball()
    bpy.data.objects["Sphere"].data.materials.clear()
    _key_input(node.inputs["Color"], RED, BLUE)
    assert _told(export, "MATERIAL") == []


def test_what_is_left_out_at_an_end_alone(export, shutter):
    """Roughness is 0 at the middle of the shutter, and nothing would be told of it there."""
    socket = _ball().inputs["Roughness"]
    for frame, value in ((5, 0.5), (6, 0.0), (7, 0.5)):
        socket.default_value = value
        socket.keyframe_insert("default_value", frame=frame)
    bpy.context.scene.frame_set(6)
    assert "Roughness is left out" in things.reasons(export())['Material "Material"'][0]


def test_a_world_s_colour(export, shutter):
    world = shutter.world = bpy.data.worlds.new("World")
    world.use_nodes = True
    node = next(n for n in world.node_tree.nodes if n.type == "BACKGROUND")
    _key_input(node.inputs["Color"], RED, BLUE)
    assert _told(export, "WORLD") == ["its colour changes"]


def test_clipping_at_an_end_of_the_shutter(export, shutter):
    things.uv_sphere()
    things.keyed(shutter.camera.data, "clip_end", 11.0, 13.0)
    shutter.render.motion_blur_shutter = 8.0
    bpy.context.scene.frame_set(6)
    assert export(use_motion=False).issues == ()
    things.keyed(shutter.camera.data, "clip_end", 10.0, 13.0)
    bpy.context.scene.frame_set(6)
    (reason,) = things.reasons(export())["Sphere"]
    assert "Clip End" in reason


def test_depth_of_field_s_focus_has_no_second_line(export, shutter):
    dof = shutter.camera.data.dof
    dof.use_dof = True
    for frame, value in ((1, 1.0), (11, 9.0)):
        dof.focus_distance = value
        shutter.camera.data.keyframe_insert("dof.focus_distance", frame=frame)
    bpy.context.scene.frame_set(6)
    assert things.reasons(export()) == {'Camera "Camera"': ["its depth of field is left out"]}


@pytest.mark.parametrize("why", ["still", "no blur"])
def test_nothing_is_told_where_nothing_is_blurred(export, shutter, why):
    if why == "no blur":
        shutter.render.use_motion_blur = False
        things.keyed(shutter.camera.data, "lens", 30.0, 90.0)
    things.light("POINT")
    _ball()
    shutter.frame_set(6)
    assert export().issues == ()
