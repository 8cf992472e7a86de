# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects and instances of a depsgraph a render shows, under lasting names."""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from typing import Any

from ...adaptive_drt.scene import Issue
from .nodes import called


def key_of(instance: Any) -> Hashable:
    """Return what identifies an instance at every time of the shutter."""
    parent = instance.parent.original.name_full if instance.parent else ""
    place = tuple(instance.persistent_id) if instance.is_instance else ()
    return (instance.object.original.name_full, parent, place)


def name_of(instance: Any) -> str:
    """Return the name a person knows an instance by."""
    name = instance.object.original.name
    return f"{instance.parent.original.name}/{name}" if instance.parent else name


class Visible:
    """Tells which instances a render shows: what is hidden from renders is not among them.

    The depsgraph of an operator is the viewport's, so what is hidden in the viewport alone is
    not in it; `missing` names those. `unheeded` is what the view layer asks of its collections
    beyond being there.
    """

    def __init__(self, depsgraph: Any) -> None:
        self._objects: set[Any] = set()
        self._instanced: dict[Any, set[Any]] = {}
        self.unheeded: list[Issue] = []
        self._walk(depsgraph.view_layer.layer_collection)
        below = depsgraph.scene.original.background_set
        while below is not None:
            self._walk(_first_layer(below).layer_collection)
            below = below.background_set

    def __call__(self, instance: Any) -> bool:
        thing = instance.object.original
        if not instance.is_instance:
            shown = thing in self._objects
            hides_itself = thing.is_instancer and not thing.show_instancer_for_render
            return shown and not hides_itself
        parent = instance.parent.original
        if thing.hide_render or parent.hide_render:
            return False
        if parent.instance_type != "COLLECTION" or parent.instance_collection is None:
            return parent in self._objects
        return parent in self._objects and thing in self._members(parent.instance_collection)

    def missing(self, seen: set[Any]) -> Iterator[Issue]:
        """Yield an issue for each object that a render shows but the viewport does not hold."""
        for thing in sorted(self._objects - seen, key=lambda o: o.name):
            if thing.is_instancer or thing.type in RENDERED:
                yield Issue(thing.name, "it is hidden in the viewport; show it there to render it")

    def _walk(self, layer: Any) -> None:
        if layer.exclude or layer.collection.hide_render:
            return
        self._objects.update(o.original for o in layer.collection.objects if not o.hide_render)
        self.unheeded.extend(_asked_of(layer))
        for child in layer.children:
            self._walk(child)

    def _members(self, collection: Any) -> set[Any]:
        if collection not in self._instanced:
            self._instanced[collection] = set(_reached(collection))
        return self._instanced[collection]


RENDERED = frozenset(
    "MESH CURVE SURFACE META FONT CURVES POINTCLOUD VOLUME GREASEPENCIL GPENCIL LIGHT".split()
)
"""Types of objects that a render of Blender's shows."""


def _asked_of(layer: Any) -> Iterator[Issue]:
    """Yield what a view layer asks of a collection, and is left out."""
    if not len(layer.collection.all_objects):
        return
    said = called("Collection", layer.name)
    remedy = "exclude it from the view layer, or switch that off"
    if layer.holdout:
        yield Issue(said, f"its Holdout is left out, so its objects are seen: {remedy}")
    if layer.indirect_only:
        yield Issue(said, f"its Indirect Only is left out, so the camera sees it: {remedy}")


def _first_layer(scene: Any) -> Any:
    """Return the view layer whose objects a scene lends as a Background Set."""
    layers = scene.view_layers
    return next((layer for layer in layers if layer.use), layers[0])


def _reached(collection: Any) -> Iterator[Any]:
    if collection.hide_render:
        return
    for thing in collection.objects:
        if thing.hide_render:
            continue
        yield thing.original
        if thing.instance_type == "COLLECTION" and thing.instance_collection is not None:
            yield from _reached(thing.instance_collection)
    for child in collection.children:
        yield from _reached(child)
