# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings that change while the shutter is open, and are rendered as at its middle.

What the picture would be made of is compared, rather than keyframes: these may all be alike, and
drivers and handlers change settings, too.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import bpy

from ...adaptive_drt.scene.description import Issue
from .camera_table import CAMERA, DEPTH_OF_FIELD
from .coverage import Listed, Table, Use
from .light import emission_of, lamp_of
from .light_table import BY_TYPE, LIGHT
from .links import GROUPS
from .listing import left_out, plain, same
from .material import material_of
from .nodes import called
from .world import world_of

Key = tuple[str, str]
"""Kind of a datablock, as an issue names it, and its full name."""

HANDLERS = tuple(
    getattr(bpy.app.handlers, f"{event}_{time}")
    for event in ("frame_change", "depsgraph_update")
    for time in ("pre", "post")
)
"""Functions of the user's own that may change anything at a change of the frame."""

PLAIN = ("BOOLEAN", "INT", "FLOAT", "ENUM")
"""Types of properties whose values can be compared."""


@dataclass(frozen=True)
class _State:
    """What is rendered of a datablock at one time, by what a person calls it; what is left out."""

    fields: dict[str, Any]
    issues: list[Issue]
    clip: tuple[float, float] | None = None


class Animated:
    """Holds what the ends of the shutter show, to be compared with its middle."""

    def __init__(self) -> None:
        self._ends: list[dict[Key, _State]] = []

    def sample(self, depsgraph: Any) -> None:
        """Read the settings at one end of the shutter."""
        changeable = (x for x in _things(depsgraph) if _may_change(x[1]))
        self._ends.append({key: state(thing) for key, thing, state in changeable})

    def changes(self, depsgraph: Any, used: set[Key]) -> Iterator[Issue]:
        """Yield what differs from the middle of the shutter, at which the depsgraph is.

        Parameters
        ----------
        used : the datablocks that are in the picture.
        """
        for key, thing, state in _things(depsgraph) if self._ends else ():
            ends = [end[key] for end in self._ends if key in end]
            if key not in used or not ends:
                continue
            middle = state(thing)
            changed = [
                label
                for label, value in middle.fields.items()
                if any(label in e.fields and not same(e.fields[label], value) for e in ends)
            ]
            if changed:
                name = called(key[0].title(), thing.name)
                yield Issue(name, _sentence(changed), kind=key[0], target=thing.name)
            for end in ends:
                yield from (issue for issue in end.issues if issue not in middle.issues)

    def clip(self, camera: Any) -> tuple[float, float]:
        """Return the largest Clip Start and the smallest Clip End while the shutter is open."""
        key = ("CAMERA", camera.name_full)
        found = [end[key].clip for end in self._ends if key in end]
        clips = [(camera.clip_start, camera.clip_end), *(c for c in found if c is not None)]
        return max(start for start, _ in clips), min(end for _, end in clips)


def _sentence(labels: list[str]) -> str:
    if len(labels) == 1:
        return f"its {labels[0]} changes during the shutter; it is rendered as at the middle"
    said = f"{', '.join(labels[:-1])} and {labels[-1]}"
    return f"its {said} change during the shutter; they are rendered as at the middle"


def _things(depsgraph: Any) -> Iterator[tuple[Key, Any, Any]]:
    """Yield each evaluated datablock that has settings, its key and what reads them."""
    for thing in depsgraph.ids:
        for kind, (type_of, state) in READERS.items():
            if isinstance(thing, type_of):
                yield (kind, thing.name_full), thing, state


def _may_change(thing: Any) -> bool:
    """Whether anything could change a datablock from one time to another."""
    if any(HANDLERS):
        return True
    thing = thing.original
    tree = getattr(thing, "node_tree", None)
    return thing.animation_data is not None or (tree is not None and _is_animated(tree, set()))


def _is_animated(tree: Any, seen: set[Any]) -> bool:
    """Whether a tree of nodes, or one of the groups in it, has keyframes or drivers."""
    if tree in seen:
        return False
    seen.add(tree)
    if tree.animation_data is not None:
        return True
    groups = (n.node_tree for n in tree.nodes if isinstance(n, GROUPS))
    return any(group is not None and _is_animated(group, seen) for group in groups)


def _values(table: Table, owner: Any) -> dict[str, Any]:
    """Return the values of the settings in a table that are rendered, or would be listed."""
    found = {}
    for name, prop in owner.bl_rna.properties.items():
        entry = table.get(name)
        heeded = entry is Use.RENDERED or isinstance(entry, Listed)
        if heeded and prop.type in PLAIN and not prop.is_readonly:
            found[prop.name.lower()] = plain(getattr(owner, name))
    return found


def _camera(camera: Any) -> _State:
    fields = _values(CAMERA, camera)
    listed = ((CAMERA, camera), (DEPTH_OF_FIELD, camera.dof))
    issues = [
        Issue(called("Camera", camera.name), reason, kind="CAMERA", target=camera.name)
        for table, owner in listed
        for reason, _ in left_out(table, owner)
    ]
    return _State(fields, issues, (camera.clip_start, camera.clip_end))


def _light(light: Any) -> _State:
    issues: list[Issue] = []
    lamp_of(light, issues)
    fields = _values(BY_TYPE.get(light.type, LIGHT), light)
    return _State({**fields, "nodes' emission": emission_of(light, [])}, issues)


def _material(material: Any) -> _State:
    issues: list[Issue] = []
    return _State({"colour": material_of(material, issues).color}, issues)


def _world(world: Any) -> _State:
    issues: list[Issue] = []
    found = world_of(world, issues)
    light = None if found.light is None else found.light.radiance
    return _State({"colour": (found.background, light)}, issues)


READERS = {
    "CAMERA": (bpy.types.Camera, _camera),
    "LIGHT": (bpy.types.Light, _light),
    "MATERIAL": (bpy.types.Material, _material),
    "WORLD": (bpy.types.World, _world),
}
"""Types of datablocks, and what reads their settings, by kind."""
