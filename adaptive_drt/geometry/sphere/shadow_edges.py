# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow edges of spheres, and of shapes of which only bounding spheres are known, over patches.

All functions take m pairs of patches and spheres. `center` (3, m) are the spheres' centres relative
to the camera, at the times of the patches, in metres; `displacement` (3, m) metres is the spheres'
over the shutter, or None if none of them moves.
"""

from __future__ import annotations

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.axes import TIME
from ...numerics.floats import TINY
from ...numerics.gather import columns
from ...numerics.vector import cross, dot
from ..light_protocol import AreaLight
from ..shaded_patches import ShadedPatches
from ..shadow_edges import (
    MARGIN_WEIGHT,
    MIN_RELATIVE_DISTANCE,
    ROUNDING_ANGLE,
    TANGENCY_COEFFICIENT,
    ShadowEdges,
    largest_shift,
    outline_rates,
    outline_shifts,
    shadow_edges_around,
    shifts_around,
)
from .section_edges import add_section_edges

__all__ = ["enclosed_shadow_edges", "sphere_shadow_edges"]


MIN_ANGLE_RATIO = 2.0**-52
"""Least ratio of the angles of light and occluder; a light with a smaller angle counts as a
point."""


def sphere_shadow_edges(
    center: Array,
    r: Array,
    displacement: Array | None,
    receivers: ShadedPatches,
    light: AreaLight,
    bounds: tuple[Array, Array] | None = None,
) -> ShadowEdges:
    """Shadow edges of spheres of radii r (m,), metres.

    bounds : of shapes that are no spheres, radii (m,) of balls within them and around them; r is
        their extent towards the light.
    """
    if light.surrounds:
        return _shadow_edges_around(center, r, displacement, receivers, light)
    return _shadow_edges_across(center, r, displacement, receivers, light, bounds)


def _shadow_edges_across(
    center: Array,
    r: Array,
    displacement: Array | None,
    receivers: ShadedPatches,
    light: AreaLight,
    bounds: tuple[Array, Array] | None,
) -> ShadowEdges:
    """`sphere_shadow_edges` from the angles between the spheres' outlines and that of the light."""
    point = receivers.places
    v, to = center - point, light.to_center(point, receivers.time)
    far = np.maximum(np.sqrt(dot(to, to)), TINY)
    axis, lit_around = _view_axis(light, to, far, receivers)
    vv, along = dot(v, v), dot(axis, v)
    aside = v - along * axis
    off = np.sqrt(dot(aside, aside))
    toward, angle = aside / np.maximum(off, TINY), np.arctan2(off, along)
    tangent = np.sqrt(np.maximum(vv - r * r, 0.0))
    opening, half = np.arctan2(r, tangent), light.half_angle_along(toward, far)
    near = np.maximum(tangent, light.distance_or(far, np.sqrt(vv)) * MIN_RELATIVE_DISTANCE)
    rate, steps = outline_rates(receivers, light, displacement, near, far)
    shifts = outline_shifts(steps, toward, axis, rate, angle)
    within = shifts.sum(axis=0)
    whole = largest_shift(within) * receivers.patch.margin
    # the outlines cross in the patch unless the sphere misses the light, hides all of it, or lies
    # within its outline, from all of the patch
    farthest, clearance = _outline_angles(light, axis, toward, v, far, angle, half)
    # all directions over the horizon count, but not alike: within the hemisphere a shadow varies
    least = most = opening
    if bounds is not None:
        least, most = (np.arcsin(np.minimum(each / np.sqrt(vv), 1.0)) for each in bounds)
    inner = np.where(lit_around, -np.inf, clearance - most)
    crosses = (angle - opening - half < whole) & (least - farthest < whole)
    crosses &= (inner < whole) & (whole > ROUNDING_ANGLE)
    inside = (angle - opening - half < within) & (least - farthest < within) & (inner < within)
    before = np.sqrt(vv) - r < far + light.radius
    enclosed = (vv <= r * r) | receivers.own
    depth = np.minimum(1.0, opening / np.maximum(half, MIN_ANGLE_RATIO * opening)) ** 2
    depth = depth * np.where(inside, 1.0, MARGIN_WEIGHT) * (crosses & before & ~enclosed)
    away = np.abs(np.array([angle - opening - half, opening - farthest, clearance - opening]))
    nearest = _nearest_bound(light, away, whole, half, opening)
    hides_all = (least - farthest >= whole) & ~enclosed & (tangent < far - light.radius)
    width = 2.0 * np.minimum(half, opening)
    edges = ShadowEdges(depth, shifts, width, *nearest, hides_all)
    _add_touching_edges(edges, enclosed, half, (v, to, r), receivers, light, displacement)
    return edges


