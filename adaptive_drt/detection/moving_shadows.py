# SPDX-License-Identifier: GPL-3.0-or-later
"""Detection over the shutter for light: may the light on a pixel's surface change with time?

The pixel's square and the light's area are taken into account by enlarging the objects by a bound
on their effect. The tests are conservative: they never miss a change.
"""

from __future__ import annotations

import numpy as np

from ..geometry.polygon.kernels import edge_planes
from ..geometry.sphere.kernels import cone_overlap
from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Mask
from ..numerics.axes import SHUTTER_ENDS
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.taylor_range import clip_positive
from ..numerics.vector import cross, dot
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface, curvature
from .occlusion import classify_horizon, classify_occluders

__all__ = ["light_changes", "patch_light_changes"]


def light_changes(plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, reach: Array) -> Mask:
    """Whether the light on surfaces at rest may change during the shutter: (n,).

    Parameters
    ----------
    surface : n points; their hits do not move under a fixed ray.
    light : as it casts shadows.  pairs : candidate occluders.
    reach : (n,) metres, the reach of the pixel's surface around the point (0 without edges).
    """
    moving = plan.moves[pairs.item]
    bend = curvature(plan, surface)
    if light.displacement is not None:
        return _changes_of_moving_light(plan, surface, light, pairs.take(~moving), reach, bend)
    dark = classify_horizon(light, light.to_center(surface.point), surface, reach, bend)[0]
    live = ~dark[pairs.pixel]
    changes = np.zeros(surface.item.size, dtype=np.bool_)
    candidates = pairs.take(moving & live)
    if not candidates.item.size:
        return changes
    touched = _may_shadow(plan, surface, light, candidates, reach)
    always = _always_hidden(plan, surface, light, candidates, reach)
    changes[candidates.pixel[touched & ~always]] = True
    # nothing changes where one occluder, at rest or moving, always hides all of the light
    still = pairs.take(~moving & live)
    hidden = np.zeros_like(changes)
    hidden[still.pixel[_always_hidden(plan, surface, light, still, reach)]] = True
    hidden[candidates.pixel[always]] = True
    changes &= ~hidden
    return changes


def patch_light_changes(
    plan: Plan, patch: Surface, light: Emitter, pairs: Pairs, reach: Array
) -> Mask:
    """Whether the light on surfaces of unknown shape may change during the shutter: (n,).

    Parameters
    ----------
    patch : centres of balls that hold the surfaces. Their normals are 0, so that no light is below
        their horizon.  reach : (n,) radii of the balls, metres.
    pairs : candidate occluders that hold for the whole balls.
    """
    changes = np.zeros(patch.item.size, dtype=np.bool_)
    if light.displacement is not None:
        changes[:] = True
        return changes
    candidates = pairs.take(plan.moves[pairs.item])
    touched = _may_shadow(plan, patch, light, candidates, reach)
    changes[candidates.pixel[touched]] = True
    return changes


def _always_hidden(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, reach: Array
) -> Mask:
    """Whether an occluder hides all of the light at both ends of the shutter, so at all times.

    The centres at which a sphere blocks a fixed ray fill a convex cylinder, and the points that a
    fixed sphere hides fill a convex cone, so both ends decide; a quad's edge functions are linear
    in time. All points within reach are covered if a sphere smaller by the reach hides the light,
    or if the edge functions of a quad are larger than their change within the reach.
    """
    ends = [classify_occluders(plan, surface, light, pairs, time)[1] for time in SHUTTER_ENDS]
    always = ends[0] & ends[1]
    for kind, part in ((True, _spheres_hide_from_patch), (False, _quads_hide_from_patch)):
        wide = always & (reach[pairs.pixel] > 0.0) & ((pairs.item < plan.sphere_count) == kind)
        rows = wide.nonzero()[0]
        if rows.size:
            chosen = pairs.take(rows)
            for time in SHUTTER_ENDS:
                always[rows] &= part(plan, surface, light, chosen, time, reach[chosen.pixel])
    return always


def _spheres_hide_from_patch(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, time: float, reach: Array
) -> Mask:
    """Whether spheres hide all of a light from all points within reach: (m,)."""
    point = columns(surface.point, pairs.pixel)
    r = plan.spheres.radius[pairs.item] - reach
    v = plan.spheres.moved(pairs.item, time) - point
    cone = light.view_cone(light.to_center(point, time))
    _, cover, tangent = cone_overlap(cone.axis, cone.cosine, cone.sine, v, r)
    hides: Mask = cover & (r > 0.0) & (tangent + reach <= cone.near)
    return hides


def _quads_hide_from_patch(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, time: float, reach: Array
) -> Mask:
    """Whether quads hide all of a light from all points within reach: (m,).

    For a fixed point of the light, each edge function is linear in the surface point.
    """
    ids = pairs.item - plan.sphere_count
    u, v = columns(plan.quads.edge_u, ids), columns(plan.quads.edge_v, ids)
    point = columns(surface.point, pairs.pixel)
    q = plan.quads.corners_at(ids, time) - point
    planes, normal, height = edge_planes(q, u, v)
    to = light.to_center(point, time)
    hides: Mask = height > reach * _length(normal)
    hides &= dot(to, normal) - height > light.extent(normal)
    for plane, corner, edge in zip(planes, (q, q, q + u, q + v), (v, u, v, u), strict=True):
        shift = reach * (_length(cross(to - corner, edge)) + light.radius * _length(edge))
        hides &= dot(to, plane) - light.extent(plane) > shift
    return hides


