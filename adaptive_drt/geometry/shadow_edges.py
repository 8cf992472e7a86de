# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow edges that occluders cast over patches, and how outlines move over a light.

The angles by which an outline moves over a light as the point moves over its patch tell whether the
edge of the shadow lies in the patch, and how sharp it is there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.axes import TIME
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import dot
from .light_protocol import AreaLight
from .shaded_patches import ShadedPatches

__all__ = [
    "MARGIN_WEIGHT",
    "MAX_SHARPNESS",
    "MIN_RELATIVE_DISTANCE",
    "ROUNDING_ANGLE",
    "TANGENCY_COEFFICIENT",
    "ShadowEdges",
    "largest_shift",
    "outline_rates",
    "outline_shifts",
    "shadow_edges_around",
    "shifts_around",
]


MIN_RELATIVE_DISTANCE = 2.0**-20
"""Least distance from the point to an outline, as a fraction of the distance to the light, or of
that to the occluder where the light is at infinity; nearer outlines count as that near."""
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


SURROUNDING_WIDTH = 0.7
"""Angle, in radians, over which the shadow of an outline in a light that surrounds the point begins
and ends. The hidden fraction of irradiance falls with powers 2 to 3 of the distance d, and a patch
of half extent h is off by some (h / d)^2 of it."""


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
    has_kink : (m,) whether such a bound, a kink, lies within the patch.
    coefficient : (m,) of the shadow's beginning at the nearest bound: `coefficient` u^(3/2) as a
    fraction of `depth`, with u in units of `width`; inf where it is a linear ramp.
    bound_distance : (m,) radians from the middle of the patch to that bound, and no less than to
    the side of the patch.
    hides_all : (m,) whether the occluder hides the light from the whole patch.
    """

    depth: Array
    shifts: Array
    width: Array
    has_kink: Mask
    coefficient: Array
    bound_distance: Array
    hides_all: Mask

    def take(self, rows: Ints) -> ShadowEdges:
        """The edges selected by an index."""
        return ShadowEdges(
            self.depth[rows],
            columns(self.shifts, rows),
            self.width[rows],
            self.has_kink[rows],
            self.coefficient[rows],
            self.bound_distance[rows],
            self.hides_all[rows],
        )


def largest_shift(angle: Array) -> Array:
    """Largest angles (m,) by which outlines move, given the angles `angle` at constant speed.

    An outline at a distance of few steps comes nearer with each of them, and moves the faster.
    """
    most: Array = angle / (1.0 - np.minimum(angle, MAX_RELATIVE_STEP))
    return most


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
    receivers: ShadedPatches,
    light: AreaLight,
    displacement: Array | None,
    near: Array,
    far: Array,
) -> tuple[Array, dict[int, Array]]:
    """Rates, in radians per metre, at which an outline at a distance `near` moves over a light at
    `far`.

    Returns with them the steps by axis, (3, m) each: where objects move, the equivalent step of a
    point that alone moves. From within a ball of light the light is all around, and has no parallax
    of its own.

    displacement : (3, m) metres over the shutter, of the occluders; None if none of them moves.
    """
    if light.solid:
        far = np.where(far <= light.radius, np.inf, far)
    rate = np.abs(1.0 / np.maximum(near, TINY) - 1.0 / far)
    steps = {axis: receivers.step(axis) for axis in receivers.patch.axes}
    if TIME not in steps:
        return rate, steps
    half = receivers.half_time
    moved = np.zeros((3, half.size)) if displacement is None else displacement
    carried = 0.0 if light.displacement is None else light.displacement
    # (occluder - point) / near - (light - point) / far, as a step of the point times the rate
    own = steps[TIME]
    turn = (moved * half - own) / np.maximum(near, TINY) - (carried * half - own) / far
    steps[TIME] = turn / np.maximum(rate, TINY)
    return rate, steps


def shifts_around(
    receivers: ShadedPatches, light: AreaLight, displacement: Array | None, near: Array
) -> Array:
    """Angles (3, m) by which outlines move relative to the horizon of a point, by axis.

    The horizon turns with the surface's normal.

    displacement : (3, m) metres over the shutter, of the occluders; None if none of them moves.
    near : (m,) metres, distances of the outlines.
    """
    to = light.to_center(receivers.places, receivers.time)
    rate, steps = outline_rates(receivers, light, displacement, near, np.sqrt(dot(to, to)))
    patch, row = receivers.patch, receivers.row
    shifts = np.zeros((3, near.size))
    for axis, step in steps.items():
        turn = patch.surface_steps[axis] * patch.curvature
        shifts[axis] = np.sqrt(dot(step, step)) * rate + turn[row]
    return shifts


def shadow_edges_around(depth: Array, shifts: Array, hides_all: Mask) -> ShadowEdges:
    """Smooth shadow edges of occluders in a light that surrounds the points.

    depth, shifts, hides_all : see `ShadowEdges`.
    """
    width = np.full(depth.size, SURROUNDING_WIDTH)
    never = np.zeros(depth.size, dtype=np.bool_)
    ramp = np.full(depth.size, np.inf)
    return ShadowEdges(depth, shifts, width, never, ramp, ramp.copy(), hides_all)
