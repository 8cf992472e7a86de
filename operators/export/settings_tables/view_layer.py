# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of view layers, and of collections in them."""

from __future__ import annotations

from typing import Any

from ..coverage import Listed, Table, Use
from ..datablock_table import GROUP, ID
from .passes import goes_to_layers, passes


def _writes_some(collection: str) -> Any:
    return lambda layer: len(getattr(layer, collection)) > 0 and goes_to_layers(layer)


VIEW_LAYER: Table = {
    **GROUP,
    # what it shows
    **dict.fromkeys(
        (
            "use",
            "layer_collection",
            "objects",
            "material_override",
            "world_override",
            "use_solid",
            "use_sky",
            "use_motion_blur",
        ),
        Use.RENDERED,
    ),
    # off: what is left out in any case stays out, and is not missed
    **dict.fromkeys(("use_strand", "use_volumes"), Use.RENDERED),
    # passes that this engine, or Blender itself, makes
    **dict.fromkeys(
        ("use_pass_combined", "use_pass_z", "use_pass_normal", "use_pass_grease_pencil"),
        Use.RENDERED,
    ),
    **passes(
        {
            "use_pass_mist": "Mist",
            "use_pass_position": "Position",
            "use_pass_vector": "Vector",
            "use_pass_uv": "UV",
            "use_pass_object_index": "Object Index",
            "use_pass_material_index": "Material Index",
            "use_pass_shadow": "Shadow",
            "use_pass_ambient_occlusion": "Ambient Occlusion",
            "use_pass_emit": "Emission",
            "use_pass_environment": "Environment",
            "use_pass_diffuse_direct": "Diffuse Direct",
            "use_pass_diffuse_indirect": "Diffuse Indirect",
            "use_pass_diffuse_color": "Diffuse Color",
            "use_pass_glossy_direct": "Glossy Direct",
            "use_pass_glossy_indirect": "Glossy Indirect",
            "use_pass_glossy_color": "Glossy Color",
            "use_pass_transmission_direct": "Transmission Direct",
            "use_pass_transmission_indirect": "Transmission Indirect",
            "use_pass_transmission_color": "Transmission Color",
            "use_pass_subsurface_direct": "Subsurface Direct",
            "use_pass_subsurface_indirect": "Subsurface Indirect",
            "use_pass_subsurface_color": "Subsurface Color",
            "use_pass_cryptomatte_object": "Cryptomatte Object",
            "use_pass_cryptomatte_material": "Cryptomatte Material",
            "use_pass_cryptomatte_asset": "Cryptomatte Asset",
        }
    ),
    "aovs": Listed(
        neutral=(),
        when=_writes_some("aovs"),
        reason="its shader AOV passes are not made and will not be in the multilayer file",
    ),
    "lightgroups": Listed(
        neutral=(),
        when=_writes_some("lightgroups"),
        reason="its light group passes are not made and will not be in the multilayer file",
    ),
    # of those passes
    **dict.fromkeys(
        (
            "pass_cryptomatte_depth",
            "use_pass_cryptomatte_accurate",
            "active_aov",
            "active_aov_index",
            "active_lightgroup",
            "active_lightgroup_index",
        ),
        Use.COVERED,
    ),
    # of surfaces that are transparent in part: their materials are listed
    "pass_alpha_threshold": Use.COVERED,
    # what Blender draws over the picture
    **dict.fromkeys(("use_freestyle", "freestyle_settings", "use_grease_pencil"), Use.RENDERED),
    # Cycles' samples; its Ambient Occlusion switch changes no picture of Cycles either
    **dict.fromkeys(("samples", "use_ao"), Use.NO_EFFECT),
    # Cycles' passes have a table of their own; EEVEE's belong to EEVEE
    "cycles": Use.RENDERED,
    "eevee": Use.NO_EFFECT,
    # the interface
    **dict.fromkeys(
        ("active_layer_collection", "has_export_collections", "depsgraph"), Use.NO_EFFECT
    ),
}

LAYER_COLLECTION: Table = {
    **GROUP,
    **dict.fromkeys(
        ("collection", "children", "exclude", "holdout", "indirect_only"), Use.RENDERED
    ),
    # the viewport
    **dict.fromkeys(("hide_viewport", "is_visible"), Use.NO_EFFECT),
}

COLLECTION: Table = {
    **ID,
    **dict.fromkeys(
        ("objects", "all_objects", "children", "hide_render", "instance_offset"), Use.RENDERED
    ),
    # Line Art is a modifier, which Blender applies
    **dict.fromkeys(
        (
            "lineart_usage",
            "lineart_use_intersection_mask",
            "lineart_intersection_mask",
            "lineart_intersection_priority",
            "use_lineart_intersection_priority",
        ),
        Use.RENDERED,
    ),
    # how members take part in light linking, which is listed with the lights that use it
    **dict.fromkeys(("collection_objects", "collection_children"), Use.COVERED),
    # the viewport, the outliner, and files
    **dict.fromkeys(
        ("hide_viewport", "hide_select", "color_tag", "exporters", "active_exporter_index"),
        Use.NO_EFFECT,
    ),
}
