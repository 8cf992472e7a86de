# SPDX-License-Identifier: GPL-3.0-or-later
"""Estimates of how far one sample of unoccluded light may be from its mean over a patch.

Unoccluded light varies with the distance to the light and with the orientation of the surface, and
where something crosses a plane: the light crosses the horizon of the surface, or the patch crosses
the plane of a quad light. The estimates are given by kind and by axis, as in `variation`.
"""

from __future__ import annotations

import numpy as np

from ..geometry.patch import Patch
from ..geometry.shadow_edges import MARGIN_WEIGHT
from ..lights.emitter import Emitter, LightContact
from ..numerics.arrays import Array, Ints
from ..numerics.axes import TIME
from ..numerics.error_coefficients import (
    FALLOFF_KINK_RATIO,
    FALLOFF_ROOT_RATIO,
)
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import dot
from ..tracing.intersect import Surface
from .environment_variation import environment_deviations
from .variation import (
    KINK_KIND,
    ROOT_KIND,
    SMOOTH_COEFFICIENT,
    SMOOTH_KIND,
    STEP_COEFFICIENT,
    STEP_EXTENT,
    STEP_KIND,
    zero_variation,
)

__all__ = ["unoccluded_deviations"]


FALLOFF_COEFFICIENT = 0.5
"""Deviation of the irradiance factor by falloff, as a fraction of the factor times |5 a^2 - s^2|
over the squared distance to the light: see `_add_falloff`. Derived: a third, the mean of the
squares from -1 to 1, of the coefficient 3/2 of second order."""
MIN_PEAK_DISTANCE = 0.3
"""Least distance to the light anywhere in a patch with such a steep falloff, as a fraction of the
distance at its middle. Chosen, not fitted: it bounds the estimate where the peak of the light may
lie in the patch (without it one patch in a hundred was off by 28 times what was foreseen, with it
by 3)."""
CURVATURE_COEFFICIENT = 1.0 / 6.0
"""Deviation by the curvature of the surface, as a fraction of the largest irradiance factor times
the square of the angle, in radians, by which the normal turns over the half extent. Derived: h^2/24
of the second derivative of a cosine, which is at most 1, with h twice the half extent."""
HORIZON_COEFFICIENT = 1.0 / 12.0
"""Deviation where a light crosses the horizon of the surface, as a fraction of the largest
irradiance factor times either the squared turn over the light's half angle (the slope then changes
over twice that angle), or the turn, if that is larger and causes a kink. Derived: h^2/24 of the
change of slope, 1 over twice the half angle, with h twice the turn; a kink at a random place within
the turn would be 1 / sqrt(80) of it, RMS, and counts the same."""
GRAZING_COEFFICIENT = 2.0**0.5 / 12.0
"""Deviation beside a ball of light, as a fraction of the squared half extent over gap^(3/2)
radius^(1/2): a sixth of the second derivative of 2 (2 gap / radius)^(1/2)."""
GRAZING_EXTENTS = 8.0
"""Distance from a ball of light, in half extents of the patch, up to which that is considered;
farther away the falloff with the distance is more."""
HIDDEN_WITHIN = 3.0**-0.5
"""Jump of the irradiance factor at the surface of a ball of light that other shapes reach into, as
a fraction of the factor: they hide light from within the ball, but not its near side from outside.
Derived: the RMS of a hidden fraction that may have any value from 0 to 1."""
LIMB_RATIO = 0.3
"""Ratio of half a patch's extent and twice its distance from the limb of a sphere (0.5: the patch
reaches the limb), from which the normal, which turns with a square root there, is not well
approximated by a parabola. Of the centroid's deviation the nodes of the cubature leave 0.04 at 0.25
and 0.18 at 0.5, and less with the gains of `limb_correction`: as of a power of 3/2. Chosen, not
fitted."""

PROFILE_MARGIN = 2.0
"""Distance of a patch from the edge of a light's profile, in half extents, within which that counts
with `MARGIN_WEIGHT`."""


