# SPDX-License-Identifier: GPL-3.0-or-later
"""Follows the links of shader nodes to what feeds a socket, as Cycles does.

Reroutes, groups and muted nodes are seen through. A muted node passes one of its inputs on, which
`internal_links` names, or nothing. What a socket shows that nothing feeds depends on the version of
Blender: up to 4.5 each node passed through converts the value, and passes on a zero if it gets
none; 5.0 and later take them out of the tree before Cycles sees it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import bpy

from ...adaptive_drt.scene.description import Vector

INLINED = bpy.app.version >= (5, 0, 0)
"""Whether Blender takes reroutes, groups and muted nodes out of the tree before a render."""

LUMA = (0.2126, 0.7152, 0.0722)
"""Weights of linear Rec. 709 by which a colour becomes a number."""

NUMBERS = ("VALUE", "INT", "BOOLEAN")
"""Types of sockets that hold one number."""

GROUPS = tuple(
    getattr(bpy.types, name)
    for name in ("ShaderNodeGroup", "ShaderNodeCustomGroup")
    if hasattr(bpy.types, name)
)

Value = tuple[float, ...]
"""A number (1,) or a colour or vector (3,)."""


@dataclass(frozen=True)
class Input:
    """An input socket of a node that lies inside the group nodes `groups`, outermost first."""

    socket: Any
    groups: tuple[Any, ...] = ()

    def source(self) -> Source:
        """Return what feeds this socket."""
        return _followed(self)


@dataclass(frozen=True)
class Source:
    """What decides the value of an input socket.

    Attributes
    ----------
    node, groups : the node that feeds it, and the group nodes around that; None: no node does.
    socket : an output of `node`; without a node the input whose own value holds, or None where
        only a zero is passed on.
    passed : types of the sockets on the way, from the fed one on, that convert what they pass.
    """

    node: Any | None
    socket: Any | None
    groups: tuple[Any, ...] = ()
    passed: tuple[str, ...] = ()


Known = Callable[[Source], Value | None]
"""Returns the value of a node's output, or None where it is not constant."""


def output_node(tree: Any) -> Any | None:
    """Return the output node that Cycles takes, or None."""
    node = tree.get_output_node("CYCLES") or tree.get_output_node("ALL")
    # measured: 4.5 renders nothing for a muted output; 5.0 renders it all the same
    return None if node is not None and node.mute and not INLINED else node


def surface_of(tree: Any) -> Source:
    """Return what feeds the surface of a tree's output; there is no node if nothing does."""
    output = output_node(tree)
    if output is None:
        return Source(None, None)
    return Input(output.inputs["Surface"]).source()


def nothing_known(source: Source) -> Value | None:
    """Return None: no node is understood but those of constants."""
    return None


def value_of(fed: Input, known: Known = nothing_known) -> Value | None:
    """Return a socket's constant value, or None when a node decides that is not understood.

    known : returns the values of further nodes' outputs.
    """
    source = fed.source()
    if source.node is None:
        value = (0.0,) if source.socket is None else _own_value(source.socket)
    elif source.node.type in ("RGB", "VALUE"):
        value = _own_value(source.socket)
    else:
        value = known(source)
    for kind in (*reversed(source.passed), fed.socket.type):
        if value is None:
            return None
        value = _converted(value, kind)
    return value


def number_of(fed: Input, known: Known = nothing_known) -> float | None:
    """Return the number that a socket gets, or None when it is not constant."""
    value = value_of(fed, known)
    return value[0] if value is not None and len(value) == 1 else None


def color_of(fed: Input, known: Known = nothing_known) -> Vector | None:
    """Return the colour that a socket gets, scene-linear, or None when it is not constant."""
    value = value_of(fed, known)
    return None if value is None or len(value) != 3 else (value[0], value[1], value[2])


def own_number(fed: Input) -> float:
    """Return the number that a socket has for itself."""
    return float(fed.socket.default_value)


def own_color(fed: Input) -> Vector:
    """Return the colour that a socket has for itself."""
    r, g, b = tuple(fed.socket.default_value)[:3]
    return (float(r), float(g), float(b))


def _followed(fed: Input) -> Source:
    at, owner = fed, fed
    passed: tuple[str, ...] = ()
    passing = False  # whether `at` belongs to a node that passes its input on
    while True:
        link = _link(at.socket)
        step = None if link is None else _step(link, at.groups)
        if step is None:
            # measured: here 5.0 falls back to the socket that was fed, 4.5 to a zero
            zero = passing and not INLINED
            return Source(None, None if zero else owner.socket, owner.groups, passed)
        if isinstance(step, Source):
            if _is_shader(step.socket) and not _is_shader(fed.socket):
                # Cycles has no way to make a colour of a shader
                return Source(None, owner.socket, owner.groups, passed)
            return Source(step.node, step.socket, step.groups, passed)
        at, passing = step
        if not passing:
            owner = at
        if not INLINED:
            passed = (*passed, at.socket.type)


def _link(socket: Any) -> Any | None:
    """Return the link that feeds a socket, or None: Cycles leaves out those that are not valid."""
    if not socket.is_linked or not socket.enabled or socket.is_unavailable:
        return None
    for link in socket.links:
        if link.is_valid and not link.is_muted and link.from_socket.enabled:
            return link
    return None


def _step(link: Any, groups: tuple[Any, ...]) -> tuple[Input, bool] | Source | None:
    """Return the input that a link leads to through its node, or the node; None: nothing."""
    node, socket = link.from_node, link.from_socket
    inside = node.type in ("GROUP_INPUT", "GROUP_OUTPUT")
    if node.mute and not (inside and INLINED):
        own = (x for x in node.internal_links if x.to_socket == socket)
        found = next(own, None)
        return None if found is None else (Input(found.from_socket, groups), True)
    if node.type == "REROUTE":
        return Input(node.inputs[0], groups), True
    if isinstance(node, GROUPS):
        return _inside(node, socket, groups)
    if inside:
        outer = _identified(groups[-1].inputs, socket.identifier) if groups else None
        return None if outer is None else (Input(outer, groups[:-1]), False)
    return Source(node, socket, groups)


def _inside(node: Any, socket: Any, groups: tuple[Any, ...]) -> tuple[Input, bool] | Source | None:
    """Return the input of a group's own output node that feeds one of the group's outputs."""
    if node.node_tree is None:
        return None
    outputs = [n for n in node.node_tree.nodes if n.type == "GROUP_OUTPUT"]
    output = next((n for n in outputs if n.is_active_output), None)
    found = None if output is None else _identified(output.inputs, socket.identifier)
    if found is None or (output.mute and not INLINED):
        return Source(None, None)
    return Input(found, (*groups, node)), False


def _identified(sockets: Any, identifier: str) -> Any | None:
    return next((s for s in sockets if s.identifier == identifier), None)


def _is_shader(socket: Any) -> bool:
    return bool(socket is not None and socket.type == "SHADER")


def _own_value(socket: Any) -> Value | None:
    if socket.type in NUMBERS:
        return (float(socket.default_value),)
    if socket.type in ("RGBA", "VECTOR"):
        x, y, z = tuple(socket.default_value)[:3]
        return (float(x), float(y), float(z))
    return None


def _converted(value: Value, kind: str) -> Value | None:
    """Return a value as a socket of another type takes it; None where no test has shown how."""
    if kind == "VALUE":
        return value if len(value) == 1 else (sum(a * b for a, b in zip(value, LUMA, strict=True)),)
    if kind in ("RGBA", "VECTOR"):
        return value if len(value) == 3 else value * 3
    return value if kind in NUMBERS and len(value) == 1 and value[0].is_integer() else None
