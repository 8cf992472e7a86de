# SPDX-License-Identifier: GPL-3.0-or-later
"""Brings compositing nodes, and the picture that they make, before the user's eyes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import bpy

from .temporary import changed

EDITOR = "CompositorNodeTree"

DRAWN = 0.5
"""Seconds until a window that has just been opened has been drawn, and its regions have sizes."""

NODES_PART = 0.3
"""Of the editor's height: nodes lie there, at the bottom; the picture is above them."""

STEPS_OUT = 7
"""Steps of zoom, each by a factor of about 1.2, from where the selected nodes fill the editor."""


def show_selected_nodes() -> None:
    """Show the selected compositing nodes in a node editor, with the Viewer's picture behind.

    A node editor that shows the compositor is used; where none is open, a window is opened. The
    caller is a timer: windows must not change inside an operator.
    """
    if bpy.app.background:
        return
    steps = _steps()
    bpy.app.timers.register(lambda: next(steps, None), first_interval=0.0)


def _steps() -> Iterator[float]:
    """Do it piece by piece, and yield the seconds until the next: Blender draws between them."""
    found = next(_open_editors(), None)
    is_new = found is None
    found = found or _new_window()
    if found is None:
        return
    window, area = found
    yield DRAWN
    if is_new and _is_open(area):
        for side in ("show_region_ui", "show_region_toolbar", "show_region_asset_shelf"):
            with suppress(AttributeError):  # not every Blender has each of them here
                setattr(area.spaces.active, side, False)
        yield DRAWN
    if _is_open(area):
        area.spaces.active.show_backdrop = True
        _arrange(window, area)


def _is_open(area: Any) -> bool:
    """Whether an area is still there: the user may have closed it meanwhile."""
    return any(area == one for w in bpy.context.window_manager.windows for one in w.screen.areas)


def _open_editors() -> Iterator[tuple[Any, Any]]:
    """Yield windows and those of their areas that show the compositor."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.ui_type == EDITOR:
                yield window, area


def _new_window() -> tuple[Any, Any] | None:
    """Open a window of one area that shows the compositor."""
    manager = bpy.context.window_manager
    before = set(manager.windows)
    with bpy.context.temp_override(window=bpy.context.window or manager.windows[0]):
        bpy.ops.wm.window_new()
    window = next((w for w in manager.windows if w not in before), None)
    if window is None:
        return None
    area = max(window.screen.areas, key=lambda a: a.width * a.height)
    area.ui_type = EDITOR
    return window, area


def _arrange(window: Any, area: Any) -> None:
    """Lay the nodes along the bottom of the editor, and the backdrop above them."""
    region = next(r for r in area.regions if r.type == "WINDOW")
    space = area.spaces.active
    preferences = bpy.context.preferences.view
    with (
        # an animated view would still be on its way when it is moved on
        changed(preferences, smooth_view=0),
        bpy.context.temp_override(window=window, area=area, region=region),
    ):
        bpy.ops.node.view_selected()
        for _ in range(STEPS_OUT):
            bpy.ops.view2d.zoom_out()
        bpy.ops.view2d.pan(deltax=0, deltay=round(region.height * (0.5 - 0.5 * NODES_PART)))
        bpy.ops.node.backimage_fit()
    space.backdrop_zoom *= 1.0 - NODES_PART
    space.backdrop_offset = (0.0, 0.5 * NODES_PART * region.height)
    area.tag_redraw()
