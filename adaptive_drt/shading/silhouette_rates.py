# SPDX-License-Identifier: GPL-3.0-or-later
"""Angles by which the outlines of occluders move over a light, as seen from a patch, by axis."""

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
    "MARGIN_WEIGHT",
    "MAX_SHARPNESS",
    "MIN_RELATIVE_DISTANCE",
    "ROUNDING_ANGLE",
    "TANGENCY_COEFFICIENT",
    "ShadowEdges",
    "ball_half_angle",
    "largest_shift",
    "light_half_angle",
    "outline_rates",
    "outline_shifts",
]


MIN_RELATIVE_DISTANCE = 2.0**-20
"""Least distance from the point to an outline, as a fraction of the distance to the light; nearer
outlines count as that near."""
ROUNDING_ANGLE = 2.0**-48
"""Rounding error of directions to outlines and lights, in radians, an upper estimate. An outline
that moves over the light by less than this across a patch lies where rounding puts it, and no
subdivision would resolve it. A light metres from an occluder is seen so from a point 1e29 m away.
In a scene of common sizes a cell of 2^-24 pixels is a thousand times that."""
MARGIN_WEIGHT = 0.3
"""Weight of a shadow that only meets the margin around a patch, as a fraction of its depth. Chosen,
not fitted: most such shadows miss the patch, and those that reach it were misplaced by the
linearisation of the patch."""
TANGENCY_COEFFICIENT = 16.0 / (3.0 * np.pi)
"""Coefficient of the power 3/2 with which a shadow begins whose round outline meets a straight one,
or one half as round. Derived: of two circles of radii a and b that overlap by u, the common area is
4/3 (2 r)^(1/2) u^(3/2), with 1/r = 1/a + 1/b, or 1/a - 1/b where one is inside the other. That over
pi a^2, with the smaller radius a, for a width of 2 a, is 16 / (3 pi) (r / a)^(1/2)."""
MAX_RELATIVE_STEP = 0.75
"""Largest relative step, in radians or as a fraction of the distance, that enters the extrapolation
of an outline's motion; for larger steps nothing is known of where the outline ends up. Chosen, not
fitted: it bounds the extrapolated angle to four times the step."""
MAX_SHARPNESS = 1e3
"""Largest ratio of a patch's half extent and a shadow edge's width; a sharper edge makes no
difference. Chosen, not fitted."""


@dataclass(frozen=True)
class ShadowEdges:
    """Shadow edges of m occluders over patches.

    Attributes
    ----------
    depth : (m,) largest fraction of the light that the occluder hides; 0 where neither bound of its
    shadow edge comes near the patch.
    shifts : (3, m) radians by which its outline moves over the light, by axis.
    width : (m,) radians between the beginning of the shadow edge and its end, where the shadow is
    complete.
    ends : (m,) whether such a bound, a kink, lies within the patch.
    power : (m,) coefficient of the shadow's beginning at the nearest bound: `power` u^(3/2) as a
    fraction of `depth`, with u in units of `width`; inf where it is a linear ramp.
    away : (m,) radians from the middle of the patch to that bound, and no less than to the side of
    the patch.
    covers : (m,) whether the occluder hides the light from the whole patch.
    """

    depth: Array
    shifts: Array
    width: Array
    ends: Mask
    power: Array
    away: Array
    covers: Mask


def largest_shift(angle: Array) -> Array:
    """Largest angles (m,) by which outlines move, given the angles `angle` at constant speed.

    An outline at a distance of few steps comes nearer with each of them, and moves the faster.
    """
    most: Array = angle / (1.0 - np.minimum(angle, MAX_RELATIVE_STEP))
    return most


def ball_half_angle(light: Emitter, distance: Array) -> Array:
    """Half the angle (n,) of the bounding ball of a light, in radians; of a disk that faces the
    point."""
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
    steps : (3, m) metres each.  toward : (3, m) unit vector normal to the outline.
    axis : (3, m) unit vectors to the light.  rate : (m,) radians per metre.
    angle : (m,) between the centers of light and occluder: steps along the outline have an effect
    of second order.
    """
    moved = np.zeros((3, rate.size))
    for number, step in steps.items():
        aside = step - dot(step, axis) * axis
        size = np.sqrt(dot(aside, aside)) * rate
        sideways = 0.5 * size * size / np.maximum(np.maximum(angle, size), TINY)
        moved[number] = np.abs(dot(aside, toward)) * rate + sideways
    return moved


def outline_rates(
    plan: Plan, light: Emitter, patch: Patch, pairs: Pairs, near: Array, far: Array
) -> tuple[Array, dict[int, Array]]:
    """Rates, in radians per metre, at which an outline at a distance `near` moves over a light at
    `far`.

    Returns with them the steps by axis, (3, m) each: where objects move, the equivalent step of a
    point that alone moves.
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


def light_half_angle(light: Emitter, toward: Array, far: Array) -> Array:
    """Half the angle (m,) of a light along a direction normal to the line of sight, in radians."""
    if light.kind == QUAD:
        wide = np.abs(dot(light.half_u, toward)) + np.abs(dot(light.half_v, toward))
        flat: Array = np.arctan2(wide, far)
        return flat
    return ball_half_angle(light, far)
