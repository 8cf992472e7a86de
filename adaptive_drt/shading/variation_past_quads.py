# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow edges that quads cast over patches.

Of a quad's edges, the one whose shadow is sharpest relative to the patch counts. See `variation`.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from ..geometry.patch import Patch
from ..geometry.polygon.kernels import (
    PlaneNormals,
    distance_at_closest_approach,
    distance_to_quad,
    edge_planes,
    quad_edges,
)
from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import dot, norm
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface
from .silhouette_rates import (
    MARGIN_WEIGHT,
    MAX_SHARPNESS,
    MIN_RELATIVE_DISTANCE,
    ROUNDING_ANGLE,
    TANGENCY_COEFFICIENT,
    ShadowEdges,
    largest_shift,
    outline_rates,
    outline_shifts,
)
from .standing_quads import shadowing_edges

__all__ = ["quad_shadow_edges"]


EQUAL_SHARPNESS = 1.0 + 2.0**-20
"""Ratio of the sharpness of two edges up to which they count as equally sharp. In front of a point
all edges of a quad are, and then the first of them counts, so that rounding does not decide."""


@dataclass(frozen=True)
class _QuadView:
    """Quads and a light as seen from m points: (3, m) metres, relative to the points.

    `to` points to the center of the light; `planes`, `normal` and `height` are those of
    `edge_planes`, and `edges` those of `edges_of`.
    """

    to: Array
    planes: PlaneNormals
    normal: Array
    height: Array
    edges: tuple[PlaneNormals, PlaneNormals]

    def take(self, rows: Ints) -> _QuadView:
        """Select points by index."""
        planes, *edges = (
            (columns(a, rows), columns(b, rows), columns(c, rows), columns(d, rows))
            for a, b, c, d in (self.planes, *self.edges)
        )
        to, normal = columns(self.to, rows), columns(self.normal, rows)
        return _QuadView(to, planes, normal, self.height[rows], (edges[0], edges[1]))

    @property
    def sides(self) -> tuple[Array, Array, Array]:
        """A corner of each quad (3, m), and the two edge vectors from there."""
        (corner, *_), (v, u, *_) = self.edges
        return corner, u, v

    @property
    def corner_distance(self) -> Array:
        """Sum (m,) of the distances of two opposite corners, metres."""
        corner, u, v = self.sides
        return norm(corner) + norm(corner + u + v)


def quad_shadow_edges(
    plan: Plan, surface: Surface, patch: Patch, light: Emitter, pairs: Pairs, time: Array | float
) -> ShadowEdges:
    """Shadow edges of quads: for each quad its sharpest edge across the light or beside it."""
    point, ids = columns(surface.point, pairs.pixel), pairs.item - plan.sphere_count
    q = plan.quads.corners_at(ids, time) - point
    u, v = columns(plan.quads.edge_u, ids), columns(plan.quads.edge_v, ids)
    view = _QuadView(light.to_center(point, time), *edge_planes(q, u, v), quad_edges(q, u, v))
    shadows = _shadow_edges(plan, patch, light, pairs, view)
    own = pairs.item == surface.item[pairs.pixel]
    height, normal = view.height, view.normal
    size = np.sqrt(dot(normal, normal))
    point_slack, light_slack = _normal_motion(plan, patch, light, pairs, normal)
    before = height > point_slack
    cut = (~before & ~own).nonzero()[0]
    near = distance_to_quad(*(columns(side, cut) for side in view.sides))
    touched = near <= _motion_radius(plan, patch, pairs.take(cut))
    stands = cut[touched]
    walls, through = _update_standing(plan, surface, patch, light, pairs, view, stands, shadows)
    before[stands[walls]] = True
    depth, shifts, width = shadows.depth, shadows.shifts, shadows.width
    # a quad hides nothing if the point and the light are on one side of its plane,
    # or if the point is in that plane
    beyond = dot(view.to, normal) - height
    depth[own | ~(height > 0.0) | (before & (beyond + light.radius * size < -light_slack))] = 0.0
    covers = shadows.covers & before & (beyond - light.radius * size > light_slack)
    covers &= (height > 0.0) & ~own
    edge_on = cut[~touched]
    if edge_on.size:
        # the plane of the quad cuts the patch but the quad does not: at the cut it is seen edge-on,
        # and the edge functions change sign
        some = pairs.take(edge_on), view.take(edge_on)
        moved, half = _edge_on_shifts(plan, patch, light, *some, near[~touched])
        reached = (moved.max(axis=0) > 0.0) & (depth[edge_on] == 0.0)
        edge_on = edge_on[reached]
        depth[edge_on], shifts[:, edge_on] = MARGIN_WEIGHT, columns(moved, reached)
        width[edge_on] = 2.0 * half[reached]
    cut = stands[~walls]
    if cut.size:
        # the quad itself cuts the patch, which is lit on one side and dark on the other: a step
        depth[cut], width[cut], shifts[:, cut] = 1.0, 0.0, columns(through, ~walls)
    return ShadowEdges(depth, shifts, width, shadows.ends, shadows.power, shadows.away, covers)


