# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that occluders hide in part, at surface points: which of them count, and how.

An occluder wholly before the light counts by its outline, one that a light's plane cuts by the
part before it. Left to rays are points inside an occluder or a spherical light, and occluders that
reach into one.
"""

from __future__ import annotations

import numpy as np

from ..lights.emitter import QUAD, SPHERE, Emitter, view_cone
from ..lights.emitter_clip import backdrop, ball_polygons, clip_quads
from ..lights.form_factor import CORNERS
from ..lights.occluded_form_factor import RoundOutline, visible_factor
from ..numerics.arrays import Array, Ints
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.low_discrepancy import points
from ..numerics.vector import dot
from ..parallel.call_progress import part_of_call, tell
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface
from .nested_occluders import nested
from .ratio_estimator import gather_light

__all__ = ["hide"]


NESTED = 0.3
"""Of what partly hidden light takes: to find spheres that others hide."""
SHARED_LIGHT_RAYS = 1_024
"""Rays to a light where no closed form is known."""

DROP, BALL, FLAT, CUT, RAYS = range(5)
"""Occluders behind the light; spheres before it; quads; spheres that its plane cuts; the rest."""


def hide(
    plan: Plan,
    surface: Surface,
    light: Emitter,
    pairs: Pairs,
    time: Array | float,
    factor: Array,
) -> None:
    """Take from unblocked factors (n,) what the occluders of `pairs` hide in part, in place."""
    some = np.zeros(factor.size, dtype=np.bool_)
    some[pairs.pixel] = True
    rows = some.nonzero()[0]
    if rows.size:
        part = Pairs((some.cumsum() - 1)[pairs.pixel], pairs.item)
        factor[rows] = _partial(plan, surface.take(rows), light, part, _at(time, rows))


def _at(time: Array | float, rows: Ints) -> Array | float:
    return time[rows] if isinstance(time, np.ndarray) else time


def _partial(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, time: Array | float
) -> Array:
    """Factors (n,) of points each of which has a pair that may hide part of the light."""
    count = surface.item.size
    factor = np.zeros(count)
    kind = _place(plan, surface, light, pairs, _at(time, pairs.pixel))
    rays = np.zeros(count, dtype=np.bool_)
    rays[pairs.pixel[kind == RAYS]] = True
    if light.kind == SPHERE:
        # from within a ball that shines no cone holds it
        to = light.moved(time) - surface.point
        rays |= np.sqrt(dot(to, to)) <= light.radius
    keep = (kind != DROP) & ~rays[pairs.pixel]
    balls = (keep & (kind == BALL)).nonzero()[0]
    with part_of_call(0.0, NESTED):
        keep[balls] = ~nested(plan, surface, pairs.take(balls), _at(time, pairs.pixel[balls]))
    chosen, kind = pairs.take(keep), kind[keep]
    # points with as many occluders of each kind go together
    key = np.zeros(count, dtype=np.int64)
    for each in (BALL, FLAT, CUT):
        number = np.bincount(chosen.pixel[kind == each], minlength=count)
        key = key * (number.max(initial=0) + 1) + number
    key[rays] = -1
    # arcs meet each other: the work grows by the square of their number
    work = np.bincount(chosen.pixel, minlength=count).astype(np.float64) ** 2 + 1.0
    done, most = 0.0, float(work.sum())
    for group in np.unique(key):
        plan.go_on()
        tell(NESTED + (1.0 - NESTED) * done / most)
        rows = (key == group).nonzero()[0]
        done += float(work[rows].sum())
        if group < 0:
            factor[rows] = _by_rays(plan, surface, light, pairs, time, rows)
            continue
        number = np.full(count, -1)
        number[rows] = np.arange(rows.size)
        mine = (number[chosen.pixel] >= 0).nonzero()[0]
        own = Pairs(number[chosen.pixel[mine]], chosen.item[mine])
        part = surface.take(rows)
        factor[rows] = _closed(plan, part, light, own, kind[mine], _at(time, rows))
    return factor


def _closed(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, kind: Ints, time: Array | float
) -> Array:
    """Factors (n,) of points with equally many occluders of each kind."""
    n = surface.item.size
    when = time if isinstance(time, np.ndarray) else np.full(n, time)
    to = light.moved(time) - surface.point

    def balls(which: int) -> tuple[Array, Array]:
        items = pairs.item[kind == which].reshape(n, -1).T
        place = plan.spheres.moved(items, when) - surface.point[:, None]
        return place.swapaxes(0, 1), plan.spheres.radius[items]

    ids = pairs.item[kind == FLAT].reshape(n, -1).T - plan.sphere_count
    q = plan.quads.moved(ids, when) - surface.point[:, None]
    a, b = columns(plan.quads.edge_u, ids), columns(plan.quads.edge_v, ids)
    plane = backdrop(light, to)
    quads = clip_quads(plane, np.array([q, q + a, q + a + b, q + b]).transpose(2, 0, 1, 3))
    cut = balls(CUT)
    if cut[1].shape[0]:
        quads = _together(quads, ball_polygons(plane, *cut))
    outline: Array | RoundOutline
    if light.kind == QUAD:
        outline = np.array([to + su * light.half_u + sv * light.half_v for su, sv in CORNERS])
    else:
        cone = view_cone(light, light.moved(time), surface.point)
        outline = RoundOutline(cone.axis, cone.cosine, cone.sine)
    return visible_factor(outline, surface.normal, balls(BALL), quads)


def _together(few: Array, many: Array) -> Array:
    """Polygons of different numbers of corners in one array: the last corner is repeated."""
    if not few.shape[0]:
        return many
    spare = np.repeat(few[:, -1:], many.shape[1] - few.shape[1], axis=1)
    return np.concatenate([np.concatenate([few, spare], axis=1), many])


def _place(plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, time: Array | float) -> Ints:
    """How each occluder is counted: DROP, BALL, FLAT, CUT or RAYS (m,)."""
    kind = np.full(pairs.item.size, FLAT)
    point, center = columns(surface.point, pairs.pixel), light.moved(time)
    rows = (pairs.item < plan.sphere_count).nonzero()[0]
    if rows.size:
        when = _at(time, rows)
        kind[rows] = _place_spheres(plan, surface, light, pairs.take(rows), when)
    rows = (kind == FLAT).nonzero()[0]
    if rows.size and light.kind == SPHERE:
        ids = pairs.item[rows] - plan.sphere_count
        gap = plan.quads.moved(ids, _at(time, rows)) - columns(center + np.zeros_like(point), rows)
        away = _distance(gap, columns(plan.quads.edge_u, ids), columns(plan.quads.edge_v, ids))
        kind[rows[away < light.radius]] = RAYS
    return kind


def _place_spheres(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, time: Array | float
) -> Ints:
    point = columns(surface.point, pairs.pixel)
    r = plan.spheres.radius[pairs.item]
    place, center = plan.spheres.moved(pairs.item, time), light.moved(time)
    v, gap = place - point, place - center
    enclosed = (pairs.item == surface.item[pairs.pixel]) | (dot(v, v) <= r * r)
    if light.kind == SPHERE:
        # of two balls apart from each other a plane parts, the one on the point's side is before
        away = np.sqrt(dot(gap, gap))
        before = dot(point - center, gap) > light.radius * away
        kind = np.where(away <= r + light.radius, RAYS, np.where(before, BALL, DROP))
    else:
        height = backdrop(light, center - point).height(v)
        kind = np.where(height >= r, BALL, np.where(height <= -r, DROP, CUT))
    return np.where(enclosed, RAYS, kind)


def _distance(corner: Array, u: Array, v: Array) -> Array:
    """Distance (m,) from the origin to rectangles; of sheared ones a lower bound's estimate."""
    nearest = corner
    for edge in (u, v):
        part = np.clip(-dot(nearest, edge) / np.maximum(dot(edge, edge), TINY), 0.0, 1.0)
        nearest = nearest + part * edge
    return np.sqrt(dot(nearest, nearest))


def _by_rays(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, time: Array | float, rows: Ints
) -> Array:
    """Factors of the points `rows` by distributed rays, the same points of light for all."""
    number = np.full(surface.item.size, -1)
    number[rows] = np.arange(rows.size)
    own = pairs.take(number[pairs.pixel] >= 0)
    own = Pairs(number[own.pixel], own.item)
    same = np.zeros(1, dtype=np.int64)
    a, b = points(plan.settings.seed, same, 0, SHARED_LIGHT_RAYS, 2)
    spots = np.repeat(a, rows.size, axis=0), np.repeat(b, rows.size, axis=0)
    when = time[rows][:, None] if isinstance(time, np.ndarray) else time
    return gather_light(plan, surface.take(rows), light, own, spots, when).estimate()
