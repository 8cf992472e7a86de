# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures and their figures outlive undo and redo, and the user's edits do not."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import things

OURS = ("Adaptive Render", "Adaptive Samples", "Adaptive Mask")


@pytest.fixture
def ball(file):
    """A ball over a floor; the undo history begins here."""
    things.plane(size=12.0)
    things.light("POINT", energy=500.0).location = (1.0, 0.0, 5.0)
    made = things.uv_sphere()
    bpy.ops.ed.undo_push(message="begin")
    return made.name


def _move(name, x):
    bpy.data.objects[name].location.x = x
    bpy.ops.ed.undo_push(message="move")


def _held():
    """Each image's pixels, and the figures."""
    found = []
    for name in OURS:
        image = bpy.data.images[name]
        flat = np.empty(len(image.pixels), dtype=np.float32)
        image.pixels.foreach_get(flat)
        found.append((name, tuple(image.size), image.colorspace_settings.name, flat.tobytes()))
    return found, bpy.data.images["Adaptive Mask"]["adaptive_drt"]


def test_a_picture_that_is_newer_than_the_step(ball):
    bpy.ops.adaptive_drt.render()
    before = _held()
    assert np.frombuffer(before[0][0][3], dtype=np.float32).any()
    _move(ball, 2.0)
    bpy.ops.ed.undo()
    assert bpy.data.objects[ball].location.x == 0.0 and _held() == before
    bpy.ops.ed.redo()
    assert bpy.data.objects[ball].location.x == 2.0 and _held() == before
    assert len(bpy.data.images) == 3 and all(i.use_fake_user for i in bpy.data.images)


def test_a_picture_rendered_anew_between_steps(ball):
    bpy.ops.adaptive_drt.render()
    _move(ball, 2.0)
    bpy.context.scene.render.resolution_x = 12
    bpy.ops.adaptive_drt.render()
    _move(ball, 3.0)
    before = _held()
    assert before[0][0][1] == (12, 8)
    for step, x in ((bpy.ops.ed.undo, 2.0), (bpy.ops.ed.undo, 0.0), (bpy.ops.ed.redo, 2.0)):
        step()
        assert bpy.data.objects[ball].location.x == x and _held() == before


def test_an_image_editor_keeps_showing_it(ball, addon):
    (window,) = bpy.context.window_manager.windows
    area = window.screen.areas[0]
    area.type = "IMAGE_EDITOR"
    bpy.ops.adaptive_drt.render()
    area.spaces.active.image = bpy.data.images["Adaptive Mask"]
    _move(ball, 2.0)
    bpy.ops.ed.undo()
    assert area.spaces.active.image == bpy.data.images["Adaptive Mask"]


def test_steps_without_a_picture_make_none(ball):
    _move(ball, 2.0)
    bpy.ops.ed.undo()
    bpy.ops.ed.redo()
    assert not set(OURS) & set(bpy.data.images.keys())
