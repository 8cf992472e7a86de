# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in Blender's window: uses the extension as a person does, and writes down what it saw.

Mouse and keys are real events of the X server; screenshots and facts.json go to the folder given.
"""

from __future__ import annotations

import importlib
import json
import os
import sys
import threading
import time
from pathlib import Path

import bpy
import numpy as np

FOLDER = Path(sys.argv[sys.argv.index("--") + 1])
sys.path.insert(0, str(FOLDER))

from desk import act, areas, arrange, point, press, press_long, shoot  # noqa: E402

PACKAGE = "bl_ext.user_default.adaptive_drt"
CHUNK = 0.1
"""Seconds of a processor's time: a render looks that often whether to go on."""
FACTS = {"gaps": {}}
state = importlib.import_module(f"{PACKAGE}.operators.state").state
job = importlib.import_module(f"{PACKAGE}.operators.job")


def click_button(view):
    """The first button of the sidebar's first panel lies 55 pixels below its top."""
    region = next(r for r in view.regions if r.type == "UI")
    point(region.x + region.width // 2 - 10, region.y + region.height - 55)
    press("click", 1)


def start(view):
    """Click until it renders: a panel that is not drawn yet takes no click."""
    for _ in range(5):
        click_button(view)
        yield 0.7
        if not idle():
            return
    raise RuntimeError("the button does nothing")


def watched(name, over):
    """Wait until `over()`, and note the longest time that the window stood still."""
    began = last = time.monotonic()
    gaps = []
    while not over() and time.monotonic() - began < 60.0:
        yield 0.02
        now = time.monotonic()
        gaps.append(now - last)
        last = now
    FACTS["gaps"][name] = {"longest": max(gaps, default=0.0), "looks": len(gaps)}
    FACTS[f"{name}_seconds"] = time.monotonic() - began


def idle():
    return state.job is None


def press_escape(view, kept):
    """Press ESC in the 3D view; note the seconds until the render is over, and the machine's."""
    point(view.x + 300, view.y + 300)
    press("key", "Escape")
    yield from watched("escape", idle)
    seconds = FACTS["escape_seconds"]
    yield 0.5
    yield from measure_machine()
    FACTS.setdefault(kept, []).append((seconds, *FACTS["machine"]))


def measure_machine():
    """Note what ESC has to wait for, with no render: a picture drawn, and a chunk of rays.

    The chunk is 0.1 s of a processor's time in a thread as gentle as the render's.
    """
    image = bpy.data.images["Adaptive Render"]
    flat = np.zeros(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(flat)
    began = time.monotonic()
    image.pixels.foreach_set(flat)
    yield 0.01
    drawn = time.monotonic()
    chunk = threading.Thread(target=work_gently)
    chunk.start()
    while chunk.is_alive():
        yield 0.02
    FACTS["machine"] = drawn - began, time.monotonic() - drawn


def work_gently():
    mine = threading.get_native_id()
    os.setpriority(os.PRIO_PROCESS, mine, os.getpriority(os.PRIO_PROCESS, mine) + job.GENTLE)
    numbers = np.ones(100_000)
    while time.thread_time() < CHUNK:
        np.sqrt(numbers)


def picture():
    """How large the picture is, and what part of it is not black."""
    image = bpy.data.images.get("Adaptive Render")
    if image is None:
        return None
    flat = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(flat)
    return {"size": list(image.size), "part": float((flat[3::4] > 0.0).mean())}


def cancel_by_escape(view, editor):
    """A large picture is begun by a click and ended by ESC; what is there stays."""
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y = 1920, 1080
    ours = bpy.context.scene.adaptive_drt
    # long enough to be cancelled
    ours.method, ours.tolerance = "EXACT", 1e-4
    yield from start(view)
    yield from watched("filling", lambda: idle() or state.job.factor > 0.1)
    FACTS["running"] = state.job is not None
    FACTS["text"] = state.job.text if state.job else ""
    # progress begins before there are pixels
    yield from watched("first pixels", lambda: idle() or editor.spaces.active.image is not None)
    FACTS["shown_while_running"] = getattr(editor.spaces.active.image, "name", None)
    with bpy.context.temp_override(area=editor, region=editor.regions[-1]):
        bpy.ops.image.view_all(fit_view=True)
    yield from watched("shown", lambda: idle() or state.job.factor > 0.15)
    shoot("running")  # some of its rows are there, others are not
    yield from watched("refining", lambda: idle() or state.job.factor > 0.4)
    click_button(view)  # a second click harms nothing
    yield 0.3
    yield from press_escape(view, "exact_escapes")
    FACTS["cancelled"] = picture()
    FACTS["figures"] = json.loads(bpy.data.images["Adaptive Mask"]["adaptive_drt"])
    for ours.method, kept, times in (("RAYS", "escapes", 4), ("EXACT", "exact_escapes", 4)):
        for again in range(times):
            yield from start(view)
            # at another moment of the render each time
            yield 1.0 + 0.37 * again
            yield from press_escape(view, kept)


def cancel_by_button(view):
    """The X beside the bar, pressed as long as a finger does."""
    yield from start(view)
    region = next(r for r in view.regions if r.type == "UI")
    for _ in range(5):
        yield from press_long(region.x + region.width - 42, region.y + region.height - 55)
        if idle():
            break
    FACTS["button"] = idle() and json.loads(bpy.data.images["Adaptive Mask"]["adaptive_drt"])
    press("key", "Escape")
    yield from watched("button", idle)


def undo(view):
    """Whatever is undone, the picture and who shows it stay."""
    before = picture()
    bpy.context.scene.objects["Red"].location.z += 1.0
    bpy.ops.ed.undo_push(message="an edit")
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, area=view):
        bpy.ops.ed.undo()
    yield 0.5
    shown = [a.spaces.active.image for a in areas("IMAGE_EDITOR")]
    FACTS["undone"] = {"same": picture() == before, "shown": [i and i.name for i in shown]}


def finish(view, editor):
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y = 480, 320
    # as a new scene has them
    for name in ("method", "tolerance", "time_rays"):
        bpy.context.scene.adaptive_drt.property_unset(name)
    yield from start(view)
    yield from watched("whole", idle)
    FACTS["finished"] = picture()
    with bpy.context.temp_override(area=editor, region=editor.regions[-1]):
        bpy.ops.image.view_all(fit_view=True)
    yield 1.0
    shoot("finished")


def engine(view, editor):
    """The engine's render is ended by ESC, and then left to end."""
    scene = bpy.context.scene
    scene.render.engine = "ADAPTIVE_DRT"
    scene.adaptive_drt.method = "RAYS"
    scene.render.resolution_x, scene.render.resolution_y = 1920, 1080
    yield 0.5
    invoke_render(view)
    yield 3.0
    FACTS["engine_running"] = state.job is not None
    editor.spaces.active.image = bpy.data.images["Render Result"]
    yield from watched("engine_filling", lambda: idle() or state.job.factor > 0.2)
    window = bpy.context.window_manager.windows[0]
    region = next(r for r in editor.regions if r.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=editor, region=region):
        bpy.ops.image.view_all(fit_view=True)
    yield 1.0
    shoot("engine")
    yield from press_escape(view, "engine_escapes")
    for again in range(2):
        yield 1.0
        invoke_render(view)
        yield 2.0 + 0.37 * again
        yield from press_escape(view, "engine_escapes")
    # its button is offered again though Blender has not drawn it since
    yield from start(view)
    FACTS["after_engine"] = not idle()
    press("key", "Escape")
    yield from watched("after_engine", idle)
    yield 1.0


def invoke_render(view):
    """Menu Render, Render Image; the key's own meaning varies with the place of the mouse."""
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, area=view):
        bpy.ops.render.render("INVOKE_DEFAULT")


