# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in Blender's window: reads the report of a render, and clicks on it.

Screenshots and list.json go to the folder given.
"""

from __future__ import annotations

import importlib
import sys
import time
from pathlib import Path

import bpy
import numpy as np

FOLDER = Path(sys.argv[sys.argv.index("--") + 1])
sys.path.insert(0, str(FOLDER))

from desk import HEIGHT, act, areas, point, press, shoot  # noqa: E402

PACKAGE = "bl_ext.user_default.adaptive_drt"
TAB = "Adaptive Render"
FAR = 1e31
"""Metres: beyond what the tracer takes."""
FACTS = {"drawn": []}
state = importlib.import_module(f"{PACKAGE}.operators.state").state
panels = importlib.import_module(f"{PACKAGE}.ui.panels")
figure_lines = panels.figure_lines


def noted(figures):
    FACTS["drawn"].append(figures.get("seconds", {}).get("total"))
    return figure_lines(figures)


panels.figure_lines = noted


def window():
    return bpy.context.window_manager.windows[0]


def add_far_balls():
    """Three objects that cannot be in the picture, and whose line is one."""
    for number in range(3):
        mesh = bpy.data.objects["Red"].data
        thing = bpy.data.objects.new(f"Far {number}", mesh)
        thing.location.x = FAR
        bpy.context.scene.collection.objects.link(thing)


def open_tab(view, width=None):
    view.spaces.active.show_region_ui = True
    yield 1.0
    region = next(r for r in view.regions if r.type == "UI")
    for _ in range(5):
        region.active_panel_category = TAB
        region.tag_redraw()
        yield 0.5
        if region.active_panel_category == TAB:
            break
    FACTS["width"] = region.width


def render(view):
    with bpy.context.temp_override(window=window(), area=view):
        bpy.ops.render.render("INVOKE_DEFAULT")
    yield 1.0
    end = time.monotonic() + 60.0
    while bpy.app.is_job_running("RENDER") and time.monotonic() < end:
        yield 0.2
    # nothing moves the mouse, so that nothing else makes Blender draw the panels
    yield 1.5


def cancel(view):
    """End a large render of the engine by ESC; then the button has to be offered again."""
    render = bpy.context.scene.render
    before = render.resolution_x, render.resolution_y
    render.resolution_x, render.resolution_y = 1920, 1080
    with bpy.context.temp_override(window=window(), area=view):
        bpy.ops.render.render("INVOKE_DEFAULT")
    yield 2.0
    point(view.x + 300, view.y + 300)
    press("key", "Escape")
    end = time.monotonic() + 60.0
    while bpy.app.is_job_running("RENDER") and time.monotonic() < end:
        yield 0.2
    yield 1.5
    render.resolution_x, render.resolution_y = before
    region = next(r for r in view.regions if r.type == "UI")
    for _ in range(5):
        point(region.x + region.width // 2 - 10, region.y + region.height - 55)
        press("click", 1)
        yield 0.5
        if "Adaptive Render" in bpy.data.images:
            break
        yield 1.0
    FACTS["offered_again"] = "Adaptive Render" in bpy.data.images
    while state.job is not None and time.monotonic() < end:
        yield 0.2


def red_rows(region, name):
    """Rows of the window, from below, at which a region of the screenshot has red text."""
    shoot(name)
    image = bpy.data.images.load(str(FOLDER / f"{name}.png"))
    width, height = image.size
    flat = np.empty(width * height * 4, dtype=np.float32)
    image.pixels.foreach_get(flat)
    bpy.data.images.remove(image)
    pixels = flat.reshape(height, width, 4)[
        region.y + height - HEIGHT : region.y + height - HEIGHT + region.height,
        region.x : region.x + region.width,
    ]
    red = (
        (pixels[..., 0] > 0.5)
        & (pixels[..., 1] < 0.6 * pixels[..., 0])
        & (pixels[..., 2] < 0.6 * pixels[..., 0])
    )
    return [int(region.y + row) for row in np.flatnonzero(red.sum(axis=1) > 2)]


def show_tabs():
    """Screenshots of the Properties editor: the render's tab, the material's and the light's."""
    (area,) = areas("PROPERTIES")
    layer = bpy.context.view_layer
    for name, tab in (("Red", "MATERIAL"), ("Quad Light", "DATA"), ("Red", "RENDER")):
        layer.objects.active = bpy.data.objects[name]
        yield 0.5
        area.spaces.active.context = tab
        yield 1.0
        shoot(f"list-{tab.lower()}")


def steps():
    yield 1.0
    scene = bpy.context.scene
    scene.render.engine = "ADAPTIVE_DRT"
    bpy.context.preferences.view.render_display_type = "NONE"
    view = max(areas("VIEW_3D"), key=lambda a: a.width)
    yield from open_tab(view)
    region = next(r for r in view.regions if r.type == "UI")
    yield from render(view)
    FACTS["shown"] = FACTS["drawn"][-1:] == [
        figures["seconds"]["total"] for figures in state.figures.values()
    ]
    FACTS["red_without_missing"] = red_rows(region, "list-notes")
    add_far_balls()
    yield from cancel(view)
    yield from render(view)
    FACTS["text"] = bpy.data.texts["Adaptive Render Report"].as_string()
    for one in scene.objects:
        one.select_set(False)
    yield 0.5
    rows = FACTS["red"] = red_rows(region, "list-missing")
    if rows:
        # the lowest is the line of the list, the one above it the count
        point(region.x + 60, rows[0] + 5)
        yield 0.5
        press("click", 1)
        yield 1.0
    FACTS["selected"] = sorted(o.name for o in scene.objects if o.select_get())
    shoot("list-selected")
    yield from show_tabs()
    with bpy.context.temp_override(window=window(), area=view, region=region):
        bpy.ops.adaptive_drt.show_report()
    yield 1.5
    shoot("list-report")
    FACTS["windows"] = [
        [area.type for area in w.screen.areas] for w in bpy.context.window_manager.windows
    ]
    editors = [a for w in bpy.context.window_manager.windows for a in w.screen.areas
               if a.type == "TEXT_EDITOR"]  # fmt: skip
    FACTS["editor"] = [a.spaces.active.text.name for a in editors]


act(steps(), FACTS, "list")
