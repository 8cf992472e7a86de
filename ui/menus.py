# SPDX-License-Identifier: GPL-3.0-or-later
"""Entries in Blender's own menus: Render, the compositor's View and the Image Editor's Image."""

from __future__ import annotations

from typing import Any

import bpy

from ..operators.images import RESULT


def draw_in_render_menu(menu: Any, _context: Any) -> None:
    menu.layout.separator()
    menu.layout.operator("adaptive_drt.render", icon="RENDER_STILL")
    menu.layout.operator("adaptive_drt.show_mask", icon="NODE_COMPOSITING")


def draw_in_node_menu(menu: Any, context: Any) -> None:
    if getattr(context.space_data, "tree_type", "") == "CompositorNodeTree":
        menu.layout.separator()
        menu.layout.operator("adaptive_drt.show_mask", icon="NODE_COMPOSITING")


def draw_in_image_menu(menu: Any, context: Any) -> None:
    image = context.space_data.image
    if image is not None and image.name == RESULT:
        menu.layout.separator()
        # Save As is set to save the picture as it is, without the view transform
        entry = menu.layout.operator("image.save_as", text="Save Picture As Rendered...")
        entry.save_as_render = True


ENTRIES = (
    ("IMAGE_MT_image", draw_in_image_menu),
    ("TOPBAR_MT_render", draw_in_render_menu),
    ("NODE_MT_view", draw_in_node_menu),
)


def register() -> None:
    for name, draw in ENTRIES:
        getattr(bpy.types, name).append(draw)


def unregister() -> None:
    for name, draw in ENTRIES:
        getattr(bpy.types, name).remove(draw)
