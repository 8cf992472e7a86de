# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow edges that convex polygons of any number k of edges cast over patches.

Of a polygon's edges, the one whose shadow is sharpest relative to the patch counts. All functions
take m pairs of patches and polygons; `motion` (3, m) metres is the polygons' displacement over the
shutter, or None if none of them moves.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.axes import TIME
from ...numerics.floats import TINY
from ...numerics.gather import columns
from ...numerics.vector import dot, norm
from ..light_protocol import AreaLight
from ..shaded_patches import ShadedPatches
from ..shadow_edges import (
    MARGIN_WEIGHT,
    MAX_SHARPNESS,
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
from .kernels import distance_at_closest_approach, distance_to_edge
from .standing import shadowing_edges
from .view import PolygonView

__all__ = ["polygon_shadow_edges"]


EQUAL_SHARPNESS = 1.0 + 2.0**-20
"""Ratio of the sharpness of two edges up to which they count as equally sharp. In front of a point
all edges of a polygon are, and then the first of them counts, so that rounding does not decide."""


def polygon_shadow_edges(
    view: PolygonView,
    motion: Array | None,
    receivers: ShadedPatches,
    light: AreaLight,
    distance: Callable[[Array, Array, Array], Array],
    bounding_ball: Callable[[Array, Array, Array], tuple[Array, Array]],
) -> ShadowEdges:
    """Shadow edges of polygons: for each its sharpest edge across the light or beside it.

    Parameters
    ----------
    view : the polygons as seen from the middles of the patches.
    distance, bounding_ball : those of `PolygonSet` for polygons of this kind.
    """
    if light.surrounds:
        return _shadow_edges_around(view, motion, receivers, light, distance, bounding_ball)
    to = light.to_center(receivers.places, receivers.time)
    shadows = _shadow_edges(view, to, motion, receivers, light)
    own, height, normal = receivers.own, view.height, view.normal
    size = np.sqrt(dot(normal, normal))
    point_slack, light_slack = _normal_motion(motion, receivers, light, normal)
    before = height > point_slack
    cut = (~before & ~own).nonzero()[0]
    near = distance(*(columns(side, cut) for side in (view.corner, view.edge_u, view.edge_v)))
    touched = near <= _motion_radius(_take(motion, cut), receivers.take(cut))
    stands = cut[touched]
    walls, through = _update_standing(view, to, motion, receivers, light, stands, shadows)
    before[stands[walls]] = True
    depth, shifts, width = shadows.depth, shadows.shifts, shadows.width
    # a polygon hides nothing if the point and the light are on one side of its plane,
    # or if the point is in that plane
    beyond = dot(to, normal) - height
    depth[own | ~(height > 0.0) | (before & (beyond + light.radius * size < -light_slack))] = 0.0
    shadows.hides_all[:] &= before & (beyond - light.radius * size > light_slack)
    shadows.hides_all[:] &= (height > 0.0) & ~own
    edge_on = cut[~touched]
    if edge_on.size:
        ball = bounding_ball(
            *(columns(side, edge_on) for side in (view.corner, view.edge_u, view.edge_v))
        )
        some = _take(motion, edge_on), receivers.take(edge_on), light
        found = _edge_on_shifts(ball, columns(to, edge_on), near[~touched], *some)
        _update_edge_on(shadows, edge_on, *found)
    cut = stands[~walls]
    if cut.size:
        # the polygon itself cuts the patch, which is lit on one side and dark on the other: a step
        depth[cut], width[cut], shifts[:, cut] = 1.0, 0.0, columns(through, ~walls)
    return shadows


def _shadow_edges_around(
    view: PolygonView,
    motion: Array | None,
    receivers: ShadedPatches,
    light: AreaLight,
    distance: Callable[[Array, Array, Array], Array],
    bounding_ball: Callable[[Array, Array, Array], tuple[Array, Array]],
) -> ShadowEdges:
    """`polygon_shadow_edges` under a light that surrounds the points: all edges lie on it.

    An edge's term of the irradiance varies over lengths of its distance, the less the nearer the
    edge is to the horizon, whose light is weighted with a cosine of 0. How much a polygon hides is
    told by the direction to its middle, or, where it is as wide as far away, by that to its plane:
    of what is above the horizon the half-space behind a plane hides (1 + cos) / 2.
    """
    normal = columns(receivers.normal, receivers.row)
    center, wide = bounding_ball(view.corner, view.edge_u, view.edge_v)
    away = np.maximum(norm(center), TINY)
    sine = np.minimum(wide / away, 1.0)
    towards = dot(normal, view.normal) / np.maximum(norm(view.normal), TINY)
    behind = sine * sine * 0.5 * (1.0 + towards)
    risen = np.zeros(away.size, dtype=np.bool_)
    near = np.full(away.size, np.inf)
    for start, edge in zip(view.starts, view.edges, strict=True):
        end = start + edge
        rise = [dot(normal, each) / np.maximum(norm(each), TINY) for each in (start, end)]
        risen |= np.maximum(*rise) > 0.0
        lever = np.sqrt(np.clip(np.maximum(*rise), 0.0, 1.0))
        near = np.minimum(near, distance_to_edge(start, edge) / np.maximum(lever, TINY))
    near = np.maximum(near, away * MIN_RELATIVE_DISTANCE)
    share = np.clip(dot(normal, center) / away + 0.5 * sine, 0.0, 1.0)
    depth = sine * sine * np.maximum(share, np.where(risen, behind, 0.0))
    depth[receivers.own | ~(view.height > 0.0)] = 0.0
    nowhere = np.zeros(away.size, dtype=np.bool_)
    shadows = shadow_edges_around(depth, shifts_around(receivers, light, motion, near), nowhere)
    _update_cut_patches(view, motion, receivers, light, distance, shadows)
    return shadows


def _update_cut_patches(
    view: PolygonView,
    motion: Array | None,
    receivers: ShadedPatches,
    light: AreaLight,
    distance: Callable[[Array, Array, Array], Array],
    shadows: ShadowEdges,
) -> None:
    """Replace shadows, in place, of polygons that cut patches: each side sees its own half of a
    light that surrounds them. Where only one of the sides is visible, nothing changes."""
    point_slack, _ = _normal_motion(motion, receivers, light, view.normal)
    rows = (~(view.height > point_slack) & ~receivers.own).nonzero()[0]
    near = distance(*(columns(side, rows) for side in (view.corner, view.edge_u, view.edge_v)))
    rows = rows[near <= _motion_radius(_take(motion, rows), receivers.take(rows))]
    if not rows.size:
        return
    part, seen, moved = receivers.take(rows), view.take(rows), _take(motion, rows)
    size = np.sqrt(dot(seen.normal, seen.normal))
    unit, height, drift = seen.normal / size, seen.height / size, _half_motion(moved, part)
    through = _normal_extents(drift, part, unit)
    walls, _ = shadowing_edges(part, (seen.starts, seen.edges), unit, height, drift, through)
    cut = rows[~walls]
    shadows.depth[cut], shadows.width[cut] = 0.5, 0.0
    shadows.shifts[:, cut] = columns(through, ~walls)


def _take(motion: Array | None, rows: Ints) -> Array | None:
    """The motion of some of the polygons."""
    return None if motion is None else columns(motion, rows)


def _update_standing(
    view: PolygonView,
    to: Array,
    motion: Array | None,
    receivers: ShadedPatches,
    light: AreaLight,
    stands: Ints,
    shadows: ShadowEdges,
) -> tuple[Mask, Array]:
    """Replace shadows, in place, of polygons that stand in patches and of which only some edges
    count.

    Returns the mask (j,) of these polygons, and the extents (3, j) of patches normal to polygons,
    by axis.

    Parameters
    ----------
    stands : (j,) indices of the pairs to be examined.  shadows : (m) of all pairs.
    """
    if not stands.size:
        return np.zeros(0, dtype=np.bool_), np.zeros((3, 0))
    part, seen, moved = receivers.take(stands), view.take(stands), _take(motion, stands)
    size = np.sqrt(dot(seen.normal, seen.normal))
    unit, height, drift = seen.normal / size, seen.height / size, _half_motion(moved, part)
    through = _normal_extents(drift, part, unit)
    edges = seen.starts, seen.edges
    walls, free = shadowing_edges(part, edges, unit, height, drift, through)
    chosen = walls.nonzero()[0]
    if chosen.size:
        found = _shadow_edges(
            seen.take(chosen),
            columns(to, stands[chosen]),
            _take(moved, chosen),
            part.take(chosen),
            light,
            columns(free, chosen),
        )
        for one in fields(ShadowEdges):
            getattr(shadows, one.name)[..., stands[chosen]] = getattr(found, one.name)
    return walls, through


def _shadow_edges(
    view: PolygonView,
    to: Array,
    motion: Array | None,
    receivers: ShadedPatches,
    light: AreaLight,
    free: Mask | None = None,
) -> ShadowEdges:
    """Shadow edges of polygons, from the planes through the points and the polygons' edges alone.

    to : (3, m) metres, from the points to the centre of the light.
    free : (k, m) the edges that count; all of them if not given.
    """
    count, far = view.height.size, np.maximum(np.sqrt(dot(to, to)), TINY)
    axis = to / far
    nearest = light.distance_or(far, _corner_distance(view)) * MIN_RELATIVE_DISTANCE
    depth, width, sharpest = np.zeros(count), np.ones(count), np.zeros(count)
    shifts, away = np.zeros((3, count)), np.full(count, np.inf)
    has_kink, misses = np.zeros((2, count), dtype=np.bool_)
    hides_all = np.ones(count, dtype=np.bool_) if free is None else free.any(axis=0)
    for number, plane in enumerate(view.planes):
        near = distance_at_closest_approach(view.starts[number], view.edges[number], axis)
        rate, steps = outline_rates(receivers, light, motion, np.maximum(near, nearest), far)
        toward = plane / np.maximum(np.sqrt(dot(plane, plane)), TINY)
        height_of = np.arcsin(np.clip(dot(axis, toward), -1.0, 1.0))
        half = light.half_angle_along(toward, far)
        each = outline_shifts(steps, toward, axis, rate, 1.0)
        within = each.sum(axis=0)
        whole = largest_shift(within) * receivers.patch.margin
        outside, within_edge = height_of < -half - whole, height_of > half + whole
        crosses = (np.abs(height_of) < half + whole) & (whole > ROUNDING_ANGLE)
        if free is not None:
            outside &= free[number]
            within_edge |= ~free[number]
            crosses &= free[number]
        misses |= outside
        hides_all &= within_edge
        sharp = np.where(crosses, whole / np.maximum(half, whole / MAX_SHARPNESS), 0.0)
        better = sharp > EQUAL_SHARPNESS * sharpest
        sharpest = np.where(better, sharp, sharpest)
        width = np.where(better, 2.0 * half, width)
        shifts = np.where(better, each, shifts)
        share = np.where(np.abs(height_of) < half + within, 1.0, MARGIN_WEIGHT)
        depth = np.maximum(depth, np.where(crosses, share, 0.0))
        bound = np.abs(np.abs(height_of) - half)
        has_kink |= crosses & (bound < whole)
        away = np.minimum(away, np.where(crosses, np.maximum(bound, whole), np.inf))
    depth[misses] = 0.0
    coefficient = np.full(count, np.inf if light.span is not None else TANGENCY_COEFFICIENT)
    return ShadowEdges(depth, shifts, width, has_kink, coefficient, away, hides_all & ~misses)


def _update_edge_on(shadows: ShadowEdges, rows: Ints, moved: Array, half: Array) -> None:
    """Update shadows, in place, of polygons whose planes cut patches that they do not cut.

    At the cut a polygon is seen edge-on, and the edge functions change sign.

    rows : (j,) indices of the pairs.  moved, half : of `_edge_on_shifts`.
    """
    reached = (moved.max(axis=0) > 0.0) & (shadows.depth[rows] == 0.0)
    rows = rows[reached]
    shadows.depth[rows], shadows.shifts[:, rows] = MARGIN_WEIGHT, columns(moved, reached)
    shadows.width[rows] = 2.0 * half[reached]


def _edge_on_shifts(
    ball: tuple[Array, Array],
    to: Array,
    near: Array,
    motion: Array | None,
    receivers: ShadedPatches,
    light: AreaLight,
) -> tuple[Array, Array]:
    """Angles (3, m) by which outlines of polygons that are seen edge-on move over the light, by
    axis.

    They are 0 where the outline comes nowhere near the light. Returns with them half the angles
    (m,) of the light.

    Parameters
    ----------
    ball : centres (3, m) from the points and radii (m,), metres, of balls around the polygons.
    to : (3, m) metres, from the points to the centre of the light.
    near : (m,) metres to the polygons.
    """
    center, wide = ball
    far = np.maximum(np.sqrt(dot(to, to)), TINY)
    axis = to / far
    away, along = np.sqrt(dot(center, center)), dot(axis, center)
    nearest = light.distance_or(far, away) * MIN_RELATIVE_DISTANCE
    rate, steps = outline_rates(receivers, light, motion, np.maximum(near, nearest), far)
    moved = np.zeros((3, rate.size))
    for number, step in steps.items():
        aside = step - dot(step, axis) * axis
        moved[number] = np.sqrt(dot(aside, aside)) * rate
    angle = np.arctan2(np.sqrt(np.maximum(away * away - along * along, 0.0)), along)
    opening = np.arcsin(np.minimum(wide / np.maximum(away, TINY), 1.0))
    whole = largest_shift(moved.sum(axis=0)) * receivers.patch.margin
    half = light.half_angle(far)
    reached = (angle - opening - half < whole) & (whole > ROUNDING_ANGLE)
    return np.where(reached, moved, 0.0), half


def _corner_distance(view: PolygonView) -> Array:
    """Sum (m,) of the distances of two vertices of each polygon, metres."""
    return norm(view.vertices[0]) + norm(view.vertices[2])


def _half_motion(motion: Array | None, receivers: ShadedPatches) -> Array:
    """Motion (3, m) of polygons over half the patches' time interval."""
    if motion is None:
        return np.zeros((3, receivers.row.size))
    drift: Array = motion * receivers.half_time
    return drift


def _motion_radius(motion: Array | None, receivers: ShadedPatches) -> Array:
    """Radii (m,) of patches, plus the motion of polygons over half the patches' time interval."""
    drift = _half_motion(motion, receivers)
    reach: Array = receivers.reach + np.sqrt(dot(drift, drift))
    return reach


def _normal_extents(drift: Array, receivers: ShadedPatches, normal: Array) -> Array:
    """Extents (3, m) of patches normal to the planes of polygons, relative to their motion, by
    axis.

    drift : (3, m) metres, motion of the polygons over half the patches' time interval.
    """
    steps = [receivers.step(axis) for axis in range(3)]
    steps[TIME] = steps[TIME] - drift
    through: Array = np.abs(np.array([dot(step, normal) for step in steps]))
    return through


def _normal_motion(
    motion: Array | None, receivers: ShadedPatches, light: AreaLight, normal: Array
) -> tuple[Array, Array]:
    """Motion of points, and of the light, normal to the planes of polygons, times |normal|: (m,)
    each."""
    point = np.zeros(receivers.row.size)
    for axis in receivers.patch.axes:
        point += np.abs(dot(receivers.step(axis), normal))
    moved = np.zeros(receivers.row.size)
    half = receivers.half_time
    if motion is not None:
        moved += half * np.abs(dot(motion, normal))
    point += moved
    if light.displacement is not None:
        moved = moved + half * np.abs(dot(light.displacement, normal))
    return point, moved