def unoccluded_deviations(
    light: Emitter, to: Array, surface: Surface, patch: Patch, factor: Array
) -> Array:
    """Deviations (4, 3, n) of a light that only the horizon of the surface hides.

    Parameters
    ----------
    to : (3, n) metres, vectors to the light's centre.  factor : (n,) unoccluded irradiance factors.
    """
    if light.surrounds:
        return environment_deviations(light, to, surface, patch)
    square = np.maximum(dot(to, to), TINY)
    distance = np.sqrt(square)
    half = light.half_angle(distance)
    head_on = light.normal_incidence_factor(square, half)
    front = light.front_sine(to, distance)
    most = head_on if front is None else np.minimum(head_on * np.maximum(front, 0.0), np.pi)
    result = zero_variation(factor.size)
    clear = np.maximum(distance - light.radius, 0.25 * distance)
    moves, turns, curves = np.zeros((3, 3, factor.size))
    relative = {}
    for axis in patch.axes:
        step = patch.steps[axis]
        if axis == TIME and light.displacement is not None:
            step = step - light.displacement * patch.half_time
        relative[axis] = step
        moves[axis] = np.sqrt(dot(step, step)) / clear
        curves[axis] = np.abs(5.0 * (dot(step, to) / (distance * clear)) ** 2 - moves[axis] ** 2)
        turns[axis] = patch.surface_steps[axis] * patch.curvature
    bent, turns = turns, turns + moves
    sine = dot(surface.normal, to) / distance
    risen = sine > -(np.sqrt(dot(turns, turns)) + np.sin(half))
    near = np.sqrt(dot(moves, moves)) * clear / distance
    _add_falloff(result, factor * FALLOFF_COEFFICIENT, (curves, moves**2), near, sine)
    _add_curvature(result, np.where(risen, most, 0.0), bent)
    curved = (risen & (patch.curvature > 0.0)).nonzero()[0]
    _add_limb(result, curved, patch, to, surface, most, bent)
    _add_plane_crossing(result, sine, half, most, turns)
    if front is not None:
        _add_plane_crossing(result, front, 0.0 * half, np.minimum(head_on, np.pi), moves)
    _add_profile_edge(result, light, to, most * risen, moves)
    if light.touched is not None:
        rows = light.touched[surface.item].nonzero()[0]
        part = columns(result, rows, -1)
        steps = {axis: columns(step, rows) for axis, step in relative.items()}
        points = columns(to, rows), columns(surface.normal, rows), factor[rows]
        _add_contact(part, light, points, steps, patch.margin)
        result[..., rows] = part
    return result


def _contact_jump(light: Emitter, contact: LightContact, factor: Array) -> Array:
    """Return by how much irradiance factors (n,) jump at the light's surface, hidden parts too."""
    if light.solid and light.casts_shadow and light.touched is not None and light.touched.sum() > 1:
        return np.maximum(contact.step, HIDDEN_WITHIN * factor)
    return contact.step


def _add_profile_edge(result: Array, light: Emitter, to: Array, most: Array, moves: Array) -> None:
    """Add deviations by the edge of a light's profile that crosses patches, in place.

    Parameters
    ----------
    most : (n,) largest irradiance factors.  moves : (3, n) radians by which the points move, seen
        from the light, over the half extents.
    """
    edge = light.profile_edge(to)
    if edge is None:
        return
    across = np.sqrt(dot(moves, moves))
    rows = ((edge.gap < PROFILE_MARGIN * across) & (most > 0.0)).nonzero()[0]
    if not rows.size:
        return
    gap, width, across = edge.gap[rows], np.maximum(edge.width[rows], TINY), across[rows]
    square = columns(moves, rows) ** 2 / np.maximum(across * across, TINY)
    size = most[rows] * np.where(gap < across, 1.0, MARGIN_WEIGHT)
    bend = SMOOTH_COEFFICIENT * (across / width) ** 2
    step = across >= STEP_EXTENT * width
    # where it begins or ends the profile is not smooth: its second derivative jumps
    root = ~step & (edge.onset[rows] < PROFILE_MARGIN * across)
    # no centre of a pixel around may see a change that only touches this patch: differences
    # between them must not override it, as they do for all but steps
    aside = root & (gap > 0.0)
    result[SMOOTH_KIND][:, rows] += np.where(step | root, 0.0, size * bend) * square
    result[ROOT_KIND][:, rows] += np.where(root & ~aside, size * bend, 0.0) * square
    size *= np.where(step, STEP_COEFFICIENT, bend)
    result[STEP_KIND][:, rows] += np.where(step | aside, size, 0.0) * square


