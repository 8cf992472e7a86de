# SPDX-License-Identifier: GPL-3.0-or-later
"""Mouse, keys, eyes and the arrangement of areas, for what is run in Blender's window."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import traceback
from pathlib import Path

import bpy

FOLDER = Path(sys.argv[sys.argv.index("--") + 1])
HEIGHT = 1000


def press(*words):
    subprocess.run(["xdotool", *(str(w) for w in words)], check=True)


def shoot(name):
    subprocess.run(["scrot", "-o", str(FOLDER / f"{name}.png")], check=True)


def areas(kind):
    screen = bpy.context.window_manager.windows[0].screen
    return [a for a in screen.areas if a.type == kind]


def point(x, y):
    """Move the mouse to a place that counts from below, as Blender does."""
    press("mousemove", x, HEIGHT - y)


def arrange():
    """3D view with its sidebar on the left, Image Editor on the right of it."""
    window = bpy.context.window_manager.windows[0]
    view = max(areas("VIEW_3D"), key=lambda a: a.width)
    with bpy.context.temp_override(window=window, area=view):
        bpy.ops.screen.area_split(direction="VERTICAL", factor=0.5)
    yield 0.5  # until it is drawn, both say the same place
    first, second = sorted(areas("VIEW_3D"), key=lambda a: a.x)[:2]
    second.type = "IMAGE_EDITOR"
    first.spaces.active.region_3d.view_perspective = "CAMERA"
    for area in areas("PROPERTIES"):
        area.spaces.active.context = "RENDER"
    yield from show_any_picture(second)
    return first, second


def show_any_picture(editor):
    """The first one takes seconds without a graphics card, whose programs are compiled for it."""
    image = bpy.data.images.new("Any", 1920, 1080, float_buffer=True)
    editor.spaces.active.image = image
    yield 1.0
    editor.spaces.active.image = None
    bpy.data.images.remove(image)
    yield 0.5


def press_long(x, y):
    """Come to a place from its left and press there, as long as a finger does."""
    for way in (20, 0):
        point(x - way, y)
        yield 0.4
    press("mousedown", 1)
    yield 0.1
    press("mouseup", 1)
    yield 0.5


def act(steps, facts, name):
    """Take the steps of a generator, which yields the seconds until the next; then end Blender.

    What it noted in `facts` goes to the file `name`.json, and the exit code says how it went.
    """

    def tick():
        try:
            return next(steps)
        except StopIteration:
            code = 0
        except Exception:
            traceback.print_exc()
            shoot("failed")
            code = 9
        (FOLDER / f"{name}.json").write_text(json.dumps(facts, indent=2))
        sys.stdout.flush()
        # not wm.quit_blender(), which saves the preferences
        os._exit(code)

    bpy.context.preferences.view.show_splash = False
    bpy.app.timers.register(tick, first_interval=0.5, persistent=True)
