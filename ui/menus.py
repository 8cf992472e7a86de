# SPDX-License-Identifier: GPL-3.0-or-later
"""Entries in Blender's own menus: Render, and the compositor's View."""

from __future__ import annotations

from typing import Any

import bpy


def draw_in_render_menu(menu: Any, _context: Any) -> None:
    menu.layout.separator()
    menu.layout.operator("adaptive_drt.render", icon="RENDER_STILL")
    menu.layout.operator("adaptive_drt.show_mask", icon="NODE_COMPOSITING")


def draw_in_node_menu(menu: Any, context: Any) -> None:
    if getattr(context.space_data, "tree_type", "") == "CompositorNodeTree":
        menu.layout.separator()
        menu.layout.operator("adaptive_drt.show_mask", icon="NODE_COMPOSITING")


ENTRIES = (("TOPBAR_MT_render", draw_in_render_menu), ("NODE_MT_view", draw_in_node_menu))


def register() -> None:
    for name, draw in ENTRIES:
        getattr(bpy.types, name).append(draw)


def unregister() -> None:
    for name, draw in ENTRIES:
        getattr(bpy.types, name).remove(draw)
