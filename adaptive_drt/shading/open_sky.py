# SPDX-License-Identifier: GPL-3.0-or-later
"""Irradiance of a uniform sky behind round shapes and a few polygons, at many points at a time.

Under a sky every object is an occluder, and hardly two points have as many of them. So points are
not grouped by the numbers of their occluders as for other lights: see `geometry.open_hemisphere`.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..geometry.elliptic_cones import EllipticCones, cones_of_ellipses, map_cones
from ..geometry.occluder_outline import CIRCLE, ELLIPSE, NOTHING, POLYGON
from ..geometry.open_hemisphere import open_hemisphere_factor, polygons_in_general_position
from ..geometry.silhouettes import Hemisphere, PolygonSilhouettes, make_polygon_silhouettes
from ..geometry.spherical_curves import make_circles
from ..lights.emitter import Emitter
from ..lights.occluded_form_factor import visible_factor
from ..numerics.arrays import Array, Ints
from ..numerics.gather import columns, place
from ..numerics.vector import dot
from ..parallel.call_progress import report_progress
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface

__all__ = ["open_sky_factors"]


BATCH_PAIRS = 1 << 20
"""Number of pairs of points and occluders in a batch: some 100 MB."""
CONE_PADDING = 8
"""Numbers of cones are rounded up to multiples of this, so that points fall into few groups."""
MOST_POLYGONS = 6
"""Number of polygons from which a point is left to `lights.occluded_form_factor`, which compares
only those that come near each other."""


def open_sky_factors(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, time: Array | float
) -> tuple[Ints, Array]:
    """Irradiance factors of a uniform sky behind spheres and a few polygons.

    Parameters
    ----------
    surface : n points.  light : the sky.  pairs : their occluders, sorted by point.
    time : shutter times, a number or (n,).

    Returns
    -------
    rows : (k,) the points of which all occluders are such, ascending.  factor : (k,) in sr.
    """
    count = surface.item.size
    known, factor = np.zeros(count, dtype=np.bool_), np.zeros(count)
    for some, own in _batches(pairs, count):
        plan.raise_if_cancelled()
        report_progress(some[0] / count)
        when = time[some] if isinstance(time, np.ndarray) else time
        rows, factors = _batch_factors(plan, surface.take(some), light, own, when)
        known[some[rows]] = True
        factor[some[rows]] = factors
    rows = known.nonzero()[0]
    return rows, factor[rows]


def _batches(pairs: Pairs, count: int) -> Iterator[tuple[Ints, Pairs]]:
    """Consecutive points (k,), of `count` in all, and their pairs, which number them from 0."""
    ends = np.cumsum(np.bincount(pairs.pixel, minlength=count))
    first = before = 0
    while first < count:
        last = max(first + 1, int(ends.searchsorted(before + BATCH_PAIRS, side="right")))
        end = int(ends[last - 1])
        yield (
            np.arange(first, last),
            Pairs(pairs.pixel[before:end] - first, pairs.item[before:end]),
        )
        first, before = last, end


def _batch_factors(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, time: Array | float
) -> tuple[Ints, Array]:
    """`open_sky_factors` of a batch of points."""
    count = surface.item.size
    kind, v, r = _outlines(plan, surface, light, pairs, time)
    other = ~np.isin(kind, (CIRCLE, ELLIPSE, POLYGON, NOTHING))
    flat = (kind == POLYGON).nonzero()[0]
    number = np.bincount(pairs.pixel[flat], minlength=count)
    number[pairs.pixel[other]] = MOST_POLYGONS
    known, factor = number < MOST_POLYGONS, np.zeros(count)
    oval = np.bincount(pairs.pixel[kind == ELLIPSE], minlength=count) > 0
    found = (((kind == ELLIPSE) | (kind == CIRCLE)) & (oval & known)[pairs.pixel]).nonzero()[0]
    cones = _cones(plan, surface, pairs, time, found, (kind, v, r))
    for m in np.unique(number[known]).tolist():
        same = number == m
        mine = flat[same[pairs.pixel[flat]]]
        rows = (same & oval).nonzero()[0]
        if rows.size:
            own = pairs.take(mine[oval[pairs.pixel[mine]]])
            corners = _polygons(plan, surface, own, time, m)
            factor[rows] = _factors_of_cones(surface, pairs.pixel[found], cones, rows, corners)
        rows = (same & ~oval).nonzero()[0]
        if not rows.size:
            continue
        polygons = None
        if m:
            own = pairs.take(mine[~oval[pairs.pixel[mine]]])
            corners, normal = _polygons(plan, surface, own, time, m), columns(surface.normal, rows)
            polygons = make_polygon_silhouettes(corners, normal)
            clear = polygons_in_general_position(normal, polygons)
            known[rows[~clear]] = False
            polygons, rows = polygons.at_points(clear.nonzero()[0]), rows[clear]
        factor[rows] = _factors_of_circles(surface, pairs, (kind, v, r), rows, polygons)
    rows = known.nonzero()[0]
    return rows, factor[rows]


def _factors_of_circles(
    surface: Surface,
    pairs: Pairs,
    outlines: tuple[Ints, Array, Array],
    rows: Ints,
    polygons: PolygonSilhouettes | None,
) -> Array:
    """Factors of points `rows` (k,) behind circles and polygons; `outlines` as of `_outlines`."""
    kind, v, r = outlines
    at = np.full(surface.item.size, -1)
    at[rows] = np.arange(rows.size)
    round_ = (kind == CIRCLE).nonzero()[0]
    own = round_[at[pairs.pixel[round_]] >= 0]
    away, radius = columns(v, own), r[own]
    length = np.sqrt(dot(away, away))
    cosine = np.sqrt(np.maximum((length - radius) * (length + radius), 0.0)) / length
    return open_hemisphere_factor(
        columns(surface.normal, rows), away / length, radius / length, cosine,
        at[pairs.pixel[own]], polygons,
    )  # fmt: skip


def _factors_of_cones(
    surface: Surface, pixel: Ints, cones: EllipticCones, rows: Ints, corners: Array
) -> Array:
    """Factors of points `rows` (k,) behind ellipses, circles and polygons.

    Points are taken together whose numbers of outlines are not the same: those with fewer have
    cones of no size as well.

    pixel : (m,) ascending, the points of cones (m + 1,), of which the last one has no size.
    corners : (p, j, 3, k) metres, of the polygons.
    """
    number = np.bincount(pixel, minlength=surface.item.size)
    first = (np.cumsum(number) - number)[rows]
    number = number[rows]
    factor = np.zeros(rows.size)
    width = -(-number // CONE_PADDING) * CONE_PADDING
    for k in np.unique(width).tolist():
        some = (width == k).nonzero()[0]
        index = first[some] + np.arange(k)[:, None]
        unused = np.arange(k)[:, None] >= number[some]
        index[unused] = pixel.size
        none = np.zeros((0, 3, some.size)), np.zeros((0, some.size))
        own = map_cones(lambda each, at=index: columns(each, at, -1), cones)
        factor[some] = visible_factor(
            Hemisphere(), columns(surface.normal, rows[some]), none,
            columns(corners, some, -1), None, own,
        )  # fmt: skip
    return factor


def _cones(
    plan: Plan,
    surface: Surface,
    pairs: Pairs,
    time: Array | float,
    found: Ints,
    outlines: tuple[Ints, Array, Array],
) -> EllipticCones:
    """Cones (m + 1,) of the elliptic and circular outlines of pairs `found` (m,), and an empty one.

    A circle is an ellipse across the line to the sphere's centre.
    """
    kind, v, r = outlines
    m = found.size
    center, half_u, half_v = np.zeros((3, 3, m + 1))
    center[2] = 1.0
    place_of = np.full(kind.size, -1)
    place_of[found] = np.arange(m)
    round_ = (kind[found] == CIRCLE).nonzero()[0]
    away, radius = columns(v, found[round_]), r[found[round_]]
    square = dot(away, away)
    frame = make_circles(
        (away / np.sqrt(square))[:, None], np.ones((1, round_.size)), np.zeros((1, round_.size)),
        columns(surface.normal, pairs.pixel[found[round_]]),
    )  # fmt: skip
    near = np.sqrt(np.maximum(1.0 - radius * radius / square, 0.0))
    for values, parts in (
        (center, near * away), (half_u, radius * frame.u[:, 0]), (half_v, radius * frame.w[:, 0])
    ):  # fmt: skip
        place(values, round_, parts)
    for shapes, rows, index in plan.shapes.groups(pairs.item):
        own = ((kind[rows] == ELLIPSE) & (place_of[rows] >= 0)).nonzero()[0]
        if own.size:
            pixel = pairs.pixel[rows[own]]
            when = time[pixel] if isinstance(time, np.ndarray) else time
            oval = shapes.elliptic_outline(index[own], columns(surface.point, pixel), when)
            for values, parts in zip((center, half_u, half_v), oval, strict=True):
                place(values, place_of[rows[own]], parts)
    return cones_of_ellipses(center, half_u, half_v)


def _outlines(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, time: Array | float
) -> tuple[Ints, Array, Array]:
    """Kinds (m,) of the outlines of occluders; centres (3, m) from the points, and radii, of
    circular ones.
    """
    m = pairs.item.size
    kind, v, r = np.empty(m, dtype=np.int64), np.zeros((3, m)), np.zeros(m)
    for shapes, rows, index in plan.shapes.groups(pairs.item):
        pixel = pairs.pixel[rows]
        point, own = columns(surface.point, pixel), pairs.item[rows] == surface.item[pixel]
        when = time[pixel] if isinstance(time, np.ndarray) else time
        kind[rows] = each = shapes.outline_kind(index, point, own, light, when)
        some = (each == CIRCLE).nonzero()[0]
        if some.size:
            moment = when[some] if isinstance(when, np.ndarray) else when
            circle = shapes.circular_outline(index[some], columns(point, some), moment)
            place(v, rows[some], circle[0])
            r[rows[some]] = circle[1]
    return kind, v, r


def _polygons(
    plan: Plan, surface: Surface, pairs: Pairs, time: Array | float, number: int
) -> Array:
    """Corners (number, j, 3, n) metres of the polygons of n points that all have equally many.

    pairs : of these points and the polygons, sorted by point.
    """
    if not number:
        return np.zeros((0, 4, 3, pairs.item.size))
    count = pairs.item.size // number
    parts: list[tuple[Ints, Array]] = []
    most = 0
    for shapes, rows, index in plan.shapes.groups(pairs.item):
        when = time[pairs.pixel[rows]] if isinstance(time, np.ndarray) else time
        point = columns(surface.point, pairs.pixel[rows])
        outline = np.array(shapes.polygonal_outline(index, point, when))
        parts.append((rows, outline))
        most = max(most, len(outline))
    corners = np.empty((most, 3, pairs.item.size))
    for rows, outline in parts:
        for k in range(most):
            # of polygons with fewer corners the last one is repeated
            place(corners[k], rows, outline[min(k, len(outline) - 1)])
    return corners.reshape(most, 3, count, number).transpose(3, 0, 1, 2)
