# SPDX-License-Identifier: GPL-3.0-or-later
"""The regions of Blender's windows that hold the panels of this add-on."""

from __future__ import annotations

import bpy

HOLD_PANELS = {"PROPERTIES": "WINDOW", "VIEW_3D": "UI"}
"""Type of the region, by type of area."""


def redraw_panels() -> None:
    """Ask the regions that hold our panels to draw again, and not the 3D view beside them."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions:
                if region.type == HOLD_PANELS.get(area.type):
                    region.tag_redraw()
