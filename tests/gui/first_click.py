# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in Blender's window with factory settings: one click on the button, then F12.

It leaves screenshots of what each shows, and the pixels of both pictures.
"""

from __future__ import annotations

import importlib
import os
import sys
import time
from pathlib import Path

import bpy
import numpy as np

FOLDER = Path(sys.argv[sys.argv.index("--") + 1])
KIND = os.environ["ADAPTIVE_DRT_RENDER_IN"]
sys.path.insert(0, str(FOLDER))

from desk import HEIGHT, act, point, press, shoot  # noqa: E402

PACKAGE = "bl_ext.user_default.adaptive_drt"
RESULT = "Adaptive Render"
FACTS = {}
state = importlib.import_module(f"{PACKAGE}.operators.state").state


def wait(over, seconds=60.0):
    began = time.monotonic()
    while not over() and time.monotonic() - began < seconds:
        yield 0.1


def idle():
    return not (state.job or state.preparing or bpy.app.is_job_running("RENDER"))


def main_area():
    """The 3D View of the factory Layout workspace."""
    screen = bpy.context.window_manager.windows[0].screen
    return max(screen.areas, key=lambda a: a.width * a.height)


def windows():
    """What each window shows: the types of its areas, and the images."""
    return [
        [
            [a.type, getattr(getattr(a.spaces.active, "image", None), "name", "")]
            for a in w.screen.areas
        ]
        for w in bpy.context.window_manager.windows
    ]


def open_sidebar():
    """The sidebar of the 3D View, at our tab."""
    view = main_area()
    view.spaces.active.show_region_ui = True
    yield 1.0
    region = next(r for r in view.regions if r.type == "UI")
    # the tab is there once the region has been drawn
    for _ in range(10):
        region.active_panel_category = "Adaptive Render"
        region.tag_redraw()
        yield 0.4
        if region.active_panel_category == "Adaptive Render":
            break
    yield 0.5


def point_at_button():
    region = next(r for r in main_area().regions if r.type == "UI")
    point(region.x + region.width // 2 - 10, region.y + region.height - 55)


def click():
    point_at_button()
    press("click", 1)


def flat(image):
    pixels = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(pixels)
    return pixels


def close_picture():
    """ESC over the picture: the window closes, or its area is what it was."""
    left, top, right, bottom = picture_on_screen(RESULT)
    press("mousemove", int(left + right) // 2, int(top + bottom) // 2)
    yield 0.5
    press("key", "Escape")
    yield 1.5


def picture_on_screen(name):
    """Where on the screenshot the image of that name is drawn: left, top, right, bottom."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            image = getattr(area.spaces.active, "image", None)
            if area.type != "IMAGE_EDITOR" or image is None or image.name != name:
                continue
            region = next(r for r in area.regions if r.type == "WINDOW")
            left, bottom = region.view2d.view_to_region(0.0, 0.0, clip=False)
            right, top = region.view2d.view_to_region(1.0, 1.0, clip=False)
            x, y = window.x + region.x, window.y + region.y
            return [x + left, HEIGHT - (y + top), x + right, HEIGHT - (y + bottom)]
    return None


def look(what, name):
    """Note what is on the screen, and where the image of that name is."""
    FACTS[what] = {"windows": windows(), "place": picture_on_screen(name)}
    shoot(f"{KIND}-{what}")


def steps():
    bpy.context.preferences.view.render_display_type = KIND
    scene = bpy.context.scene
    scene.render.resolution_percentage = 25
    # what Blender draws of its own picture has noise, which would differ
    scene.render.dither_intensity = 0.0
    scene.view_settings.exposure = -0.5
    yield 1.0
    FACTS["before"], FACTS["engine before"] = windows(), scene.render.engine
    yield from open_sidebar()
    click()
    yield from wait(lambda: not idle(), 5.0)
    yield from wait(idle)
    yield from wait(lambda: KIND == "NONE" or picture_on_screen(RESULT) is not None)
    yield 3.0
    look("button", RESULT)
    image = bpy.data.images[RESULT]
    np.save(FOLDER / f"{KIND}-button.npy", flat(image))
    scene.render.image_settings.file_format = "PNG"
    image.save_render(str(FOLDER / "expected.png"), scene=scene)
    if KIND == "NONE":  # F12 shows nothing then; the panel's own button does
        bpy.ops.adaptive_drt.show_image(image="PICTURE")
        yield from wait(lambda: picture_on_screen(RESULT) is not None)
        yield 3.0
        look("asked", RESULT)
    yield from close_picture()
    FACTS["closed"] = windows()
    FACTS["engine"] = scene.render.engine
    scene.render.engine = "ADAPTIVE_DRT"
    yield from press_f12()
    look("F12", "Render Result")
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = str(FOLDER / "F12.exr")
    bpy.ops.render.render(write_still=True)
    read = bpy.data.images.load(scene.render.filepath)
    read.colorspace_settings.name = "Non-Color"
    np.save(FOLDER / f"{KIND}-F12.npy", flat(read))


def press_f12():
    """What the key does; with no window manager a key has nowhere to go once a window closes."""
    window, view = bpy.context.window_manager.windows[0], main_area()
    with bpy.context.temp_override(window=window, area=view, region=view.regions[-1]):
        bpy.ops.render.render("INVOKE_DEFAULT")
    yield from wait(lambda: not idle(), 5.0)
    yield from wait(idle)
    yield 3.0


act(steps(), FACTS, KIND)
