# SPDX-License-Identifier: GPL-3.0-or-later
"""What is hidden, instanced or of another type."""

from __future__ import annotations

import bpy
import pytest
import things


def _names(scene):
    return sorted(shape.name for shape in scene.shapes)


def _collection(name, parent=None):
    made = bpy.data.collections.new(name)
    if parent is not None:
        parent.children.link(made)
    return made


def test_hidden_from_render(export):
    things.uv_sphere("Shown")
    things.uv_sphere("Hidden").hide_render = True
    lamp = things.light("POINT", "Dark")
    lamp.hide_render = True
    scene = export()
    assert _names(scene) == ["Shown"] and scene.lights == () and scene.issues == ()


def test_hidden_collections(export):
    root = bpy.context.scene.collection
    outer = _collection("Outer", root)
    inner = _collection("Inner", outer)
    things.uv_sphere("Inside", collection=inner)
    assert _names(export()) == ["Inside"]
    outer.hide_render = True
    assert _names(export()) == []
    outer.hide_render = False
    bpy.context.view_layer.layer_collection.children["Outer"].exclude = True
    bpy.context.view_layer.update()
    scene = export()
    assert _names(scene) == [] and scene.issues == ()


def test_in_two_collections_one_hidden(export):
    root = bpy.context.scene.collection
    one, two = _collection("One", root), _collection("Two", root)
    ball = things.uv_sphere("Ball", collection=one)
    two.objects.link(ball)
    one.hide_render = True
    assert _names(export()) == ["Ball"]


@pytest.mark.parametrize("how", ["eye", "screen"])
def test_hidden_in_the_viewport_alone_is_told(export, how):
    ball = things.uv_sphere("Ball")
    if how == "eye":
        bpy.context.view_layer.update()
        ball.hide_set(True)
    else:
        ball.hide_viewport = True
    scene = export()
    assert _names(scene) == [] and "hidden in the viewport" in things.reasons(scene)["Ball"][0]


def test_collection_instances(export):
    source = _collection("Source")
    things.uv_sphere("Ball", radius=0.5, collection=source).location = (1.0, 0.0, 0.0)
    things.uv_sphere("Never", collection=source).hide_render = True
    lamp = things.light("POINT", "Lamp")
    bpy.context.scene.collection.objects.unlink(lamp)
    source.objects.link(lamp)
    for name, x, scale in (("A", 0.0, 1.0), ("B", 10.0, 2.0)):
        empty = things.link(bpy.data.objects.new(name, None))
        empty.instance_type, empty.instance_collection = "COLLECTION", source
        empty.location.x, empty.scale = x, (scale,) * 3
    scene = export()
    found = {s.name: (s.center, s.radius) for s in scene.shapes}
    assert found["A/Ball"] == (pytest.approx((1.0, 0.0, 0.0)), pytest.approx(0.5))
    assert found["B/Ball"] == (pytest.approx((12.0, 0.0, 0.0)), pytest.approx(1.0))
    assert len(found) == 2 and sorted(light.name for light in scene.lights) == ["A/Lamp", "B/Lamp"]
    bpy.data.objects["B"].hide_render = True
    assert _names(export()) == ["A/Ball"]


def test_nested_collection_instances(export):
    inner, outer = _collection("Inner"), _collection("Outer")
    things.uv_sphere("Ball", collection=inner)
    nest = things.link(bpy.data.objects.new("Nest", None), outer)
    nest.instance_type, nest.instance_collection = "COLLECTION", inner
    nest.location.x = 3.0
    top = things.link(bpy.data.objects.new("Top", None))
    top.instance_type, top.instance_collection = "COLLECTION", outer
    top.location.y = 4.0
    (sphere,) = export().shapes
    assert sphere.center == pytest.approx((3.0, 4.0, 0.0))
    nest.hide_render = True
    assert export().shapes == ()


def test_moving_instances(export):
    source = _collection("Source")
    things.uv_sphere("Ball", collection=source)
    empty = things.link(bpy.data.objects.new("Empty", None))
    empty.instance_type, empty.instance_collection = "COLLECTION", source
    things.keyed(empty, "location", (0.0, 0.0, 0.0), (10.0, 0.0, 0.0))
    scene = bpy.context.scene
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 0.5
    scene.frame_set(6)
    (sphere,) = export().shapes
    assert sphere.center == pytest.approx((5.0, 0.0, 0.0), abs=1e-5)
    assert sphere.motion.displacement == pytest.approx((0.5, 0.0, 0.0), abs=1e-5)


def test_other_types_are_told(export):
    things.link(bpy.data.objects.new("Text", bpy.data.curves.new("Text", "FONT"))).data.body = "a"
    things.link(bpy.data.objects.new("Ball", bpy.data.metaballs.new("Ball")))
    things.link(bpy.data.objects.new("Empty", None))
    things.link(bpy.data.objects.new("Volume", bpy.data.volumes.new("Volume")))
    scene = export()
    assert scene.shapes == ()
    told = things.reasons(scene)
    assert "Text" in told and "Volume" in told and "Empty" not in told


def test_visibility_flags_are_told(export):
    things.uv_sphere("Ball").visible_shadow = False
    things.uv_sphere("Hole").is_holdout = True
    things.light("POINT", "Seen").visible_camera = True
    scene = export()
    assert set(things.reasons(scene)) == {"Ball", "Hole", "Seen"}
    assert len(scene.shapes) == 2 and len(scene.lights) == 1


def test_background_sets_are_seen(export):
    """What a scene's Background Set holds, and that one's, unless it is hidden there."""
    top, scenes = bpy.context.scene, []
    for name in ("Near", "Far"):
        scenes.append(bpy.data.scenes.new(name))
        inside = _collection(f"{name} Collection", scenes[-1].collection)
        things.uv_sphere(f"{name} Ball", collection=inside)
        things.uv_sphere(f"{name} Hidden", collection=inside).hide_render = True
    bpy.data.scenes["Far"].collection.objects.link(things.light("POINT", "Far Lamp"))
    bpy.context.scene.collection.objects.unlink(bpy.data.objects["Far Lamp"])
    top.background_set, scenes[0].background_set = scenes
    bpy.context.view_layer.update()
    scene = export()
    assert _names(scene) == ["Far Ball", "Near Ball"] and len(scene.lights) == 1
    bpy.data.collections["Far Collection"].hide_render = True
    assert _names(export()) == ["Near Ball"]
