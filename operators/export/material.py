# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's materials as Lambert materials, with all that this leaves out."""

from __future__ import annotations

from typing import Any

from ...adaptive_drt.scene.description import Issue, Material, Vector
from .coverage import Table
from .links import Source, output_node, surface_of
from .listing import left_out
from .material_table import CYCLES_MATERIAL, MATERIAL
from .node_table import VOLUME
from .nodes import called, node_called, uses_nodes
from .shader import MIXERS, Shader, mixed_parts

CYCLES_DEFAULT = Material((0.8, 0.8, 0.8))
"""What Cycles gives to a surface without a material."""

BLACK = Material((0.0, 0.0, 0.0))

EMISSION = "ShaderNodeEmission"
"""The surface node that shines and reflects nothing."""

GLOW = ("Emission Color", "Emission Strength")
"""Inputs of a Principled BSDF that shines."""

COLORS = {"ShaderNodeBsdfDiffuse": "Color", "ShaderNodeBsdfPrincipled": "Base Color"}
"""Surface nodes that are rendered, and the input that is their diffuse colour."""

WHITE = (1.0, 1.0, 1.0)
"""Colour of a material of which each point has a colour of its own."""

USED = {
    "ShaderNodeBsdfDiffuse": "only the colour of its Diffuse BSDF is used",
    "ShaderNodeBsdfPrincipled": "only its base colour is used",
}


def slot_material(thing: Any, slot: int) -> Any | None:
    """Return the Blender material in one of an object's slots, or None."""
    slots = thing.material_slots
    return slots[min(slot, len(slots) - 1)].material if len(slots) else None


def color_attribute(material: Any | None) -> str | None:
    """Return the name of the attribute that is the diffuse colour of a material, or None."""
    if material is None or not uses_nodes(material):
        return None
    surface = surface_of(material.node_tree)
    if surface.node is None or surface.node.bl_idname not in COLORS:
        return None
    source = Shader(surface).source(COLORS[surface.node.bl_idname])
    # sockets of other types on the way would change the colour
    if source is None or source.node is None or set(source.passed) - {"RGBA"}:
        return None
    node, output = source.node, source.socket.identifier
    if node.bl_idname == "ShaderNodeAttribute" and output == "Color":
        return (node.attribute_name or None) if node.attribute_type == "GEOMETRY" else None
    if node.bl_idname == "ShaderNodeVertexColor" and output == "Color":
        return node.layer_name or None
    return None


def material_of(material: Any | None, issues: list[Issue], is_colored: bool = False) -> Material:
    """Return the Lambert material of a Blender material, and append what it leaves out.

    is_colored : whether its `color_attribute` is rendered, in place of the material's own colour.
    """
    if material is None:
        return CYCLES_DEFAULT
    reasons = list(_settings(material))
    if uses_nodes(material):
        result = _shaded(material, reasons, is_colored)
    else:
        result = Material(_rgb(material.diffuse_color))
    said = called("Material", material.name)
    issues.extend(Issue(said, r, kind="MATERIAL", target=material.name) for r in reasons)
    return result


def _settings(material: Any) -> list[str]:
    """Return what is left out of a material's settings, Cycles' own included."""
    tables: tuple[tuple[Table, Any], ...] = (
        (MATERIAL, material),
        # a change of an add-on's settings does not reach the evaluated copy
        (CYCLES_MATERIAL, getattr(material.original, "cycles", None)),
    )
    return [reason for table, owner in tables for reason, _ in left_out(table, owner)]


def _shaded(material: Any, reasons: list[str], is_colored: bool) -> Material:
    output = output_node(material.node_tree)
    terms = [] if output is None else Shader(Source(output, None)).terms()
    reasons.extend(terms)
    source = surface_of(material.node_tree)
    if source.node is None and VOLUME in terms:
        reasons.append("it has no surface shader, only a volume; its surface is shown black")
    unknown: list[str] = []
    result = _scattered(source, reasons, unknown, is_colored)
    if result is None:
        named, verb = " and ".join(sorted(set(unknown))), "is" if len(unknown) == 1 else "are"
        reasons.append(f"its {named} {verb} left out; its viewport colour is used as diffuse")
        return Material(_rgb(material.diffuse_color))
    reasons.extend(f"its {named} is left out, which is mixed with others" for named in unknown)
    return result


def _scattered(
    source: Source, reasons: list[str], unknown: list[str], is_colored: bool
) -> Material | None:
    """Return what a shader reflects and emits, or None where no part of it is rendered.

    unknown : what the shaders that are not rendered are called is appended.
    """
    node = source.node
    if node is None:  # Cycles shows black, too, but nothing around a volume
        return BLACK
    if node.bl_idname in MIXERS:
        return _mixed(source, reasons, unknown)
    if node.bl_idname == EMISSION:
        unread: list[str] = []
        glow = Shader(source).emission(unread)
        reasons.extend(f"{said}; its own value is used" for said in unread)
        return Material(BLACK.color, glow)
    if node.bl_idname not in COLORS:
        unknown.append(node_called(node))
        return None
    return _diffuse(source, reasons, is_colored)


def _mixed(source: Source, reasons: list[str], unknown: list[str]) -> Material | None:
    """Return the sum of the parts of a Mix Shader or an Add Shader, each by its weight."""
    linked: list[str] = []
    parts = [
        (weight, _scattered(part, reasons, unknown, False))
        for weight, part in mixed_parts(source, linked)
        if weight
    ]
    reasons.extend(f"{said}; its own value is used" for said in linked)
    known = [(weight, part) for weight, part in parts if part is not None]
    if not known:
        return None
    return Material(
        _weighted_sum([(weight, part.color) for weight, part in known]),
        _weighted_sum([(weight, part.emission) for weight, part in known]),
    )


def _weighted_sum(colors: list[tuple[float, Vector]]) -> Vector:
    r, g, b = (sum(weight * color[channel] for weight, color in colors) for channel in range(3))
    return (r, g, b)


def _diffuse(source: Source, reasons: list[str], is_colored: bool) -> Material:
    """Return the diffuse colour and the emission of a node of `COLORS`."""
    node: Any = source.node
    shader = Shader(source)
    terms = shader.terms()
    if terms:
        verb = "is" if len(terms) == 1 else "are"
        reasons.append(f"{', '.join(terms)} {verb} left out: {USED[node.bl_idname]}")
    linked: list[str] = []
    linked_glow: list[str] = []
    color = WHITE if is_colored else shader.rendered_color(COLORS[node.bl_idname], linked)
    reasons.extend(f"{said}; one colour is used" for said in linked)
    glow = shader.glow(*GLOW, linked_glow) if shader.has(*GLOW) else (0.0, 0.0, 0.0)
    reasons.extend(f"{said}; its own value is used" for said in linked_glow)
    return Material(color, glow)


def _rgb(color: Any) -> Vector:
    r, g, b = tuple(color)[:3]
    return (float(r), float(g), float(b))