def _add_touching_edges(
    edges: ShadowEdges,
    enclosed: Mask,
    half: Array,
    ends: tuple[Array, Array, Array],
    receivers: ShadedPatches,
    light: AreaLight,
    displacement: Array | None,
) -> None:
    """Set, in place, the edges of spheres that enclose the point or that the light reaches into.

    Parameters
    ----------
    enclosed : (m,) whether the point is within the sphere or on it.  half : (m,) radians, half
    angles of the light.  ends : v, to and r of `_encloses_patch`.
    """
    v, to, r = ends
    some = enclosed.nonzero()[0]
    if some.size:
        part = columns(v, some), columns(to, some), r[some], receivers.take(some), light
        drift = None if displacement is None else columns(displacement, some)
        edges.hides_all[some] = _encloses_patch(*part, drift)
        _add_enclosed_edges(edges, some, half[some], *part, drift)
    moved = _relative_drift(receivers, light, displacement)
    apart = np.sqrt(dot(v - to, v - to))
    reached = (np.abs(apart - r) < light.radius + moved) & light.extended
    rows = (reached & ~enclosed).nonzero()[0]
    if rows.size:
        outer = columns(v, rows), columns(to, rows), r[rows]
        add_section_edges(edges, rows, half[rows], outer, moved[rows], receivers.take(rows), light)


def _relative_drift(
    receivers: ShadedPatches, light: AreaLight, displacement: Array | None
) -> Array:
    """Metres (m,) by which spheres move relative to the light over half the patches' times."""
    moved = 0.0 if displacement is None else displacement
    carried = 0.0 if light.displacement is None else light.displacement
    drift = np.zeros((3, receivers.row.size)) + (moved - carried) * receivers.half_time
    size: Array = np.sqrt(dot(drift, drift))
    return size


def _view_axis(
    light: AreaLight, to: Array, far: Array, receivers: ShadedPatches
) -> tuple[Array, Mask]:
    """Unit vectors (3, m) to the middle of the light as seen, and where the point lies within it.

    From within, the light fills the hemisphere over the surface, whose middle is its normal.
    """
    axis, lit_around = to / far, np.zeros(far.size, dtype=np.bool_)
    if light.solid:
        lit_around = far <= light.radius
        axis = np.where(lit_around, columns(receivers.normal, receivers.row), axis)
    return axis, lit_around


def _add_enclosed_edges(
    edges: ShadowEdges,
    some: Ints,
    half: Array,
    v: Array,
    to: Array,
    r: Array,
    receivers: ShadedPatches,
    light: AreaLight,
    displacement: Array | None,
) -> None:
    """Set, in place, the edges of spheres `some` that enclose the point.

    Where the light passes the sphere, their outline is that of the part of the light which lies
    within it. If the patch leaves the sphere, what that hides is a step, and the shifts are those
    of the points through its surface, in metres. The other parameters are those of these spheres:
    see `_encloses_patch`.

    half : (m,) radians, half angles of the light.
    """
    gap, size = v - to, np.sqrt(dot(v, v))
    moved = np.zeros((3, r.size)) if displacement is None else displacement * receivers.half_time
    drift = _relative_drift(receivers, light, displacement)
    reached = np.abs(np.sqrt(dot(gap, gap)) - r) < light.radius + drift
    far = np.maximum(np.sqrt(dot(to, to)), light.radius)
    out, over, through = -v / np.maximum(size, TINY), np.zeros((3, r.size)), np.zeros((3, r.size))
    for axis in receivers.patch.axes:
        step = receivers.step(axis)
        over[axis] = np.sqrt(dot(step, step)) / far
        if axis == TIME:
            over[axis] += drift / far
            step = step - moved
        through[axis] = np.abs(dot(step, out))
    left = (r - size <= through.sum(axis=0)) & ~receivers.own
    # what moves may have the middle of a patch within the sphere at a time when it is not seen
    shifts = np.where(left & (reached | (receivers.half_time > 0.0)), through, 0.0)
    shifts = np.where(reached & ~left, over, shifts)
    met = shifts.any(axis=0).nonzero()[0]
    rows = some[met]
    edges.depth[rows], edges.shifts[:, rows] = 1.0, columns(shifts, met)
    edges.width[rows] = np.where(left[met], 0.0, 2.0 * half[met])


