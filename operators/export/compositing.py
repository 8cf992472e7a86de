# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes that a scene's compositing tree uses, and this engine does not make."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import Any

from ...adaptive_drt.scene.description import Issue
from ...adaptive_drt.scene.film import PASSES
from .nodes import called

MADE = frozenset(
    (
        *(one.name for one in PASSES),
        # of the Combined pass
        "Image",
        "Alpha",
        # Blender's own; before 5.0 without the blank
        "Freestyle",
        "GreasePencil",
        "Grease Pencil",
    )
)
"""Sockets of a Render Layers node that are filled, by their names."""


def compositing_issues(scene: Any, layer: Any) -> Iterator[Issue]:
    """Yield an issue for each pass of a view layer that nodes use and that is not there.

    Other scenes' layers in the tree count, too, if this engine is the one that renders them.
    """
    tree = _tree_of(scene) if scene.render.use_compositing else None
    for node in _nodes(tree, set()) if tree is not None else ():
        # a Cryptomatte node names no layer where none has its passes
        name = node.layer if node.type == "R_LAYERS" else layer.name
        if node.scene == scene:
            told = name == layer.name
        else:
            told = node.scene is not None and node.scene.render.engine == scene.render.engine
        if told:
            said = called("View Layer", name)
            for what in _lacking(node):
                yield Issue(said, f"the compositor uses its {what}", False, "VIEW_LAYER", name)


def _lacking(node: Any) -> Iterator[str]:
    if node.type != "R_LAYERS":
        if any(map(_is_used, node.outputs)):
            yield "Cryptomatte passes, which are not made: mattes are empty"
        return
    for socket in node.outputs:
        if socket.name not in MADE and _is_used(socket):
            yield f"{socket.name} pass, which is not made: it is empty there"


def _is_used(socket: Any) -> bool:
    return any(not link.is_muted for link in socket.links)


def _nodes(tree: Any, seen: set[Any]) -> Iterator[Any]:
    """Yield the nodes of a tree, and of the groups in it, that read what was rendered."""
    if tree in seen:
        return
    seen.add(tree)
    for node in tree.nodes:
        if node.mute:
            continue
        if node.type == "GROUP" and node.node_tree is not None:
            yield from _nodes(node.node_tree, seen)
        elif node.type == "R_LAYERS" or (node.type == "CRYPTOMATTE_V2" and node.source == "RENDER"):
            yield node


def _tree_of(scene: Any) -> Any | None:
    """Return the tree that composites a scene's pictures, if any."""
    if hasattr(scene, "compositing_node_group"):
        return scene.compositing_node_group
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        return scene.node_tree if scene.use_nodes else None