def compositor(view, editor):
    """The nodes on the left, what they make of the picture on the right."""
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 480, 320
    scene.adaptive_drt.property_unset("method")
    invoke_render(view)
    yield 0.5
    yield from watched("engine_whole", idle)
    yield 1.0
    # an editor that is open is used; a new window would lie over the others
    view.ui_type = "CompositorNodeTree"
    yield 0.5
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, area=view):
        bpy.ops.adaptive_drt.show_mask(to_output=True)
    yield 2.0
    space = view.spaces.active
    for switch in ("show_region_ui", "show_region_asset_shelf", "show_backdrop"):
        if hasattr(space, switch):
            setattr(space, switch, False)
    space.overlay.show_context_path = False  # it lies over the nodes
    editor.spaces.active.image = bpy.data.images.get("Viewer Node")
    yield 1.0
    # its own nodes alone are selected, so they fill the view
    for area, fit in ((view, bpy.ops.node.view_selected), (editor, bpy.ops.image.view_all)):
        region = next(r for r in area.regions if r.type == "WINDOW")
        window = bpy.context.window_manager.windows[0]
        with bpy.context.temp_override(window=window, area=area, region=region):
            fit()
    yield 1.0
    for node in space.edit_tree.nodes:
        node.select = False
    yield 1.0
    shoot("compositor")
    viewer = bpy.data.images.get("Viewer Node")
    FACTS["viewer"] = list(viewer.size) if viewer else None


