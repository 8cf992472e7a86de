# SPDX-License-Identifier: GPL-3.0-or-later
"""Detection over lights: is a light visible from a point as a whole, in part, or not at all?

For one occluder the answer is exact at order 2. A sphere's discriminant for rays from a point p to
points L of a light is a quadratic in the light's coordinates: over a quad light its jet gives the
range; over a round light the problem is rotationally symmetric, and two cones are compared. The
edge functions of quads are linear. In addition, the hit must lie between p and the light.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.polygon.kernels import (
    PlaneNormals,
    edge_planes,
    quad_blocks_segment,
    snapped_height,
)
from ..geometry.sphere.kernels import (
    cone_overlap,
    discriminant,
    discriminant_rounding,
    origin_inside,
    sphere_blocks_segment,
    surface_tolerance,
)
from ..lights.bounds import LightBounds, LinearSpan, ViewCone
from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Mask
from ..numerics.floats import TINY, UNIT_ROUNDOFF
from ..numerics.gather import columns
from ..numerics.jet import Jet
from ..numerics.taylor_range import rectangle_range
from ..numerics.vector import cross, dot, norm, squared_norm
from ..parallel.call_progress import report_progress
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface, cache_sized_chunks

__all__ = [
    "LightVisibility",
    "classify_balls",
    "classify_horizon",
    "classify_light_visibility",
    "classify_occluders",
]


EDGE_FUNCTION_OPERATIONS = 32
"""Number of rounded operations behind one edge function w.plane.

