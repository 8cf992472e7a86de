# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair of particle systems, as the curves that Cycles makes of it.

Blender gives the points of particles' paths one by one only: some 3 microseconds each.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .hair_curves import Strands

__all__ = ["hair_systems", "strands_of_system"]


def hair_systems(thing: Any) -> Iterator[Any]:
    """Yield the particle systems of an evaluated object whose paths Cycles renders: no emitters."""
    for system in thing.particle_systems:
        settings = system.settings
        is_hair = settings.type == "HAIR" and settings.render_type == "PATH"
        if is_hair and (len(system.particles) or len(system.child_particles)):
            yield system


def strands_of_system(thing: Any, system: Any) -> Strands:
    """Return the curves of a particle system in its object's space.

    Where particles have children these alone are shown, as in Cycles (`blender/curves.cpp`).
    """
    settings = system.settings
    parents, children = len(system.particles), len(system.child_particles)
    keys = (1 << settings.render_step) + 1
    if settings.kink == "SPIRAL":
        keys += settings.kink_extra_steps
    first = parents if settings.child_type != "NONE" and children else 0
    hairs, steps, place = range(first, parents + children), range(keys), system.co_hair
    points = [place(thing, particle_no=hair, step=step)[:] for hair in hairs for step in steps]
    world = np.array(points, dtype=np.float64).reshape(len(hairs), keys, 3)
    back = np.array(thing.matrix_world.inverted_safe(), dtype=np.float64)
    local = world @ back[:3, :3].T + back[:3, 3]
    radii = _radii(local, settings)
    offsets = np.arange(len(hairs) + 1, dtype=np.int32) * keys
    positions = np.ascontiguousarray(local.reshape(-1, 3), dtype=np.float32)
    return Strands(positions, radii.ravel().astype(np.float32), offsets)


def _radii(points: NDArray[np.float64], settings: Any) -> NDArray[np.float64]:
    """Return the radii (hairs, keys) of hairs with points (hairs, keys, 3), metres."""
    steps = np.linalg.norm(np.diff(points, axis=1), axis=2)
    along = np.concatenate([np.zeros((len(points), 1)), np.cumsum(steps, axis=1)], axis=1)
    whole = along[:, -1:]
    rest = 1.0 - along / np.where(whole > 0.0, whole, 1.0)
    shape = settings.shape
    if shape < 0.0:
        rest = rest ** (1.0 + shape)
    elif 0.0 < shape < 1.0:
        rest = rest ** (1.0 / (1.0 - shape))
    elif shape >= 1.0:
        rest = np.where(rest < 1.0, 0.0, 1.0)
    half = 0.5 * settings.radius_scale
    root, tip = half * settings.root_radius, half * settings.tip_radius
    radii: NDArray[np.float64] = rest * (root - tip) + tip
    if settings.use_close_tip:
        radii[:, -1] = 0.0
    return radii
