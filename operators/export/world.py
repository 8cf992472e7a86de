# SPDX-License-Identifier: GPL-3.0-or-later
"""The colour of a Blender world."""

from __future__ import annotations

from typing import Any

from ...adaptive_drt.scene import Issue, Vector
from .nodes import called, input_color, input_value, output_node, source_node, uses_nodes

BLACK: Vector = (0.0, 0.0, 0.0)


def background_of(world: Any | None, issues: list[Issue]) -> Vector:
    """Return the radiance (RGB) seen where nothing is hit, and append what is left out."""
    if world is None:
        return BLACK
    said = called("World", world.name)
    color = _background(world, said, issues)
    if any(color):
        issues.append(Issue(said, "the light it throws on surfaces is left out; it is only seen"))
    return color


def _background(world: Any, said: str, issues: list[Issue]) -> Vector:
    if not uses_nodes(world):
        r, g, b = world.color
        return (r, g, b)
    output = output_node(world.node_tree)
    if output is None:
        return BLACK
    if source_node(output.inputs["Volume"]) is not None:
        issues.append(Issue(said, "its volume is left out"))
    node = source_node(output.inputs["Surface"])
    if node is None:
        return BLACK
    if node.type != "BACKGROUND":
        issues.append(Issue(said, f"its {node.bl_label} node is left out; black is used"))
        return BLACK
    color, exact = input_color(node.inputs["Color"])
    strength = input_value(node.inputs["Strength"])
    if not exact or strength is None:
        issues.append(Issue(said, "what is linked to its background is left out"))
    if strength is None:
        strength = float(node.inputs["Strength"].default_value)
    return (color[0] * strength, color[1] * strength, color[2] * strength)
