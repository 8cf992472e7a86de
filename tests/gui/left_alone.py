# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in Blender's window: it is closed, and the file is saved, while a picture is rendered."""

from __future__ import annotations

import importlib
import json
import sys
import time
from pathlib import Path

import bpy
import numpy as np

FOLDER = Path(sys.argv[sys.argv.index("--") + 1])
sys.path.insert(0, str(FOLDER))

from desk import act, shoot  # noqa: E402

PACKAGE = "bl_ext.user_default.adaptive_drt"
FACTS = {}
state = importlib.import_module(f"{PACKAGE}.operators.state").state


def idle():
    return not (state.job or state.preparing)


def wait(over, seconds=60.0):
    began = time.monotonic()
    while not over() and time.monotonic() - began < seconds:
        yield 0.05


def seen_part():
    """What part of the picture is there."""
    image = bpy.data.images["Adaptive Render"]
    flat = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(flat)
    return float((flat[3::4] > 0.0).mean())


def figures():
    return json.loads(bpy.data.images["Adaptive Mask"]["adaptive_drt"])


def start(window):
    area = max(window.screen.areas, key=lambda a: a.width * a.height)
    with bpy.context.temp_override(window=window, area=area, region=area.regions[-1]):
        bpy.ops.adaptive_drt.render("INVOKE_DEFAULT")


def first_sign(window):
    """What the status bar says until the render runs, and when progress comes."""
    texts = []
    began = time.monotonic()
    start(window)
    while time.monotonic() - began < 30.0 and not (state.job and state.job.factor > 0.0):
        texts.append(state.job.text if state.job else "preparing" if state.preparing else "")
        yield 0.02
    FACTS["first"] = texts[0] if texts else None


def save_meanwhile(window):
    """How long saving takes while it renders, beside a save that has to pack a picture."""
    yield from first_sign(window)
    yield from wait(lambda: state.job is None or state.job.factor > 0.3)
    FACTS["rendering"] = state.job is not None
    path = str(FOLDER / "saved.blend")
    began = time.monotonic()
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    FACTS["saved_meanwhile"] = time.monotonic() - began
    state.job.cancel()
    yield from wait(idle)
    yield 1.0
    FACTS["dirty"] = bpy.data.images["Adaptive Render"].is_dirty
    began = time.monotonic()
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    FACTS["saved_after"] = time.monotonic() - began
    FACTS["clean"] = not bpy.data.images["Adaptive Render"].is_dirty
    began = time.monotonic()
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    FACTS["saved_again"] = time.monotonic() - began


def close_window():
    """The window that began the render is closed; what is done is kept, and said."""
    manager = bpy.context.window_manager
    bpy.data.images.remove(bpy.data.images["Adaptive Mask"])
    with bpy.context.temp_override(window=manager.windows[0]):
        bpy.ops.wm.window_new()
    yield 1.0
    second = manager.windows[-1]
    start(second)
    yield from wait(lambda: state.job is not None and state.job.factor > 0.3)
    FACTS["closing"] = state.job is not None
    with bpy.context.temp_override(window=second):
        bpy.ops.wm.window_close()
    yield 1.5
    FACTS["windows"] = len(manager.windows)
    FACTS["idle"] = idle()
    FACTS["part"] = seen_part()
    FACTS["figures"] = figures()
    shoot("closed")
    # the button goes on working in the window that is left
    start(manager.windows[0])
    yield from wait(lambda: state.job is not None)
    FACTS["again"] = state.job is not None
    state.job.cancel()
    yield from wait(idle)


def steps():
    bpy.context.preferences.view.render_display_type = "NONE"
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 1280, 960
    scene.adaptive_drt.tolerance = 1e-4
    yield 1.0
    yield from save_meanwhile(bpy.context.window_manager.windows[0])
    yield from close_window()


act(steps(), FACTS, "left_alone")
