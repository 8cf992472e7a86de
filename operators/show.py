# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows our images in a window, where Blender would show its Render Result."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy

from .images import MASK, NAMES, RESULT, find_image
from .temporary import RENDER_RESULT, changed

IMAGES = (
    ("PICTURE", "Picture", "The picture that Adaptive Render has made", 0),
    ("MASK", "Mask", "The pixels that rays were distributed in, coloured by effect", 1),
)
NAMED = {"PICTURE": RESULT, "MASK": MASK}


def show_rendered() -> None:
    """Show the picture as F12 shows its own: where the preference Render In says.

    An editor that shows something of ours already goes on doing so.
    """
    if bpy.app.background or find_image(RESULT) is None:
        return
    if any(_shows_ours(area) for area in _editors()):
        redraw_images()
        return
    editor = _opened_by_preference()
    if editor is not None:
        _put(editor, RESULT)


def show_image(name: str) -> bool:
    """Show one of our images whatever the preference; return False if there is nowhere to."""
    editor = next((area for area in _editors() if _shows_ours(area)), None)
    if editor is None:
        editor = _opened_by_preference() or _opened("WINDOW")
    if editor is None:
        return False
    _put(editor, name)
    return True


def _put(editor: Any, name: str) -> None:
    editor.spaces.active.image = find_image(name)
    editor.tag_redraw()


def _opened_by_preference() -> Any | None:
    """Return the Image Editor that F12 would open or use, or None where it leaves windows alone."""
    return _opened(bpy.context.preferences.view.render_display_type)


def _opened(kind: str) -> Any | None:
    """Return the Image Editor that Blender shows its Render Result in, opened that way.

    `kind` is one of the preference's: WINDOW, SCREEN, AREA, or NONE.
    """
    if kind == "NONE":
        # F12 leaves windows alone; an Image Editor that is open and empty is no one's
        return next((a for a in _editors() if a.spaces.active.image is None), None)
    # Blender's operator would close an editor that shows the Render Result
    shown = [a for a in _editors() if _name_of(a) == RENDER_RESULT]
    if not shown:
        preferences = bpy.context.preferences.view
        window = bpy.context.window or bpy.context.window_manager.windows[0]
        area = max(window.screen.areas, key=lambda a: a.width * a.height)
        with (
            changed(preferences, render_display_type=kind),
            bpy.context.temp_override(window=window, area=area, region=area.regions[-1]),
        ):
            bpy.ops.render.view_show("INVOKE_DEFAULT")
        shown = [a for a in _editors() if _name_of(a) == RENDER_RESULT]
    return shown[-1] if shown else None


def _shows_ours(area: Any) -> bool:
    return _name_of(area) in NAMES


def _name_of(area: Any) -> str:
    image = area.spaces.active.image
    return "" if image is None else str(image.name)


def _editors() -> Iterator[Any]:
    """Yield the open Image Editors."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.ui_type == "IMAGE_EDITOR":
                yield area


def redraw_images() -> None:
    """Ask the Image Editors that show something of ours to draw again."""
    for area in _editors():
        if _shows_ours(area):
            area.tag_redraw()


class ADRT_OT_show_image(bpy.types.Operator):
    """Show the rendered picture or its mask in an Image Editor"""

    bl_idname = "adaptive_drt.show_image"
    bl_label = "Show Picture"

    image: bpy.props.EnumProperty(name="Image", items=IMAGES, default="PICTURE")

    @classmethod
    def poll(cls, _context: Any) -> bool:
        if find_image(RESULT) is None:
            cls.poll_message_set("Nothing is rendered yet: press Adaptive Render first")
            return False
        return not bpy.app.background

    def execute(self, _context: Any) -> set[str]:
        name = NAMED[self.image]
        if find_image(name) is None:
            self.report({"ERROR"}, f'There is no image "{name}": press Adaptive Render first')
            return {"CANCELLED"}
        # Blender gives a new window its content only after this operator
        bpy.app.timers.register(lambda: show_image(name) and None, first_interval=0.0)
        return {"FINISHED"}