def viewport(view):
    """EEVEE draws the viewport under this engine too; it must only not crash."""
    bpy.context.scene.render.engine = "ADAPTIVE_DRT"
    view.spaces.active.shading.type = "MATERIAL"
    yield 1.5
    view.spaces.active.shading.type = "SOLID"
    yield 0.3


def trouble(view):
    """Undo, and the scene deleted, while it renders."""
    window = bpy.context.window_manager.windows[0]
    kept = window.scene
    copy = window.scene = kept.copy()
    copy.render.resolution_x, copy.render.resolution_y = 960, 640
    copy.adaptive_drt.method = "RAYS"
    yield 0.5
    yield from start(view)
    FACTS["before_trouble"] = state.job is not None
    point(view.x + 300, view.y + 300)
    press("key", "ctrl+z")
    yield 0.5
    # what undo has left of the copy
    copy, window.scene = window.scene, bpy.data.scenes["Scene"]
    if copy != window.scene:
        bpy.data.scenes.remove(copy)
    yield 1.0
    FACTS["in_trouble"] = state.job is not None
    press("key", "Escape")
    yield from watched("trouble", idle)
    FACTS["after_trouble"] = picture()
    yield 0.5


def load_while_running(view):
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 1920, 1080
    scene.adaptive_drt.method = "RAYS"
    yield from start(view)
    FACTS["before_load"] = state.job is not None
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        bpy.ops.wm.read_homefile(use_empty=False)
    yield 0.5
    FACTS["after_load"] = idle()


def open_sidebar(view):
    if view.type != "VIEW_3D":
        view.type = "VIEW_3D"
    view.spaces.active.show_region_ui = True
    yield 1.0
    region = next(r for r in view.regions if r.type == "UI")
    # the tab is there once the region has been drawn
    for _ in range(5):
        region.active_panel_category = "Adaptive Render"
        region.tag_redraw()
        yield 0.5
        if region.active_panel_category == "Adaptive Render":
            break
    yield 0.5


def steps():
    # the open Image Editor is to show the picture, not a window of its own
    bpy.context.preferences.view.render_display_type = "NONE"
    yield 1.0
    view, editor = yield from arrange()
    yield from open_sidebar(view)
    yield from cancel_by_escape(view, editor)
    yield from cancel_by_button(view)
    yield from undo(view)
    yield from finish(view, editor)
    yield from viewport(view)
    yield from engine(view, editor)
    yield from compositor(view, editor)
    yield from open_sidebar(view)
    yield from trouble(view)
    yield from load_while_running(view)


act(steps(), FACTS, "facts")
