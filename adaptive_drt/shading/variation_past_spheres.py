# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow edges that spheres cast over patches. See `variation`."""

from __future__ import annotations

import numpy as np

from ..geometry.patch import Patch
from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Mask
from ..numerics.axes import TIME
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import cross, dot
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface
from .silhouette_rates import (
    MARGIN_WEIGHT,
    MIN_RELATIVE_DISTANCE,
    ROUNDING_ANGLE,
    TANGENCY_COEFFICIENT,
    ShadowEdges,
    largest_shift,
    outline_rates,
    outline_shifts,
)

__all__ = ["sphere_shadow_edges"]


MIN_ANGLE_RATIO = 2.0**-52
"""Least ratio of the angles of light and occluder; a light with a smaller angle counts as a
point."""


def sphere_shadow_edges(
    plan: Plan, surface: Surface, patch: Patch, light: Emitter, pairs: Pairs, time: Array | float
) -> ShadowEdges:
    """Shadow edges of spheres, from the angles between their outlines and that of the light."""
    point = columns(surface.point, pairs.pixel)
    r = plan.spheres.radius[pairs.item]
    v = plan.spheres.moved(pairs.item, time) - point
    to = light.to_center(point, time)
    far = np.maximum(np.sqrt(dot(to, to)), TINY)
    axis = to / far
    lit_around = np.zeros(far.size, dtype=np.bool_)
    if light.solid:
        # from within, the light fills the hemisphere over the surface
        lit_around = far <= light.radius
        axis = np.where(lit_around, columns(surface.normal, pairs.pixel), axis)
    vv = dot(v, v)
    along = dot(axis, v)
    aside = v - along * axis
    off = np.sqrt(dot(aside, aside))
    toward = aside / np.maximum(off, TINY)
    angle = np.arctan2(off, along)
    tangent = np.sqrt(np.maximum(vv - r * r, 0.0))
    opening = np.arctan2(r, tangent)
    half = light.half_angle_along(toward, far)
    nearest = light.distance_or(far, np.sqrt(vv)) * MIN_RELATIVE_DISTANCE
    rate, steps = outline_rates(plan, light, patch, pairs, np.maximum(tangent, nearest), far)
    shifts = outline_shifts(steps, toward, axis, rate, angle)
    within = shifts.sum(axis=0)
    whole = largest_shift(within) * patch.margin
    # the outlines cross somewhere in the patch: it is not so that the sphere misses the light,
    # hides all of it, or lies within its outline, from all of the patch
    farthest, clearance = _outline_angles(light, axis, toward, v, far, angle, half)
    # all directions over the horizon count, but not alike: within the hemisphere a shadow varies
    inner = np.where(lit_around, -np.inf, clearance - opening)
    crosses = (angle - opening - half < whole) & (opening - farthest < whole)
    crosses &= (inner < whole) & (whole > ROUNDING_ANGLE)
    inside = (angle - opening - half < within) & (opening - farthest < within) & (inner < within)
    before = np.sqrt(vv) - r < far + light.radius
    enclosed = (vv <= r * r) | (pairs.item == surface.item[pairs.pixel])
    depth = np.minimum(1.0, opening / np.maximum(half, MIN_ANGLE_RATIO * opening)) ** 2
    depth = np.where(
        crosses & before & ~enclosed, depth * np.where(inside, 1.0, MARGIN_WEIGHT), 0.0
    )
    inner = np.where(lit_around, clearance - opening, inner)
    bounds = np.abs(np.array([angle - opening - half, opening - farthest, inner]))
    power, away, ends = _nearest_bound(light, bounds, whole, half, opening)
    covers = (opening - farthest >= whole) & ~enclosed & (tangent < far - light.radius)
    some = enclosed.nonzero()[0]
    if some.size:
        covers[some] = _encloses_patch(
            plan, surface, patch, light, pairs.take(some), columns(v, some), columns(to, some)
        )
    width = 2.0 * np.minimum(half, opening)
    if some.size:
        part = pairs.take(some)
        moved, left = _enclosed_shifts(
            plan, surface, patch, light, part, columns(v, some), columns(to, some)
        )
        reached = moved.any(axis=0)
        rows = some[reached]
        depth[rows], shifts[:, rows] = 1.0, columns(moved, reached)
        width[rows] = np.where(left[reached], 0.0, 2.0 * half[rows])
    return ShadowEdges(depth, shifts, width, ends, power, away, covers)


