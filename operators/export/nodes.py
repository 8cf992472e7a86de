# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a datablock is shaded by nodes, and what a person calls datablocks and nodes."""

from __future__ import annotations

import warnings
from typing import Any

import bpy


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
    """Return what a person calls a datablock, such as 'Material "Red"'."""
    return f'{kind} "{name}"'


def node_called(node: Any) -> str:
    """Return what a person calls a node: its kind, and its own name where that says more."""
    name = node.label or node.name
    kind = node.bl_label or name
    return f"{kind} node" if name == kind else f'{kind} node "{name}"'
