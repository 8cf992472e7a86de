# SPDX-License-Identifier: GPL-3.0-or-later
"""Lists what is set and not heeded, by the tables of settings.

There are few settings that are listed and many that are not, so only those are read, and of an
object only once however often it is instanced.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ...adaptive_drt.scene.description import Issue
from .compositing import compositing_issues
from .coverage import Listed, Table
from .instances import lent_layer
from .listing import left_out
from .nodes import called
from .settings_tables.color import DISPLAY, VIEW
from .settings_tables.cycles import CYCLES, CYCLES_LAYER, CYCLES_OBJECT
from .settings_tables.image_format import IMAGE_FORMAT
from .settings_tables.object import INSTANCED, INSTANCER, LAMP, LIGHT_LINKING, SHAPE
from .settings_tables.render import RENDER
from .settings_tables.scene import SCENE
from .settings_tables.view_layer import COLLECTION, LAYER_COLLECTION, VIEW_LAYER

OWN = "own"
"""Stands for the owner itself among a checklist's attributes."""


class Checklist:
    """The listed entries of tables, each of which is of something reached from an owner.

    Parameters
    ----------
    tables : by the attribute of the owner that has these settings; `OWN` for the owner itself.
    """

    def __init__(self, **tables: Table) -> None:
        self._tables: list[tuple[str, Table]] = []
        for attribute, table in tables.items():
            listed: Table = {n: entry for n, entry in table.items() if isinstance(entry, Listed)}
            if listed:
                self._tables.append((attribute, listed))

    def __call__(self, owner: Any, said: str, kind: str, target: str) -> Iterator[Issue]:
        """Yield what is set on an owner and not heeded."""
        for attribute, table in self._tables:
            for reason, missing in left_out(table, _reached(owner, attribute)):
                yield Issue(said, reason, missing, kind, target)


SCENES = Checklist(
    own=SCENE,
    render=RENDER,
    cycles=CYCLES,
    view_settings=VIEW,
    display_settings=DISPLAY,
    image_settings=IMAGE_FORMAT,
)
VIEW_LAYERS = Checklist(own=VIEW_LAYER, cycles=CYCLES_LAYER)
LAYER_COLLECTIONS = Checklist(own=LAYER_COLLECTION, collection=COLLECTION)
SHAPES = Checklist(own=SHAPE, cycles=CYCLES_OBJECT)
INSTANCED_SHAPES = Checklist(own=INSTANCED, cycles=CYCLES_OBJECT)
INSTANCERS = Checklist(own=INSTANCER)
LAMPS = Checklist(own=LAMP, light_linking=LIGHT_LINKING)


def cycles_of(thing: Any) -> Any | None:
    """Return Cycles' settings of an evaluated datablock; None while its add-on is off.

    They are custom properties: a script's change of one does not reach the evaluated copy, and
    an animation of one does not reach the original.
    """
    return getattr(thing if _animates_cycles(thing) else thing.original, "cycles", None)


def _animates_cycles(thing: Any) -> bool:
    data = thing.animation_data
    if data is None:
        return False
    if len(data.nla_tracks):
        return True
    curves = [*data.drivers, *(_curves(data.action) if data.action is not None else ())]
    return any(curve.data_path.startswith("cycles.") for curve in curves)


def _curves(action: Any) -> Iterator[Any]:
    if hasattr(action, "fcurves"):  # until 4.5
        yield from action.fcurves
        return
    for layer in action.layers:
        for strip in layer.strips:
            for bag in strip.channelbags:
                yield from bag.fcurves


def scene_issues(depsgraph: Any) -> Iterator[Issue]:
    """Yield what a scene, its view layer and the collections in it ask for and do not get."""
    scene = depsgraph.scene_eval
    yield from SCENES(scene, called("Scene", scene.name), "SCENE", scene.name)
    layer = depsgraph.view_layer_eval
    yield from VIEW_LAYERS(layer, called("View Layer", layer.name), "VIEW_LAYER", layer.name)
    yield from compositing_issues(scene.original, layer)
    yield from _collections(depsgraph.view_layer.layer_collection)
    below = scene.original.background_set
    while below is not None:
        yield from _collections(lent_layer(below).layer_collection)
        below = below.background_set


class ObjectIssues:
    """What objects and their instancers ask for and do not get."""

    def __init__(self) -> None:
        self._read: dict[tuple[Any, str], list[Issue]] = {}

    def read(self, instance: Any) -> None:
        """Look at an instance's object, which is valid as long as the instance is."""
        thing, instancer = instance.object, instancer_of(instance)
        if thing.type == "LIGHT":
            self._read_as("lamp", thing, LAMPS)
        elif instancer is None:
            self._read_as("shape", thing, SHAPES)
        else:
            self._read_as("instanced", thing, INSTANCED_SHAPES)
            self._read_as("instancer", instancer, INSTANCERS)

    def __iter__(self) -> Iterator[Issue]:
        for (thing, part), issues in self._read.items():
            # what is told of a shape holds for its instances
            if part not in ("instanced", "instancer") or (thing, "shape") not in self._read:
                yield from issues

    def _read_as(self, part: str, thing: Any, checklist: Checklist) -> None:
        key = thing.original, part
        if key not in self._read:
            name = thing.original.name
            self._read[key] = list(checklist(thing, name, "OBJECT", name))


def instancer_of(instance: Any) -> Any | None:
    """Return the evaluated object that repeats another one; None where it stands itself."""
    if not instance.is_instance or instance.parent is None:
        return None
    # a text's faces are an instance that it is itself the parent of
    return None if instance.parent.original == instance.object.original else instance.parent


def _reached(owner: Any, attribute: str) -> Any | None:
    if attribute == OWN:
        return owner
    if attribute == "cycles":
        return _cycles(owner)
    if attribute == "image_settings":
        return owner.render.image_settings
    return getattr(owner, attribute, None)


def _cycles(owner: Any) -> Any | None:
    # a view layer is no datablock: it has no copy of its own to be stale
    return cycles_of(owner) if hasattr(owner, "original") else getattr(owner, "cycles", None)


def _collections(layer: Any) -> Iterator[Issue]:
    """Yield what a view layer asks of the collections that are in it."""
    if layer.exclude or layer.collection.hide_render:
        return
    said = called("Collection", layer.name)
    yield from LAYER_COLLECTIONS(layer, said, "COLLECTION", layer.collection.name)
    for child in layer.children:
        yield from _collections(child)