Its rounding error is at most so many unit roundoffs of |w| |plane|."""


@dataclass(frozen=True)
class LightVisibility:
    """Visibility of a light from n points at one shutter time.

    Attributes
    ----------
    dark : (n,) the light contributes nothing: it is below the point's horizon, or faces away.
    blocked : (n,) one object occludes all of the light.
    partial : (n,) the light may be visible in part, so rays have to be distributed over it.
    pairs : pairs of partially lit points and their possible occluders, sorted by point.
    """

    dark: Mask
    blocked: Mask
    partial: Mask
    pairs: Pairs


def classify_light_visibility(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, time: Array | float = 0.0
) -> LightVisibility:
    """Classify the visibility of a light from n points.

    Parameters
    ----------
    light : as it casts shadows (`Plan.shadow_light`).  pairs : candidate occluders.
    time : shutter times of the points, a number or (n,).
    """
    dark, horizon = classify_horizon(light, light.to_center(surface.point, time), surface)
    live = pairs.take(~dark[pairs.pixel])
    when = time[live.pixel] if isinstance(time, np.ndarray) else time
    none, full = classify_occluders(plan, surface, light, live, when)
    blocked = np.zeros(dark.size, dtype=np.bool_)
    blocked[live.pixel[full]] = True
    kept = live.take(~none & ~blocked[live.pixel])
    partial = np.zeros(dark.size, dtype=np.bool_)
    partial[kept.pixel] = True
    partial |= horizon & ~blocked
    if not light.extended or not light.casts_shadow:
        partial[:] = False
    return LightVisibility(dark, blocked, partial, kept)


def classify_horizon(
    light: Emitter,
    to: Array,
    surface: Surface,
    reach: Array | float = 0.0,
    bend: Array | float = 0.0,
) -> tuple[Mask, Mask]:
    """Where a light contributes nothing, and where the point's horizon cuts it: (n,) each.

    The parameters are those of `Emitter.horizon`.
    """
    dark, cut = light.horizon(to, surface.point, surface.normal, reach, bend)
    if light.coplanar is not None:
        edge_on = light.edge_on(surface.item)
        dark, cut = dark | edge_on, cut & ~edge_on
    return dark, cut


def classify_occluders(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, time: Array | float
) -> tuple[Mask, Mask]:
    """Whether each occluder certainly hides nothing of the light, or certainly all of it.

    Parameters
    ----------
    pairs : (m) points and objects.
    time : shutter time of light and occluders, a number or (m,).

    Returns
    -------
    none, full : (m,) bool; both are false where the occluder may hide a part.
    """
    m = pairs.item.size
    none, full = np.zeros(m, dtype=np.bool_), np.zeros(m, dtype=np.bool_)
    ball = pairs.item < plan.sphere_count
    done = 0
    for all_rows, part in (
        (ball.nonzero()[0], _classify_spheres),
        ((~ball).nonzero()[0], _classify_quads),
    ):
        for rows in cache_sized_chunks(all_rows):
            plan.go_on()
            report_progress(done / m)
            done += rows.size
            chosen = pairs.take(rows)
            when = time[rows] if isinstance(time, np.ndarray) else time
            none[rows], full[rows] = part(plan, surface, light, chosen, when)
    return none, full


def _classify_spheres(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, time: Array | float
) -> tuple[Mask, Mask]:
    """`classify_occluders` for spheres."""
    point = columns(surface.point, pairs.pixel)
    r = plan.spheres.radius[pairs.item]
    place = plan.spheres.moved(pairs.item, time)
    v = place - point
    graze = surface_tolerance(point, r)
    to = light.to_center(point, time)
    if not light.extended:
        block = sphere_blocks_segment(to, v, r, graze)
        return ~block, block
    enclosed = pairs.item == surface.item[pairs.pixel]
    enclosed |= origin_inside(dot(v, v), r, graze)
    gap = light.to_center(place, time)
    none, full = classify_balls(plan, light, to, gap, v, r, enclosed)
    away = norm(gap)
    none = np.where(enclosed, away + light.radius <= r, none)
    full = np.where(enclosed, away - light.radius >= r, full)
    return none & ~full, full


def classify_balls(
    plan: Plan,
    light: LightBounds,
    to: Array,
    gap: Array,
    v: Array,
    r: Array,
    enclosed: Mask,
) -> tuple[Mask, Mask]:
    """Whether balls certainly hide nothing of an extended light, or certainly all of it.

    Parameters
    ----------
    to, gap : (3, m) metres, vectors to the light's centre from the points, and from the balls'.
    v, r : (3, m) vectors from the points to the balls' centres, and (m,) radii, metres.
    enclosed : (m,) whether the point is inside its ball; both answers are then undefined.

    Returns
    -------
    none, full : (m,).
    """
    cone = light.view_cone(to)
    touch, cover, tangent = cone_overlap(cone.axis, cone.cosine, cone.sine, v, r)
    none: Mask = ~touch | (norm(v) - r >= cone.far)
    full: Mask = cover & (tangent <= cone.near)
    # a light inside the ball is hidden from outside
    full |= norm(gap) + light.radius <= r
    none |= light.is_behind(gap, r)
    if light.span is not None:
        unsure = (~none & ~full & ~enclosed).nonzero()[0]
        if unsure.size:
            some = _classify_over_span(
                plan.settings.order,
                light.span,
                light.radius,
                columns(to, unsure),
                columns(v, unsure),
                r[unsure],
                tangent[unsure],
            )
            none[unsure], full[unsure] = some
    return none, full


def _classify_over_span(
    order: int, span: LinearSpan, radius: float, to: Array, v: Array, r: Array, tangent: Array
) -> tuple[Mask, Mask]:
    """`classify_balls` for a light of a linear span, by jets of an order in its two coordinates.

    `to` and v (3, m) lead from the points to the centres of the light and of the balls, metres.
    """
    w = Jet.linear(to, (span.half_u, span.half_v), order)
    d = discriminant(w, v, r)
    vv = dot(v, v)
    square = radius * radius
    # the remainder of order 1 is r^2 |o|^2 - |o x v|^2 for an offset |o| <= radius
    low, high = rectangle_range(d, 1.0, 1.0, square * np.maximum(r * r, vv))
    far = np.sqrt(dot(to, to)) + radius
    side = cross(to, v)
    miss = np.sqrt(dot(side, side)) + radius * np.sqrt(vv)
    rounding = discriminant_rounding(far * far, vv, r, miss)
    along = dot(to, v)
    spread = np.abs(dot(span.half_u, v)) + np.abs(dot(span.half_v, v))
    none = (high < -rounding) | (along + spread <= 0.0)
    full = (low > rounding) & (along - spread > 0.0)
    # the ball is certainly in front: the light is beyond any hit, or beyond the foot of its centre
    plane = np.abs(dot(span.normal, to))
    unsure = (full & (tangent > plane)).nonzero()[0]
    if unsure.size:
        near = Jet.linear(columns(to, unsure), (span.half_u, span.half_v), order)
        foot = dot(near, columns(v, unsure)) - squared_norm(near)
        full[unsure] = rectangle_range(foot, 1.0, 1.0, square)[1] < 0.0
    return none, full


def _classify_quads(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, time: Array | float
) -> tuple[Mask, Mask]:
    """`classify_occluders` for quads."""
    point = columns(surface.point, pairs.pixel)
    ids = pairs.item - plan.sphere_count
    u, v = columns(plan.quads.edge_u, ids), columns(plan.quads.edge_v, ids)
    q = plan.quads.corners_at(ids, time) - point
    planes, normal, height = edge_planes(q, u, v)
    height = snapped_height(height, normal, surface_tolerance(point, np.sqrt(dot(q, q))))
    to = light.to_center(point, time)
    if not light.extended:
        block = quad_blocks_segment(to, planes, normal, height)
        return ~block, block
    over = dot(to, normal) - height
    reach = light.extent(normal)
    if light.span is not None:
        outside, within = _light_in_planes(light, to, planes)
        outside |= _separated_by_light_edges(light.span, to, q, u, v)
    else:
        outside, within = _cone_in_planes(light.view_cone(to), planes, q, u, v)
    none = outside | (over + reach <= 0.0) | ~(height > 0.0)
    return none, within & (over - reach > 0.0) & ~none


def _light_in_planes(light: Emitter, to: Array, planes: PlaneNormals) -> tuple[Mask, Mask]:
    """Whether a light certainly lies outside one of a quad's edge planes, or inside all."""
    outside = np.zeros(to.shape[1], dtype=np.bool_)
    within = np.ones(to.shape[1], dtype=np.bool_)
    size = np.sqrt(dot(to, to)) + light.radius
    for plane in planes:
        value = dot(to, plane)
        spread = light.extent(plane)
        rounding = EDGE_FUNCTION_OPERATIONS * UNIT_ROUNDOFF * size * np.sqrt(dot(plane, plane))
        outside |= value + spread < -rounding
        within &= value - spread > rounding
    return outside, within


