# SPDX-License-Identifier: GPL-3.0-or-later
"""Detection over the pixel for light: does a shadow's edge, sharper than a pixel, run through it?

That is the case where some point of the pixel's patch of surface may see all of the light and
another none of it, because of one occluder. Points' shadows are always that sharp; an area light's
are near contact. A wide penumbra is smooth over a pixel and needs no rays distributed in it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..geometry.parallelogram import edge_planes
from ..geometry.sphere import cone_touch, discriminant, discriminant_rounding
from ..lights.emitter import POINT, QUAD, Emitter, view_cone
from ..numerics.arrays import Array, Mask
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.jet import Jet
from ..numerics.taylor_range import rectangle_range
from ..numerics.vector import cross, dot
from ..parallel.call_progress import tell
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface, in_cache
from .edges import half_pixel
from .pixel_bounds import Footprint, make_footprint

__all__ = ["detect_shadow_edges", "detect_steep_light", "patch_reach"]


_Part: TypeAlias = Callable[[Plan, Surface, Emitter, Pairs, Array, Footprint | None], Mask]
"""The test by occluders of one kind: see `_by_sphere`."""


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
    ball = (surface.item < plan.sphere_count).nonzero()[0]
    if ball.size:
        r = plan.spheres.radius[surface.item[ball]]
        v = columns(plan.spheres.center, surface.item[ball])
        # cos^2 = 1 - (distance of the line from the centre / r)^2
        shift = np.sqrt(dot(v, v)) * turn[ball] / r
        sine = np.sqrt(np.maximum(1.0 - cosine[ball] ** 2, 0.0)) + shift
        least[ball] = np.sqrt(np.maximum(1.0 - sine * sine, 0.0))
    # a patch seen edge-on has no bound, nor has one that the camera lies in
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        reach = t * h * (1.0 + turn) / np.maximum(least, 0.0)
        # farther away within the patch a step counts for more
        reach = reach / np.maximum(1.0 - reach / np.maximum(t * length, TINY), 0.0)
    return np.where(np.isfinite(reach), reach, np.sqrt(dot(surface.point, surface.point)))


LARGEST_PATCH = 0.25
"""Of the distance to a light: a wider patch of surface sees it from too many sides to be one point
(over a quarter of the distance its irradiance may change by half)."""
LARGEST_CHANGE = 0.1
"""Of the distance, either way: on a plane irradiance falls with its cube, by 0.45 over that."""


def detect_steep_light(
    light: Emitter, surface: Surface, reach: Array, plan: Plan | None = None
) -> Mask:
    """Find the pixels over which the light changes steeply, because it is so near: (n,).

    Parameters
    ----------
    surface : n hits of centre rays.  reach : (n,) of `patch_reach`.
    plan : where the patches are single pixels, to look at their shapes too.
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
    rows = steep.nonzero()[0]
    if plan is None or plan.settings.order == 1 or not rows.size:
        return steep
    # a sphere's light falls off from its centre
    length = np.sqrt(dot(away, away))[rows]
    axis = columns(away, rows) / np.maximum(length, TINY)
    patch = make_footprint(plan, surface.take(rows), reach[rows])
    change = patch.change(axis, np.arange(rows.size))
    # the distance bends away from its slope by no more than this, without bound at the light
    with np.errstate(over="ignore"):
        change += reach[rows] ** 2 / (2.0 * np.maximum(length - reach[rows], TINY))
    steep[rows] = change > LARGEST_CHANGE * length
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
    if plan.settings.order == 2 and pairs.item.size:
        patch = make_footprint(plan, surface, reach)
    ball = pairs.item < plan.sphere_count
    for all_rows, part in ((ball.nonzero()[0], _by_sphere), ((~ball).nonzero()[0], _by_quad)):
        for rows in in_cache(all_rows):
            plan.go_on()
            tell(rows[0] / pairs.item.size)
            chosen = pairs.take(rows)
            wide = reach[chosen.pixel]
            sharp = part(plan, surface, light, chosen, wide, patch).nonzero()[0]
            if patch is not None and light.kind != POINT and sharp.size:
                sharp = sharp[
                    _most_crosses(
                        part, plan, surface, light, chosen.take(sharp), wide[sharp], patch
                    )
                ]
            edge[chosen.pixel[sharp]] = True
    if patch is not None and light.kind == POINT:
        some = pairs.take(ball & edge[pairs.pixel])
        edge[some.pixel[_hidden(plan, surface, light, some, patch)]] = False
    return edge


