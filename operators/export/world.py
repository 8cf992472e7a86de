# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender worlds: the colour that is seen, and the light that it throws on surfaces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ...adaptive_drt.scene.description import Issue, SkyLight, Vector
from .links import Source, output_node, surface_of
from .listing import left_out
from .nodes import called, node_called, uses_nodes
from .shader import EMITTERS, Shader
from .world_table import CYCLES_WORLD, LIGHTING, MIST, VISIBILITY, WORLD

BLACK: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class World:
    """What a world gives: the radiance (RGB) seen where nothing is hit, and a light or None."""

    background: Vector = BLACK
    light: SkyLight | None = None


def world_of(world: Any | None, issues: list[Issue]) -> World:
    """Return what a world gives, and append what of it is left out."""
    if world is None:
        return World()
    reasons = _settings(world)
    lights = True
    if uses_nodes(world):
        color, lights = _shaded(world, reasons)
    else:
        color = _rgb(world.color)
    said = called("World", world.name)
    issues.extend(Issue(said, r, kind="WORLD", target=world.name) for r in reasons)
    # a change of an add-on's settings does not reach the evaluated copy
    sight = getattr(world.original, "cycles_visibility", None)
    seen = color if sight is None or sight.camera else BLACK
    if not (lights and any(color) and (sight is None or sight.diffuse)):
        return World(seen)
    shadows = bool(getattr(getattr(world.original, "cycles", None), "use_shadows", True))
    return World(seen, SkyLight(color, casts_shadow=shadows, name=said))


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


def _shaded(world: Any, reasons: list[str]) -> tuple[Vector, bool]:
    """Return the colour of a world's nodes, and whether it is the same in all directions."""
    output = output_node(world.node_tree)
    if output is not None:
        reasons.extend(Shader(Source(output, None)).terms())
    source = surface_of(world.node_tree)
    if source.node is None:  # Cycles shows black, too
        return BLACK, False
    if source.node.bl_idname not in EMITTERS:
        said = f"its {node_called(source.node)} is left out, and the light that it throws"
        reasons.append(f"{said}; black is used")
        return BLACK, False
    linked: list[str] = []
    color = Shader(source).emission(linked)
    used = f"what its {node_called(source.node)} is set to is seen, and lights nothing"
    reasons.extend(f"{said}, and the light that it throws; {used}" for said in linked)
    return color, not linked


def _rgb(color: Any) -> Vector:
    r, g, b = color
    return (float(r), float(g), float(b))