def _add_contact(
    result: Array,
    light: Emitter,
    points: tuple[Array, Array, Array],
    steps: dict[int, Array],
    margin: float,
) -> None:
    """Add deviations where the surface of the light itself passes through patches, in place.

    Parameters
    ----------
    points : (3, n) vectors to the light's centre, metres; (3, n) normals; (n,) irradiance factors.
    steps : (3, n) metres, motion of the points relative to the light over half the patch, by axis.
    margin : see `Patch`.
    """
    to, normal, factor = points
    contact = light.contact(to, normal)
    if contact is None:
        return
    jump = _contact_jump(light, contact, factor)
    shifts, reach = np.zeros((3, contact.gap.size)), np.zeros(contact.gap.size)
    for step in steps.values():
        reach += np.sqrt(dot(step, step))
    for axis, step in steps.items():
        along = dot(step, contact.away)
        shifts[axis] = np.abs(along)
        if light.solid:
            # the surface of a ball curves away from the plane that touches it
            aside = np.sqrt(np.maximum(dot(step, step) - along * along, 0.0))
            shifts[axis] += 0.5 * aside * reach / (light.radius + np.maximum(contact.gap, 0.0))
    across = shifts.sum(axis=0)
    if light.solid:
        # the light fills the hemispheres of all points within: pi, whatever the patch
        result[..., contact.gap < -margin * across] = 0.0
    beside = (contact.clearance <= margin * reach).nonzero()[0]
    for kind in (SMOOTH_KIND, ROOT_KIND):
        # the light is as near as the patch is wide: nothing is smooth there
        result[KINK_KIND][:, beside] += columns(result[kind], beside)
        result[kind][:, beside] = 0.0
    rows = beside[(np.abs(contact.gap) <= margin * across)[beside] & (across > 0.0)[beside]]
    inner = (np.abs(contact.gap) <= across) & (contact.clearance <= reach)
    weight = STEP_COEFFICIENT * jump * np.where(inner, 1.0, MARGIN_WEIGHT)
    square = columns(shifts, rows) ** 2
    result[STEP_KIND][:, rows] += weight[rows] * square / square.sum(axis=0)
    if light.solid:
        _add_grazing(result, contact, shifts, across, light.radius)


def _add_grazing(
    result: Array, contact: LightContact, shifts: Array, across: Array, radius: float
) -> None:
    """Add deviations beside a ball of light, whose half angle falls from a right one as a root.

    The irradiance factor falls by some 2 sin (2 gap / radius)^(1/2) there, where sin is the sine
    between both normals: the second derivative gives the deviation, and a gap no less than the
    extent.
    """
    rows = ((contact.gap > 0.0) & (contact.gap < GRAZING_EXTENTS * across)).nonzero()[0]
    if not rows.size:
        return
    square, gap = columns(shifts, rows) ** 2, np.maximum(contact.gap, across)[rows]
    cosine = 2.0 * contact.step[rows] / np.pi - 1.0
    sine = np.sqrt(np.maximum(1.0 - cosine * cosine, 0.0))
    result[KINK_KIND][:, rows] += GRAZING_COEFFICIENT * sine * square / (gap**1.5 * radius**0.5)


