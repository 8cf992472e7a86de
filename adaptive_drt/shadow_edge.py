# SPDX-License-Identifier: GPL-3.0-or-later
"""Detection over the pixel for light: does a shadow's edge, sharper than a pixel, run through it?

That is the case where some point of the pixel's patch of surface may see all of the light and
another none of it, because of one occluder. Points' shadows are always that sharp; an area light's
are near contact. A wide penumbra is smooth over a pixel and needs no rays distributed in it.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from .bounds import rectangle_range
from .edge import half_pixel
from .emitter import POINT, QUAD, Emitter, view_cone
from .jet import Jet
from .plan import Plan
from .primary import Pairs, Surface
from .quad import edge_planes
from .quadric import cone_touch, discriminant, discriminant_rounding
from .vector import cross, dot

__all__ = ["detect_shadow_edges", "detect_steep_light", "patch_reach"]

Array: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]

TINY = float(np.finfo(np.float64).tiny)


def patch_reach(plan: Plan, surface: Surface, w: Array) -> Array:
    """Bound on how far the pixel's patch of surface reaches from its centre: (n,) metres.

    The hit moves by t |step| / cos for a step of the direction; on a sphere the cosine is the
    least within the pixel, which the discriminant's change bounds.

    Parameters
    ----------
    surface : hits of the centre rays.  w : (3, n) their directions.
    """
    h = half_pixel(plan)
    length = np.sqrt(dot(w, w))
    t = np.sqrt(dot(surface.point, surface.point)) / length
    cosine = np.abs(dot(w, surface.normal)) / length
    # the normal of a plane stays; the direction turns by at most h / |w|
    turn = h / np.maximum(length - h, 0.5 * length)
    least = cosine - turn
    ball = np.flatnonzero(surface.item < plan.sphere_count)
    if ball.size:
        r = plan.spheres.radius[surface.item[ball]]
        v = plan.spheres.center[:, surface.item[ball]]
        # cos^2 = 1 - (distance of the line from the centre / r)^2
        shift = np.sqrt(dot(v, v)) * turn[ball] / r
        sine = np.sqrt(np.maximum(1.0 - cosine[ball] ** 2, 0.0)) + shift
        least[ball] = np.sqrt(np.maximum(1.0 - sine * sine, 0.0))
    with np.errstate(divide="ignore", over="ignore"):  # a patch seen edge-on has no bound
        reach = t * h * (1.0 + turn) / np.maximum(least, 0.0)
        # farther away within the patch a step counts for more
        reach = reach / np.maximum(1.0 - reach / np.maximum(t * length, TINY), 0.0)
    return np.where(np.isfinite(reach), reach, np.sqrt(dot(surface.point, surface.point)))


LARGEST_PATCH = 0.25
"""Of the distance to a light: a wider patch of surface sees it from too many sides to be one point
(over a quarter of the distance its irradiance may change by half)."""


def detect_steep_light(light: Emitter, surface: Surface, reach: Array) -> Mask:
    """Find the pixels over which the light changes steeply, because it is so near: (n,).

    Parameters
    ----------
    surface : n hits of centre rays.  reach : (n,) of `patch_reach`.
    """
    away = surface.point - light.center
    if light.kind == QUAD:
        # the nearest point of a rectangle; of a sheared quad a little farther than the nearest
        for half in (light.half_u, light.half_v):
            part = np.clip(dot(away, half) / dot(half, half), -1.0, 1.0)
            away = away - part * half
        distance = np.sqrt(dot(away, away))
    else:
        distance = np.maximum(np.sqrt(dot(away, away)) - light.radius, 0.0)
    steep: Mask = reach > LARGEST_PATCH * distance
    return steep


def detect_shadow_edges(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, reach: Array
) -> Mask:
    """Find the pixels that a sharp shadow edge may cross at the middle of the shutter.

    Parameters
    ----------
    surface : n hits of centre rays.  light : as it casts shadows.
    pairs : candidate occluders that serve the whole patches.  reach : (n,) of `patch_reach`.
    """
    edge = np.zeros(surface.item.size, dtype=np.bool_)
    ball = pairs.item < plan.sphere_count
    for rows, part in ((np.flatnonzero(ball), _by_sphere), (np.flatnonzero(~ball), _by_quad)):
        if rows.size:
            chosen = pairs.take(rows)
            sharp = part(plan, surface, light, chosen, reach[chosen.pixel])
            edge[chosen.pixel[sharp]] = True
    return edge


def _by_sphere(plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, reach: Array) -> Mask:
    """None of it hidden with the radius less the reach, all of it with the reach added."""
    point = surface.point[:, pairs.pixel]
    v = plan.spheres.center[:, pairs.item] - point
    r = plan.spheres.radius[pairs.item]
    small, large = np.maximum(r - reach, 0.0), r + reach
    vv = dot(v, v)
    cone = view_cone(light, light.center, point)
    line = view_cone(light.pinpoint(), light.center, point)
    sharp = np.ones(r.size, dtype=np.bool_)
    for test in (line,) if light.kind in (QUAD, POINT) else (line, cone):
        touch, _, _ = cone_touch(test.axis, test.cosine, test.sine, v, small)
        _, cover, _ = cone_touch(test.axis, test.cosine, test.sine, v, large)
        # within reach of the surface itself anything may be hidden
        sharp &= (~touch | (small == 0.0)) & (cover | (vv <= large * large))
        if plan.settings.order == 1:
            break
    sharp &= np.sqrt(vv) - large < cone.far
    # the inner side of a sphere that holds point and light casts no shadow between them
    gap = light.center - plan.spheres.center[:, pairs.item]
    sharp &= ~((vv < small * small) & (np.sqrt(dot(gap, gap)) + light.radius <= r))
    sharp &= pairs.item != surface.item[pairs.pixel]
    if light.kind == QUAD and plan.settings.order == 2:
        rows = np.flatnonzero(sharp & (vv > large * large))
        if rows.size:
            to = light.center - point[:, rows]
            high = _range(light, to, v[:, rows], small[rows])[1]
            low = _range(light, to, v[:, rows], large[rows])[0]
            sharp[rows] = ((high <= 0.0) | (small[rows] == 0.0)) & (low >= 0.0)
    return sharp


def _range(light: Emitter, to: Array, v: Array, r: Array) -> tuple[Array, Array]:
    """Range of the discriminant over a quad light, inwards by its rounding."""
    d = discriminant(Jet.linear(to, (light.half_u, light.half_v), 2), v, r)
    low, high = rectangle_range(d, 1.0, 1.0)
    rounding = discriminant_rounding(dot(to, to), dot(v, v), r)
    return low + rounding, high - rounding


def _by_quad(plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, reach: Array) -> Mask:
    """By the edge functions: each is linear in the light and, for a fixed light, in the point."""
    ids = pairs.item - plan.sphere_count
    u, v = plan.quads.edge_u[:, ids], plan.quads.edge_v[:, ids]
    point = surface.point[:, pairs.pixel]
    q = plan.quads.corner[:, ids] - point
    planes, normal, height = edge_planes(q, u, v)
    to = light.center - point
    may_miss = np.zeros(ids.size, dtype=np.bool_)
    may_cover = np.ones(ids.size, dtype=np.bool_)
    may_cover_behind = np.ones(ids.size, dtype=np.bool_)
    corners, edges = (q, q, q + u, q + v), (v, u, v, u)
    for plane, corner, edge in zip(planes, corners, edges, strict=True):
        away = cross(to - corner, edge)
        shift = reach * (np.sqrt(dot(away, away)) + light.radius * np.sqrt(dot(edge, edge)))
        value, spread = dot(to, plane), np.zeros(ids.size)
        if light.kind == QUAD:
            spread = np.abs(dot(light.half_u, plane)) + np.abs(dot(light.half_v, plane))
        elif light.kind != POINT:
            spread = light.radius * np.sqrt(dot(plane, plane))
        may_miss |= value + spread - shift <= 0.0
        may_cover &= value - spread + shift >= 0.0
        may_cover_behind &= -value - spread + shift >= 0.0
    size = np.sqrt(dot(normal, normal))
    across, slack = dot(to, normal), (light.radius + reach) * size
    sharp: Mask = may_cover & may_miss & (across + slack > height)
    # the patch may reach through the quad's plane: from there all signs are the other way
    near = height <= reach * size
    either = may_cover & (across + slack > -height)
    behind = may_cover_behind & (slack - across > -height)
    sharp |= near & (either | behind)
    return sharp
