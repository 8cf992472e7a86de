# SPDX-License-Identifier: GPL-3.0-or-later
"""Detection over the pixel for light: may a shadow edge sharper than a pixel cross it?

It may if one occluder can hide all of a light from one point of the pixel's footprint (the patch of
surface that it shows) and nothing from another. Shadow edges of point lights are always that sharp,
those of area lights near contact. A wide penumbra is smooth over a pixel and needs no distribution.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..geometry.footprint import Footprint
from ..geometry.polygon.kernels import edge_planes
from ..geometry.sphere.kernels import cone_overlap, discriminant, discriminant_rounding
from ..lights.bounds import LinearSpan
from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Mask
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.jet import Jet
from ..numerics.taylor_range import rectangle_range
from ..numerics.vector import cross, dot
from ..parallel.call_progress import report_progress
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface, cache_sized_chunks
from .pixel_footprint import make_footprint

__all__ = ["detect_shadow_edges", "detect_steep_irradiance", "patch_reach"]


_OccluderTest: TypeAlias = Callable[[Plan, Surface, Emitter, Pairs, Array, Footprint | None], Mask]
"""Whether occluders of one kind of shape may cast a sharp shadow edge: see `_sharp_by_sphere`."""


def patch_reach(plan: Plan, surface: Surface, w: Array) -> Array:
    """Bound on the distance of a pixel's patch of surface from its centre: (n,) metres.

    A step of the ray's direction moves the hit by t |step| / cos, cos the least cosine within the
    pixel. Where there is no bound, the distance to the camera is returned.

    Parameters
    ----------
    surface : hits of the centre rays.  w : (3, n) their directions.
    """
    h = plan.lens.half_pixel
    length = np.sqrt(dot(w, w))
    t = np.sqrt(dot(surface.point, surface.point)) / length
    cosine = np.abs(dot(w, surface.normal)) / length
    # the direction turns by at most h / |w|
    turn = h / np.maximum(length - h, 0.5 * length)
    least = np.zeros(length.size)
    for shapes, rows, index in plan.shapes.groups(surface.item):
        least[rows] = shapes.least_cosine(index, cosine[rows], turn[rows])
    # a patch that is seen edge-on or contains the camera has no bound
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        reach = t * h * (1.0 + turn) / np.maximum(least, 0.0)
        # t is larger in the parts of the patch that are farther away
        reach = reach / np.maximum(1.0 - reach / np.maximum(t * length, TINY), 0.0)
    return np.where(np.isfinite(reach), reach, np.sqrt(dot(surface.point, surface.point)))


MAX_PATCH_TO_DISTANCE = 0.25
"""Largest reach of a patch over which irradiance is not steep, as a fraction of its distance to the
light. Over a quarter of the distance the irradiance may change by half."""
MAX_DISTANCE_CHANGE = 0.1
"""Largest change, either way, of the distance to a light over a footprint, as a fraction of it.
On a plane irradiance falls with the cube of the distance: by 0.45 over that range."""


def detect_steep_irradiance(
    light: Emitter,
    surface: Surface,
    reach: Array,
    plan: Plan | None = None,
    time: float | None = None,
) -> Mask:
    """Find the pixels over which irradiance is steep because the light is near: (n,) bool.

    Parameters
    ----------
    surface : n hits of centre rays.  reach : (n,) of `patch_reach`.
    plan : given where the patches are those of single pixels; their footprints are then used too.
    time : shutter time; None for the middle.
    """
    away, distance = light.falloff_offset(surface.point, time)
    steep: Mask = reach > MAX_PATCH_TO_DISTANCE * distance
    rows = steep.nonzero()[0]
    if plan is None or plan.settings.order == 1 or not rows.size:
        return steep
    length = np.sqrt(dot(away, away))[rows]
    axis = columns(away, rows) / np.maximum(length, TINY)
    patch = make_footprint(plan, surface.take(rows), reach[rows])
    change = patch.change(axis, np.arange(rows.size))
    # bound on the second-order term of the distance; unbounded at the light
    with np.errstate(over="ignore"):
        change += reach[rows] ** 2 / (2.0 * np.maximum(length - reach[rows], TINY))
    steep[rows] = change > MAX_DISTANCE_CHANGE * length
    return steep


def detect_shadow_edges(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, reach: Array
) -> Mask:
    """Find the pixels that a sharp shadow edge may cross at the middle of the shutter: (n,) bool.

    Parameters
    ----------
    surface : n hits of centre rays.  light : as it casts shadows.
    pairs : candidate occluders that hold for the whole patches.  reach : (n,) of `patch_reach`.
    """
    edge = np.zeros(surface.item.size, dtype=np.bool_)
    patch = None
    if plan.settings.order == 2 and pairs.item.size:
        patch = make_footprint(plan, surface, reach)
    ball = pairs.item < plan.sphere_count
    for all_rows, part in (
        (ball.nonzero()[0], _sharp_by_sphere),
        ((~ball).nonzero()[0], _sharp_by_quad),
    ):
        for rows in cache_sized_chunks(all_rows):
            plan.go_on()
            report_progress(rows[0] / pairs.item.size)
            chosen = pairs.take(rows)
            wide = reach[chosen.pixel]
            sharp = part(plan, surface, light, chosen, wide, patch).nonzero()[0]
            if patch is not None and light.extended and sharp.size:
                sharp = sharp[
                    _enough_shadow_lines_cross(
                        part, plan, surface, light, chosen.take(sharp), wide[sharp], patch
                    )
                ]
            edge[chosen.pixel[sharp]] = True
    if patch is not None and not light.extended:
        some = pairs.take(ball & edge[pairs.pixel])
        edge[some.pixel[_hidden_from_patch(plan, surface, light, some, patch)]] = False
    return edge


def _hidden_from_patch(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, patch: Footprint
) -> Mask:
    """Whether a sphere hides a point light from a whole patch, so that no shadow edge is visible.

    All lines from the patch to the light meet the sphere, which contains neither the light nor a
    point of the patch. So its position on those lines relative to both ends cannot change: if it is
    between them at the patch's centre, it is everywhere.
    """
    point = columns(surface.point, pairs.pixel)
    center, r = columns(plan.spheres.center, pairs.item), plan.spheres.radius[pairs.item]
    v, to, gap = center - point, light.to_center(point), light.to_center(center)
    low, _, rounding = _shadow_line_range(to, v, r, patch, pairs.pixel)
    along = dot(to, v)
    hidden: Mask = patch.clear_of(v, r, pairs.pixel) & (low > rounding)
    hidden &= (dot(gap, gap) > r * r) & (along > 0.0) & (along < dot(to, to))
    return hidden


LIGHT_PROBES = ((0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, -0.5))
"""Points of a light, in its half extents, whose shadow lines are tested besides its centre's.
A shadow line is the edge of the shadow that the point would cast as a point light."""
MIN_PROBES_CROSSED = 2
"""Least number of probes whose shadow lines cross a patch in which the visible part of the light
changes by half. The part hidden from one place of the patch and visible from another is then a band
that holds half of the light. It contains the centre, for a half plane without it holds less, and
two of the probes, for a band with only one would be narrower than half of the light."""


def _enough_shadow_lines_cross(
    part: _OccluderTest,
    plan: Plan,
    surface: Surface,
    light: Emitter,
    pairs: Pairs,
    reach: Array,
    patch: Footprint,
) -> Mask:
    """Whether the shadow lines of an area light's centre, and of enough probes, cross a patch.

    If all of a light is visible from one place of a patch and nothing of it from another, the
    shadow lines of all its points cross the patch. So no such patch is missed.
    """
    point = columns(surface.point, pairs.pixel)
    to = light.to_center(point)
    if light.span is not None:
        sides = (light.span.half_u, light.span.half_v)
        odd = np.zeros(pairs.item.size, dtype=np.bool_)
    else:
        sides = _facing_half_extents(plan, light, to, pairs, point)
        odd = _probes_unreliable(plan, light, to, pairs, point, reach)

    def crosses(spot: Emitter, rows: NDArray[np.int64]) -> Mask:
        return part(plan, surface, spot, pairs.take(rows), reach[rows], patch)

    rows = np.arange(pairs.item.size)
    result = crosses(light.as_point(), rows)
    rows = (result & ~odd).nonzero()[0]
    # all probes in one call: few pairs are left, and a call costs more than they do
    u, v = (columns(np.broadcast_to(side, point.shape), rows) for side in sides)
    probes = light.point_at(
        np.concatenate([a * u for a, _ in LIGHT_PROBES], axis=1),
        np.concatenate([b * v for _, b in LIGHT_PROBES], axis=1),
    )
    found = crosses(probes, np.tile(rows, len(LIGHT_PROBES)))
    result[rows] = found.reshape(len(LIGHT_PROBES), -1).sum(axis=0) >= MIN_PROBES_CROSSED
    return result | odd


def _facing_half_extents(
    plan: Plan, light: Emitter, to: Array, pairs: Pairs, point: Array
) -> tuple[Array, Array]:
    """Half extents (3, m) of a round light across the view: to the occluder, and normal to that."""
    far = np.maximum(np.sqrt(dot(to, to)), TINY)
    axis = to / far
    middle = np.concatenate([plan.spheres.center, plan.quads.bounding_spheres[0]], axis=1)
    aside = columns(middle, pairs.item) - point
    aside = aside - dot(aside, axis) * axis
    size = np.sqrt(dot(aside, aside))
    # if the light and the occluder are seen in the same direction, any perpendicular will do
    least = np.abs(axis)
    least = least == least.min(axis=0)
    other = cross(axis, least.astype(np.float64))
    aside = np.where(size > ALIGNMENT_TOLERANCE * far, aside, other)
    first = aside * (light.radius / np.maximum(np.sqrt(dot(aside, aside)), TINY))
    return first, cross(axis, first)


ALIGNMENT_TOLERANCE = 2.0**-40
"""Largest distance from the line to a light, relative to the light's, of an occluder on it."""