def _add_falloff(
    result: Array, scale: Array, curves: tuple[Array, Array], near: Array, sine: Array
) -> None:
    """Add deviations by the falloff of light with distance, in place.

    A step s of the point changes (n.w) / |w|^3 by the fraction 3/2 (5 a^2 - s^2) / |w|^2 in second
    order, where a is the part of s along w: less than 0 across the light's direction, and four
    times as much along it. Where the peak of the light may lie in the patch, s^2 counts at least.

    Parameters
    ----------
    scale : (n,) coefficient times factor at the centroids.  curves : (3, n) of |5 a^2 - s^2| and of
    s^2, by axis, over the squared distance to the light.  near : (n,) half the patch's extent over
    the distance to the light.  sine : (n,) of the light's elevation over the surface.
    """
    steep = near >= FALLOFF_ROOT_RATIO
    size = scale * curves[0]
    if not steep.any():
        result[SMOOTH_KIND] += size
        return
    size = np.where(steep, scale * np.maximum(*curves), size)
    # the peak may be within the patch: bound the least distance by the height over the plane
    least = np.maximum(np.maximum(np.abs(sine), 1.0 - near), MIN_PEAK_DISTANCE)
    size = np.where(steep, size / (least * least), size)
    peaked = near >= FALLOFF_KINK_RATIO
    result[SMOOTH_KIND] += np.where(steep, 0.0, size)
    result[ROOT_KIND] += np.where(steep & ~peaked, size, 0.0)
    result[KINK_KIND] += np.where(peaked, size, 0.0)


def _add_curvature(result: Array, most: Array, bent: Array) -> None:
    """Add deviations by the turn of normals, in place.

    most : (n,) largest irradiance factors, 0 below horizons.  bent : (3, n) radians by which the
    normals turn over the half extents.
    """
    size = most * CURVATURE_COEFFICIENT * np.minimum(bent * bent, 1.0)
    # normals that turn by more than a radian leave errors of either sign
    wild = dot(bent, bent) > 1.0
    result[SMOOTH_KIND] += np.where(wild, 0.0, size)
    result[KINK_KIND] += np.where(wild, size, 0.0)


def _add_limb(
    result: Array, rows: Ints, patch: Patch, to: Array, surface: Surface, most: Array, bent: Array
) -> None:
    """Add deviations by the rapid turn of normals at the limbs of spheres, in place.

    rows : points with curved surfaces.  most : (n,) largest irradiance factors.  bent : (3, n)
    radians by which the normals turn over the half extents.
    """
    if not rows.size:
        return
    to, view, slant = columns(to, rows), columns(surface.point, rows), patch.cosine[rows]
    # at the limb the normal turns towards the camera or away from it
    toward = np.abs(dot(to, view)) / np.maximum(np.sqrt(dot(to, to) * dot(view, view)), TINY)
    slope = np.sqrt(np.maximum(1.0 - slant**2, 0.0)) * patch.curvature[rows] / slant**2
    near = np.minimum(columns(patch.view_steps, rows) * slope, 1.0)
    size = most[rows] * toward * CURVATURE_COEFFICIENT * np.minimum(columns(bent, rows) * near, 1.0)
    result[SMOOTH_KIND][:, rows] += np.where(near < LIMB_RATIO, size, 0.0)
    result[ROOT_KIND][:, rows] += np.where(near >= LIMB_RATIO, size, 0.0)


def _add_plane_crossing(result: Array, sine: Array, half: Array, most: Array, turns: Array) -> None:
    """Add deviations by a light that crosses a plane, in place.

    Parameters
    ----------
    sine : (n,) of the light's elevation over the plane.  half : (n,) half its angle.  most : (n,)
    its largest irradiance factor.
    turns : (3, n) radians by which it moves relative to the plane over the half extents.
    """
    turn = np.sqrt(dot(turns, turns))
    rows = ((np.abs(sine) < turn + np.sin(half)) & (most > 0.0)).nonzero()[0]
    if not rows.size:
        return
    turn, half = np.maximum(turn[rows], TINY), half[rows]
    # however far the normals turn, light falls to 0 and rises to the largest factor at most
    slope = np.minimum(HORIZON_COEFFICIENT / (turn + half), STEP_COEFFICIENT / (turn * turn))
    size = most[rows] * slope * columns(turns, rows) ** 2
    sharp = turn > half
    result[SMOOTH_KIND][:, rows] += np.where(sharp, 0.0, size)
    result[KINK_KIND][:, rows] += np.where(sharp, size, 0.0)
