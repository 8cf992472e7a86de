# SPDX-License-Identifier: GPL-3.0-or-later
"""Irradiance of lights that occluders hide in part, at surface points.

An occluder that is wholly in front of the light counts by its outline; of an occluder that the
plane of the light cuts, the part in front counts. Which it is, the kind of shape answers:
`geometry.occluder_outline`. Distributed rays are used where no closed form is known: for points
inside an occluder or inside a spherical light, and for occluders that intersect a spherical light.
"""

from __future__ import annotations

import numpy as np

from ..geometry.occluder_outline import CIRCLE, HIDDEN_PART_KINDS, NOTHING, RAYS
from ..geometry.polygon.clipping import clip_polygons, concatenate_polygons
from ..lights.emitter import Emitter
from ..lights.occluded_form_factor import visible_factor
from ..numerics.arrays import Array, Ints
from ..numerics.gather import columns
from ..numerics.low_discrepancy import low_discrepancy_points
from ..parallel.call_progress import progress_range, report_progress
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface
from .nested_occluders import find_nested
from .ratio_estimator import gather_light

__all__ = ["apply_occluders"]


NESTED_WORK = 0.3
"""Fraction of the work on partly hidden lights, for the progress bar, that finding nested outlines
takes."""
SHARED_LIGHT_RAYS = 1_024
"""Number of rays to a light where no closed form is known."""

SECTION_CORNERS = 48
"""Number of corners of the polygon that replaces an occluder that is cut by a light's plane. The
remaining error is of fourth order in its reciprocal: some 1e-6 of the light."""


def apply_occluders(
    plan: Plan,
    surface: Surface,
    light: Emitter,
    pairs: Pairs,
    time: Array | float,
    factor: Array,
) -> None:
    """Replace irradiance factors (n,), in place, where the occluders `pairs` hide the light in
    part.

    Parameters
    ----------
    factor : unoccluded irradiance factors; changed at all points that have a pair.
    time : shutter times, a number or (n,).
    """
    some = np.zeros(factor.size, dtype=np.bool_)
    some[pairs.pixel] = True
    rows = some.nonzero()[0]
    if rows.size:
        part = Pairs((some.cumsum() - 1)[pairs.pixel], pairs.item)
        factor[rows] = _occluded_factors(
            plan, surface.take(rows), light, part, _times_at(time, rows)
        )


def _times_at(time: Array | float, rows: Ints) -> Array | float:
    """Times at some points, of times (n,) or one number."""
    return time[rows] if isinstance(time, np.ndarray) else time


def _occluded_factors(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, time: Array | float
) -> Array:
    """Factors (n,) of points that all have a pair that may hide part of the light."""
    count = surface.item.size
    factor = np.zeros(count)
    kind = _outline_kinds(plan, surface, light, pairs, _times_at(time, pairs.pixel))
    rays = np.zeros(count, dtype=np.bool_)
    rays[pairs.pixel[kind == RAYS]] = True
    rays |= ~light.has_silhouette(light.to_center(surface.point, time))
    keep = (kind != NOTHING) & ~rays[pairs.pixel]
    circles = (keep & (kind == CIRCLE)).nonzero()[0]
    with progress_range(0.0, NESTED_WORK):
        keep[circles] = ~find_nested(
            plan, surface, pairs.take(circles), _times_at(time, pairs.pixel[circles])
        )
    chosen, kind = pairs.take(keep), kind[keep]
    key = _group_keys(plan, chosen, kind, count)
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
            factor[rows] = _ray_traced_factors(plan, surface, light, pairs, time, rows)
            continue
        number = np.full(count, -1)
        number[rows] = np.arange(rows.size)
        mine = (number[chosen.pixel] >= 0).nonzero()[0]
        own = Pairs(number[chosen.pixel[mine]], chosen.item[mine])
        part = surface.take(rows)
        factor[rows] = _closed_form_factors(
            plan, part, light, own, kind[mine], _times_at(time, rows)
        )
    return factor


def _closed_form_factors(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, kind: Ints, time: Array | float
) -> Array:
    """Factors (n,) in closed form, of points with equally many occluders of each treatment."""
    n = surface.item.size
    when = time if isinstance(time, np.ndarray) else np.full(n, time)
    to = light.to_center(surface.point, time)
    plane, point = light.plane(to), surface.point[:, None]
    centers, radii = [np.zeros((0, 3, n))], [np.zeros((0, n))]
    polygons: list[Array] = []
    sections: list[Array] = []
    for shapes, rows, index in plan.shapes.groups(pairs.item):
        own = kind[rows]
        circle, flat, cut = (index[own == one].reshape(n, -1).T for one in HIDDEN_PART_KINDS)
        if circle.size:
            center, radius = shapes.circular_outline(circle, point, when)
            centers.append(center.swapaxes(0, 1))
            radii.append(radius)
        if flat.size:
            corners = np.array(shapes.polygonal_outline(flat, point, when))
            polygons.append(clip_polygons(plane, corners.transpose(2, 0, 1, 3)))
        if cut.size:
            sections.append(shapes.outline_in_plane(cut, point, when, plane, SECTION_CORNERS))
    circles = np.concatenate(centers), np.concatenate(radii)
    hidden = concatenate_polygons([*polygons, *sections], n)
    return visible_factor(light.silhouette(to, surface.normal), surface.normal, circles, hidden)


def _group_keys(plan: Plan, pairs: Pairs, kind: Ints, count: int) -> Ints:
    """Numbers (n,), equal for points with equal numbers of occluders of each shape and outline."""
    key = np.zeros(count, dtype=np.int64)
    groups = [(rows, kind[rows]) for _, rows, _ in plan.shapes.groups(pairs.item)]
    for each in HIDDEN_PART_KINDS:
        for rows, own in groups:
            number = np.bincount(pairs.pixel[rows[own == each]], minlength=count)
            key = key * (number.max(initial=0) + 1) + number
    return key


def _outline_kinds(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, time: Array | float
) -> Ints:
    """How each occluder (m,) hides the light: one of the kinds of `occluder_outline`."""
    kind = np.empty(pairs.item.size, dtype=np.int64)
    for shapes, rows, index in plan.shapes.groups(pairs.item):
        pixel = pairs.pixel[rows]
        own = pairs.item[rows] == surface.item[pixel]
        point, when = columns(surface.point, pixel), _times_at(time, rows)
        kind[rows] = shapes.outline_kind(index, point, own, light, when)
    return kind


def _ray_traced_factors(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, time: Array | float, rows: Ints
) -> Array:
    """Factors of the points `rows` by distributed rays, with the same points of the light for
    all."""
    number = np.full(surface.item.size, -1)
    number[rows] = np.arange(rows.size)
    own = pairs.take(number[pairs.pixel] >= 0)
    own = Pairs(number[own.pixel], own.item)
    same = np.zeros(1, dtype=np.int64)
    a, b = low_discrepancy_points(plan.settings.seed, same, 0, SHARED_LIGHT_RAYS, 2)
    spots = np.repeat(a, rows.size, axis=0), np.repeat(b, rows.size, axis=0)
    when = time[rows][:, None] if isinstance(time, np.ndarray) else time
    return gather_light(plan, surface.take(rows), light, own, spots, when).estimate()
