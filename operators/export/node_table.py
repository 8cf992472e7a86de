# SPDX-License-Identifier: GPL-3.0-or-later
"""What is done with each shader node: its own settings, and the inputs of those it renders."""

from __future__ import annotations

from typing import Any

from .coverage import Listed, Table, Use
from .datablock_table import ID
from .left_out_nodes import LEFT_OUT

NODE: Table = {
    # followed to what feeds an output
    **dict.fromkeys(
        ("type", "bl_idname", "bl_static_type", "mute", "inputs", "outputs", "internal_links"),
        Use.RENDERED,
    ),
    # how the node editor shows a node
    **dict.fromkeys(
        (
            *("rna_type", "name", "label", "location", "location_absolute", "width", "height"),
            *("dimensions", "parent", "use_custom_color", "color", "color_tag", "select"),
            *("show_options", "show_preview", "show_texture", "hide", "warning_propagation"),
            *("panel_states", "bl_label", "bl_description", "bl_icon", "bl_width_default"),
            *("bl_width_min", "bl_width_max", "bl_height_default", "bl_height_min"),
            "bl_height_max",
        ),
        Use.NO_EFFECT,
    ),
}
"""Of every node."""

TREE: Table = {
    **ID,
    **dict.fromkeys(("nodes", "links", "interface", "type", "bl_idname"), Use.RENDERED),
    # how the node editor shows a tree
    **dict.fromkeys(
        (
            *("color_tag", "view_center", "description", "default_group_node_width"),
            *("bl_use_group_interface", "annotation", "grease_pencil", "bl_label"),
            *("bl_description", "bl_icon"),
        ),
        Use.NO_EFFECT,
    ),
}

LINK: Table = {
    **dict.fromkeys(
        ("is_valid", "is_muted", "from_node", "to_node", "from_socket", "to_socket"), Use.RENDERED
    ),
    # whether it is drawn; the order of links into one socket, which shader nodes do not have
    **dict.fromkeys(("rna_type", "is_hidden", "multi_input_sort_id"), Use.NO_EFFECT),
}

SOCKET: Table = {
    **dict.fromkeys(
        (
            *("identifier", "is_output", "enabled", "is_linked", "links", "is_unavailable"),
            *("node", "type", "bl_idname"),
        ),
        Use.RENDERED,
    ),
    # how the node editor shows a socket, and what it lets a user do
    **dict.fromkeys(
        (
            *("rna_type", "name", "label", "description", "hide", "link_limit", "is_multi_input"),
            *("show_expanded", "hide_value", "display_shape", "select", "is_inactive"),
            *("is_icon_visible", "pin_gizmo", "inferred_structure_type", "bl_label"),
            "bl_subtype_label",
        ),
        Use.NO_EFFECT,
    ),
}
"""Of every socket; its value is in the tables of inputs below."""

TABLES: dict[str, Table] = {
    "Node": NODE,
    "NodeLink": LINK,
    "NodeSocket": SOCKET,
    "ShaderNodeTree": TREE,
}
"""By the identifiers of the RNA structs."""

ACTIVE: Table = dict.fromkeys(("is_active_output", "target"), Use.RENDERED)
"""Which of a tree's outputs is rendered."""

RENDERED: dict[str, Table] = {
    "ShaderNodeBsdfDiffuse": {},
    # of the reflection and of the subsurface scattering, which have lines
    "ShaderNodeBsdfPrincipled": dict.fromkeys(("distribution", "subsurface_method"), Use.COVERED),
    "ShaderNodeBackground": {},
    "ShaderNodeEmission": {},
    "ShaderNodeRGB": {},
    "ShaderNodeValue": {},
    "ShaderNodeAddShader": {},
    # of worlds; in materials a line says that it is left out
    "ShaderNodeLightPath": {},
    "ShaderNodeMixShader": {},
    "ShaderNodeOutputMaterial": ACTIVE,
    "ShaderNodeOutputWorld": ACTIVE,
    "ShaderNodeOutputLight": ACTIVE,
}
"""Settings of the nodes that are rendered, where they feed what they are rendered for."""

SEEN_THROUGH: dict[str, Table] = {
    "NodeReroute": {"socket_idname": Use.RENDERED},
    "NodeGroupInput": {},
    "NodeGroupOutput": {"is_active_output": Use.RENDERED},
    "ShaderNodeGroup": {"node_tree": Use.RENDERED},
    "ShaderNodeCustomGroup": {"node_tree": Use.RENDERED},
}
"""Settings of the nodes that are followed to what lies behind them."""

