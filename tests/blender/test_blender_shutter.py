# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion during the shutter, and the user's own frame."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
import things


@pytest.fixture
def shutter(file):
    scene = bpy.context.scene
    scene.render.use_motion_blur = True
    scene.render.motion_blur_shutter = 0.5
    scene.frame_set(6)
    return scene


@pytest.mark.parametrize("position, middle", [("START", 5.25), ("CENTER", 5.0), ("END", 4.75)])
def test_positions(export, shutter, position, middle):
    ball = things.uv_sphere()
    things.keyed(ball, "location", (0.0, 0.0, 0.0), (10.0, 0.0, 0.0))
    lamp = things.light("POINT", shadow_soft_size=0.0)
    things.keyed(lamp, "location", (0.0, 0.0, 0.0), (0.0, -10.0, 0.0))
    shutter.render.motion_blur_position = position
    shutter.frame_set(6)
    scene = export()
    (sphere,), (light,) = scene.shapes, scene.lights
    assert sphere.center == pytest.approx((middle, 0.0, 0.0), abs=1e-5)
    assert sphere.motion.displacement == pytest.approx((0.5, 0.0, 0.0), abs=1e-5)
    assert light.center == pytest.approx((0.0, -middle, 0.0), abs=1e-5)
    assert light.motion.displacement == pytest.approx((0.0, -0.5, 0.0), abs=1e-5)
    assert scene.issues == ()


def test_all_kinds_move_through_a_parent(export, shutter):
    parent = things.link(bpy.data.objects.new("Parent", None))
    things.keyed(parent, "location", (0.0, 0.0, 0.0), (10.0, 0.0, 0.0))
    moved = [things.uv_sphere(), things.plane(), things.light("AREA"), things.light("POINT")]
    for thing in moved:
        thing.parent = parent
    shutter.frame_set(6)
    scene = export()
    for thing in (*scene.shapes, *scene.lights):
        assert thing.motion.displacement == pytest.approx((0.5, 0.0, 0.0), abs=1e-5), thing.name
    assert scene.issues == ()


def test_still_things_have_no_motion(export, shutter):
    things.uv_sphere().location = (0.1, 0.2, 0.3)
    assert export().shapes[0].motion is None


def test_an_object_may_be_left_unblurred(export, shutter):
    ball = things.uv_sphere()
    things.keyed(ball, "location", (0.0, 0.0, 0.0), (10.0, 0.0, 0.0))
    shutter.frame_set(6)
    if hasattr(ball, "cycles"):  # Cycles is an add-on, and may be switched off
        ball.cycles.use_motion_blur = False
        scene = export()
        assert scene.shapes[0].motion is None and scene.issues == ()


def test_sphere_may_turn(export, shutter):
    ball = things.uv_sphere()
    things.keyed(ball, "rotation_euler", (0.0, 0.0, 0.0), (3.0, 2.0, 1.0))
    shutter.frame_set(6)
    scene = export()
    assert scene.shapes[0].motion is None and scene.issues == ()


def test_a_plane_that_turns_is_a_mesh_and_an_area_is_told(export, shutter):
    for thing in (things.plane(), things.light("AREA")):
        things.keyed(thing, "rotation_euler", (0.0, 0.0, 0.0), (0.0, 0.0, 3.0))
    shutter.frame_set(6)
    scene = export()
    (mesh,) = scene.shapes
    turned = np.arctan2(mesh.matrices[:, 1, 0, 0], mesh.matrices[:, 0, 0, 0])

    np.testing.assert_allclose(np.diff(turned), 0.075, atol=1e-5)
    assert turned[1] == pytest.approx(1.5, abs=1e-5) and mesh.motion is None
    assert set(things.reasons(scene)) == {"Area"}
    assert "turns" in things.reasons(scene)["Area"][0]


def test_a_sphere_that_grows_is_a_mesh(export, shutter):
    ball = things.uv_sphere()
    things.keyed(ball, "scale", (1.0, 1.0, 1.0), (2.0, 2.0, 2.0))
    shutter.frame_set(6)
    scene = export()
    size = scene.shapes[0].matrices[:, 2, 2, 0]
    np.testing.assert_allclose(size, (1.475, 1.5, 1.525), atol=1e-5)
    assert scene.issues == ()


def test_a_mesh_on_a_curved_path_is_where_it_is_at_three_times(export, shutter):
    shutter.render.motion_blur_shutter = 1.0
    parent = things.link(bpy.data.objects.new("Parent", None))
    things.keyed(parent, "rotation_euler", (0.0, 0.0, 0.0), (0.0, 0.0, 10.0))
    bpy.ops.mesh.primitive_torus_add()
    torus = bpy.context.object
    torus.parent, torus.location = parent, (3.0, 0.0, 0.0)
    shutter.frame_set(6)
    scene = export()
    (mesh,) = scene.shapes
    assert scene.issues == () and len(mesh.matrices) == 3
    np.testing.assert_allclose(np.linalg.norm(mesh.matrices[:, :2, 3, 0], axis=1), 3.0, atol=1e-5)


