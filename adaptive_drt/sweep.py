# SPDX-License-Identifier: GPL-3.0-or-later
"""Detection over the shutter: does what a pixel sees, or the light on it, change with time?

A sphere in straight motion under a fixed ray has a discriminant that is a quadratic in t; a
quad's edge functions are linear in t. Where the domain is wider than time alone (the pixel's
square, a light's area), the objects are widened by what that can add: conservative, never less.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from .bounds import interval_range
from .edge import half_pixel
from .emitter import QUAD, Emitter, view_cone
from .jet import Jet
from .plan import Plan
from .primary import Pairs, Surface
from .quad import edge_planes
from .quadric import cone_touch, discriminant, discriminant_rounding
from .shadow import classify_pairs, contributes, curvature
from .vector import cross, dot

__all__ = ["light_changes", "moves_in_sight", "outlines_pass", "patch_light_changes"]

Array: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]

ENDS = (-0.5, 0.5)
"""Shutter times at which it opens and closes."""


def outlines_pass(
    plan: Plan, count: int, pairs: Pairs, w: Array, depth: Array, clear: Array
) -> tuple[Mask, Mask]:
    """Which pixels a moving object may be seen in at some time.

    Parameters
    ----------
    count : pixels.  pairs : (m) candidates that move.
    w : (3, m) directions through the pixels' centres, per pair.
    depth : (count,) ray parameter of what stands still in front, inf for none.
    clear : (count,) ray parameter up to which nothing that stands still is seen.

    Returns
    -------
    motion : (count,) some such object is seen, and its outline passes or it hits elsewhere.
    outline : (count,) an outline may pass through the pixel's square (only with edges).
    """
    motion = np.zeros(count, dtype=np.bool_)
    outline = np.zeros(count, dtype=np.bool_)
    movers = np.zeros(count, dtype=np.int64)
    ball = pairs.item < plan.sphere_count
    for rows, part in (
        (np.flatnonzero(ball), _sphere_passes),
        (np.flatnonzero(~ball), _quad_passes),
    ):
        if not rows.size:
            continue
        chosen = pairs.take(rows)
        seen, always, near, far, shifts = part(plan, chosen, w[:, rows])
        seen &= near <= depth[chosen.pixel]
        motion[chosen.pixel[seen & (shifts | ~always)]] = True
        # an outline, or the seam where it cuts something that stands still
        outline[chosen.pixel[seen & (~always | (far > clear[chosen.pixel]))]] = True
        movers += np.bincount(chosen.pixel[seen], minlength=count)
    # or where two that move cut each other
    outline |= movers > 1
    if not plan.edges:
        outline[:] = False
    return motion, outline


def _sphere_passes(plan: Plan, pairs: Pairs, w: Array) -> tuple[Mask, Mask, Array, Array, Mask]:
    """Seen at some time; at all times and everywhere; bounds on its ray parameter; it shifts."""
    spheres = plan.spheres
    assert spheres.displacement is not None
    v, d = spheres.center[:, pairs.item], spheres.displacement[:, pairs.item]
    r = spheres.radius[pairs.item]
    ww = dot(w, w)
    v0, v1 = v - 0.5 * d, v + 0.5 * d
    farthest = np.maximum(dot(v0, v0), dot(v1, v1))
    # a line within the pixel passes a point no farther than `widen` from where the centre's does
    widen = np.zeros_like(r)
    if plan.edges:
        h = half_pixel(plan)
        length = np.sqrt(ww)
        widen = np.sqrt(farthest) * (h / np.maximum(length - h, 0.5 * length))
    place = Jet.linear(v, (d,), plan.settings.order)
    remainder = 0.25 * ww * dot(d, d)
    rounding = discriminant_rounding(ww, farthest, r + widen)
    outer = discriminant(w, place, r + widen)
    high = interval_range(outer, 0.5, remainder)[1]
    inner = discriminant(w, place, np.maximum(r - widen, 0.0))
    low = interval_range(inner, 0.5, remainder)[0]
    a0, a1 = dot(w, v0), dot(w, v1)
    length = np.sqrt(ww)
    reach = (r + 2.0 * widen) * length
    ahead = np.maximum(a0, a1) + reach > 0.0
    holds = np.minimum(dot(v0, v0), dot(v1, v1)) < (r + widen) ** 2
    always = (low > rounding) & (np.minimum(a0, a1) > reach) & ~holds
    near = np.maximum(np.minimum(a0, a1) - np.sqrt(np.maximum(high, 0.0)) - widen * length, 0.0)
    near = near / (length + (half_pixel(plan) if plan.edges else 0.0)) ** 2
    seen = (high > -rounding) & ahead
    shortest = np.maximum(length - (half_pixel(plan) if plan.edges else 0.0), 0.5 * length)
    far = np.maximum(a0, a1) - np.sqrt(np.maximum(low, 0.0)) + widen * length
    far = np.where(always, far / (shortest * shortest), np.inf)
    return seen, always, near, far, np.ones_like(seen)


def _quad_passes(plan: Plan, pairs: Pairs, w: Array) -> tuple[Mask, Mask, Array, Array, Mask]:
    """As `_sphere_passes`; edge functions are linear in time where the eye keeps to one side."""
    quads = plan.quads
    assert quads.displacement is not None
    ids = pairs.item - plan.sphere_count
    u, v, d = quads.edge_u[:, ids], quads.edge_v[:, ids], quads.displacement[:, ids]
    ends = [edge_planes(quads.corner[:, ids] + t * d, u, v) for t in ENDS]
    normal = cross(u, v)
    sides = [dot(quads.corner[:, ids] + t * d, normal) for t in ENDS]
    crosses = sides[0] * sides[1] <= 0.0
    first, last = np.full(ids.size, -0.5), np.full(ids.size, 0.5)
    always = ~crosses
    for k in range(4):
        values = []
        for planes, _, _ in ends:
            spread = np.zeros(ids.size)
            if plan.edges:
                for step in (plan.lens.right, plan.lens.up):
                    spread = spread + 0.5 * np.abs(dot(step[:, None], planes[k]))
            value = dot(w, planes[k])
            always &= value - spread > 0.0
            values.append(value + spread)
        first, last = _clip_positive(first, last, values[0], values[1])
    spread = np.zeros(ids.size)
    if plan.edges:
        for step in (plan.lens.right, plan.lens.up):
            spread = spread + 0.5 * np.abs(dot(step[:, None], normal))
    facing = np.abs(dot(w, normal)) + spread
    near = np.minimum(np.abs(sides[0]), np.abs(sides[1])) / np.maximum(facing, TINY)
    least = np.maximum(facing - 2.0 * spread, 0.0)
    with np.errstate(over="ignore"):  # seen edge-on: unbounded
        far = np.maximum(np.abs(sides[0]), np.abs(sides[1])) / np.maximum(least, TINY)
    seen = crosses | (first <= last)
    shifts = dot(d, normal) != 0.0
    return seen, always, np.where(crosses, 0.0, near), far, shifts


TINY = float(np.finfo(np.float64).tiny)
"""Smallest normal float64: keeps a quotient of two zeros finite."""


def _clip_positive(first: Array, last: Array, start: Array, end: Array) -> tuple[Array, Array]:
    """The part of [first, last] where a linear function from `start` to `end` is >= 0.

    The function runs over [-1/2, 1/2].
    """
    slope = end - start
    safe = np.where(slope != 0.0, slope, 1.0)
    root = -0.5 - start / safe
    first = np.where(slope > 0.0, np.maximum(first, root), first)
    last = np.where(slope < 0.0, np.minimum(last, root), last)
    never = (slope == 0.0) & (start < 0.0)
    return np.where(never, np.inf, first), last


def moves_in_sight(plan: Plan, item: NDArray[np.int64]) -> Mask:
    """Which hits lie on objects whose place under a fixed ray changes: (n,), -1 = nothing hit.

    A moving sphere always; a moving quad only where it does not slide within its own plane.
    """
    shifts = plan.moves.copy()
    quads = plan.quads
    if quads.displacement is not None:
        normal = cross(quads.edge_u, quads.edge_v)
        shifts[plan.sphere_count :] &= dot(quads.displacement, normal) != 0.0
    return np.append(shifts, False)[item]


def light_changes(plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, reach: Array) -> Mask:
    """Where the light on points that stand still may change during the shutter.

    Parameters
    ----------
    surface : n points on things that stand still under their ray.
    light : as it casts shadows.  pairs : candidate occluders.
    reach : (n,) metres, the extent of the pixel on the surface (0 without edges).
    """
    moving = plan.moves[pairs.item]
    bend = curvature(plan, surface)
    if light.displacement is not None:
        return _moving_light(plan, surface, light, pairs.take(~moving), reach, bend)
    live = ~contributes(light, light.center, surface, reach, bend)[0][pairs.pixel]
    changes = np.zeros(surface.item.size, dtype=np.bool_)
    candidates = pairs.take(moving & live)
    if not candidates.item.size:
        return changes
    touched = _touched(plan, surface, light, candidates, reach)
    always = _always_full(plan, surface, light, candidates, reach)
    changes[candidates.pixel[touched & ~always]] = True
    # what stands still and hides the light all the time, or a mover that never leaves it
    still = pairs.take(~moving & live)
    hidden = np.zeros_like(changes)
    hidden[still.pixel[_always_full(plan, surface, light, still, reach)]] = True
    hidden[candidates.pixel[always]] = True
    changes &= ~hidden
    return changes


def patch_light_changes(
    plan: Plan, patch: Surface, light: Emitter, pairs: Pairs, reach: Array
) -> Mask:
    """Where the light on patches may change, whatever their shape: (n,), never too few.

    Parameters
    ----------
    patch : balls around surfaces that pixels see in part; normals of 0, so nothing is below
        a horizon.  reach : (n,) their radii, metres.
    pairs : candidate occluders that serve the whole balls.
    """
    changes = np.zeros(patch.item.size, dtype=np.bool_)
    if light.displacement is not None:
        changes[:] = True
        return changes
    candidates = pairs.take(plan.moves[pairs.item])
    touched = _touched(plan, patch, light, candidates, reach)
    changes[candidates.pixel[touched]] = True
    return changes


def _always_full(plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, reach: Array) -> Mask:
    """Whether an occluder hides all of the light at both ends, and so at all times between.

    The centres from which a fixed ray is blocked fill a convex cylinder, and the lights that
    a fixed sphere hides fill a convex cone. That holds for all points within reach if a sphere
    smaller by the reach does it; of quads it is then not said.
    """
    ends = [classify_pairs(plan, surface, light, pairs, time)[1] for time in ENDS]
    always = ends[0] & ends[1]
    wide = np.flatnonzero(always & (reach[pairs.pixel] > 0.0))
    if wide.size:
        part = pairs.take(wide)
        always[wide] = part.item < plan.sphere_count
        wide = wide[always[wide]]
        part = pairs.take(wide)
        for time in ENDS:
            point = surface.point[:, part.pixel]
            r = plan.spheres.radius[part.item] - reach[part.pixel]
            v = plan.spheres.moved(part.item, time) - point
            cone = view_cone(light, light.moved(time), point)
            _, cover, tangent = cone_touch(cone.axis, cone.cosine, cone.sine, v, r)
            always[wide] &= cover & (r > 0.0) & (tangent + reach[part.pixel] <= cone.near)
    return always


def _moving_light(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, reach: Array, bend: Array
) -> Mask:
    dark = [contributes(light, light.moved(time), surface, reach, bend)[0] for time in ENDS]
    changes = ~(dark[0] & dark[1])
    always = _always_full(plan, surface, light, pairs, reach)
    changes[pairs.pixel[always]] = False
    return changes


def _touched(plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, reach: Array) -> Mask:
    touched = np.zeros(pairs.item.size, dtype=np.bool_)
    ball = pairs.item < plan.sphere_count
    for rows, part in (
        (np.flatnonzero(ball), _sphere_touches),
        (np.flatnonzero(~ball), _quad_touches),
    ):
        if rows.size:
            chosen = pairs.take(rows)
            touched[rows] = part(plan, surface, light, chosen, reach[chosen.pixel])
    return touched


def _sphere_touches(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, reach: Array
) -> Mask:
    """Whether the sweep of a sphere meets the hull of a point and a light.

    A segment to any point of the light stays within s * radius of the one to its centre at
    the fraction s of the way, so the sphere is widened by that and tested as a capsule.
    """
    spheres = plan.spheres
    assert spheres.displacement is not None
    d = spheres.displacement[:, pairs.item]
    v = spheres.center[:, pairs.item] - surface.point[:, pairs.pixel]
    r = spheres.radius[pairs.item]
    w = light.center - surface.point[:, pairs.pixel]
    ww = np.maximum(dot(w, w), TINY)
    at = [dot(v + t * d, w) for t in ENDS]
    latest = np.clip((np.maximum(at[0], at[1]) + r * np.sqrt(ww)) / ww, 0.0, 1.0)
    wide = r + reach + latest * light.radius
    gap = _segment_distance(v - 0.5 * d, d, w)
    slack = TOUCH_ROUNDING * (wide + np.sqrt(ww))
    touched: Mask = gap <= wide + slack
    return touched


TOUCH_ROUNDING = 2.0**-44
"""Relative rounding of a distance between segments, counted generously."""


def _segment_distance(start: Array, along: Array, w: Array) -> Array:
    """Distance of the segments start + t along and s w, s and t in 0..1 (Ericson 2005, 5.1.9)."""
    a, e, f = dot(along, along), dot(w, w), dot(w, start)
    c, b = dot(along, start), dot(along, w)
    denominator = a * e - b * b
    parallel = denominator <= TOUCH_ROUNDING * a * e
    t = np.where(
        parallel, 0.0, np.clip((b * f - c * e) / np.where(parallel, 1.0, denominator), 0, 1)
    )
    s = (b * t + f) / np.maximum(e, TINY)
    clipped = np.clip(s, 0.0, 1.0)
    # where s was cut off, t is the foot of that end
    t = np.where(s != clipped, np.clip((b * clipped - c) / np.maximum(a, TINY), 0.0, 1.0), t)
    best = _length(start + t * along - clipped * w)
    # nearly parallel segments: an end of one is as near as it gets
    for fixed in (0.0, 1.0):
        s = np.clip(dot(w, start + fixed * along) / np.maximum(e, TINY), 0.0, 1.0)
        best = np.minimum(best, _length(start + fixed * along - s * w))
        t = np.clip((fixed * b - c) / np.maximum(a, TINY), 0.0, 1.0)
        best = np.minimum(best, _length(start + t * along - fixed * w))
    return best


def _length(vector: Array) -> Array:
    length: Array = np.sqrt(dot(vector, vector))
    return length


def _quad_touches(plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, reach: Array) -> Mask:
    """Whether a moving quad may cut some segment to the light, widened to all its points.

    For each edge function the greatest value over the light at both ends bounds it between them
    (it is convex in time); the times that all four allow must overlap.
    """
    quads = plan.quads
    assert quads.displacement is not None
    ids = pairs.item - plan.sphere_count
    u, v, d = quads.edge_u[:, ids], quads.edge_v[:, ids], quads.displacement[:, ids]
    point = surface.point[:, pairs.pixel]
    q = quads.corner[:, ids] - point
    to = light.center - point
    normal = cross(u, v)
    size = _length(normal)
    sides = [dot(q + t * d, normal) for t in ENDS]
    crosses = sides[0] * sides[1] <= reach * reach * size * size
    first, last = np.full(ids.size, -0.5), np.full(ids.size, 0.5)
    edges = (v, u, v, u)
    for k in range(4):
        values = []
        for t in ENDS:
            place = q + t * d
            planes, _, _ = edge_planes(place, u, v)
            widen = reach * (
                _length(cross(to - place, edges[k])) + light.radius * _length(edges[k])
            )
            if k > 1:
                widen = widen + reach * size
            if light.kind == QUAD:
                spread = np.abs(dot(light.half_u, planes[k])) + np.abs(dot(light.half_v, planes[k]))
            else:
                spread = light.radius * _length(planes[k])
            values.append(dot(to, planes[k]) + spread + widen)
        first, last = _clip_positive(first, last, values[0], values[1])
    side = np.where(sides[0] < 0.0, -1.0, 1.0)
    across = side * dot(to, normal) + light.radius * size + reach * size
    between = across > np.minimum(np.abs(sides[0]), np.abs(sides[1]))
    touched: Mask = crosses | ((first <= last) & between)
    return touched