NO_EFFECT: dict[str, Table] = {
    # frames hold nodes together in the editor; a frame that is muted mutes none of them
    "NodeFrame": dict.fromkeys(("text", "shrink", "label_size"), Use.NO_EFFECT),
    # it fills a pass of its own, and the view layer's AOVs have lines
    "ShaderNodeOutputAOV": {"aov_name": Use.COVERED},
    # Freestyle's, which the scene's table lists
    "ShaderNodeOutputLineStyle": dict.fromkeys(
        ("is_active_output", "target", "blend_type", "use_alpha", "use_clamp"), Use.COVERED
    ),
    # what all shader nodes come from
    "ShaderNode": {},
}
"""Settings of the nodes that change no picture of this engine."""

TYPES: dict[str, Table] = {
    **RENDERED,
    **SEEN_THROUGH,
    **NO_EFFECT,
    **{name: dict.fromkeys(settings, Use.COVERED) for name, settings in LEFT_OUT.items()},
}
"""Settings of every node that a shader tree may hold."""

UNLINKED = (None,)
"""Neutral of an input that only a link sets."""


def _reflects(shader: Any) -> bool:
    return bool(shader.number("IOR") != 1.0)  # measured: Cycles reflects nothing at 1


PRINCIPLED: Table = {
    "Base Color": Use.RENDERED,
    "Metallic": Listed((0.0,), "Metallic"),
    "Specular IOR Level": Listed((0.0,), "Specular", when=_reflects),
    "Transmission Weight": Listed((0.0,), "Transmission"),
    "Subsurface Weight": Listed((0.0,), "Subsurface"),
    "Coat Weight": Listed((0.0,), "Coat"),
    "Sheen Weight": Listed((0.0,), "Sheen"),
    "Diffuse Roughness": Listed((0.0,), "Diffuse Roughness"),
    "Thin Film Thickness": Listed((0.0,), "Thin Film"),
    "Normal": Listed(UNLINKED, "Normal"),
    "Alpha": Listed((1.0,), "Alpha"),
    "Emission Strength": Use.RENDERED,
    "Emission Color": Use.RENDERED,
    # details of the terms above
    **dict.fromkeys(
        (
            *("Roughness", "IOR", "Specular Tint", "Anisotropic", "Anisotropic Rotation"),
            *("Tangent", "Subsurface Radius", "Subsurface Scale", "Subsurface IOR"),
            *("Subsurface Anisotropy", "Coat Roughness", "Coat IOR", "Coat Tint", "Coat Normal"),
            *("Sheen Roughness", "Sheen Tint", "Thin Film IOR", "Thin Wall"),
        ),
        Use.COVERED,
    ),
    # Cycles' own, which no user sees
    "Weight": Use.NO_EFFECT,
}

DIFFUSE: Table = {
    "Color": Use.RENDERED,
    "Roughness": Listed((0.0,), "Roughness"),
    "Normal": Listed(UNLINKED, "Normal"),
    "Weight": Use.NO_EFFECT,
}

EMITTER: Table = {
    "Color": Use.RENDERED,
    "Strength": Use.RENDERED,
    "Weight": Use.NO_EFFECT,
}

VOLUME = "its volume is left out"

MATERIAL_OUTPUT: Table = {
    "Surface": Use.RENDERED,
    "Volume": Listed(UNLINKED, VOLUME),
    "Displacement": Listed(UNLINKED, "its displacement is left out"),
    # EEVEE's
    "Thickness": Use.NO_EFFECT,
}

WORLD_OUTPUT: Table = {
    "Surface": Use.RENDERED,
    "Volume": Listed(UNLINKED, VOLUME),
}

MIXER: Table = dict.fromkeys(("Fac", "Factor", "Shader", "Shader_001"), Use.RENDERED)

INPUTS: dict[str, Table] = {
    "ShaderNodeAddShader": MIXER,
    "ShaderNodeMixShader": MIXER,
    "ShaderNodeLightPath": {},
    "ShaderNodeBsdfPrincipled": PRINCIPLED,
    "ShaderNodeBsdfDiffuse": DIFFUSE,
    "ShaderNodeBackground": EMITTER,
    "ShaderNodeEmission": EMITTER,
    "ShaderNodeOutputMaterial": MATERIAL_OUTPUT,
    "ShaderNodeOutputWorld": WORLD_OUTPUT,
    "ShaderNodeOutputLight": {"Surface": Use.RENDERED},
    "ShaderNodeRGB": {},
    "ShaderNodeValue": {},
}
"""Inputs of the nodes that are rendered, by their identifiers."""