def _changes_of_moving_light(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, reach: Array, bend: Array
) -> Mask:
    """Whether the light of a moving light may change: (n,). `pairs` are occluders at rest."""
    dark = [
        classify_horizon(light, light.to_center(surface.point, time), surface, reach, bend)[0]
        for time in SHUTTER_ENDS
    ]
    changes = ~(dark[0] & dark[1])
    always = _always_hidden(plan, surface, light, pairs, reach)
    changes[pairs.pixel[always]] = False
    return changes


def _may_shadow(plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, reach: Array) -> Mask:
    """Whether moving occluders may hide some of a light at rest at some time: (m,)."""
    touched = np.zeros(pairs.item.size, dtype=np.bool_)
    ball = pairs.item < plan.sphere_count
    for rows, part in (
        (ball.nonzero()[0], _moving_spheres_may_shadow),
        ((~ball).nonzero()[0], _moving_quads_may_shadow),
    ):
        if rows.size:
            chosen = pairs.take(rows)
            touched[rows] = part(plan, surface, light, chosen, reach[chosen.pixel])
    return touched


def _moving_spheres_may_shadow(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, reach: Array
) -> Mask:
    """Whether a sphere's sweep may intersect the convex hull of a point's patch and a light: (m,).

    A segment to any point of the light is, at the fraction s of its length, within s * radius of
    the segment to its centre. So the sphere is enlarged by that and its sweep tested as a capsule.
    """
    spheres = plan.spheres
    assert spheres.displacement is not None
    d = columns(spheres.displacement, pairs.item)
    point = columns(surface.point, pairs.pixel)
    v = columns(spheres.center, pairs.item) - point
    r = spheres.radius[pairs.item]
    w = light.to_center(point)
    ww = np.maximum(dot(w, w), TINY)
    at = [dot(v + t * d, w) for t in SHUTTER_ENDS]
    latest = np.clip((np.maximum(at[0], at[1]) + r * np.sqrt(ww)) / ww, 0.0, 1.0)
    wide = r + reach + latest * light.radius
    gap = _segment_distance(v - 0.5 * d, d, w)
    scale = light.distance_or(np.sqrt(ww), _length(v) + _length(d))
    slack = SEGMENT_DISTANCE_ROUNDING * (wide + scale)
    touched: Mask = gap <= wide + slack
    return touched


SEGMENT_DISTANCE_ROUNDING = 2.0**-44
"""Generous bound on the relative rounding error of a distance between segments."""


def _segment_distance(start: Array, along: Array, w: Array) -> Array:
    """Distance of the segments start + t along and s w, 0 <= s, t <= 1 (Ericson 2005, 5.1.9)."""
    a, e, f = dot(along, along), dot(w, w), dot(w, start)
    c, b = dot(along, start), dot(along, w)
    denominator = a * e - b * b
    parallel = denominator <= SEGMENT_DISTANCE_ROUNDING * a * e
    t = np.where(
        parallel, 0.0, np.clip((b * f - c * e) / np.where(parallel, 1.0, denominator), 0, 1)
    )
    s = (b * t + f) / np.maximum(e, TINY)
    clipped = np.clip(s, 0.0, 1.0)
    # where s was clipped, t is that of the closest point to that end
    t = np.where(s != clipped, np.clip((b * clipped - c) / np.maximum(a, TINY), 0.0, 1.0), t)
    best = _length(start + t * along - clipped * w)
    # for nearly parallel segments, an end of one is among the closest points
    for fixed in (0.0, 1.0):
        s = np.clip(dot(w, start + fixed * along) / np.maximum(e, TINY), 0.0, 1.0)
        best = np.minimum(best, _length(start + fixed * along - s * w))
        t = np.clip((fixed * b - c) / np.maximum(a, TINY), 0.0, 1.0)
        best = np.minimum(best, _length(start + t * along - fixed * w))
    return best


def _length(vector: Array) -> Array:
    length: Array = np.sqrt(dot(vector, vector))
    return length


def _moving_quads_may_shadow(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, reach: Array
) -> Mask:
    """Whether a moving quad may intersect some segment from a point's patch to the light: (m,).

    The maximum of an edge function over the light is convex in time, so its values at both ends of
    the shutter bound it between them. The times at which all four may be positive must overlap.
    """
    quads = plan.quads
    assert quads.displacement is not None
    ids = pairs.item - plan.sphere_count
    u, v, d = (
        columns(quads.edge_u, ids),
        columns(quads.edge_v, ids),
        columns(quads.displacement, ids),
    )
    point = columns(surface.point, pairs.pixel)
    q = columns(quads.corner, ids) - point
    to = light.to_center(point)
    normal = cross(u, v)
    size = _length(normal)
    sides = [dot(q + t * d, normal) for t in SHUTTER_ENDS]
    crosses = sides[0] * sides[1] <= reach * reach * size * size
    first, last = np.full(ids.size, -0.5), np.full(ids.size, 0.5)
    edges = (v, u, v, u)
    for k in range(4):
        values = []
        for t in SHUTTER_ENDS:
            place = q + t * d
            planes, _, _ = edge_planes(place, u, v)
            widen = reach * (
                _length(cross(to - place, edges[k])) + light.radius * _length(edges[k])
            )
            if k > 1:
                widen = widen + reach * size
            values.append(dot(to, planes[k]) + light.extent(planes[k]) + widen)
        first, last = clip_positive(first, last, values[0], values[1])
    side = np.where(sides[0] < 0.0, -1.0, 1.0)
    across = side * dot(to, normal) + light.radius * size + reach * size
    between = across > np.minimum(np.abs(sides[0]), np.abs(sides[1]))
    touched: Mask = crosses | ((first <= last) & between)
    return touched
