# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender worlds: the colour that is seen, and the light that it throws on surfaces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ...adaptive_drt.scene.description import Issue, SkyLight, Vector
from .links import Input, Known, Source, Value, number_of, output_node, own_number, surface_of
from .listing import left_out
from .nodes import called, node_called, uses_nodes
from .shader import EMITTERS, Shader
from .world_table import CYCLES_WORLD, LIGHTING, MIST, VISIBILITY, WORLD

BLACK: Vector = (0.0, 0.0, 0.0)

NOT_DIFFUSE = ("Is Shadow Ray", "Is Glossy Ray", "Is Singular Ray", "Is Transmission Ray")
"""Outputs of a Light Path node that are 0 for the camera's rays, and where a world lights surfaces
that scatter light evenly."""


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
    if uses_nodes(world):
        seen, thrown = _shaded(world, reasons)
    else:
        seen = thrown = _rgb(world.color)
    said = called("World", world.name)
    issues.extend(Issue(said, r, kind="WORLD", target=world.name) for r in reasons)
    # a change of an add-on's settings does not reach the evaluated copy
    sight = getattr(world.original, "cycles_visibility", None)
    seen = seen if sight is None or sight.camera else BLACK
    if not (any(thrown) and (sight is None or sight.diffuse)):
        return World(seen)
    shadows = bool(getattr(getattr(world.original, "cycles", None), "use_shadows", True))
    return World(seen, SkyLight(thrown, casts_shadow=shadows, name=said))


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


def _shaded(world: Any, reasons: list[str]) -> tuple[Vector, Vector]:
    """Return what the camera sees of a world's nodes, and the radiance that they throw."""
    output = output_node(world.node_tree)
    if output is not None:
        reasons.extend(Shader(Source(output, None)).terms())
    source = surface_of(world.node_tree)
    linked: list[str] = []
    missing: list[str] = []
    seen = _radiance(source, _camera_ray, linked, missing)
    if missing:
        said = f"its {missing[0]} is left out, and the light that it throws"
        reasons.append(f"{said}; black is used")
        return BLACK, BLACK
    thrown = _radiance(source, _light_ray, linked, missing)
    if not linked:
        return seen, thrown
    used = f"what its {_named(source)} is set to is seen, and lights nothing"
    told = dict.fromkeys(linked)
    reasons.extend(f"{said}, and the light that it throws; {used}" for said in told)
    return seen, BLACK


def _named(source: Source) -> str:
    """Return what a person calls the node that feeds a world's surface."""
    return "world" if source.node is None else node_called(source.node)


def _radiance(source: Source, known: Known, linked: list[str], missing: list[str]) -> Vector:
    """Return the radiance (RGB) of a world's shader for one kind of ray.

    Parameters
    ----------
    known : what the outputs of a Light Path node are for that kind.
    linked : gets the reasons of inputs that are not constant.  missing : gets the names of the
        nodes that are not understood.
    """
    node = source.node
    if node is None:  # Cycles shows black, too
        return BLACK
    if node.bl_idname in EMITTERS:
        return Shader(source, known).emission(linked)
    if node.bl_idname not in ("ShaderNodeMixShader", "ShaderNodeAddShader"):
        missing.append(node_called(node))
        return BLACK
    *factor, one, two = (Input(socket, source.groups) for socket in node.inputs)
    share = number_of(factor[0], known) if factor else None
    if factor and share is None:
        linked.append(
            f"the {node_called(factor[0].source().node)} linked to its Factor is left out"
        )
        share = own_number(factor[0])
    a = _radiance(one.source(), known, linked, missing)
    b = _radiance(two.source(), known, linked, missing)
    if share is None:
        return _sum(a, 1.0, b, 1.0)
    share = min(max(share, 0.0), 1.0)
    return _sum(a, 1.0 - share, b, share)


def _sum(a: Vector, p: float, b: Vector, q: float) -> Vector:
    """Return p times one colour and q times another one."""
    return (p * a[0] + q * b[0], p * a[1] + q * b[1], p * a[2] + q * b[2])


def _camera_ray(source: Source) -> Value | None:
    """Return what a Light Path node's outputs are for rays from the camera, or None."""
    return _light_path(source, {"Is Camera Ray": 1.0, "Is Diffuse Ray": 0.0})


def _light_ray(source: Source) -> Value | None:
    """Return what a Light Path node's outputs are where a world lights surfaces, or None.

    Cycles looks at a world along rays that surfaces scatter, and as at any other light: only what
    is the same in both is known.
    """
    return _light_path(source, {"Is Camera Ray": 0.0})


def _light_path(source: Source, kind: dict[str, float]) -> Value | None:
    if source.node is None or source.socket is None or source.node.type != "LIGHT_PATH":
        return None
    own = {**dict.fromkeys(NOT_DIFFUSE, 0.0), **kind}
    found = own.get(source.socket.identifier)
    return None if found is None else (found,)


def _rgb(color: Any) -> Vector:
    r, g, b = color
    return (float(r), float(g), float(b))
