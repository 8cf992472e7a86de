# SPDX-License-Identifier: GPL-3.0-or-later
"""The camera and the picture's frame."""

from __future__ import annotations

import bpy
import pytest
import things


def test_camera(export):
    thing = bpy.context.scene.camera
    data = thing.data
    data.lens, data.sensor_fit, data.shift_x, data.shift_y = 35.0, "VERTICAL", 0.1, -0.2
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = 333, 101, 50
    render.pixel_aspect_x, render.pixel_aspect_y = 1.0, 2.0
    camera = export().camera
    assert camera.focal_length == 35.0 and camera.sensor_fit == "VERTICAL"
    assert (camera.sensor_width, camera.sensor_height) == (36.0, 24.0)
    assert (camera.shift_x, camera.shift_y) == pytest.approx((0.1, -0.2))
    assert camera.resolution == (166, 50) and camera.pixel_aspect == (1.0, 2.0)
    assert camera.border is None and camera.motion is None
    assert [row[3] for row in camera.matrix] == [0.0, 0.0, 10.0, 1.0]


def test_border(export):
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y = 100, 50
    render.use_border = True
    render.border_min_x, render.border_max_x = 0.25, 0.75
    render.border_min_y, render.border_max_y = 0.5, 1.0
    assert export().camera.border == (25, 25, 75, 50)


def test_camera_moves(export):
    thing = bpy.context.scene.camera
    things.keyed(thing, "location", (0.0, 0.0, 10.0), (0.0, 10.0, 10.0))
    bpy.context.scene.render.use_motion_blur = True
    bpy.context.scene.frame_set(6)
    camera = export().camera
    assert camera.motion.displacement == pytest.approx((0.0, 0.5, 0.0), abs=1e-5)
    assert camera.matrix[1][3] == pytest.approx(5.0, abs=1e-5)


def test_depth_of_field_is_told(export):
    bpy.context.scene.camera.data.dof.use_dof = True
    assert "depth of field" in things.reasons(export())['Camera "Camera"'][0]


def test_stereoscopy_is_told(export):
    assert export().issues == ()
    bpy.context.scene.render.use_multiview = True
    (reason,) = things.reasons(export())['Scene "Scene"']
    assert "Stereoscopy is left out" in reason and "use_multiview" in reason


@pytest.mark.parametrize("kind, said", [("ORTHO", "orthographic"), ("PANO", "panoramic")])
def test_other_cameras(export, core, kind, said):
    bpy.context.scene.camera.data.type = kind
    with pytest.raises(core.SceneError, match=f'The camera "Camera" is {said}'):
        export()


def test_no_camera(export, core):
    bpy.context.scene.camera = None
    with pytest.raises(core.SceneError, match="no camera: add one"):
        export()


def test_no_camera_but_a_light(export, core):
    bpy.context.scene.camera = things.light("POINT", "Lamp")
    with pytest.raises(core.SceneError, match='"Lamp" is no camera'):
        export()
