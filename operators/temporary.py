# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes of Blender's data that are taken back: what the user has set stays as it was."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy

RENDER_RESULT = "Render Result"
SLOT = "Adaptive Render"
"""Name of the render slot that the button's reading of the scene empties."""

LAST_PART = re.compile(r'(?P<owner>.*?)(?:\.?(?P<name>[a-z_]\w*)|\["(?P<key>(?:[^"\\]|\\.)*)"\])')
"""A data path: what holds the property, and the property's name or the custom property's key."""


@contextmanager
def changed(thing: Any, **values: Any) -> Iterator[None]:
    """Set properties, in this order, and put back what they were."""
    before = {name: getattr(thing, name) for name in values}
    try:
        for name, value in values.items():
            if getattr(thing, name) != value:
                setattr(thing, name, value)
        yield
    finally:
        for name, value in before.items():
            if getattr(thing, name) != value:
                setattr(thing, name, value)


@contextmanager
def kept_render_result() -> Iterator[None]:
    """Let Blender render into a slot of ours, so that the user's own renders stay in theirs."""
    image = _render_result()
    if image is None:
        try:
            yield
        finally:
            image = _render_result()
            if image is not None:  # Blender makes another with the next render of the user's
                bpy.data.images.remove(image)
        return
    slots = image.render_slots
    active = slots.active_index
    # a slot cannot be asked whether it is empty: Blender loses the picture of one that is not
    names = [slot.name for slot in slots]
    if SLOT not in names:
        slots.new(name=SLOT)
        names.append(SLOT)
    slots.active_index = names.index(SLOT)
    try:
        yield
    finally:
        slots.active_index = active


def _render_result() -> Any | None:
    return next((i for i in bpy.data.images if i.type == "RENDER_RESULT"), None)


@contextmanager
def kept_edits() -> Iterator[None]:
    """Keep edits that are not keyed yet of what F-curves animate.

    A render evaluates the animation at the current frame, and with it takes back such edits: F12
    does so, too.
    """
    before = [(owner, *found) for owner in _animated() for found in _values(owner)]
    try:
        yield
    finally:
        for owner, path, index, value in before:
            _put_back(owner, path, index, value)


def _animated() -> Iterator[Any]:
    """Yield the datablocks that F-curves animate."""
    for prop in bpy.data.bl_rna.properties:
        if prop.type != "COLLECTION":
            continue
        for owner in getattr(bpy.data, prop.identifier):
            # a node tree of a material, say, is in no collection of its own
            for one in (owner, getattr(owner, "node_tree", None)):
                data = getattr(one, "animation_data", None)
                if data is not None and data.action is not None:
                    yield one


def _values(owner: Any) -> Iterator[tuple[str, int, Any]]:
    """Yield data path, index and value of each property that an action of `owner` animates."""
    for curve in _curves(owner.animation_data):
        try:
            value = owner.path_resolve(curve.data_path)
        except ValueError:  # a curve whose property is gone
            continue
        if hasattr(value, "__len__") and not isinstance(value, str):
            if curve.array_index >= len(value):
                continue
            value = value[curve.array_index]
        yield curve.data_path, curve.array_index, value


def _curves(data: Any) -> Any:
    """Return the F-curves of an action; from Blender 4.4 on an action has slots."""
    from bpy_extras import anim_utils

    if not hasattr(anim_utils, "action_get_channelbag_for_slot"):
        return data.action.fcurves
    if data.action_slot is None:
        return ()
    bag = anim_utils.action_get_channelbag_for_slot(data.action, data.action_slot)
    return () if bag is None else bag.fcurves


def _put_back(owner: Any, path: str, index: int, value: Any) -> None:
    found = LAST_PART.fullmatch(path)
    if found is None:
        return
    try:
        now = owner.path_resolve(path)
        if hasattr(now, "__len__") and not isinstance(now, str):
            if now[index] != value:
                now[index] = value
        elif now != value:
            _assign(owner.path_resolve(found["owner"]) if found["owner"] else owner, found, value)
    except (ValueError, AttributeError, TypeError):
        return  # read-only, or gone: nothing that a person has edited


def _assign(place: Any, part: re.Match[str], value: Any) -> None:
    """Set a property by the last part of its data path."""
    if part["name"]:
        setattr(place, part["name"], value)
    else:
        place[part["key"].replace('\\"', '"')] = value
