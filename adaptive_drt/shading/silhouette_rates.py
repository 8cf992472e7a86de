# SPDX-License-Identifier: GPL-3.0-or-later
"""How far the outlines of occluders move over a light, as seen from a patch: angles by axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..lights.emitter import DISK, POINT, QUAD, Emitter
from ..numerics.arrays import Array, Mask
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import dot
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs
from ..visibility.line_intervals import TIME
from .footprint import Patch

__all__ = [
    "BEYOND",
    "NEAREST",
    "ROUNDING",
    "SHARPEST",
    "TOUCH",
    "Shadows",
    "at_most",
    "extent",
    "half_angle",
    "outline_shifts",
    "rates",
]


NEAREST = 2.0**-20
"""Of the distance to a light: an outline nearer to the point than that is as good as there."""
ROUNDING = 2.0**-48
"""Radians: directions to outlines and lights are rounded by that, counted generously. An outline
that moves over the light by less over a patch is where rounding puts it: no split would settle it.
A light metres from an occluder is seen so from a point 1e29 m away. In a scene of common sizes a
cell of 2^-24 pixels is a thousand times that."""
BEYOND = 0.3
"""Of a shadow: what counts of one that only the margin of a patch meets."""
TOUCH = 1.7
"""Power of a shadow whose round outline meets a straight one or one half as round as it: of two
circles of radii a and b that touch, 4/3 (2 r)^(1/2) u^(3/2) is common where they overlap by u, with
1/r = 1/a + 1/b, or 1/a - 1/b where one is inside the other. That over pi a^2, with a, the smaller,
for a width of 2 a, is 1.7 (r / a)^(1/2)."""
HASTE = 0.75
"""Radians, or steps of that part of the distance: with more, nothing is known of where it ends."""
SHARPEST = 1e3
"""Half extents in units of a shadow's width: sharper than that makes no difference."""


@dataclass(frozen=True)
class Shadows:
    """Shadows of m occluders over patches.

    Attributes
    ----------
    depth : (m,) part of the light that one hides at most; 0 where none of its bounds comes near.
    shifts : (3, m) radians that its outline moves over the light, by axis.
    width : (m,) radians between where it begins and where it is whole.
    ends : (m,) whether such a bound, a kink, runs through the patch.
    power : (m,) what it begins with there, or nearest to it: `power` u^(3/2) of `depth`, u in
        units of `width`; inf where it is a ramp.
    away : (m,) radians from the patch's middle to that bound, and no less than to its side.
    covers : (m,) whether it hides the light from the whole patch.
    """

    depth: Array
    shifts: Array
    width: Array
    ends: Mask
    power: Array
    away: Array
    covers: Mask


def at_most(angle: Array) -> Array:
    """Angles (m,) by which outlines move at most, given those by which they would move evenly.

    What is steps of a good part of the distance away comes nearer with them, and moves the faster.
    """
    most: Array = angle / (1.0 - np.minimum(angle, HASTE))
    return most


def half_angle(light: Emitter, distance: Array) -> Array:
    """Half the angle (n,) under which a light's ball is seen."""
    if light.kind == POINT:
        return np.zeros_like(distance)
    if light.kind == DISK:
        return np.arctan2(light.radius, distance)
    half: Array = np.arcsin(np.minimum(light.radius / distance, 1.0))
    return half


def outline_shifts(
    steps: dict[int, Array], toward: Array, axis: Array, rate: Array, angle: Array | float
) -> Array:
    """Angles (3, m) by which an outline moves over a light as the point takes steps, by axis.

    Parameters
    ----------
    steps : (3, m) metres each.  toward : (3, m) unit vector across the outline.
    axis : (3, m) to the light.  rate : (m,) radians a metre.
    angle : (m,) from the light's centre to the occluder's: sideways steps count by their square.
    """
    moved = np.zeros((3, rate.size))
    for number, step in steps.items():
        aside = step - dot(step, axis) * axis
        size = np.sqrt(dot(aside, aside)) * rate
        sideways = 0.5 * size * size / np.maximum(np.maximum(angle, size), TINY)
        moved[number] = np.abs(dot(aside, toward)) * rate + sideways
    return moved


def rates(
    plan: Plan, light: Emitter, patch: Patch, pairs: Pairs, near: Array, far: Array
) -> tuple[Array, dict[int, Array]]:
    """Radians a metre at which an outline at a distance `near` moves over a light at `far`.

    Returns with it the steps by axis as if the point alone moved: (3, m) each.
    """
    rate = np.abs(1.0 / np.maximum(near, TINY) - 1.0 / far)
    steps = {axis: columns(patch.steps[axis], pairs.pixel) for axis in patch.axes}
    if TIME not in steps:
        return rate, steps
    half = patch.time[pairs.pixel]
    moved = np.zeros((3, pairs.item.size))
    for part, first in ((plan.spheres, 0), (plan.quads, plan.sphere_count)):
        d = part.displacement
        ids = pairs.item - first
        if d is not None and ids.size and 0 <= ids[0] < d.shape[1]:
            moved = columns(d, ids)
    carried = 0.0 if light.displacement is None else light.displacement
    # (occluder - point) / near - (light - point) / far, as a step of the point times the rate
    own = steps[TIME]
    turn = (moved * half - own) / np.maximum(near, TINY) - (carried * half - own) / far
    steps[TIME] = turn / np.maximum(rate, TINY)
    return rate, steps


def extent(light: Emitter, toward: Array, far: Array) -> Array:
    """Half the angle (m,) a light fills along a direction across the view."""
    if light.kind == QUAD:
        wide = np.abs(dot(light.half_u, toward)) + np.abs(dot(light.half_v, toward))
        flat: Array = np.arctan2(wide, far)
        return flat
    return half_angle(light, far)
