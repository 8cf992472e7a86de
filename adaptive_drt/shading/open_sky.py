# SPDX-License-Identifier: GPL-3.0-or-later
"""Irradiance of a uniform sky behind spheres and a few polygons, at many points at a time.

Under a sky every object is an occluder, and hardly two points have as many of them. So points are
not grouped by the numbers of their occluders as for other lights: see `geometry.open_hemisphere`.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..geometry.occluder_outline import CIRCLE, NOTHING, POLYGON
from ..geometry.open_hemisphere import open_hemisphere_factor, polygons_in_general_position
from ..geometry.silhouettes import PolygonSilhouettes, make_polygon_silhouettes
from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Ints
from ..numerics.gather import columns, place
from ..numerics.vector import dot
from ..parallel.call_progress import report_progress
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface

__all__ = ["open_sky_factors"]


BATCH_PAIRS = 1 << 20
"""Number of pairs of points and occluders in a batch: some 100 MB."""
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
    other = (kind != CIRCLE) & (kind != POLYGON) & (kind != NOTHING)
    flat = (kind == POLYGON).nonzero()[0]
    number = np.bincount(pairs.pixel[flat], minlength=count)
    number[pairs.pixel[other]] = MOST_POLYGONS
    known, factor = number < MOST_POLYGONS, np.zeros(count)
    round_ = (kind == CIRCLE).nonzero()[0]
    for m in np.unique(number[known]).tolist():
        rows = (number == m).nonzero()[0]
        polygons = None
        if m:
            mine = flat[number[pairs.pixel[flat]] == m]
            polygons = _polygons(plan, surface, pairs.take(mine), time, m)
            clear = polygons_in_general_position(columns(surface.normal, rows), polygons)
            known[rows[~clear]] = False
            polygons, rows = polygons.at_points(clear.nonzero()[0]), rows[clear]
        at = np.full(count, -1)
        at[rows] = np.arange(rows.size)
        own = round_[at[pairs.pixel[round_]] >= 0]
        away, radius = columns(v, own), r[own]
        length = np.sqrt(dot(away, away))
        cosine = np.sqrt(np.maximum((length - radius) * (length + radius), 0.0)) / length
        factor[rows] = open_hemisphere_factor(
            columns(surface.normal, rows), away / length, radius / length, cosine,
            at[pairs.pixel[own]], polygons,
        )  # fmt: skip
    rows = known.nonzero()[0]
    return rows, factor[rows]


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
) -> PolygonSilhouettes:
    """The silhouettes of the polygons of n points that all have equally many.

    pairs : of these points and the polygons, sorted by point.
    """
    pixel = pairs.pixel[::number]
    count = pixel.size
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
    own = corners.reshape(most, 3, count, number).transpose(3, 0, 1, 2)
    return make_polygon_silhouettes(own, columns(surface.normal, pixel))