def _update_standing(
    plan: Plan,
    surface: Surface,
    patch: Patch,
    light: Emitter,
    pairs: Pairs,
    view: _QuadView,
    stands: Ints,
    shadows: ShadowEdges,
) -> tuple[Mask, Array]:
    """Replace shadows, in place, of quads that stand in patches and of which only some edges count.

    Returns the mask (k,) of these quads, and the extents (3, k) of patches normal to quads, by
    axis.

    Parameters
    ----------
    stands : (k,) indices of the pairs to be examined.  shadows : (m) of all pairs.
    """
    if not stands.size:
        return np.zeros(0, dtype=np.bool_), np.zeros((3, 0))
    part, seen = pairs.take(stands), view.take(stands)
    size = np.sqrt(dot(seen.normal, seen.normal))
    unit, height, drift = seen.normal / size, seen.height / size, _motion(plan, patch, part)
    through = _normal_extents(plan, patch, part, unit)
    walls, free = shadowing_edges(surface, patch, part, seen.edges, unit, height, drift, through)
    chosen = walls.nonzero()[0]
    if chosen.size:
        own = part.take(chosen), seen.take(chosen)
        found = _shadow_edges(plan, patch, light, *own, columns(free, chosen))
        for one in fields(ShadowEdges):
            getattr(shadows, one.name)[..., stands[chosen]] = getattr(found, one.name)
    return walls, through


def _shadow_edges(
    plan: Plan,
    patch: Patch,
    light: Emitter,
    pairs: Pairs,
    view: _QuadView,
    free: Mask | None = None,
) -> ShadowEdges:
    """Shadow edges of quads, from the planes through the points and the quads' edges alone.

    free : (4, m) the edges that count; all of them if not given.
    """
    count = pairs.item.size
    far = np.maximum(np.sqrt(dot(view.to, view.to)), TINY)
    axis = view.to / far
    depth, width, sharpest = np.zeros(count), np.ones(count), np.zeros(count)
    shifts, away = np.zeros((3, count)), np.full(count, np.inf)
    ends, misses = np.zeros((2, count), dtype=np.bool_)
    covers = np.ones(count, dtype=np.bool_) if free is None else free.any(axis=0)
    nearest = light.distance_or(far, view.corner_distance) * MIN_RELATIVE_DISTANCE
    for number, (plane, start, edge) in enumerate(zip(view.planes, *view.edges, strict=True)):
        near = np.maximum(distance_at_closest_approach(start, edge, axis), nearest)
        rate, steps = outline_rates(plan, light, patch, pairs, near, far)
        toward = plane / np.maximum(np.sqrt(dot(plane, plane)), TINY)
        height_of = np.arcsin(np.clip(dot(axis, toward), -1.0, 1.0))
        half = light.half_angle_along(toward, far)
        each = outline_shifts(steps, toward, axis, rate, 1.0)
        within = each.sum(axis=0)
        whole = largest_shift(within) * patch.margin
        outside, within_edge = height_of < -half - whole, height_of > half + whole
        crosses = (np.abs(height_of) < half + whole) & (whole > ROUNDING_ANGLE)
        if free is not None:
            outside &= free[number]
            within_edge |= ~free[number]
            crosses &= free[number]
        misses |= outside
        covers &= within_edge
        sharp = np.where(crosses, whole / np.maximum(half, whole / MAX_SHARPNESS), 0.0)
        better = sharp > EQUAL_SHARPNESS * sharpest
        sharpest = np.where(better, sharp, sharpest)
        width = np.where(better, 2.0 * half, width)
        shifts = np.where(better, each, shifts)
        inside = np.abs(height_of) < half + within
        depth = np.maximum(depth, np.where(crosses, np.where(inside, 1.0, MARGIN_WEIGHT), 0.0))
        bound = np.abs(np.abs(height_of) - half)
        ends |= crosses & (bound < whole)
        away = np.minimum(away, np.where(crosses, np.maximum(bound, whole), np.inf))
    depth[misses] = 0.0
    power = np.full(count, np.inf if light.span is not None else TANGENCY_COEFFICIENT)
    return ShadowEdges(depth, shifts, width, ends, power, away, covers & ~misses)


