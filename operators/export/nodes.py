# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the few facts of shader nodes that a Lambert tracer can use."""

from __future__ import annotations

import warnings
from typing import Any

import bpy

from ...adaptive_drt.scene import Vector


def uses_nodes(owner: Any) -> bool:
    """Whether a material, world or light is shaded by its nodes."""
    if owner.node_tree is None:
        return False
    # from 5.0 on materials and worlds always use their nodes
    if bpy.app.version >= (5, 0, 0) and isinstance(owner, (bpy.types.Material, bpy.types.World)):
        return True
    with warnings.catch_warnings():
        # 5.x warns that 6.0 will have no such switch; `getattr` is ready for that
        warnings.simplefilter("ignore", DeprecationWarning)
        return bool(getattr(owner, "use_nodes", True))


def called(kind: str, name: str) -> str:
    """Return what a person calls a datablock: its name, with its kind if that does not say so."""
    return name if name.startswith(kind) else f"{kind} {name}"


def output_node(tree: Any) -> Any | None:
    """Return the output node that Cycles would take."""
    return tree.get_output_node("CYCLES") or tree.get_output_node("ALL")


def source_node(socket: Any) -> Any | None:
    """Return the node that feeds a socket, seen through reroutes; None if there is none."""
    while socket.is_linked:
        link = socket.links[0]
        if not link.is_valid or link.is_muted:
            return None
        node = link.from_node
        if node.type != "REROUTE":
            return node
        socket = node.inputs[0]
    return None


def input_value(socket: Any) -> float | None:
    """Return the number of a socket, or None when a link decides it."""
    node = source_node(socket)
    if node is None:
        return float(socket.default_value)
    return float(node.outputs[0].default_value) if node.type == "VALUE" else None


def input_color(socket: Any) -> tuple[Vector, bool]:
    """Return the colour of a socket, scene-linear, and whether that is all there is to it."""
    node = source_node(socket)
    exact = node is None or node.type == "RGB"
    source = node.outputs[0] if node is not None and node.type == "RGB" else socket
    r, g, b = tuple(source.default_value)[:3]
    return (float(r), float(g), float(b)), exact
