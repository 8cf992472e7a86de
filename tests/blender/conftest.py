# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender as a module, the add-on under a name of our own, and an empty file for each test."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from dataclasses import replace
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "demo"))

PACKAGE = "drt_under_test"
"""Not the checkout's name, and not the core's: imports must be relative to pass."""

collect_ignore_glob = ["test_*.py"]
if importlib.util.find_spec("bpy"):
    import bpy  # noqa: F401  (bmesh can be imported only after it)

    collect_ignore_glob = []


@pytest.fixture(scope="session")
def addon():
    from addon import load_addon

    package = load_addon(PACKAGE)
    package.register()
    yield package
    # bpy 4.5 hangs at exit while classes stay registered
    package.unregister()


@pytest.fixture
def core(addon):
    """The core's records as the add-on itself imports them."""
    return importlib.import_module(f"{PACKAGE}.adaptive_drt.scene.description")


@pytest.fixture
def file(addon):
    """An empty file with a camera that looks down from 10 m."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    state = importlib.import_module(f"{PACKAGE}.operators.state").state
    kept = (state.issues, state.layers, state.logged, state.figures, state.newest)
    for one in kept:
        one.clear()
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0.0, 0.0, 10.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x = scene.render.resolution_y = 8
    return bpy.data


@pytest.fixture
def export(addon, file):
    """Export the scene as the operator does; returns the core's scene, with single shapes."""
    import bpy

    module = importlib.import_module(f"{PACKAGE}.operators.engine_export")
    description = importlib.import_module(f"{PACKAGE}.adaptive_drt.scene.description")

    def run(use_motion=True):
        render = bpy.context.scene.render
        before = render.use_motion_blur
        render.use_motion_blur = before and use_motion
        try:
            scene = module.export_for_render(bpy.context.scene, bpy.context.view_layer)[0]
            return replace(scene, shapes=description.single_shapes(scene.shapes))
        finally:
            render.use_motion_blur = before

    return run


@pytest.fixture
def rendered(addon, file, monkeypatch, tmp_path):
    """Render with the engine, one frame or those from first to last; the core's scene of each, with
    single shapes.
    """
    import bpy

    engine = importlib.import_module(f"{PACKAGE}.operators.engine_export")
    description = importlib.import_module(f"{PACKAGE}.adaptive_drt.scene.description")
    made, found = engine.export_scene, []
    monkeypatch.setattr(engine, "export_scene", lambda *a: found.append(made(*a)) or found[-1])

    def run(first=None, last=None):
        found.clear()
        scene = bpy.context.scene
        scene.render.engine, scene.render.filepath = "ADAPTIVE_DRT", str(tmp_path / "frame_")
        if first is not None:
            scene.frame_start, scene.frame_end = first, last
        bpy.ops.render.render(animation=first is not None)
        return [replace(one, shapes=description.single_shapes(one.shapes)) for one in found]

    return run
