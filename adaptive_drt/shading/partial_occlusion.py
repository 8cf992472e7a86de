# SPDX-License-Identifier: GPL-3.0-or-later
"""Irradiance of lights that occluders hide in part, at surface points.

An occluder that is wholly in front of the light counts by its outline; of an occluder that the
plane of the light cuts, the part in front counts. Which it is, the kind of shape answers:
`geometry.occluder_outline`. Distributed rays are used where no closed form is known: for points
inside an occluder or inside a spherical light, and for occluders that intersect a spherical light.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from ..geometry.elliptic_cones import EllipticCones, cones_of_ellipses
from ..geometry.light_plane import LightPlane
from ..geometry.occluder_outline import (
    CIRCLE,
    CUT,
    ELLIPSE,
    HIDDEN_PART_KINDS,
    NOTHING,
    POLYGON,
    RAYS,
)
from ..geometry.polygon.clipping import clip_polygons, concatenate_polygons
from ..lights.emitter import Emitter
from ..lights.occluded_form_factor import visible_factor
from ..numerics.arrays import Array, Ints
from ..numerics.error_coefficients import SECTION_ERROR_FRACTION
from ..numerics.gather import columns
from ..parallel.call_progress import progress_range, report_progress
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface
from .nested_occluders import find_nested
from .open_sky import open_sky_factors
from .sampled_occlusion import sampled_factors

__all__ = ["apply_occluders"]


NESTED_WORK = 0.3
"""Fraction of the work on partly hidden lights, for the progress bar, that finding nested outlines
takes."""
MAX_POLYGONS = 512
"""Number of polygons that hide a light in part, from which rays are distributed over it: their arcs
take a tenth of a second a point, and hundreds of megabytes, where most of them overlap."""
MAX_ELLIPSES = 512
"""The same number of elliptic outlines."""
SECTION_ERROR_MARGIN = 1.6
"""Factor on the fitted root mean square of a plane section's error, so that the stated error is no
less than the true one on scenes of other seeds, and 95 of 100 points are within twice of it."""
SECTION_CORNERS = 48
"""Number of corners of the polygon that replaces an occluder that is cut by a light's plane."""


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
    """Replace irradiance factors (n,) or (3, n), in place, where the occluders `pairs` hide the
    light in part.

    Parameters
    ----------
    factor : unoccluded irradiance factors; changed at all points that have a pair.
    error : (n,) changed in place there: estimated errors of the new factors, 0 for closed forms.
    allowed : (n,) errors up to which distributed rays are not refined.
    time : shutter times, a number or (n,).
    """
    rows, part = pairs.numbered(error.size)
    if rows.size and light.uniform_hemisphere:
        when = _times_at(time, rows)
        known, seen = open_sky_factors(plan, surface.take(rows), light, part, when)
        known = rows[known]
        factor[known], error[known] = seen, 0.0
        left = np.ones(error.size, dtype=np.bool_)
        left[known] = False
        rows, part = pairs.take(left[pairs.pixel]).numbered(error.size)
    if rows.size:
        factor[..., rows], error[rows] = _occluded_factors(
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
    error = np.zeros(count)
    factor = np.zeros((light.channel_count, count) if light.channel_count > 1 else count)
    kind = _outline_kinds(plan, surface, light, pairs, _times_at(time, pairs.pixel))
    rays = np.zeros(count, dtype=np.bool_)
    rays[pairs.pixel[kind == RAYS]] = True
    straight = (kind == POLYGON) | (kind == CUT)
    rays |= np.bincount(pairs.pixel[straight], minlength=count) > MAX_POLYGONS
    rays |= np.bincount(pairs.pixel[kind == ELLIPSE], minlength=count) > MAX_ELLIPSES
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
    for rows, mine, place in _groups_by_key(key, chosen.pixel):
        plan.raise_if_cancelled()
        report_progress(NESTED_WORK + (1.0 - NESTED_WORK) * done / most)
        done += float(work[rows].sum())
        if rays[rows[0]]:
            own, when = pairs.for_pixels(rows, count), _times_at(time, rows)
            factor[..., rows], error[rows] = _sampled_channels(
                plan, surface.take(rows), light, own, when, allowed[rows]
            )
            continue
        own = Pairs(place, chosen.item[mine])
        part = surface.take(rows)
        factor[..., rows], error[rows] = _closed_form_factors(
            plan, part, light, own, kind[mine], _times_at(time, rows), allowed[rows]
        )
    return factor, error


def _sampled_channels(
    plan: Plan,
    surface: Surface,
    light: Emitter,
    pairs: Pairs,
    time: Array | float,
    allowed: Array,
) -> tuple[Array, Array]:
    """`sampled_factors` of lights of any number of channels: (n,) or (3, n), and errors (n,)."""
    if light.channel_count == 1:
        return sampled_factors(plan, surface, light, pairs, time, allowed)
    factor, error = np.zeros((3, allowed.size)), np.zeros(allowed.size)
    for part in light.channels():
        channel = np.abs(part.power).argmax()
        factor[channel], off = sampled_factors(plan, surface, part, pairs, time, allowed)
        np.maximum(error, off, out=error)
    return factor, error


def _groups_by_key(key: Ints, pixel: Ints) -> Iterator[tuple[Ints, Ints, Ints]]:
    """Group points by their keys (n,) and pairs by those of their points, `pixel` (m,).

    Yields
    ------
    The points of each key, its pairs, and the positions of their points among those, all ascending.
    """
    order = np.argsort(key, kind="stable")
    starts = [0, *(np.diff(key[order]).nonzero()[0] + 1).tolist(), key.size]
    place, group = np.empty((2, key.size), dtype=np.int64)
    for number, (first, end) in enumerate(pairwise(starts)):
        rows = order[first:end]
        place[rows], group[rows] = np.arange(rows.size), number
    own = group[pixel]
    pairs, position = np.argsort(own, kind="stable"), place[pixel]
    ends = [0, *np.cumsum(np.bincount(own, minlength=len(starts) - 1)).tolist()]
    for points, part in zip(pairwise(starts), pairwise(ends), strict=True):
        mine = pairs[slice(*part)]
        yield order[slice(*points)], mine, position[mine]


def _closed_form_factors(
    plan: Plan,
    surface: Surface,
    light: Emitter,
    pairs: Pairs,
    kind: Ints,
    time: Array | float,
    allowed: Array,
) -> tuple[Array, Array]:
    """Factors (n,) or (3, n), of points with equally many occluders of each treatment.

    Returns with them their errors (n,): those of the polygons that stand for spheres cut by the
    light's plane, and for elliptic lights, and those of environments; 0 where there is none.
    """
    n = surface.item.size
    to = light.to_center(surface.point, time)
    outlines = _outlines(plan, surface, light.plane(to), pairs, kind, time)
    circles, ellipses, polygons, sections = outlines
    if light.environment is not None:
        assert ellipses is None, "elliptic outlines have no closed form before environments"
        hidden = concatenate_polygons(polygons, n)
        seen, error = light.environment.visible_factor(surface.normal, circles, hidden, allowed)
        return (seen if len(seen) > 1 else seen[0]), error

    outline = light.silhouette(to, surface.normal)

    def visible(part: list[Array]) -> Array:
        hidden = concatenate_polygons([*polygons, *part], n)
        return visible_factor(outline, surface.normal, circles, hidden, light.profile, ellipses)

    factor, error = visible(sections[0]), np.zeros(n)
    off = light.outline_error(to, surface.normal)
    if off is not None:
        error += off
    if sections[0]:
        error += (
            SECTION_ERROR_MARGIN * SECTION_ERROR_FRACTION * np.abs(visible(sections[1]) - factor)
        )
    return factor, error


def _outlines(
    plan: Plan,
    surface: Surface,
    plane: LightPlane,
    pairs: Pairs,
    kind: Ints,
    time: Array | float,
) -> tuple[tuple[Array, Array], EllipticCones | None, list[Array], tuple[list[Array], list[Array]]]:
    """Outlines and sections that hide a light, of points with equally many of each.

    Returns
    -------
    Centres (k, 3, n) and radii (k, n) of spheres; elliptic cones (e, n), if there are any;
    polygons, clipped by the light's plane; and the parts of that plane that occluders hide which it
    cuts, by fine and by rough polygons.
    """
    n = surface.item.size
    when, point = time if isinstance(time, np.ndarray) else np.full(n, time), surface.point[:, None]
    centers, radii = [np.zeros((0, 3, n))], [np.zeros((0, n))]
    polygons: list[Array] = []
    cones: EllipticCones | None = None
    sections: tuple[list[Array], list[Array]] = [], []
    for shapes, rows, index in plan.shapes.groups(pairs.item):
        own = kind[rows]
        circle, oval, flat, cut = (index[own == one].reshape(n, -1).T for one in HIDDEN_PART_KINDS)
        if circle.size:
            center, radius = shapes.circular_outline(circle, point, when)
            centers.append(center.swapaxes(0, 1))
            radii.append(radius)
        if oval.size:
            more = cones_of_ellipses(*shapes.elliptic_outline(oval, point, when))
            cones = more if cones is None else cones.joined(more)
        if flat.size:
            corners = np.array(shapes.polygonal_outline(flat, point, when))
            polygons.append(clip_polygons(plane, corners.transpose(2, 0, 1, 3)))
        if cut.size:
            for part, number in zip(sections, (SECTION_CORNERS, SECTION_CORNERS // 2), strict=True):
                part.append(shapes.outline_in_plane(cut, point, when, plane, number))
    return (np.concatenate(centers), np.concatenate(radii)), cones, polygons, sections


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
    if light.profile is not None or light.environment is not None:
        kind[kind == ELLIPSE] = RAYS
    return kind
