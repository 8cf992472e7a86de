# SPDX-License-Identifier: GPL-3.0-or-later
"""Irradiance of lights that occluders hide in part, at surface points.

An occluder that is wholly in front of the light counts by its outline; of an occluder that the
plane of the light cuts, the part in front counts. Distributed rays are used for points inside an
occluder or inside a spherical light, and for occluders that intersect a spherical light.
"""

from __future__ import annotations

import numpy as np

from ..lights.emitter import Emitter
from ..lights.light_plane import clip_quads, clipped_sphere_polygons
from ..lights.occluded_form_factor import visible_factor
from ..numerics.arrays import Array, Ints
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import dot
from ..parallel.call_progress import progress_range, report_progress
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface
from .nested_occluders import find_nested
from .sampled_occlusion import sampled_factors

__all__ = ["apply_occluders"]


NESTED_WORK = 0.3
"""Fraction of the work on partly hidden lights, for the progress bar, that finding nested spheres
takes."""
SPHERE_POLYGON_CORNERS = 48
"""Number of corners of the polygon that stands for a sphere cut by a light's plane."""
POLYGON_REFINEMENT_GAIN = 3.0
"""Least ratio of the difference between the results of polygons with half as many corners and with
all, and the error of the latter. A polygon of N corners is off by some N^-2 where another outline
crosses it, which gives 3, and by N^-4 where none does, which gives 15."""

IGNORED, WHOLE_SPHERE, ANY_QUAD, CLIPPED_SPHERE, BY_RAYS = range(5)
"""How an occluder is treated.

In this order: ignored, because it is behind the light; a sphere in front of the light; a quad; a
sphere that the plane of the light cuts; by distributed rays.
"""


def apply_occluders(
    plan: Plan,
    surface: Surface,
    light: Emitter,
    pairs: Pairs,
    time: Array | float,
    factor: Array,
    error: Array,
    allowed: Array,
) -> None:
    """Replace irradiance factors (n,), in place, where the occluders `pairs` hide the light in
    part.

    Parameters
    ----------
    factor : unoccluded irradiance factors; changed at all points that have a pair.
    error : (n,) changed in place there: estimated errors of the new factors, 0 for closed forms.
    allowed : (n,) errors up to which distributed rays are not refined.
    time : shutter times, a number or (n,).
    """
    some = np.zeros(factor.size, dtype=np.bool_)
    some[pairs.pixel] = True
    rows = some.nonzero()[0]
    if rows.size:
        part = Pairs((some.cumsum() - 1)[pairs.pixel], pairs.item)
        factor[rows], error[rows] = _occluded_factors(
            plan, surface.take(rows), light, part, _times_at(time, rows), allowed[rows]
        )


def _times_at(time: Array | float, rows: Ints) -> Array | float:
    """Times at some points, of times (n,) or one number."""
    return time[rows] if isinstance(time, np.ndarray) else time


def _occluded_factors(
    plan: Plan,
    surface: Surface,
    light: Emitter,
    pairs: Pairs,
    time: Array | float,
    allowed: Array,
) -> tuple[Array, Array]:
    """Factors and errors (n,) of points that all have a pair that may hide part of the light."""
    count = surface.item.size
    factor, error = np.zeros((2, count))
    kind = _classify_occluders(plan, surface, light, pairs, _times_at(time, pairs.pixel))
    rays = np.zeros(count, dtype=np.bool_)
    rays[pairs.pixel[kind == BY_RAYS]] = True
    rays |= ~light.has_silhouette(light.to_center(surface.point, time))
    keep = (kind != IGNORED) & ~rays[pairs.pixel]
    balls = (keep & (kind == WHOLE_SPHERE)).nonzero()[0]
    with progress_range(0.0, NESTED_WORK):
        keep[balls] = ~find_nested(
            plan, surface, pairs.take(balls), _times_at(time, pairs.pixel[balls])
        )
    chosen, kind = pairs.take(keep), kind[keep]
    # group points with equal numbers of occluders of each treatment
    key = np.zeros(count, dtype=np.int64)
    for each in (WHOLE_SPHERE, ANY_QUAD, CLIPPED_SPHERE):
        number = np.bincount(chosen.pixel[kind == each], minlength=count)
        key = key * (number.max(initial=0) + 1) + number
    key[rays] = -1
    # arcs intersect each other: the work grows with the square of their number
    work = np.bincount(chosen.pixel, minlength=count).astype(np.float64) ** 2 + 1.0
    done, most = 0.0, float(work.sum())
    for group in np.unique(key):
        plan.go_on()
        report_progress(NESTED_WORK + (1.0 - NESTED_WORK) * done / most)
        rows = (key == group).nonzero()[0]
        done += float(work[rows].sum())
        if group < 0:
            factor[rows], error[rows] = sampled_factors(
                plan,
                surface.take(rows),
                light,
                pairs.of(rows, count),
                _times_at(time, rows),
                allowed[rows],
            )
            continue
        number = np.full(count, -1)
        number[rows] = np.arange(rows.size)
        mine = (number[chosen.pixel] >= 0).nonzero()[0]
        own = Pairs(number[chosen.pixel[mine]], chosen.item[mine])
        part = surface.take(rows)
        factor[rows], error[rows] = _closed_form_factors(
            plan, part, light, own, kind[mine], _times_at(time, rows)
        )
    return factor, error