def _enclosed_shifts(
    plan: Plan, surface: Surface, patch: Patch, light: Emitter, pairs: Pairs, v: Array, to: Array
) -> tuple[Array, Mask]:
    """Angles (3, m) by which the part of a light moves over it that lies within the point's sphere.

    They are 0 where the light never passes through the surface of that sphere, which encloses the
    point. Returns with them whether the patch leaves the sphere (m,): what the sphere hides then is
    a step, and the shifts are those of the points through its surface, in metres.

    v, to : (3, m) metres, from the points to the centers of the spheres and of the light.
    """
    r, gap, size = plan.spheres.radius[pairs.item], v - to, np.sqrt(dot(v, v))
    half = patch.half_time[pairs.pixel]
    moved = np.zeros((3, r.size))
    if plan.spheres.displacement is not None:
        moved = columns(plan.spheres.displacement, pairs.item) * half
    carried = 0.0 if light.displacement is None else light.displacement * half
    drift = np.sqrt(dot(moved - carried, moved - carried))
    apart = np.sqrt(dot(gap, gap))
    reached = np.abs(apart - r) < light.radius + drift
    far = np.maximum(np.sqrt(dot(to, to)), light.radius)
    out, over, through = -v / np.maximum(size, TINY), np.zeros((3, r.size)), np.zeros((3, r.size))
    for axis in patch.axes:
        step = columns(patch.steps[axis], pairs.pixel)
        over[axis] = np.sqrt(dot(step, step)) / far
        if axis == TIME:
            over[axis] += drift / far
            step = step - moved
        through[axis] = np.abs(dot(step, out))
    left = (r - size <= through.sum(axis=0)) & (pairs.item != surface.item[pairs.pixel])
    return np.where(reached, np.where(left, through, over), 0.0), left


def _outline_angles(
    light: Emitter, axis: Array, toward: Array, v: Array, far: Array, angle: Array, half: Array
) -> tuple[Array, Array]:
    """Angles (m,) from directions v to the farthest point of a light, and to its nearest side.

    The latter are negative outside the light. A round light's follow from the angle between v and
    its centre and from half of its own angle, `half`, towards v.
    """
    clearance = light.outline_clearance(axis, v, far)
    if clearance is None:
        return angle + half, half - angle
    return np.hypot(angle + half, light.half_angle_along(cross(axis, toward), far)), clearance


def _nearest_bound(
    light: Emitter, bounds: Array, whole: Array, half: Array, opening: Array
) -> tuple[Array, Array, Mask]:
    """Coefficients of the powers 3/2 at the bounds that matter most.

    Returns with them the distances of these bounds in radians, and whether any bound is within the
    patch.

    bounds : (3, m) radians to where the shadow begins, where the sphere hides the whole light, and
    where the sphere's outline lies within the light's.
    """
    least = np.maximum(np.minimum(half, opening), TINY)
    if light.span is not None:
        round_ = np.broadcast_to(opening / least, bounds.shape)
    else:
        most = np.maximum(half, opening)
        inside = most / np.abs(half - opening)
        round_ = np.array([most / (half + opening), inside, inside])
    away = np.maximum(bounds, whole)
    number = (round_ / away).argmax(axis=0)
    each = np.arange(whole.size)
    return (
        TANGENCY_COEFFICIENT * np.sqrt(round_[number, each]),
        away[number, each],
        (bounds < whole).any(axis=0),
    )


def _encloses_patch(
    plan: Plan, surface: Surface, patch: Patch, light: Emitter, pairs: Pairs, v: Array, to: Array
) -> Mask:
    """Whether spheres contain the whole patch, and nothing of the light: (m,).

    v, to : (3, m) from the points to the centers of the spheres and of the light.
    """
    r, gap, eye = plan.spheres.radius[pairs.item], v - to, v + columns(surface.point, pairs.pixel)
    drift, carried = np.zeros(r.size), np.zeros(r.size)
    if plan.spheres.displacement is not None:
        d = columns(plan.spheres.displacement, pairs.item)
        drift = np.sqrt(dot(d, d)) * patch.half_time[pairs.pixel]
    if light.displacement is not None:
        carried = (
            np.sqrt(dot(light.displacement, light.displacement)) * patch.half_time[pairs.pixel]
        )
    apart = np.sqrt(dot(gap, gap)) - (drift + carried) > r + light.radius
    within = np.sqrt(dot(v, v)) + patch.reach[pairs.pixel] + drift < r
    # for a camera inside a sphere, all of its visible surface is its inside
    lined = surface.inside[pairs.pixel] & (pairs.item == surface.item[pairs.pixel])
    lined &= (drift == 0.0) | (np.sqrt(dot(eye, eye)) + drift < r)
    holds: Mask = apart & (within | lined)
    return holds
