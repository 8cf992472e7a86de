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
def test_hidden_in_the_viewport_alone_is_rendered(export, how):
    ball = things.uv_sphere("Ball")
    if how == "eye":
        bpy.context.view_layer.update()
        ball.hide_set(True)
    else:
        ball.hide_viewport = True
    scene = export()
    assert _names(scene) == ["Ball"] and scene.issues == ()


def test_collection_instances(export):
    source = _collection("Source")
    things.uv_sphere("Ball", radius=0.5, collection=source).location = (1.0, 0.0, 0.0)
    things.uv_sphere("Never", collection=source).hide_render = True
    lamp = things.light("POINT", "Lamp")
    bpy.context.scene.collection.objects.unlink(lamp)
    source.objects.link(lamp)
    for name, x, scale in (("A", 0.0, 1.0), ("B", 10.0, 2.0)):
        empty = _instancer(name, source)
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


def _instancer(name, collection):
    empty = things.link(bpy.data.objects.new(name, None))
    empty.instance_type, empty.instance_collection = "COLLECTION", collection
    return empty


def _both(export, rendered):
    """Names that the button and the engine render alike, without a word of what is left out."""
    (scene,), mine = rendered(), export()
    assert _names(scene) == _names(mine) and scene.issues == mine.issues == ()
    return _names(mine)


def test_visibility_that_is_keyed(rendered):
    """A render of an animation does not set the switch of the object that a person sees."""
    balls = {name: things.uv_sphere(name) for name in ("Comes", "Goes")}
    for frame, shown in ((1, ("Goes",)), (3, ("Comes",))):
        for name, ball in balls.items():
            ball.hide_render = name not in shown
            ball.keyframe_insert("hide_render", frame=frame)
    bpy.context.scene.frame_set(1)
    assert [_names(s) for s in rendered(1, 4)] == [["Goes"]] * 2 + [["Comes"]] * 2


def test_visibility_that_is_driven(export, rendered):
    ball = things.uv_sphere("Ball")
    ball.driver_add("hide_render").driver.expression = "frame > 3"
    bpy.context.scene.frame_set(2)
    assert _both(export, rendered) == ["Ball"]
    bpy.context.scene.frame_set(5)
    assert _both(export, rendered) == []


@pytest.mark.parametrize("how", ["hidden", "excluded", "collection hidden"])
def test_nodes_show_what_is_hidden_elsewhere(export, rendered, how):
    """What nodes scatter is mostly hidden where it stands itself."""
    sources = _collection("Sources", bpy.context.scene.collection)
    ball = things.uv_sphere("Ball", collection=sources)
    if how == "excluded":
        bpy.context.view_layer.layer_collection.children["Sources"].exclude = True
    else:
        (ball if how == "hidden" else sources).hide_render = True
    field = things.plane("Field")
    things.scatter(field, ball if how == "hidden" else None, sources)
    assert _both(export, rendered) == ["Field/Ball"] * 4
    field.hide_render = True
    assert _both(export, rendered) == []


def test_instanced_nodes(export, rendered):
    """What a member of an instanced collection scatters is no member itself."""
    inside = _collection("Inside")
    field, ball = things.plane("Field"), things.uv_sphere("Ball")
    bpy.context.scene.collection.objects.unlink(field)
    inside.objects.link(field)
    things.scatter(field, ball)
    things.uv_sphere("Never", collection=inside).hide_render = True
    _instancer("Top", inside)
    assert _both(export, rendered) == ["Ball"] + ["Top/Ball"] * 4
    ball.hide_render = True
    assert _both(export, rendered) == ["Top/Ball"] * 4
    field.hide_render = True
    assert _both(export, rendered) == []


def test_particles_show_what_is_hidden_elsewhere(export, rendered):
    ball, field = things.uv_sphere("Ball", radius=0.1), things.plane("Field")
    field.modifiers.new("Particles", "PARTICLE_SYSTEM")
    particles = field.particle_systems[0].settings
    particles.type, particles.count, particles.render_type = "HAIR", 3, "OBJECT"
    particles.instance_object = ball
    assert _both(export, rendered) == ["Ball", "Field"] + ["Field/Ball"] * 3
    ball.hide_render, field.show_instancer_for_render = True, False
    assert _both(export, rendered) == ["Field/Ball"] * 3


