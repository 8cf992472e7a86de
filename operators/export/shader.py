# SPDX-License-Identifier: GPL-3.0-or-later
"""A shader node that is rendered, and which of its inputs are left out."""

from __future__ import annotations

from typing import Any

from ...adaptive_drt.scene.description import Vector
from .coverage import Listed
from .links import (
    Input,
    Known,
    Source,
    color_of,
    nothing_known,
    number_of,
    own_color,
    own_number,
    value_of,
)
from .listing import same
from .node_table import INPUTS, UNLINKED
from .nodes import node_called

EMITTERS = ("ShaderNodeEmission", "ShaderNodeBackground")
"""Nodes that shine; measured: Cycles takes both alike in worlds and in lights."""

MIXERS = ("ShaderNodeMixShader", "ShaderNodeAddShader")
"""Nodes that add up two shaders."""


def mixed_parts(
    source: Source, left_out: list[str], known: Known = nothing_known
) -> list[tuple[float, Source]]:
    """Return the weight of each shader that a node of `MIXERS` adds up, and what feeds it.

    known : as that of `value_of`.  left_out : what decides a factor that is not constant is
    appended; the socket's own value is used.
    """
    node: Any = source.node
    *factor, one, two = (Input(socket, source.groups) for socket in node.inputs)
    weights = (1.0, 1.0)
    if factor:
        share = number_of(factor[0], known)
        if share is None:
            fed = node_called(factor[0].source().node)
            left_out.append(f"the {fed} linked to its Factor is left out")
            share = own_number(factor[0])
        share = min(max(share, 0.0), 1.0)
        weights = (1.0 - share, share)
    return [(weights[0], one.source()), (weights[1], two.source())]


class Shader:
    """Reads the inputs of a node of `INPUTS` by their identifiers.

    known : values of nodes' outputs beside those of constants.
    """

    def __init__(self, source: Source, known: Known = nothing_known) -> None:
        self._node: Any = source.node
        self._known = known
        # read once: a Principled BSDF has thirty, and each look at one of Blender's takes time
        self._inputs = {s.identifier: Input(s, source.groups) for s in source.node.inputs}

    def number(self, name: str) -> float | None:
        """Return the number of an input, or None when it is not constant or not there."""
        found = self._inputs.get(name)
        return None if found is None else number_of(found, self._known)

    def color(self, name: str) -> Vector | None:
        """Return the colour of an input, or None when it is not constant or not there."""
        found = self._inputs.get(name)
        return None if found is None else color_of(found, self._known)

    def rendered_color(self, name: str, left_out: list[str]) -> Vector:
        """Return the colour of an input; where it is not constant the input's own, and say so."""
        found = self._inputs[name]
        color = color_of(found, self._known)
        if color is None:
            left_out.append(self._linked(found))
            return own_color(found)
        return color

    def rendered_number(self, name: str, left_out: list[str]) -> float:
        """Return the number of an input; where it is not constant the input's own, and say so."""
        found = self._inputs[name]
        number = number_of(found, self._known)
        if number is None:
            left_out.append(self._linked(found))
            return own_number(found)
        return number

    def source(self, name: str) -> Source | None:
        """Return what feeds an input, or None when there is no such input."""
        found = self._inputs.get(name)
        return None if found is None else found.source()

    def emission(self, left_out: list[str]) -> Vector:
        """Return colour times strength of an emitter."""
        return self.glow("Color", "Strength", left_out)

    def has(self, *names: str) -> bool:
        """Whether the node has all of some inputs."""
        return all(name in self._inputs for name in names)

    def glow(self, color: str, strength: str, left_out: list[str]) -> Vector:
        """Return colour times strength, by the names of both inputs."""
        size = self.rendered_number(strength, left_out)
        r, g, b = self.rendered_color(color, left_out) if size else (0.0, 0.0, 0.0)
        return (r * size, g * size, b * size)

    def terms(self) -> list[str]:
        """Return the reasons of the inputs that are left out; a linked input is taken to matter."""
        found = []
        for name, entry in INPUTS[self._node.bl_idname].items():
            fed = self._inputs.get(name) if isinstance(entry, Listed) else None
            if fed is None or not isinstance(entry, Listed):
                continue
            if entry.neutral == UNLINKED:
                neutral = fed.source().node is None
            else:
                value = value_of(fed, self._known)
                single = value[0] if value is not None and len(value) == 1 else value
                neutral = any(same(single, x) for x in entry.neutral)
            if not neutral and (entry.when is None or entry.when(self)):
                found.append(entry.reason)
        return found

    def _linked(self, fed: Input) -> str:
        node = fed.source().node
        said = "what is" if node is None else f"the {node_called(node)}"
        return f"{said} linked to its {fed.socket.name} is left out"