def test_curved_path_is_told(export, shutter):
    shutter.render.motion_blur_shutter = 1.0
    parent = things.link(bpy.data.objects.new("Parent", None))
    things.keyed(parent, "rotation_euler", (0.0, 0.0, 0.0), (0.0, 0.0, 10.0))
    ball = things.uv_sphere()
    ball.parent, ball.location = parent, (5.0, 0.0, 0.0)
    shutter.frame_set(6)
    scene = export()
    assert scene.shapes[0].motion is not None
    assert "path" in things.reasons(scene)["Sphere"][0]


def test_appearing_during_the_shutter(export, shutter):
    ball = things.uv_sphere()
    ball.hide_render = True
    ball.keyframe_insert("hide_render", frame=1)
    ball.hide_render = False
    ball.keyframe_insert("hide_render", frame=6)
    shutter.frame_set(6)
    scene = export()
    assert scene.shapes[0].motion is None
    assert "not there" in things.reasons(scene)["Sphere"][0]


@pytest.mark.parametrize("why", ["blur off", "not wanted", "no shutter"])
def test_still_scenes_never_move_the_frame(export, shutter, why):
    ball = things.uv_sphere()
    things.keyed(ball, "location", (0.0, 0.0, 0.0), (10.0, 0.0, 0.0))
    shutter.frame_set(6)
    if why == "blur off":
        shutter.render.use_motion_blur = False
    elif why == "no shutter":
        shutter.render.motion_blur_shutter = 0.0
    seen = []
    handler = lambda scene, *_: seen.append((scene.frame_current, scene.frame_subframe))  # noqa: E731
    bpy.app.handlers.frame_change_pre.append(handler)
    try:
        scene = export(use_motion=why != "not wanted")
    finally:
        bpy.app.handlers.frame_change_pre.remove(handler)
    # a render evaluates the current frame, and no other
    assert set(seen) == {(6, 0.0)} and scene.shapes[0].motion is None


@pytest.mark.parametrize("blur", [False, True])
def test_edits_that_are_not_keyed_stay(export, shutter, blur):
    """The picture shows what is keyed, as F12's does; the edit itself is not lost."""
    ball = things.uv_sphere()
    things.keyed(ball, "location", (0.0, 0.0, 0.0), (10.0, 0.0, 0.0))
    ball["size.of it"] = 1.0
    ball.keyframe_insert('["size.of it"]', frame=1)
    paint = things.material(Base_Color=(1.0, 1.0, 1.0, 1.0))
    node = paint.node_tree.nodes["Principled BSDF"]
    node.name = "A.001"
    node.inputs["Base Color"].keyframe_insert("default_value", frame=1)
    ball.data.materials.append(paint)
    shutter.render.use_motion_blur = blur
    shutter.frame_set(6)
    ball.location.x, ball["size.of it"] = 77.0, 3.0
    node.inputs["Base Color"].default_value[1] = 0.25
    bpy.context.view_layer.update()
    assert export().shapes[0].center[0] == pytest.approx(5.0)
    bpy.context.view_layer.update()
    assert ball.location.x == 77.0 and ball.matrix_world.translation.x == 77.0
    assert ball["size.of it"] == 3.0 and node.inputs["Base Color"].default_value[1] == 0.25


@pytest.mark.parametrize("fail", [False, True])
def test_frame_and_subframe_come_back(export, shutter, core, fail):
    things.uv_sphere()
    shutter.frame_set(3, subframe=0.25)
    if fail:
        shutter.camera.data.type = "ORTHO"
        with pytest.raises(core.SceneError):
            export()
    else:
        export()
    assert (shutter.frame_current, shutter.frame_subframe) == (3, 0.25)


@pytest.mark.parametrize("length", [math.nan, math.inf, 1e9])
def test_a_shutter_that_is_no_time_is_refused(export, core, shutter, length):
    """Blender keeps any float32 here, one that is no number as well."""
    things.uv_sphere()
    shutter.render.motion_blur_shutter = length
    with pytest.raises(core.SceneError, match="shutter"):
        export()


@pytest.mark.parametrize("position", ["START", "CENTER", "END"])
def test_a_cut_between_cameras(rendered, shutter, position):
    """Markers switch the camera while the shutter is open; the picture is one camera's alone."""
    things.uv_sphere()
    shutter.render.motion_blur_position = position
    cameras = [shutter.camera, shutter.camera.copy()]
    things.link(cameras[1]).location.x = 3.0
    for frame, camera in zip((1, 3), cameras, strict=True):
        shutter.timeline_markers.new(camera.name, frame=frame).camera = camera
    found = [s.camera for s in rendered(2, 3)]
    assert [c.matrix[0][3] for c in found] == [0.0, 3.0]
    assert [c.motion for c in found] == [None, None]


def test_the_user_s_own_choice_of_a_camera_stays(export, shutter):
    """Markers decide what is rendered, as for F12; what the 3D View looks through stays."""
    chosen, other = shutter.camera, shutter.camera.copy()
    things.link(other).location.x = 3.0
    shutter.timeline_markers.new("Cut", frame=2).camera = other
    shutter.camera = chosen
    assert export().camera.matrix[0][3] == 3.0 and shutter.camera == chosen