def _separated_by_light_edges(span: LinearSpan, to: Array, q: Array, u: Array, v: Array) -> Mask:
    """Whether one edge plane of a light has all corners of a quad on its outer side."""
    planes, _, height = edge_planes(
        to - span.half_u - span.half_v, 2.0 * span.half_u, 2.0 * span.half_v
    )
    corners = (q, q + u, q + v, q + u + v)
    outside = np.zeros(height.shape, dtype=np.bool_)
    for plane in planes:
        beyond = np.ones(height.shape, dtype=np.bool_)
        for corner in corners:
            beyond &= dot(corner, plane) < 0.0
        outside |= beyond
    return outside & (height > 0.0)


def _cone_in_planes(
    cone: ViewCone, planes: PlaneNormals, q: Array, u: Array, v: Array
) -> tuple[Mask, Mask]:
    """Whether a circular cone certainly misses a quad, or certainly lies inside it."""
    corners = (q, q + v, q + u, q + u + v)
    # the ends of the edges u = 0, v = 0, u = 1, v = 1
    ends = ((0, 1), (0, 2), (2, 3), (1, 3))
    within = np.ones(cone.distance.shape, dtype=np.bool_)
    beyond = np.zeros_like(within)
    reached = np.ones_like(within)
    slack = EDGE_FUNCTION_OPERATIONS * UNIT_ROUNDOFF
    for plane in planes:
        sine = dot(cone.axis, plane) / np.maximum(np.sqrt(dot(plane, plane)), TINY)
        within &= sine > cone.sine + slack
        beyond |= sine < -cone.sine - slack
        reached &= sine >= 0.0
    for plane, (i, j) in zip(planes, ends, strict=True):
        sine = np.abs(dot(cone.axis, plane)) / np.maximum(np.sqrt(dot(plane, plane)), TINY)
        # whether the axis projects between the ends of the edge
        a, b = corners[i], corners[j]
        turn = dot(cross(a, b), plane)
        first = dot(cross(plane, a), cone.axis) * np.sign(turn) >= 0.0
        last = dot(cross(b, plane), cone.axis) * np.sign(turn) >= 0.0
        reached |= (sine <= cone.sine + slack) & first & last
    for corner in corners:
        length = np.maximum(np.sqrt(dot(corner, corner)), TINY)
        reached |= dot(cone.axis, corner) / length >= cone.cosine - slack
    return beyond | ~reached, within & (cone.cosine > 0.0)