def _shadow_edges_around(
    center: Array,
    r: Array,
    displacement: Array | None,
    receivers: ShadedPatches,
    light: AreaLight,
) -> ShadowEdges:
    """`sphere_shadow_edges` under a light that surrounds the points: all of an outline lies on it.

    Of the irradiance a sphere at distance d hides the fraction (r / d)^2 times the cosine, which is
    smooth over lengths of d, even where the sphere touches the surface.
    """
    point = receivers.places
    v, to = center - point, light.to_center(point, receivers.time)
    length = np.sqrt(dot(v, v))
    away = np.maximum(length, TINY)
    cosine = dot(columns(receivers.normal, receivers.row), v) / away
    enclosed = (length <= r) | receivers.own
    sine = np.minimum(r / away, 1.0)
    # the mean cosine over the part of the sphere's cone that is above the horizon, roughly
    depth = sine * sine * np.clip(cosine + 0.5 * sine, 0.0, 1.0)
    hides_all = enclosed.copy()
    some = enclosed.nonzero()[0]
    if some.size:
        part = columns(v, some), columns(to, some), r[some], receivers.take(some), light
        drift = None if displacement is None else columns(displacement, some)
        hides_all[some] = _encloses_patch(*part, drift)
    shifts = shifts_around(receivers, light, displacement, away)
    return shadow_edges_around(np.where(enclosed, 0.0, depth), shifts, hides_all)


def enclosed_shadow_edges(
    center: Array,
    r: Array,
    displacement: Array | None,
    receivers: ShadedPatches,
    light: AreaLight,
) -> ShadowEdges:
    """Shadow edges of shapes that lie anywhere within balls of radii r (m,), metres.

    An edge may cross every patch from which some of the light is seen through the ball, and so it
    does where a patch lies in the ball or on the shape itself. It is taken for a straight edge that
    hides all of the light, at the distance of the ball's near side.
    """
    point = receivers.places
    v, to = center - point, light.to_center(point, receivers.time)
    far = np.maximum(np.sqrt(dot(to, to)), TINY)
    axis, length = to / far, np.sqrt(dot(v, v))
    along = dot(axis, v)
    aside = v - along * axis
    angle = np.arctan2(np.sqrt(dot(aside, aside)), along)
    near = np.maximum(length - r, light.distance_or(far, length) * MIN_RELATIVE_DISTANCE)
    rate, steps = outline_rates(receivers, light, displacement, near, far)
    shifts = np.zeros((3, rate.size))
    for number, step in steps.items():
        across = step - dot(step, axis) * axis
        shifts[number] = np.sqrt(dot(across, across)) * rate
    within = shifts.sum(axis=0)
    whole = largest_shift(within) * receivers.patch.margin
    inside = (length <= r) | receivers.own
    opening = np.arcsin(np.minimum(r / np.maximum(length, TINY), 1.0))
    half = light.half_angle(far)
    gap = np.where(inside, 0.0, angle - opening - half)
    crosses = (gap < whole) & (whole > ROUNDING_ANGLE) & (length - r < far + light.radius)
    depth = np.where(crosses, np.where(gap < within, 1.0, MARGIN_WEIGHT), 0.0)
    always, never = np.ones(rate.size, dtype=np.bool_), np.zeros(rate.size, dtype=np.bool_)
    ramp = np.full(rate.size, np.inf)
    return ShadowEdges(depth, shifts, 2.0 * half, always, ramp, whole, never)


def _outline_angles(
    light: AreaLight,
    axis: Array,
    toward: Array,
    v: Array,
    far: Array,
    angle: Array,
    half: Array,
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
    light: AreaLight, bounds: Array, whole: Array, half: Array, opening: Array
) -> tuple[Mask, Array, Array]:
    """Whether any bound of each shadow edge is within the patch, and which of them matters most.

    Returns of the latter the coefficient of the power 3/2 and the distance in radians: see
    `ShadowEdges`.

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
        (bounds < whole).any(axis=0),
        TANGENCY_COEFFICIENT * np.sqrt(round_[number, each]),
        away[number, each],
    )


def _encloses_patch(
    v: Array,
    to: Array,
    r: Array,
    receivers: ShadedPatches,
    light: AreaLight,
    displacement: Array | None,
) -> Mask:
    """Whether spheres contain the whole patch, and nothing of the light: (m,).

    v, to : (3, m) from the points to the centers of the spheres and of the light.
    """
    gap, eye = v - to, v + receivers.places
    drift, carried = np.zeros(r.size), np.zeros(r.size)
    if displacement is not None:
        drift = np.sqrt(dot(displacement, displacement)) * receivers.half_time
    if light.displacement is not None:
        carried = np.sqrt(dot(light.displacement, light.displacement)) * receivers.half_time
    apart = np.sqrt(dot(gap, gap)) - (drift + carried) > r + light.radius
    apart |= light.surrounds
    within = np.sqrt(dot(v, v)) + receivers.reach + drift < r
    # for a camera inside a sphere, all of its visible surface is its inside
    lined = receivers.inside[receivers.row] & receivers.own
    lined &= (drift == 0.0) | (np.sqrt(dot(eye, eye)) + drift < r)
    holds: Mask = apart & (within | lined)
    return holds