def _edge_on_shifts(
    plan: Plan, patch: Patch, light: Emitter, pairs: Pairs, view: _QuadView, near: Array
) -> tuple[Array, Array]:
    """Angles (3, m) by which outlines of quads that are seen edge-on move over the light, by axis.

    They are 0 where the outline comes nowhere near the light. Returns with them half the angles
    (m,) of the light.

    near : (m,) metres to the quads.
    """
    (corner, u, v), to = view.sides, view.to
    center = corner + 0.5 * (u + v)
    wide = 0.5 * np.sqrt(np.maximum(dot(u + v, u + v), dot(u - v, u - v)))
    far = np.maximum(np.sqrt(dot(to, to)), TINY)
    axis = to / far
    away, along = np.sqrt(dot(center, center)), dot(axis, center)
    nearest = light.distance_or(far, away) * MIN_RELATIVE_DISTANCE
    rate, steps = outline_rates(plan, light, patch, pairs, np.maximum(near, nearest), far)
    moved = np.zeros((3, rate.size))
    for number, step in steps.items():
        aside = step - dot(step, axis) * axis
        moved[number] = np.sqrt(dot(aside, aside)) * rate
    angle = np.arctan2(np.sqrt(np.maximum(away * away - along * along, 0.0)), along)
    opening = np.arcsin(np.minimum(wide / np.maximum(away, TINY), 1.0))
    whole = largest_shift(moved.sum(axis=0)) * patch.margin
    half = light.half_angle(far)
    reached = (angle - opening - half < whole) & (whole > ROUNDING_ANGLE)
    return np.where(reached, moved, 0.0), half


def _motion(plan: Plan, patch: Patch, pairs: Pairs) -> Array:
    """Motion (3, m) of quads over half the patches' time interval."""
    d = plan.quads.displacement
    if d is None:
        return np.zeros((3, pairs.item.size))
    drift: Array = columns(d, pairs.item - plan.sphere_count) * patch.half_time[pairs.pixel]
    return drift


def _motion_radius(plan: Plan, patch: Patch, pairs: Pairs) -> Array:
    """Radii (m,) of patches, plus the motion of quads over half the patches' time interval."""
    drift = _motion(plan, patch, pairs)
    reach: Array = patch.reach[pairs.pixel] + np.sqrt(dot(drift, drift))
    return reach


def _normal_extents(plan: Plan, patch: Patch, pairs: Pairs, normal: Array) -> Array:
    """Extents (3, m) of patches normal to the planes of quads, relative to their motion, by
    axis."""
    steps = [columns(patch.steps[axis], pairs.pixel) for axis in range(3)]
    steps[2] = steps[2] - _motion(plan, patch, pairs)
    through: Array = np.abs(np.array([dot(step, normal) for step in steps]))
    return through


def _normal_motion(
    plan: Plan, patch: Patch, light: Emitter, pairs: Pairs, normal: Array
) -> tuple[Array, Array]:
    """Motion of points, and of the light, normal to the planes of quads, times |normal|: (m,)
    each."""
    point = np.zeros(pairs.item.size)
    for axis in patch.axes:
        point += np.abs(dot(columns(patch.steps[axis], pairs.pixel), normal))
    moved = np.zeros(pairs.item.size)
    half, d = patch.half_time[pairs.pixel], plan.quads.displacement
    if d is not None:
        moved += half * np.abs(dot(columns(d, pairs.item - plan.sphere_count), normal))
    point += moved
    if light.displacement is not None:
        moved = moved + half * np.abs(dot(light.displacement, normal))
    return point, moved
