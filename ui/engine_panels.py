# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's own panels that apply to this engine, and the few it has to bring itself."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy

from ..operators.engine import ENGINE, OPTIONAL

ADDED = (
    "EEVEE_MATERIAL_PT_context_material",
    "EEVEE_MATERIAL_PT_surface",
    "DATA_PT_EEVEE_light",
    "EEVEE_WORLD_PT_surface",
)
"""Panels of other engines that show exactly what this one reads."""

REFUSED = (
    "DATA_PT_light",  # less than DATA_PT_EEVEE_light
    "RENDER_PT_output_views",
    # this engine draws no previews (`bl_use_preview`): the box would stay empty
    "MATERIAL_PT_preview",
    "WORLD_PT_preview",
    "DATA_PT_preview",
    "TEXTURE_PT_preview",
)
"""Names of common panels that show nothing of this engine, or settings that it does not heed."""

REFUSED_KINDS = (
    "DATA_PT_spot",
    "DATA_PT_lightprobe",
    "DATA_PT_volume",
    "DATA_PT_camera_stereoscopy",
    "RENDER_PT_stereoscopy",
    "RENDER_PT_gpencil",
    "RENDER_PT_grease_pencil",
    "RENDER_PT_simplify_greasepencil",
)
"""Beginnings of such names, for a panel and those within it."""

IN_NODES = "NODE_"
"""What the node editor's copy of a panel is called before its name; both share their engines."""


def shared_panels() -> Iterator[Any]:
    """Yield Blender's panels to be shown under this engine.

    Blender's way: whatever is common to engines says it fits 'BLENDER_RENDER', an engine of
    the past, and add-ons add themselves beside it.
    """
    for panel in bpy.types.Panel.__subclasses__():
        engines = getattr(panel, "COMPAT_ENGINES", None)
        name = panel.__name__.removeprefix(IN_NODES)
        if not isinstance(engines, set) or name in REFUSED or name.startswith(REFUSED_KINDS):
            continue
        if name in ADDED or "BLENDER_RENDER" in engines:
            yield panel


class _Ours:
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"

    @classmethod
    def poll(cls, context: Any) -> bool:
        return bool(context.engine == ENGINE)


class ADRT_PT_film(_Ours, bpy.types.Panel):
    bl_label = "Film"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Any) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(context.scene.render, "film_transparent")
        cycles = getattr(context.scene, "cycles", None)
        if cycles is not None:  # Cycles is an add-on, and may be switched off
            layout.prop(cycles, "film_exposure")


class ADRT_PT_passes(_Ours, bpy.types.Panel):
    bl_label = "Passes"
    bl_context = "view_layer"

    def draw(self, context: Any) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        column = layout.column(heading="Include")
        for switch in OPTIONAL.values():
            column.prop(context.view_layer, switch)


class ADRT_PT_filter(_Ours, bpy.types.Panel):
    bl_label = "Filter"
    bl_context = "view_layer"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Any) -> None:
        layout, layer = self.layout, context.view_layer
        layout.use_property_split = True
        layout.use_property_decorate = False
        column = layout.column(heading="Include")
        column.prop(layer, "use_sky", text="Environment")
        column.prop(layer, "use_solid", text="Surfaces")
        # these are left out in any case, but listed only where they are on
        column.prop(layer, "use_strand", text="Curves")
        column.prop(layer, "use_volumes", text="Volumes")
        if hasattr(layer, "use_grease_pencil"):  # from 4.3 on; Blender draws it
            column.prop(layer, "use_grease_pencil", text="Grease Pencil")
        column = layout.column(heading="Use")
        column.active = context.scene.render.use_motion_blur
        column.prop(layer, "use_motion_blur", text="Motion Blur")


class ADRT_PT_override(_Ours, bpy.types.Panel):
    bl_label = "Override"
    bl_context = "view_layer"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Any) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(context.view_layer, "material_override", text="Material")
        layout.prop(context.view_layer, "world_override", text="World")


classes = (ADRT_PT_film, ADRT_PT_passes, ADRT_PT_filter, ADRT_PT_override)


def register() -> None:
    for panel in shared_panels():
        panel.COMPAT_ENGINES.add(ENGINE)
    for cls in classes:
        bpy.utils.register_class(cls)


def unregister() -> None:
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
    for panel in bpy.types.Panel.__subclasses__():
        engines = getattr(panel, "COMPAT_ENGINES", None)
        if isinstance(engines, set):
            engines.discard(ENGINE)