@pytest.mark.parametrize("kind, count", [("VERTS", 4), ("FACES", 1)])
def test_children_repeated_on_a_mesh(export, rendered, kind, count):
    """They are not shown where they stand; their own children are."""
    field, ball, grandchild = things.plane("Field"), things.uv_sphere("A"), things.uv_sphere("B")
    ball.parent, grandchild.parent, field.instance_type = field, ball, kind
    repeated = ["Field/A"] * count + ["Field/B"] * count
    assert _both(export, rendered) == ["B", "Field", *repeated]
    ball.hide_render = True
    assert _both(export, rendered) == ["B", "Field"] + ["Field/B"] * count
    field.hide_render = True
    assert _both(export, rendered) == ["B"]


def test_a_camera_that_is_not_in_the_view_layer(export, rendered):
    scene = bpy.context.scene
    away, camera = _collection("Away", scene.collection), scene.camera
    scene.collection.objects.unlink(camera)
    away.objects.link(camera)
    camera.parent = rig = things.link(bpy.data.objects.new("Rig", None), away)
    rig.location.x = 2.0
    bpy.context.view_layer.layer_collection.children["Away"].exclude = True
    (found,) = rendered()
    assert found.camera.matrix[0][3] == export().camera.matrix[0][3] == pytest.approx(2.0)


def test_texts_and_curves_that_have_faces_are_rendered_once(export, rendered):
    """They come a second time as meshes."""
    text = things.link(bpy.data.objects.new("Text", bpy.data.curves.new("Text", "FONT")))
    text.data.body, text.data.resolution_u = 40 * "a", 64
    for scene in (export(), *rendered()):
        assert scene.issues == () and [shape.name for shape in scene.shapes] == ["Text"]


def test_a_mesh_that_is_empty_leaves_nothing_out(export):
    things.mesh_object("Nothing", [], [])
    things.mesh_object("Edge", [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)], [])
    assert export().issues == ()


def test_visibility_flags_are_told(export):
    things.uv_sphere("Ball").is_shadow_catcher = True
    things.uv_sphere("Hole").is_holdout = True
    things.light("POINT", "Seen", shadow_soft_size=0.5).visible_camera = True
    things.light("POINT", "No size to see").visible_camera = True
    scene = export()
    assert set(things.reasons(scene)) == {"Ball"}
    assert [shape.visibility.holdout for shape in scene.shapes] == [False, True]
    assert len(scene.shapes) == 2 and all(light.seen for light in scene.lights)


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


def test_ray_visibility_is_that_of_the_shapes(export):
    things.uv_sphere("Unseen").visible_camera = False
    things.uv_sphere("Bright").visible_shadow = False
    things.uv_sphere("Ball")
    scene = export()
    found = {shape.name: shape.visibility for shape in scene.shapes}
    assert (found["Unseen"].camera, found["Unseen"].shadow) == (False, True)
    assert (found["Bright"].camera, found["Bright"].shadow) == (True, False)
    assert found["Ball"].camera and found["Ball"].shadow and scene.issues == ()


def _linked(name, *members, state="INCLUDE"):
    inside = bpy.data.collections.new(name)
    for member in members:
        inside.objects.link(member)
    for entry in inside.collection_objects:
        entry.light_linking.link_state = state
    return inside


@pytest.mark.parametrize("state", ["INCLUDE", "EXCLUDE"])
def test_lights_are_linked_to_collections(export, state):
    one, two = things.uv_sphere("One"), things.uv_sphere("Two")
    lamp, other = things.light("POINT", "Lamp"), things.light("POINT", "Other")
    lamp.light_linking.receiver_collection = _linked("Receivers", one, state=state)
    lamp.light_linking.blocker_collection = _linked("Blockers", two, state=state)
    other.light_linking.receiver_collection = _linked("Empty")
    scene = export()
    found = {shape.name: shape.visibility for shape in scene.shapes}
    unlit, clear = ("Two", "One") if state == "INCLUDE" else ("One", "Two")
    assert found[unlit].unlit_by == {"Lamp"} and found[clear].unlit_by == set()
    assert found[clear].passed_by == {"Lamp"} and found[unlit].passed_by == set()
    assert scene.issues == () and two.name == "Two"