def _closed_form_factors(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, kind: Ints, time: Array | float
) -> tuple[Array, Array]:
    """Factors (n,) in closed form, of points with equally many occluders of each treatment.

    Returns with them their errors (n,): those of the polygons that stand for spheres cut by the
    light's plane, 0 where there is none.
    """
    n = surface.item.size
    when = time if isinstance(time, np.ndarray) else np.full(n, time)
    to = light.to_center(surface.point, time)

    def balls(which: int) -> tuple[Array, Array]:
        items = pairs.item[kind == which].reshape(n, -1).T
        place = plan.spheres.moved(items, when) - surface.point[:, None]
        return place.swapaxes(0, 1), plan.spheres.radius[items]

    ids = pairs.item[kind == ANY_QUAD].reshape(n, -1).T - plan.sphere_count
    q = plan.quads.corners_at(ids, when) - surface.point[:, None]
    a, b = columns(plan.quads.edge_u, ids), columns(plan.quads.edge_v, ids)
    plane = light.plane(to)
    quads = clip_quads(plane, np.array([q, q + a, q + a + b, q + b]).transpose(2, 0, 1, 3))
    cut, whole = balls(CLIPPED_SPHERE), balls(WHOLE_SPHERE)
    outline, normal = light.silhouette(to), surface.normal
    if not cut[1].shape[0]:
        return visible_factor(outline, normal, whole, quads), np.zeros(n)
    factor, rough = (
        visible_factor(
            outline,
            normal,
            whole,
            _concatenate_polygons(quads, clipped_sphere_polygons(plane, *cut, corners)),
        )
        for corners in (SPHERE_POLYGON_CORNERS, SPHERE_POLYGON_CORNERS // 2)
    )
    return factor, np.abs(rough - factor) / POLYGON_REFINEMENT_GAIN


def _concatenate_polygons(few: Array, many: Array) -> Array:
    """Concatenate polygons with different numbers of corners: the last corner is repeated."""
    if not few.shape[0]:
        return many
    spare = np.repeat(few[:, -1:], many.shape[1] - few.shape[1], axis=1)
    return np.concatenate([np.concatenate([few, spare], axis=1), many])


def _classify_occluders(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, time: Array | float
) -> Ints:
    """Treatment of each occluder (m,).

    One of `IGNORED`, `WHOLE_SPHERE`, `ANY_QUAD`, `CLIPPED_SPHERE` and `BY_RAYS`.
    """
    kind = np.full(pairs.item.size, ANY_QUAD)
    rows = (pairs.item < plan.sphere_count).nonzero()[0]
    if rows.size:
        when = _times_at(time, rows)
        kind[rows] = _classify_spheres(plan, surface, light, pairs.take(rows), when)
    rows = (kind == ANY_QUAD).nonzero()[0]
    if rows.size and light.solid:
        ids = pairs.item[rows] - plan.sphere_count
        when = _times_at(time, rows)
        gap = -light.to_center(plan.quads.corners_at(ids, when), when)
        away = _distance(gap, columns(plan.quads.edge_u, ids), columns(plan.quads.edge_v, ids))
        kind[rows[away < light.radius]] = BY_RAYS
    return kind


def _classify_spheres(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, time: Array | float
) -> Ints:
    """Treatment of spherical occluders (m,)."""
    point = columns(surface.point, pairs.pixel)
    r = plan.spheres.radius[pairs.item]
    place = plan.spheres.moved(pairs.item, time)
    v, to = place - point, light.to_center(point, time)
    enclosed = (pairs.item == surface.item[pairs.pixel]) | (dot(v, v) <= r * r)
    if light.solid:
        # a plane separates two disjoint balls: the one on the side of the point is in front
        gap = light.to_center(place, time)
        away = np.sqrt(dot(gap, gap))
        before = dot(to, gap) > light.radius * away
        kind = np.where(away <= r + light.radius, BY_RAYS, np.where(before, WHOLE_SPHERE, IGNORED))
    else:
        height = light.plane(to).height_of(v)
        kind = np.where(height >= r, WHOLE_SPHERE, np.where(height <= -r, IGNORED, CLIPPED_SPHERE))
    return np.where(enclosed, BY_RAYS, kind)


def _distance(corner: Array, u: Array, v: Array) -> Array:
    """Distance (m,) from the origin to rectangles; an estimate for sheared parallelograms."""
    nearest = corner
    for edge in (u, v):
        part = np.clip(-dot(nearest, edge) / np.maximum(dot(edge, edge), TINY), 0.0, 1.0)
        nearest = nearest + part * edge
    return np.sqrt(dot(nearest, nearest))
