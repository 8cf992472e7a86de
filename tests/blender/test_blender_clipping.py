# SPDX-License-Identifier: GPL-3.0-or-later
"""What the camera's Clip Start and Clip End would cut is told, by name."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import things


def _told(scene, word):
    return {name for name, said in things.reasons(scene).items() if any(word in s for s in said)}


def test_an_ordinary_scene_is_not_bothered(export):
    """Camera at 10 m, Clip Start 0.1 m, Clip End 100 m."""
    bpy.context.scene.camera.data.clip_end = 100.0
    things.uv_sphere("Ball")
    things.plane("Floor", size=60.0)
    things.uv_sphere("Behind").location.z = 10.5
    assert export().issues == ()


def test_far_and_near(export):
    data = bpy.context.scene.camera.data
    data.clip_start, data.clip_end = 1.0, 12.0
    things.uv_sphere("Near", radius=0.5).location.z = 9.0
    things.uv_sphere("Around", radius=0.5).location.z = 10.0
    things.uv_sphere("Fits", radius=0.5).location.z = 5.0
    things.plane("Far", size=2.0).location.z = -3.0
    slope = things.plane("Slope", size=8.0)
    slope.rotation_euler.y = 1.0
    bpy.context.view_layer.update()
    scene = export()
    assert _told(scene, "Clip Start, 1 m") == {"Near", "Around"}
    assert _told(scene, "Clip End, 12 m") == {"Far", "Slope"}
    assert len(scene.shapes) == 5


def test_what_comes_near_while_the_shutter_is_open(export):
    bpy.context.scene.camera.data.clip_start = 1.0
    ball = things.uv_sphere("Comes", radius=0.5)
    things.keyed(ball, "location", (0.0, 0.0, 0.0), (0.0, 0.0, 12.0))
    scene = bpy.context.scene
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 4.0
    scene.render.motion_blur_position = "START"
    scene.frame_set(5)
    assert _told(export(), "Clip Start") == {"Comes"}
    scene.render.motion_blur_shutter = 1.0
    assert _told(export(), "Clip Start") == set()


def test_against_points_of_the_shapes(addon, core, file):
    """Distances and depths by brute force, on random rectangles and balls."""
    import importlib

    clipping = importlib.import_module(f"{addon.__name__}.operators.export.clipping")
    seed = int(np.random.SeedSequence().entropy % 2**32)
    random = np.random.default_rng(seed)
    steps = np.linspace(0.0, 1.0, 101)
    for _ in range(40):
        turn, _r = np.linalg.qr(random.normal(size=(3, 3)))
        eye = random.normal(size=3) * 3.0
        rows = tuple(map(tuple, np.vstack([np.c_[turn, eye], [0.0, 0.0, 0.0, 1.0]])))
        corner = random.normal(size=3)
        u, v = np.linalg.qr(random.normal(size=(3, 2)))[0].T
        u, v = u * random.uniform(0.1, 9.0), v * random.uniform(0.1, 9.0)
        quad = core.Quad(tuple(corner), tuple(u), tuple(v))
        ball = core.Sphere(tuple(corner), 0.7)
        closest, deepest = clipping._reach(core.Camera(rows), [quad, ball])
        a, b = np.meshgrid(steps, steps)
        points = corner + a[..., None] * u + b[..., None] * v - eye
        coarse = (np.hypot(np.linalg.norm(u), np.linalg.norm(v))) / 100.0
        nearest = np.linalg.norm(points, axis=-1).min()
        assert nearest - coarse <= closest[0] <= nearest + 1e-12, seed
        assert deepest[0] == pytest.approx((points @ -turn[:, 2]).max()), seed
        away = np.linalg.norm(corner - eye)
        assert closest[1] == pytest.approx(abs(away - 0.7)), seed
        assert deepest[1] == pytest.approx((corner - eye) @ -turn[:, 2] + 0.7), seed
