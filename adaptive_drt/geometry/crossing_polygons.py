# SPDX-License-Identifier: GPL-3.0-or-later
"""Visible edges of many polygons on the unit sphere, by the pairs of polygons that come near.

Of m outlines seen from a point few pairs overlap: each lies in a circular cone about the mean of
its corners, and an edge can be behind a polygon only where their cones meet. So the work is m^2
comparisons of cosines, and the arcs of the pairs that are left.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.floats import TINY
from ..numerics.vector import dot
from .crossing_circles import gaps_of_rings
from .silhouettes import PolygonSilhouettes
from .spherical_curves import (
    BoundaryAntiderivative,
    GreatCircleArcs,
    HalfSpaces,
    Intervals,
    arcs_inside_outline,
    boundary_values,
)

__all__ = ["open_arcs", "open_arcs_integral", "open_edges", "open_edges_integral"]


CONE_MARGIN = 2.0**-30
"""Cosine by which the cones that enclose two polygons may miss each other and still count as
meeting: their own are rounded. Wider cones only cost time."""


def open_edges_integral(
    polygons: PolygonSilhouettes,
    base: Intervals,
    hidden: Intervals | None,
    reach: Array,
    potential: BoundaryAntiderivative,
) -> Array:
    """Integral of n.(w x dw) along the parts of polygons' edges that no other polygon covers: (n,).

    Of edges that coincide the first polygon's is the outer one, as in `occluded_form_factor`.

    Parameters
    ----------
    base : (e, n) rad, the intervals of the edges that count at all.
    hidden : (c, e, n) rad, further intervals of them that are covered, or None.
    reach : (n,) as for `arcs_inside_outline`.
    """
    return _integral(potential, base[0].shape[1], open_edges(polygons, base, hidden, reach))


def open_edges(
    polygons: PolygonSilhouettes, base: Intervals, hidden: Intervals | None, reach: Array
) -> tuple[Ints, Array, Array]:
    """Parts of polygons' edges that no other polygon covers; see `open_edges_integral`.

    Returns
    -------
    ring : (m,) indices edge n + point of their edges, ascending.  low, high : (m,) radians.
    """
    edge, other, point = _near_pairs(polygons, base)
    j = polygons.segments.half_angle.shape[0] // polygons.edge_on.shape[0]
    pairs = edge, other, point
    spans = _intervals_behind(polygons.segments, polygons, pairs, edge // j > other, reach)
    return _open_parts(base, edge, point, spans, hidden)


def open_arcs_integral(
    arcs: GreatCircleArcs,
    polygons: PolygonSilhouettes,
    hidden: Intervals | None,
    reach: Array,
    potential: BoundaryAntiderivative,
) -> Array:
    """The same for whole arcs (e, n) of a light, which lie behind all polygons: (n,)."""
    parts = open_arcs(arcs, polygons, hidden, reach)
    return _integral(potential, arcs.half_angle.shape[1], parts)


def open_arcs(
    arcs: GreatCircleArcs, polygons: PolygonSilhouettes, hidden: Intervals | None, reach: Array
) -> tuple[Ints, Array, Array]:
    """Parts of a light's arcs that no polygon covers; see `open_arcs_integral`, `open_edges`."""
    half = arcs.half_angle
    pairs = np.broadcast_to(~polygons.edge_on, (half.shape[0], *polygons.edge_on.shape)).nonzero()
    edge, other, point = pairs
    alike = np.ones(edge.size, dtype=np.bool_)
    spans = _intervals_behind(arcs, polygons, (edge, other, point), alike, reach)
    return _open_parts((-half, half), edge, point, spans, hidden)


def _open_parts(
    base: Intervals, edge: Ints, point: Ints, spans: Intervals, hidden: Intervals | None
) -> tuple[Ints, Array, Array]:
    """What intervals `spans` (p,) and `hidden` (c, e, n) leave of `base`, as `open_edges`.

    edge, point : (p,) indices of the edges and points of `spans`.
    """
    count, n = base[0].shape
    low, high = spans
    ring, rings = edge * n + point, np.arange(count * n)
    if hidden is not None:
        ring = np.concatenate([ring, np.tile(rings, hidden[0].shape[0])])
        low, high = (
            np.concatenate([own, more.ravel()])
            for own, more in zip((low, high), hidden, strict=True)
        )
    first, last = base[0].ravel(), base[1].ravel()
    low, high = np.maximum(low, first[ring]), np.minimum(high, last[ring])
    kept = (high > low).nonzero()[0]
    around = np.full(rings.size, np.pi)
    ring = np.concatenate([rings, rings, ring[kept]])
    low = np.concatenate([-around, last, low[kept]])
    high = np.concatenate([first, around, high[kept]])
    ring, low, high = gaps_of_rings(ring, low, high, rings.size)
    live = (high > low).nonzero()[0]
    return ring[live], low[live], high[live]


