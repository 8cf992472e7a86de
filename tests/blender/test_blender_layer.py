# SPDX-License-Identifier: GPL-3.0-or-later
"""What a view layer asks: its overrides are heeded, what is not is told."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import things

RED, BLUE = (0.9, 0.1, 0.05, 1.0), (0.1, 0.2, 0.8, 1.0)


def _world(name, color):
    world = bpy.data.worlds.new(name)
    world.use_nodes = True
    world.node_tree.nodes.clear()
    output = world.node_tree.nodes.new("ShaderNodeOutputWorld")
    background = world.node_tree.nodes.new("ShaderNodeBackground")
    background.inputs["Color"].default_value = color
    world.node_tree.links.new(background.outputs[0], output.inputs["Surface"])
    return world


def test_material_override(export):
    things.uv_sphere("Bare")
    dressed = things.plane("Dressed")
    dressed.data.materials.append(things.material("Blue", Base_Color=BLUE))
    layer = bpy.context.view_layer
    layer.material_override = things.material("Red", "ShaderNodeBsdfDiffuse", Color=RED)
    colors = [shape.material.color for shape in export().shapes]
    assert colors == [pytest.approx(RED[:3])] * 2
    layer.material_override = None
    colors = {shape.name: shape.material.color for shape in export().shapes}
    assert colors["Dressed"] == pytest.approx(BLUE[:3])
    assert colors["Bare"] == pytest.approx((0.8, 0.8, 0.8))


def test_world_override(export):
    bpy.context.scene.world = _world("Red", RED)
    assert export().background == pytest.approx(RED[:3])
    bpy.context.view_layer.world_override = _world("Blue", BLUE)
    assert export().background == pytest.approx(BLUE[:3])


def _inside():
    """A collection in the scene, and its entry in the view layer."""
    collection = bpy.data.collections.new("Things")
    bpy.context.scene.collection.children.link(collection)
    return collection, bpy.context.view_layer.layer_collection.children["Things"]


@pytest.mark.parametrize("switch", ["holdout", "indirect_only"])
def test_switches_of_collections_are_those_of_their_shapes(export, rendered, switch):
    collection, layer = _inside()
    setattr(layer, switch, True)
    things.uv_sphere("Ball", collection=collection)
    things.uv_sphere("Other")
    bpy.context.view_layer.update()
    for scene in (export(), *rendered()):
        found = {shape.name: shape.visibility for shape in scene.shapes}
        assert scene.issues == () and found["Ball"].shadow
        assert found["Ball"].holdout is (switch == "holdout")
        assert found["Ball"].camera is (switch == "holdout")
        assert found["Other"].camera and not found["Other"].holdout


@pytest.mark.parametrize("switch", ["holdout", "indirect_only"])
def test_cycles_switches_of_collections_alike(export, tmp_path, switch):
    """The picture's mean, with a ball that is not seen but whose shadow is."""
    from peer import render_cycles

    collection, layer = _inside()
    setattr(layer, switch, True)
    ball = things.uv_sphere("Ball", collection=collection)
    ball.location = (0.5, 0.0, 1.0)
    things.plane("Floor", size=40.0)
    lamp = things.light("AREA", energy=3000.0, size=4.0)
    lamp.location = (3.0, 0.0, 8.0)
    bpy.context.view_layer.update()
    bpy.context.scene.adaptive_drt.tolerance = 0.01
    bpy.ops.adaptive_drt.render()
    image = bpy.data.images["Adaptive Render"]
    ours = np.array(image.pixels[:]).reshape(image.size[1], image.size[0], 4)[..., :3]
    theirs = render_cycles(tmp_path, samples=256)
    assert np.abs(ours - theirs).max() < 0.03 * theirs.max()


def test_cycles_overrides_alike(export, tmp_path):
    """The same surface in both, with an override of the world and of the material."""
    from peer import render_cycles

    things.plane("Floor", size=40.0).data.materials.append(things.material("Blue"))
    lamp = things.light("AREA", energy=3000.0, size=4.0)
    lamp.location.z = 8.0
    layer = bpy.context.view_layer
    layer.material_override = things.material("Red", "ShaderNodeBsdfDiffuse", Color=RED)
    scene = export()
    picture = render_cycles(tmp_path, samples=64)
    ratio = picture.mean(axis=(0, 1))
    color = scene.shapes[0].material.color
    np.testing.assert_allclose(ratio / ratio[0], np.array(color) / color[0], rtol=1e-3)


def test_environment_off_leaves_no_sky(export):
    bpy.context.scene.world = _world("Blue", BLUE)
    assert any(export().background) and export().lights
    bpy.context.view_layer.use_sky = False
    scene = export()
    assert scene.background == (0.0, 0.0, 0.0) and scene.issues == () and scene.lights == ()


def test_surfaces_off_leaves_none(export):
    things.uv_sphere("Ball")
    things.link(bpy.data.objects.new("Text", bpy.data.curves.new("Text", "FONT"))).data.body = "a"
    things.light("POINT", "Lamp")
    bpy.context.view_layer.use_solid = False
    scene = export()
    assert scene.shapes == () and len(scene.lights) == 1 and scene.issues == ()


def test_motion_blur_of_the_layer(export):
    things.keyed(things.uv_sphere("Ball"), "location", (0.0, 0.0, 0.0), (10.0, 0.0, 0.0))
    scene = bpy.context.scene
    scene.render.use_motion_blur, scene.render.motion_blur_position = True, "START"
    scene.cycles.rolling_shutter_type = "TOP"
    scene.frame_set(6)
    found = export()
    assert found.shapes[0].motion is not None and "Rolling Shutter" in found.issues[0].reason
    bpy.context.view_layer.use_motion_blur = False
    found = export()
    assert found.shapes[0].motion is None and found.issues == ()
    assert found.shapes[0].center[0] == pytest.approx(5.0)  # at the frame itself


def _filtered(switch):
    scene = bpy.context.scene
    scene.world = _world("Blue", BLUE)
    floor = things.plane("Floor", size=3.0)
    matt = things.material("Matt", "ShaderNodeBsdfDiffuse", Color=RED, Roughness=0.0)
    floor.data.materials.append(matt)
    lamp = things.light("AREA", energy=3000.0, size=4.0)
    lamp.location.z, lamp.visible_camera = 8.0, False
    if switch == "use_motion_blur":
        things.keyed(floor, "location", (0.0, 0.0, 0.0), (10.0, 0.0, 0.0))
        scene.render.use_motion_blur, scene.render.motion_blur_position = True, "START"
    scene.frame_set(2)
    setattr(bpy.context.view_layer, switch, False)


@pytest.mark.parametrize("switch", ["use_sky", "use_solid", "use_motion_blur"])
def test_cycles_filters_alike(export, tmp_path, switch):
    """By the pixels in which there is nothing, which need no light of the world."""
    from peer import render_cycles

    _filtered(switch)
    bpy.ops.adaptive_drt.render()
    image = bpy.data.images["Adaptive Render"]
    flat = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(flat)
    ours = flat.reshape(image.size[1], image.size[0], 4)[..., :3]
    theirs = render_cycles(tmp_path, samples=64)
    sky = (0.0, 0.0, 0.0) if switch == "use_sky" else BLUE[:3]
    empty = [np.isclose(picture, sky, atol=1e-5).all(axis=2) for picture in (ours, theirs)]
    assert empty[0].any() and np.array_equal(*empty)
