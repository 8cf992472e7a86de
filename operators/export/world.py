# SPDX-License-Identifier: GPL-3.0-or-later
"""The colour of a Blender world."""

from __future__ import annotations

from typing import Any

from ...adaptive_drt.scene.description import Issue, Vector
from .links import Source, output_node, surface_of
from .listing import left_out
from .nodes import called, node_called, uses_nodes
from .shader import EMITTERS, Shader
from .world_table import CYCLES_WORLD, LIGHTING, MIST, VISIBILITY, WORLD

BLACK: Vector = (0.0, 0.0, 0.0)


def background_of(world: Any | None, issues: list[Issue]) -> Vector:
    """Return the radiance (RGB) seen where nothing is hit, and append what is left out."""
    if world is None:
        return BLACK
    reasons = _settings(world)
    color = _shaded(world, reasons) if uses_nodes(world) else _rgb(world.color)
    # a change of an add-on's settings does not reach the evaluated copy
    sight = getattr(world.original, "cycles_visibility", None)
    seen = sight is None or sight.camera
    if any(color) and (sight is None or sight.diffuse):
        reasons.append(
            "the light it throws on surfaces is left out" + ("; it is only seen" if seen else "")
        )
    said = called("World", world.name)
    issues.extend(Issue(said, r, kind="WORLD", target=world.name) for r in reasons)
    return color if seen else BLACK


def _settings(world: Any) -> list[str]:
    """Return what is left out of a world's settings, Cycles' own included."""
    tables = (
        (WORLD, world),
        (MIST, world.mist_settings),
        (LIGHTING, world.light_settings),
        (CYCLES_WORLD, getattr(world.original, "cycles", None)),
        (VISIBILITY, getattr(world.original, "cycles_visibility", None)),
    )
    return [reason for table, owner in tables for reason, _ in left_out(table, owner)]


def _shaded(world: Any, reasons: list[str]) -> Vector:
    output = output_node(world.node_tree)
    if output is not None:
        reasons.extend(Shader(Source(output, None)).terms())
    source = surface_of(world.node_tree)
    if source.node is None:  # Cycles shows black, too
        return BLACK
    if source.node.bl_idname not in EMITTERS:
        said = f"its {node_called(source.node)} is left out, and the light that it throws"
        reasons.append(f"{said}; black is used")
        return BLACK
    linked: list[str] = []
    color = Shader(source).emission(linked)
    used = f"what its {node_called(source.node)} is set to is used"
    reasons.extend(f"{said}; {used}" for said in linked)
    return color


def _rgb(color: Any) -> Vector:
    r, g, b = color
    return (float(r), float(g), float(b))
