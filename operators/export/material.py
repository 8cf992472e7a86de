# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's materials as Lambert materials, with all that this leaves out."""

from __future__ import annotations

from typing import Any

from ...adaptive_drt.scene import Issue, Material, Vector
from .nodes import called, input_color, input_value, output_node, source_node, uses_nodes

CYCLES_DEFAULT = Material((0.8, 0.8, 0.8))
"""What Cycles gives to a surface without a material."""

PRINCIPLED_TERMS = (
    ("Metallic", "Metallic"),
    ("Specular IOR Level", "Specular"),
    ("Transmission Weight", "Transmission"),
    ("Subsurface Weight", "Subsurface"),
    ("Coat Weight", "Coat"),
    ("Sheen Weight", "Sheen"),
    ("Diffuse Roughness", "Diffuse Roughness"),
    ("Thin Film Thickness", "Thin Film"),
)
"""Inputs of a Principled BSDF that change nothing when they are 0, and what a person calls them."""


def slot_material(thing: Any, slot: int) -> Any | None:
    """Return the Blender material in one of an object's slots, or None."""
    slots = thing.material_slots
    return slots[min(slot, len(slots) - 1)].material if len(slots) else None


def material_of(material: Any | None, issues: list[Issue]) -> Material:
    """Return the Lambert material of a Blender material, and append what it leaves out."""
    if material is None:
        return CYCLES_DEFAULT
    said = called("Material", material.name)
    viewport = _rgb(material.diffuse_color)
    if not uses_nodes(material):
        return Material(viewport)
    output = output_node(material.node_tree)
    surface = source_node(output.inputs["Surface"]) if output is not None else None
    if output is not None:
        for socket in ("Volume", "Displacement"):
            if source_node(output.inputs[socket]) is not None:
                issues.append(Issue(said, f"its {socket.lower()} is left out"))
    if surface is None:
        issues.append(Issue(said, "it has no surface shader; black is used, as Cycles does"))
        return Material((0.0, 0.0, 0.0))
    if surface.type == "BSDF_DIFFUSE":
        return _diffuse(surface, said, issues)
    if surface.type == "BSDF_PRINCIPLED":
        return _principled(surface, said, issues)
    issues.append(
        Issue(
            said, f"its {surface.bl_label} node is left out; its viewport colour is used as diffuse"
        )
    )
    return Material(viewport)


def _diffuse(node: Any, said: str, issues: list[Issue]) -> Material:
    left_out = _left_out(node, (("Roughness", "Roughness"),))
    _tell(said, left_out, "only the colour of its Diffuse BSDF is used", issues)
    return Material(_color(node.inputs["Color"], said, issues))


def _principled(node: Any, said: str, issues: list[Issue]) -> Material:
    left_out = _left_out(node, PRINCIPLED_TERMS)
    alpha = node.inputs.get("Alpha")
    if alpha is not None and input_value(alpha) != 1.0:
        left_out.append("Alpha")
    strength = node.inputs.get("Emission Strength")
    glow = node.inputs.get("Emission Color")
    if strength is not None and glow is not None:
        dark = input_value(strength) == 0.0 or not (
            glow.is_linked or any(tuple(glow.default_value)[:3])
        )
        if not dark:
            left_out.append("Emission")
    _tell(said, left_out, "only its base colour is used", issues)
    return Material(_color(node.inputs["Base Color"], said, issues))


def _left_out(node: Any, terms: tuple[tuple[str, str], ...]) -> list[str]:
    """Return what a node has beyond a Lambert surface; a linked input is taken to matter."""
    found = []
    for key, said in terms:
        socket = node.inputs.get(key)
        if socket is not None and input_value(socket) != 0.0:
            found.append(said)
    normal = node.inputs.get("Normal")
    if normal is not None and normal.is_linked:
        found.append("Normal")
    return found


def _tell(said: str, left_out: list[str], used: str, issues: list[Issue]) -> None:
    if left_out:
        verb = "is" if len(left_out) == 1 else "are"
        issues.append(Issue(said, f"{', '.join(left_out)} {verb} left out: {used}"))


def _color(socket: Any, said: str, issues: list[Issue]) -> Vector:
    color, exact = input_color(socket)
    if not exact:
        issues.append(
            Issue(said, f"what is linked to its {socket.name} is left out; one colour is used")
        )
    return color


def _rgb(color: Any) -> Vector:
    r, g, b = tuple(color)[:3]
    return (float(r), float(g), float(b))