def _integral(potential: BoundaryAntiderivative, n: int, parts: tuple[Ints, Array, Array]) -> Array:
    """Integral (n,) of n.(w x dw) along parts of edges, as `open_edges` gives them."""
    ring, low, high = parts
    shift = None if potential.phase is None else potential.phase.ravel()[ring]
    a, b, c = (x.ravel()[ring] for x in (potential.a, potential.b, potential.c))
    part = BoundaryAntiderivative(a, b, c, shift)
    value = boundary_values(part, high) - boundary_values(part, low)
    # in the order of the edges, whatever other points there are
    total = np.zeros(n)
    total += np.bincount(ring % n, weights=value, minlength=n)
    return total


def _near_pairs(polygons: PolygonSilhouettes, base: Intervals) -> tuple[Ints, Ints, Ints]:
    """Edges, and other polygons that may cover a part of them: (p,) indices each, and of points."""
    m, n = polygons.edge_on.shape
    edges = polygons.segments
    j = edges.half_angle.shape[0] // m
    # ends of edges: middle cos half +- along sin half
    size = np.cos(edges.half_angle), np.sin(edges.half_angle)
    start = edges.middle * size[0] - edges.along * size[1]
    corners = start.reshape(3, m, j, n)
    axis = corners.sum(axis=2)
    axis = axis / np.maximum(np.sqrt(dot(axis, axis)), TINY)
    cosine = dot(axis[:, :, None], corners).min(axis=1)
    sine = np.sqrt(np.maximum(1.0 - cosine * cosine, 0.0))
    # beyond a right angle a cone that holds the corners need not hold the polygon
    wide = ~(cosine > 0.0)
    near: Mask = np.empty((m, m, n), dtype=np.bool_)
    for i in range(m):
        apart = dot(axis[:, i, None], axis)
        near[i] = apart > cosine[i] * cosine - sine[i] * sine - CONE_MARGIN
        near[i] |= wide[i] | wide | (cosine[i] * sine + sine[i] * cosine < 0.0)
        near[i, i] = False
    near &= ~polygons.edge_on
    live = (base[1] > base[0]).reshape(m, j, n)
    near &= live.any(axis=1)[:, None]
    own, other, point = near.nonzero()
    edge = (own[:, None] * j + np.arange(j)).ravel()
    other, point = np.repeat(other, j), np.repeat(point, j)
    some = live.reshape(m * j, n)[edge, point].nonzero()[0]
    return edge[some], other[some], point[some]


def _intervals_behind(
    arcs: GreatCircleArcs,
    polygons: PolygonSilhouettes,
    pairs: tuple[Ints, Ints, Ints],
    alike: Mask,
    reach: Array,
) -> Intervals:
    """Intervals (p,) of arcs that lie behind polygons, empty where the first is the larger.

    Parameters
    ----------
    pairs : (p,) indices of arcs, of polygons and of points.
    alike, reach : (p,) and (n,), see `arcs_inside_outline`.
    """
    edge, other, point = pairs
    j = polygons.segments.half_angle.shape[0] // polygons.edge_on.shape[0]
    segments = _taken(arcs, edge[None], point)
    outline = _taken(polygons.segments, other * j + np.arange(j)[:, None], point)
    low, high = arcs_inside_outline(segments, outline, alike[None], reach[point])
    return low[0], high[0]


def _taken(arcs: GreatCircleArcs, rows: Ints, point: Ints) -> GreatCircleArcs:
    """Arcs (k, p), given by their indices (k, p) and those of their points (p,)."""
    at = np.broadcast_to(point, rows.shape)
    planes = HalfSpaces(arcs.planes.normal[:, rows, at], arcs.planes.angle_error[rows, at])
    middle, along, u, w = (x[:, rows, at] for x in (arcs.middle, arcs.along, arcs.u, arcs.w))
    shift = None if arcs.middle_angle is None else arcs.middle_angle[rows, at]
    return GreatCircleArcs(planes, middle, along, arcs.half_angle[rows, at], u, w, shift)
