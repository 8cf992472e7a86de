# SPDX-License-Identifier: GPL-3.0-or-later
"""Selects the objects that a line of the list is about."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import bpy

from ..adaptive_drt.scene.description import Issue
from .figures import issues_of, read_figures
from .images import MASK, find_image
from .issues import Group, grouped
from .state import issues_key, state

OBJECT_DATA = frozenset(
    "ARMATURE CAMERA CURVE CURVES GREASEPENCIL GREASEPENCIL_V3 LATTICE LIGHT LIGHT_PROBE MESH META "
    "POINTCLOUD SPEAKER SURFACE FONT VOLUME".split()
)
"""Kinds of datablocks that objects show: `ID.id_type` of `Object.data`, and types of objects."""

SELECTABLE = OBJECT_DATA | {"OBJECT", "MATERIAL", "COLLECTION", "PARTICLE"}
"""Kinds of datablocks that objects of a scene stand for."""

MOST_NAMES = 3
"""Names in a message; the report holds all."""


def known_issues(scene: Any) -> tuple[Issue, ...] | None:
    """Return what was last found of a scene, or None when it was neither rendered nor checked."""
    found = state.issues.get(issues_key(scene))
    if found is not None:
        return found
    figures = read_figures(find_image(MASK))
    return tuple(issues_of(figures)) if figures else None


def is_selectable(group: Group) -> bool:
    """Whether there may be objects to select for a line."""
    return group.kind in SELECTABLE


def objects_of(issue: Issue, scene: Any) -> list[Any]:
    """Return the scene's objects that an issue is about, in no case more than once."""
    for name in _names(issue):
        found = list(dict.fromkeys(_users(issue.kind, name, scene)))
        if found:
            return found
    return []


def _names(issue: Issue) -> Iterator[str]:
    """Yield what the datablock may be called, the likeliest first."""
    name = issue.target or issue.name
    yield name
    within = re.search(r'"(.+)"', name)
    if within:
        yield within[1]
    # an instance is called by its instancer and its object; the first is in the scene
    for slash in re.finditer("/", name):
        yield name[: slash.start()]
        yield name[slash.end() :]
    # 'Material Red' is what a message calls the material 'Red'
    kind = issue.kind.replace("_", " ").title() + " "
    if name.startswith(kind):
        yield name.removeprefix(kind)


def _users(kind: str, name: str, scene: Any) -> Iterator[Any]:
    objects = scene.objects
    if kind == "MATERIAL":
        yield from (o for o in objects if any(s.material and s.material.name == name
                                              for s in o.material_slots))  # fmt: skip
    elif kind == "COLLECTION":
        for collection in (scene.collection, *scene.collection.children_recursive):
            if collection.name == name:
                yield from collection.all_objects
        yield from (o for o in objects if o.instance_collection
                    and o.instance_collection.name == name)  # fmt: skip
    elif kind == "PARTICLE":
        yield from (o for o in objects if any(p.settings.name == name for p in o.particle_systems))
    elif kind in OBJECT_DATA:
        of_kind = [o for o in objects if o.data and kind in (o.type, o.data.id_type)]
        yield from (o for o in of_kind if o.data.name == name)
        yield from (o for o in of_kind if o.name == name)
    else:
        # an object that is linked may have the name of another one
        yield from (o for o in objects if o.name == name)


class ADRT_OT_select(bpy.types.Operator):
    """Select the objects that this line is about"""

    bl_idname = "adaptive_drt.select"
    bl_label = "Select Objects"
    bl_options = {"REGISTER", "UNDO"}

    line: bpy.props.IntProperty(
        name="Line",
        description="Line of the list, counted from 0",
        min=0,
        options={"SKIP_SAVE"},
    )

    @classmethod
    def description(cls, context: Any, properties: Any) -> str:
        groups = grouped(known_issues(context.scene) or ())
        if properties.line >= len(groups):
            return cls.__doc__ or ""
        return "Select " + ", ".join(groups[properties.line].names)

    @classmethod
    def poll(cls, context: Any) -> bool:
        return context.scene is not None and context.view_layer is not None

    def execute(self, context: Any) -> set[str]:
        groups = grouped(known_issues(context.scene) or ())
        if self.line >= len(groups):
            self.report({"WARNING"}, f"The list has no line {self.line}: check the scene again")
            return {"CANCELLED"}
        group = groups[self.line]
        found = [o for one in group.members for o in objects_of(one, context.scene)]
        found = list(dict.fromkeys(found))
        if not found:
            self.report({"WARNING"}, f"No object of this scene belongs to {_listed(group.names)}")
            return {"CANCELLED"}
        layer = context.view_layer
        able = [o for o in found if _is_able(o, layer)]
        if able:
            _select(able, context)
        self._tell(found, able, layer)
        return {"FINISHED"} if able else {"CANCELLED"}

    def _tell(self, found: list[Any], able: list[Any], layer: Any) -> None:
        reasons: dict[str, list[str]] = {}
        for one in found:
            if one not in able:
                reasons.setdefault(_why_not(one, layer), []).append(f'"{one.name}"')
        said = "; ".join(f"{_listed(names)}: {reason}" for reason, names in reasons.items())
        if said:
            self.report({"WARNING"}, f"{len(able)} of {len(found)} selected; {said}")


def _is_able(thing: Any, layer: Any) -> bool:
    return not _why_not(thing, layer)


def _why_not(thing: Any, layer: Any) -> str:
    """Return why an object cannot be selected in a view layer, or ""."""
    if layer.objects.get(thing.name) != thing:
        return f'not in the view layer "{layer.name}"'
    if not thing.visible_get(view_layer=layer):
        return "hidden in the viewport"
    return "not selectable (see the Outliner's filter)" if thing.hide_select else ""


def _listed(names: Any) -> str:
    shown = ", ".join(tuple(names)[:MOST_NAMES])
    more = len(names) - MOST_NAMES
    return f"{shown} and {more} more" if more > 0 else shown


def _select(things: list[Any], context: Any) -> None:
    """Select these objects and no others, the first as the active one."""
    layer = context.view_layer
    active = layer.objects.active
    if active is not None and active.mode != "OBJECT" and bpy.ops.object.mode_set.poll():
        bpy.ops.object.mode_set(mode="OBJECT")
    for one in layer.objects.selected[:]:
        one.select_set(False, view_layer=layer)
    for one in things:
        one.select_set(True, view_layer=layer)
    layer.objects.active = things[0]
