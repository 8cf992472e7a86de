# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair of instances: hair curves, and that of particle systems, as tubes of triangles."""

from __future__ import annotations

from typing import Any

import numpy as np

from .checklist import instancer_of
from .hair_curves import strands_of, tubes_of
from .instances import key_of
from .material import slot_material
from .mesh import NO_SCALE, NOT_FINITE
from .particle_hair import hair_systems, strands_of_system
from .shutter import matrix_of
from .triangle_mesh import MeshForm, vanishes

__all__ = ["gather_curves", "gather_particle_hair"]


def gather_curves(instance: Any, name: str, gathered: Any) -> None:
    """Take in an object of hair curves; `gathered` is the exporter's gathered scene."""
    thing, curves = instance.object, instance.object.data
    pointer = curves.as_pointer()
    if pointer not in gathered.curves:
        strands = strands_of(curves)
        gathered.curves[pointer] = strands, *tubes_of(strands, gathered.straight_curves)
    strands, form, reason = gathered.curves[pointer]
    if form is not None and gathered.deforming is not None:
        gathered.tell(name, *gathered.deforming.reasons(instance, curves, strands.layout))
    _add(form, reason, slot_material(thing, 0), instance, name, gathered)


def gather_particle_hair(instance: Any, name: str, gathered: Any) -> None:
    """Take in the hair of an object's particle systems."""
    thing = instance.object
    for number, system in enumerate(hair_systems(thing)):
        key = thing.original.as_pointer(), number
        if key not in gathered.curves:
            strands = strands_of_system(thing, system)
            gathered.curves[key] = strands, *tubes_of(strands, gathered.straight_curves)
        _, form, reason = gathered.curves[key]
        worn = slot_material(thing, system.settings.material - 1)
        _add(form, reason, worn, instance, name, gathered)


def _add(
    form: MeshForm | None, reason: str, worn: Any, instance: Any, name: str, gathered: Any
) -> None:
    """Take in tubes where an instance places them, and tell what is wrong with some of them."""
    if reason:
        gathered.tell(name, reason, missing=True)
    if form is None:
        return
    material = gathered.material(worn)
    things = instance.object, instancer_of(instance)
    track = gathered.track(key_of(instance), matrix_of(instance), name, *things)
    if not np.isfinite(track.middle).all():
        gathered.tell(name, NOT_FINITE, missing=True)
    elif vanishes(form, track):
        gathered.tell(name, NO_SCALE, missing=True)
    else:
        gathered.add_copy(form, {0: material}, track, instance, name)