def _hidden(plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, patch: Footprint) -> Mask:
    """Whether a sphere hides a point light from all of a patch: no other's edge is seen there.

    All lines to the light meet it, and it holds neither the light nor any of the patch. So between
    any two places of the patch it is on the same side of them and of the light: where it is
    between at the centre, it always is.
    """
    point = columns(surface.point, pairs.pixel)
    center, r = columns(plan.spheres.center, pairs.item), plan.spheres.radius[pairs.item]
    v, to, gap = center - point, light.center - point, center - light.center
    low, _, rounding = _line_range(to, v, r, patch, pairs.pixel)
    along = dot(to, v)
    hidden: Mask = patch.clear_of(v, r, pairs.pixel) & (low > rounding)
    hidden &= (dot(gap, gap) > r * r) & (along > 0.0) & (along < dot(to, to))
    return hidden


PROBES = ((0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, -0.5))
"""Places on a light besides its centre, in its half extents, whose shadow lines are followed."""
FEWEST = 2
"""Of the probes: so many have their shadow lines in a patch in which the seen part of the light
changes by half. What is hidden in one place of the patch and seen in another is then a band across
the light that holds half of it. It holds the centre: a half plane without it holds less. And it
holds two of the probes: one that held but one would be narrower than half of the light."""


def _most_crosses(
    part: _Part,
    plan: Plan,
    surface: Surface,
    light: Emitter,
    pairs: Pairs,
    reach: Array,
    patch: Footprint,
) -> Mask:
    """Whether the shadow lines of an area light's centre, and of enough probes, cross a patch.

    Where one place of a patch sees all of a light and another none of it, it is so for every point
    of the light: all their shadow lines cross it. So no such patch is left out.
    """
    point = columns(surface.point, pairs.pixel)
    to = light.center - point
    if light.kind == QUAD:
        sides = (light.half_u, light.half_v)
        odd = np.zeros(pairs.item.size, dtype=np.bool_)
    else:
        sides = _across(plan, light, to, pairs, point)
        odd = _odd_disk(plan, light, to, pairs, point, reach)

    def crosses(place: Array, rows: NDArray[np.int64]) -> Mask:
        spot = replace(light.pinpoint(), center=place)
        return part(plan, surface, spot, pairs.take(rows), reach[rows], patch)

    rows = np.arange(pairs.item.size)
    result = crosses(np.broadcast_to(light.center, point.shape), rows)
    rows = (result & ~odd).nonzero()[0]
    # all probes at once: what crosses a line is few, and many calls
    u, v = (columns(np.broadcast_to(side, point.shape), rows) for side in sides)
    probes = [light.center + a * u + b * v for a, b in PROBES]
    found = crosses(np.concatenate(probes, axis=1), np.tile(rows, len(PROBES)))
    result[rows] = found.reshape(len(PROBES), -1).sum(axis=0) >= FEWEST
    return result | odd


def _across(
    plan: Plan, light: Emitter, to: Array, pairs: Pairs, point: Array
) -> tuple[Array, Array]:
    """Half extents (3, m) of a round light across the view: towards the occluder, and beside."""
    far = np.maximum(np.sqrt(dot(to, to)), TINY)
    axis = to / far
    middle = np.concatenate([plan.spheres.center, plan.quads.bounds[0]], axis=1)
    aside = columns(middle, pairs.item) - point
    aside = aside - dot(aside, axis) * axis
    size = np.sqrt(dot(aside, aside))
    # seen in one direction, any will do
    least = np.abs(axis)
    least = least == least.min(axis=0)
    other = cross(axis, least.astype(np.float64))
    aside = np.where(size > ALIGNED * far, aside, other)
    first = aside * (light.radius / np.maximum(np.sqrt(dot(aside, aside)), TINY))
    return first, cross(axis, first)


ALIGNED = 2.0**-40
"""Of the distance: an occluder's middle no farther off the line to a light is on it."""


def _odd_disk(
    plan: Plan, light: Emitter, to: Array, pairs: Pairs, point: Array, reach: Array
) -> Mask:
    """Pairs (m,) for which a probe of a round light may not stand for what is seen of it.

    A probe at half the radius lies in the cone in which a place of the patch sees the light, if
    R reach / d^2 <= 1 for all of them; where the occluder comes no nearer than R to the light's
    centre, it lies before both the probe and what is seen behind or before it, or before neither.
    """
    near = np.maximum(np.sqrt(dot(to, to)) - reach, 0.0)
    odd: Mask = light.radius * reach > near * near
    ball = pairs.item < plan.sphere_count
    rows = ball.nonzero()[0]
    gap = light.center - columns(plan.spheres.center, pairs.item[rows])
    odd[rows] |= np.sqrt(dot(gap, gap)) <= plan.spheres.radius[pairs.item[rows]] + light.radius
    rows = (~ball).nonzero()[0]
    ids = pairs.item[rows] - plan.sphere_count
    normal = cross(columns(plan.quads.edge_u, ids), columns(plan.quads.edge_v, ids))
    height = dot(light.center - columns(plan.quads.corner, ids), normal)
    odd[rows] |= np.abs(height) <= light.radius * np.sqrt(dot(normal, normal))
    return odd


