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
    thing = instance.object.original
    parent = instance.parent.original if instance.parent else thing
    # a text's faces are an instance that it is itself the parent of
    return thing.name if parent == thing else f"{parent.name}/{thing.name}"


def owner_of(instance: Any) -> Any:
    """Return the object that a person selects to reach an instance."""
    return (instance.parent or instance.object).original


class Visible:
    """Tells which instances a render shows.

    A render's own depsgraph holds nothing else. The depsgraph of an operator is the viewport's:
    what is hidden from renders is in it, and is found here; what is hidden in the viewport alone is
    not in it, and `missing` names it. `unheeded` is what the view layer asks of its collections
    beyond being there.
    """

    def __init__(self, depsgraph: Any) -> None:
        self._of_render = depsgraph.mode == "RENDER"
        self._objects: set[Any] = set()
        self._instanced: dict[Any, _Members] = {}
        self.unheeded: list[Issue] = []
        self._walk(depsgraph.view_layer.layer_collection)
        below = depsgraph.scene.original.background_set
        while below is not None:
            self._walk(_first_layer(below).layer_collection)
            below = below.background_set

    def __call__(self, instance: Any) -> bool:
        if self._of_render:
            # the original's switches may be those of another frame: a render does not set them
            return bool(instance.show_self)
        thing = instance.object.original
        if not instance.is_instance:
            hides_itself = thing.is_instancer and not thing.show_instancer_for_render
            is_pattern = thing.parent is not None and thing.parent.instance_type in ON_MESHES
            return thing in self._objects and not (hides_itself or is_pattern)
        parent = instance.parent.original
        if parent not in self._objects:
            return False
        if parent.instance_type in ON_MESHES:
            return thing in self._objects
        if parent.instance_type != "COLLECTION" or parent.instance_collection is None:
            return True  # nodes and particles show what is hidden elsewhere
        return self._members(parent.instance_collection).shows(thing)

    def missing(self, seen: set[Any]) -> Iterator[Issue]:
        """Yield an issue for each object that a render shows but the viewport does not hold."""
        if self._of_render:
            return
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

    def _members(self, collection: Any) -> _Members:
        if collection not in self._instanced:
            self._instanced[collection] = _Members(collection)
        return self._instanced[collection]


ON_MESHES = frozenset(("VERTS", "FACES"))
"""Ways of an object to repeat its children, which are not shown themselves then."""


class _Members:
    """What an instanced collection holds, and what of it a render shows."""

    def __init__(self, collection: Any) -> None:
        self._all = set(_reached(collection, hidden=True))
        self._shown = set(_reached(collection, hidden=False))
        self._makes_more = any(map(_makes_instances, self._shown))

    def shows(self, thing: Any) -> bool:
        """Whether it is shown; what is no member is an instance that a member makes."""
        return thing in self._shown or (self._makes_more and thing not in self._all)


def _makes_instances(thing: Any) -> bool:
    makers = ("NODES", "PARTICLE_SYSTEM")
    return thing.instance_type in ON_MESHES or any(m.type in makers for m in thing.modifiers)


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


def _reached(collection: Any, hidden: bool) -> Iterator[Any]:
    """Yield what an instanced collection holds at any depth; `hidden`: also what is hidden."""
    if collection.hide_render and not hidden:
        return
    for thing in collection.objects:
        if thing.hide_render and not hidden:
            continue
        yield thing.original
        if thing.instance_type == "COLLECTION" and thing.instance_collection is not None:
            yield from _reached(thing.instance_collection, hidden)
    for child in collection.children:
        yield from _reached(child, hidden)