def _probes_unreliable(
    plan: Plan, light: Emitter, to: Array, pairs: Pairs, point: Array, reach: Array
) -> Mask:
    """Pairs (m,) for which the probes of a round light of radius R do not prove anything.

    A probe at R / 2 is in the cone in which each place of the patch sees the light if
    R reach / d^2 <= 1. If the occluder is farther than R from the light's centre, it is in front of
    both the probe and the visible points in the same direction, or of neither.
    """
    near = np.maximum(np.sqrt(dot(to, to)) - reach, 0.0)
    odd: Mask = light.radius * reach > near * near
    ball = pairs.item < plan.sphere_count
    rows = ball.nonzero()[0]
    gap = light.to_center(columns(plan.spheres.center, pairs.item[rows]))
    odd[rows] |= np.sqrt(dot(gap, gap)) <= plan.spheres.radius[pairs.item[rows]] + light.radius
    rows = (~ball).nonzero()[0]
    ids = pairs.item[rows] - plan.sphere_count
    normal = cross(columns(plan.quads.edge_u, ids), columns(plan.quads.edge_v, ids))
    height = dot(light.to_center(columns(plan.quads.corner, ids)), normal)
    odd[rows] |= np.abs(height) <= light.radius * np.sqrt(dot(normal, normal))
    return odd


