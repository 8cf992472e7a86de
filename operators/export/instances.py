# SPDX-License-Identifier: GPL-3.0-or-later
"""Keys and names of a depsgraph's instances."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any


def key_of(instance: Any) -> Hashable:
    """Return what identifies an instance at every time of the shutter."""
    # each access to Blender's data costs some tenths of a microsecond, and there may be millions
    parent = instance.parent
    name = parent.original.name_full if parent else ""
    place = instance.persistent_id[:] if instance.is_instance else ()
    return (instance.object.original.name_full, name, place)


def repetition_of(instance: Any) -> Hashable | None:
    """Return what is equal for all instances of a mesh or hair by one instancer, else None."""
    if not instance.is_instance or instance.parent is None:
        return None
    thing = instance.object
    if thing.type not in ("MESH", "CURVES") or thing.particle_systems:
        return None  # hair of particles is read beside its mesh
    # the evaluated object may be one that the depsgraph uses for each instance in turn
    parent = instance.parent.original.as_pointer()
    own = thing.original.as_pointer(), thing.data.as_pointer()
    return parent, *own, instance.show_self


def name_of(instance: Any) -> str:
    """Return the name a person knows an instance by."""
    thing = instance.object.original
    parent = instance.parent.original if instance.parent else thing
    # a text's faces are an instance that it is itself the parent of
    return thing.name if parent == thing else f"{parent.name}/{thing.name}"


def owner_of(instance: Any) -> Any:
    """Return the object that a person selects to reach an instance."""
    return (instance.parent or instance.object).original


def lent_layer(scene: Any) -> Any:
    """Return the view layer whose objects a scene lends as a Background Set."""
    layers = scene.view_layers
    return next((layer for layer in layers if layer.use), layers[0])