def _by_sphere(
    plan: Plan,
    surface: Surface,
    light: Emitter,
    pairs: Pairs,
    reach: Array,
    patch: Footprint | None,
) -> Mask:
    """None of it hidden with the radius less the reach, all of it with the reach added.

    Of a point light the shadow's line on the patch is a conic, and decided exactly.
    """
    point = columns(surface.point, pairs.pixel)
    v = columns(plan.spheres.center, pairs.item) - point
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
    gap = light.center - columns(plan.spheres.center, pairs.item)
    sharp &= ~((vv < small * small) & (np.sqrt(dot(gap, gap)) + light.radius <= r))
    sharp &= pairs.item != surface.item[pairs.pixel]
    if patch is not None and light.kind == POINT:
        rows = (sharp & np.isfinite(patch.off[pairs.pixel])).nonzero()[0]
        rows = rows[patch.clear_of(columns(v, rows), r[rows], pairs.pixel[rows])]
        if rows.size:
            to = columns(np.broadcast_to(light.center, point.shape), rows) - columns(point, rows)
            sharp[rows] = _line_crosses(to, columns(v, rows), r[rows], patch, pairs.pixel[rows])
    if light.kind == QUAD and plan.settings.order == 2:
        rows = (sharp & (vv > large * large)).nonzero()[0]
        if rows.size:
            to = light.center - columns(point, rows)
            high = _range(light, to, columns(v, rows), small[rows])[1]
            low = _range(light, to, columns(v, rows), large[rows])[0]
            sharp[rows] = ((high <= 0.0) | (small[rows] == 0.0)) & (low >= 0.0)
    return sharp


def _line_crosses(to: Array, v: Array, r: Array, patch: Footprint, at: NDArray[np.int64]) -> Mask:
    """Whether D(L - p, C - p) may change its sign for p in a patch: see `_line_range`."""
    low, high, rounding = _line_range(to, v, r, patch, at)
    crosses: Mask = (high >= -rounding) & (low <= rounding)
    return crosses


def _line_range(
    to: Array, v: Array, r: Array, patch: Footprint, at: NDArray[np.int64]
) -> tuple[Array, Array, Array]:
    """Range of D(L - p, C - p), a quadratic in p, for p in patches, and its rounding: (m,) each.

    `to` and v (3, m) lead from the patches' centres to L and C.
    """
    steps = tuple(-columns(step, at) for step in patch.steps)
    wide = sum(np.sqrt(dot(step, step)) for step in steps) + patch.off[at]
    far, away = np.sqrt(dot(to, to)) + wide, np.sqrt(dot(v, v)) + wide
    rounding = discriminant_rounding(far * far, away * away, r, far * away)
    ray, ball = Jet.linear(to, steps, 2), Jet.linear(v, steps, 2)
    high = rectangle_range(discriminant(ray, ball, r + patch.off[at]), 1.0, 1.0)[1]
    low = rectangle_range(discriminant(ray, ball, np.maximum(r - patch.off[at], 0.0)), 1.0, 1.0)[0]
    return low, high, rounding


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
    patch: Footprint | None,
) -> Mask:
    """By the edge functions: each is linear in the light and, for a fixed light, in the point."""
    ids = pairs.item - plan.sphere_count
    u, v = columns(plan.quads.edge_u, ids), columns(plan.quads.edge_v, ids)
    point = columns(surface.point, pairs.pixel)
    q = columns(plan.quads.corner, ids) - point
    planes, normal, height = edge_planes(q, u, v)
    to = light.center - point
    may_miss = np.zeros(ids.size, dtype=np.bool_)
    may_cover = np.ones(ids.size, dtype=np.bool_)
    may_cover_behind = np.ones(ids.size, dtype=np.bool_)
    corners, edges = (q, q, q + u, q + v), (v, u, v, u)
    for plane, corner, edge in zip(planes, corners, edges, strict=True):
        away = cross(to - corner, edge)
        shift = reach * (np.sqrt(dot(away, away)) + light.radius * np.sqrt(dot(edge, edge)))
        if patch is not None and light.kind == POINT:
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
    through = reach * size
    if patch is not None:
        through = np.minimum(through, patch.change(normal, pairs.pixel))
    across, slack = dot(to, normal), light.radius * size + through
    sharp: Mask = may_cover & may_miss & (across + slack > height)
    # the patch may reach through the quad's plane: from there all signs are the other way
    near = height <= through
    either = may_cover & (across + slack > -height)
    behind = may_cover_behind & (slack - across > -height)
    sharp |= near & (either | behind)
    return sharp