def _sharp_by_sphere(
    plan: Plan,
    surface: Surface,
    light: Emitter,
    pairs: Pairs,
    reach: Array,
    patch: Footprint | None,
) -> Mask:
    """Whether spheres may hide all of a light from one point of a patch and nothing from another.

    The sphere smaller by the reach must hide nothing of the light's centre or cone, and the one
    larger by the reach all of it. A point light's shadow line is a conic and is decided exactly.
    """
    point = columns(surface.point, pairs.pixel)
    v = columns(plan.spheres.center, pairs.item) - point
    r = plan.spheres.radius[pairs.item]
    small, large = np.maximum(r - reach, 0.0), r + reach
    vv = dot(v, v)
    to = light.to_center(point)
    cone, line = light.view_cone(to), light.as_point().view_cone(to)
    sharp = np.ones(r.size, dtype=np.bool_)
    for test in (line, cone) if light.fills_cone else (line,):
        touch, _, _ = cone_overlap(test.axis, test.cosine, test.sine, v, small)
        _, cover, _ = cone_overlap(test.axis, test.cosine, test.sine, v, large)
        # within reach of the surface itself anything may be hidden
        sharp &= (~touch | (small == 0.0)) & (cover | (vv <= large * large))
        if plan.settings.order == 1:
            break
    sharp &= np.sqrt(vv) - large < cone.far
    # the inner side of a sphere that holds point and light casts no shadow between them
    gap = light.to_center(columns(plan.spheres.center, pairs.item))
    sharp &= ~((vv < small * small) & (np.sqrt(dot(gap, gap)) + light.radius <= r))
    sharp &= pairs.item != surface.item[pairs.pixel]
    if patch is not None and not light.extended:
        rows = (sharp & np.isfinite(patch.off[pairs.pixel])).nonzero()[0]
        rows = rows[patch.clear_of(columns(v, rows), r[rows], pairs.pixel[rows])]
        if rows.size:
            sharp[rows] = _shadow_line_crosses(
                columns(to, rows), columns(v, rows), r[rows], patch, pairs.pixel[rows]
            )
    if light.span is not None and plan.settings.order == 2:
        rows = (sharp & (vv > large * large)).nonzero()[0]
        if rows.size:
            seen = light.span, light.radius, columns(to, rows), columns(v, rows)
            high = _discriminant_range(*seen, small[rows])[1]
            low = _discriminant_range(*seen, large[rows])[0]
            sharp[rows] = ((high <= 0.0) | (small[rows] == 0.0)) & (low >= 0.0)
    return sharp


