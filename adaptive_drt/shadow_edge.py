# SPDX-License-Identifier: GPL-3.0-or-later
"""Detection over the pixel for light: does a shadow's edge, sharper than a pixel, run through it?

That is the case where some point of the pixel's patch of surface may see all of the light and
another none of it, because of one occluder. Points' shadows are always that sharp; an area light's
are near contact. A wide penumbra is smooth over a pixel and needs no rays distributed in it.
"""

from __future__ import annotations

from dataclasses import dataclass
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
from .shadow import curvature
from .vector import cross, dot

__all__ = ["detect_shadow_edges", "detect_steep_light", "patch_reach"]

Array: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]

TINY = float(np.finfo(np.float64).tiny)


def patch_reach(plan: Plan, surface: Surface, w: Array) -> Array:
    """Bound on how far the pixel's patch of surface reaches from its centre: (n,) metres, or inf.

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
    return np.where(np.isfinite(reach), reach, np.inf)


LARGEST_PATCH = 0.25
"""Of the distance to a light: a wider patch of surface sees it from too many sides to be one point
(over a quarter of the distance its irradiance may change by half)."""


FLATTEST = 0.25
"""Of a sphere's radius and the cosine it is seen at: a patch up to so wide is nearly a plane's."""


@dataclass(frozen=True)
class _Footprint:
    """The pixels' patches of surface as parallelograms about their centres.

    Attributes
    ----------
    steps : two (3, n) metres, from the centre to the middles of two sides.
    off : (n,) metres, how far the surface may lie from it; inf where it is no parallelogram.
    """

    steps: tuple[Array, Array]
    off: Array

    def change(self, slope: Array, at: NDArray[np.int64]) -> Array:
        """How far a linear function of the place, of slope (3, m), goes either way: (m,)."""
        along = np.abs(dot(self.steps[0][:, at], slope)) + np.abs(dot(self.steps[1][:, at], slope))
        with np.errstate(invalid="ignore"):  # a slope of 0 over a patch without bound
            wide: Array = along + self.off[at] * np.sqrt(dot(slope, slope))
        return np.where(np.isnan(wide), np.inf, wide)


def _footprint(plan: Plan, surface: Surface) -> _Footprint:
    """Parallelograms that hold the patches: on a plane they are the pixels' images, and sheared.

    The hit of direction w + s lies off w's by t (s - w tau) / (1 + tau), tau = n.s / n.w.
    """
    lens = plan.lens
    across = cross(lens.right, lens.up)[:, None]
    point, normal = surface.point, surface.normal
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # seen edge-on: no bound
        t = dot(point, across) / dot(lens.base[:, None], across)
        w = point / t
        facing = dot(normal, w)
        steps, spread = [], np.zeros(t.size)
        for step in (lens.right[:, None], lens.up[:, None]):
            tau = 0.5 * dot(normal, step) / facing
            spread = spread + np.abs(tau)
            steps.append(t * (0.5 * step - w * tau))
        grow = 1.0 / np.maximum(1.0 - spread, 0.0)
        wide = grow * sum(np.sqrt(dot(step, step)) for step in steps)
        # a sphere falls off its tangent plane by wide^2 / 2 r, seen aslant
        room = np.abs(facing) / np.sqrt(dot(w, w))
        off = 2.0 * wide * wide * curvature(plan, surface) / room
        off = np.where(wide * curvature(plan, surface) < FLATTEST * room, off, np.inf)
        held = np.isfinite(wide)
        off = np.where(held, off, np.inf)
        sides = [np.where(held, step * grow, 0.0) for step in steps]
    return _Footprint((sides[0], sides[1]), off)


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
    patch = None
    if light.kind == POINT and plan.settings.order == 2 and pairs.item.size:
        patch = _footprint(plan, surface)
    ball = pairs.item < plan.sphere_count
    for rows, part in ((np.flatnonzero(ball), _by_sphere), (np.flatnonzero(~ball), _by_quad)):
        if rows.size:
            chosen = pairs.take(rows)
            sharp = part(plan, surface, light, chosen, reach[chosen.pixel], patch)
            edge[chosen.pixel[sharp]] = True
    return edge


def _by_sphere(
    plan: Plan,
    surface: Surface,
    light: Emitter,
    pairs: Pairs,
    reach: Array,
    patch: _Footprint | None,
) -> Mask:
    """None of it hidden with the radius less the reach, all of it with the reach added.

    Of a point light the shadow's line on the patch is a conic, and decided exactly.
    """
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
    if patch is not None:
        rows = np.flatnonzero(sharp & (vv > large * large) & np.isfinite(patch.off[pairs.pixel]))
        if rows.size:
            at = pairs.pixel[rows]
            sharp[rows] = _line_crosses(light, point[:, rows], v[:, rows], r[rows], patch, at)
    if light.kind == QUAD and plan.settings.order == 2:
        rows = np.flatnonzero(sharp & (vv > large * large))
        if rows.size:
            to = light.center - point[:, rows]
            high = _range(light, to, v[:, rows], small[rows])[1]
            low = _range(light, to, v[:, rows], large[rows])[0]
            sharp[rows] = ((high <= 0.0) | (small[rows] == 0.0)) & (low >= 0.0)
    return sharp


def _line_crosses(
    light: Emitter, point: Array, v: Array, r: Array, patch: _Footprint, at: NDArray[np.int64]
) -> Mask:
    """Whether D(L - p, C - p) may change its sign for p in a patch: it is a quadratic in p."""
    steps = tuple(-step[:, at] for step in patch.steps)
    to = light.center - point
    wide = sum(np.sqrt(dot(step, step)) for step in steps) + patch.off[at]
    far, away = np.sqrt(dot(to, to)) + wide, np.sqrt(dot(v, v)) + wide
    rounding = discriminant_rounding(far * far, away * away, r, far * away)
    ray, ball = Jet.linear(to, steps, 2), Jet.linear(v, steps, 2)
    high = rectangle_range(discriminant(ray, ball, r + patch.off[at]), 1.0, 1.0)[1]
    low = rectangle_range(discriminant(ray, ball, np.maximum(r - patch.off[at], 0.0)), 1.0, 1.0)[0]
    crosses: Mask = (high >= -rounding) & (low <= rounding)
    return crosses


def _range(light: Emitter, to: Array, v: Array, r: Array) -> tuple[Array, Array]:
    """Range of the discriminant over a quad light, inwards by its rounding."""
    d = discriminant(Jet.linear(to, (light.half_u, light.half_v), 2), v, r)
    low, high = rectangle_range(d, 1.0, 1.0)
    far, away, side = np.sqrt(dot(to, to)) + light.radius, np.sqrt(dot(v, v)), cross(to, v)
    miss = np.sqrt(dot(side, side)) + light.radius * away
    rounding = discriminant_rounding(far * far, away * away, r, miss)
    return low + rounding, high - rounding


def _by_quad(
    plan: Plan,
    surface: Surface,
    light: Emitter,
    pairs: Pairs,
    reach: Array,
    patch: _Footprint | None,
) -> Mask:
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
        if patch is not None:
            shift = np.minimum(shift, patch.change(away, pairs.pixel))
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