def _shadow_line_crosses(
    to: Array, v: Array, r: Array, patch: Footprint, at: NDArray[np.int64]
) -> Mask:
    """Whether D(L - p, C - p) may change its sign in a patch: see `_shadow_line_range`."""
    low, high, rounding = _shadow_line_range(to, v, r, patch, at)
    crosses: Mask = (high >= -rounding) & (low <= rounding)
    return crosses


def _shadow_line_range(
    to: Array, v: Array, r: Array, patch: Footprint, at: NDArray[np.int64]
) -> tuple[Array, Array, Array]:
    """Bounds of D(L - p, C - p), a quadratic in p, for p in patches, and its rounding: (m,) each.

    D is the discriminant of the line from p to a point light L and a sphere of centre C. `to` and v
    (3, m) lead from the patches' centres to L and C.
    """
    steps = tuple(-columns(step, at) for step in patch.steps)
    wide = sum(np.sqrt(dot(step, step)) for step in steps) + patch.off[at]
    far, away = np.sqrt(dot(to, to)) + wide, np.sqrt(dot(v, v)) + wide
    rounding = discriminant_rounding(far * far, away * away, r, far * away)
    ray, ball = Jet.linear(to, steps, 2), Jet.linear(v, steps, 2)
    high = rectangle_range(discriminant(ray, ball, r + patch.off[at]), 1.0, 1.0)[1]
    low = rectangle_range(discriminant(ray, ball, np.maximum(r - patch.off[at], 0.0)), 1.0, 1.0)[0]
    return low, high, rounding


def _discriminant_range(
    span: LinearSpan, radius: float, to: Array, v: Array, r: Array
) -> tuple[Array, Array]:
    """Range (m,) of the discriminant over a light of a linear span and of a given radius.

    It is narrowed by its rounding at both ends.
    """
    d = discriminant(Jet.linear(to, (span.half_u, span.half_v), 2), v, r)
    low, high = rectangle_range(d, 1.0, 1.0)
    far, away, side = np.sqrt(dot(to, to)) + radius, np.sqrt(dot(v, v)), cross(to, v)
    miss = np.sqrt(dot(side, side)) + radius * away
    rounding = discriminant_rounding(far * far, away * away, r, miss)
    return low + rounding, high - rounding


def _sharp_by_quad(
    plan: Plan,
    surface: Surface,
    light: Emitter,
    pairs: Pairs,
    reach: Array,
    patch: Footprint | None,
) -> Mask:
    """`_sharp_by_sphere` for quads, whose edge functions are linear in the light and the point."""
    ids = pairs.item - plan.sphere_count
    u, v = columns(plan.quads.edge_u, ids), columns(plan.quads.edge_v, ids)
    point = columns(surface.point, pairs.pixel)
    q = columns(plan.quads.corner, ids) - point
    planes, normal, height = edge_planes(q, u, v)
    to = light.to_center(point)
    may_miss = np.zeros(ids.size, dtype=np.bool_)
    may_cover = np.ones(ids.size, dtype=np.bool_)
    may_cover_behind = np.ones(ids.size, dtype=np.bool_)
    corners, edges = (q, q, q + u, q + v), (v, u, v, u)
    for plane, corner, edge in zip(planes, corners, edges, strict=True):
        away = cross(to - corner, edge)
        shift = reach * (np.sqrt(dot(away, away)) + light.radius * np.sqrt(dot(edge, edge)))
        if patch is not None and not light.extended:
            shift = np.minimum(shift, patch.change(away, pairs.pixel))
        value, spread = dot(to, plane), light.extent(plane)
        may_miss |= value + spread - shift <= 0.0
        may_cover &= value - spread + shift >= 0.0
        may_cover_behind &= -value - spread + shift >= 0.0
    size = np.sqrt(dot(normal, normal))
    through = reach * size
    if patch is not None:
        through = np.minimum(through, patch.change(normal, pairs.pixel))
    across, slack = dot(to, normal), light.radius * size + through
    sharp: Mask = may_cover & may_miss & (across + slack > height)
    # the patch may cross the quad's plane: on the other side all signs are reversed
    near = height <= through
    either = may_cover & (across + slack > -height)
    behind = may_cover_behind & (slack - across > -height)
    sharp |= near & (either | behind)
    return sharp
