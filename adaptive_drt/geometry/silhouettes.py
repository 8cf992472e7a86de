# SPDX-License-Identifier: GPL-3.0-or-later
"""Silhouettes seen from points: of lights above the horizon, and of occluding polygons."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.floats import TINY, UNIT_ROUNDOFF
from ..numerics.gather import columns
from ..numerics.vector import cross, dot, normalize
from .elliptic_cones import EllipticCones, arcs_inside_elliptic_cones, map_cones
from .spherical_curves import (
    Circles,
    GreatCircleArcs,
    HalfSpaces,
    make_circles,
    make_great_circle_arcs,
)

__all__ = [
    "CircularSilhouette",
    "EllipticSilhouette",
    "Hemisphere",
    "LightSilhouette",
    "OpenSilhouette",
    "PolygonSilhouettes",
    "circular_silhouette",
    "elliptic_silhouette",
    "hemisphere_silhouette",
    "make_polygon_silhouettes",
    "polygon_silhouette",
]


HORIZON_ARCS = 3
"""Number of arcs into which a whole horizon is cut: the least whose arcs are below 180 degrees."""
PLANE_ROUNDING = 8.0
"""Number of rounded operations in the plane of an edge: coincident edges differ by no more."""


@dataclass(frozen=True)
class CircularSilhouette:
    """The silhouette of a sphere, or of a disk that faces the point, seen from n points.

    Attributes
    ----------
    axis : (3, n) unit vectors.  cosine, sine : (n,) of the half angle, below 90 degrees.
    """

    axis: Array
    cosine: Array
    sine: Array


@dataclass(frozen=True)
class EllipticSilhouette:
    """The silhouette of a flat ellipse, seen from n points.

    Attributes
    ----------
    cones : (n,) the cones over it.
    """

    cones: EllipticCones


@dataclass(frozen=True)
class Hemisphere:
    """The silhouette of a light that surrounds the points: all that is above their horizons."""


OpenSilhouette: TypeAlias = Array | CircularSilhouette | EllipticSilhouette | Hemisphere
"""A light's silhouette before the horizon cuts it: the corners (j, 3, n) of a convex polygon in
order, in metres from n points, or another one."""


@dataclass(frozen=True)
class LightSilhouette:
    """A light's convex silhouette above the horizon, seen from n points.

    Attributes
    ----------
    center : (3, n) unit vectors to its middle.
    reach : (n,) bound on the length of chords from `center` to points of the silhouette, at least
        the sine of its angular radius.
    edges : (j, n) its straight edges, the last on the horizon where that cuts the light; the
        light lies in the half-spaces to their left.
    bounds : one edge for each of these half-spaces; of several edges in one, the first.
    cone : the (1, n) cone that it lies in, or None.
    ellipse : the (1, n) elliptic cone that it lies in, or None.
    """

    center: Array
    reach: Array
    edges: GreatCircleArcs
    bounds: GreatCircleArcs
    cone: Circles | None
    ellipse: EllipticCones | None = None


@dataclass(frozen=True)
class PolygonSilhouettes:
    """The silhouettes of m convex occluders of j edges each.

    Attributes
    ----------
    segments : (m * j, n) their edges.  flat : (m, n) which of them are seen edge-on.
    """

    segments: GreatCircleArcs
    edge_on: Mask

    def edge_rows(self, i: int) -> slice:
        """Rows in `segments` of the edges of polygon i."""
        j = self.segments.half_angle.shape[0] // self.edge_on.shape[0]
        return slice(i * j, (i + 1) * j)

    def at_points(self, rows: Ints) -> PolygonSilhouettes:
        """The silhouettes as seen from some of the points."""
        return PolygonSilhouettes(self.segments.at_points(rows), columns(self.edge_on, rows))


def polygon_silhouette(corners: Array, normal: Array, cut: bool) -> LightSilhouette:
    """Return the silhouette of a light that is a convex polygon of j edges, above the horizon.

    Parameters
    ----------
    corners : (j, 3, n) metres from the points, in order.  normal : (3, n) unit vectors.
    cut : True if the horizon cuts the light for all n points, False if for none.
    """
    corners = _anticlockwise(np.ascontiguousarray(corners.swapaxes(0, 1)))[0]
    length = np.sqrt(dot(corners, corners))
    units = corners / length
    middle = units[:, 0]
    for k in range(1, units.shape[1]):
        middle = middle + units[:, k]
    center = normalize(middle)
    chords = units - center[:, None]
    reach = np.sqrt(dot(chords, chords).max(axis=0))
    planes = _edge_planes(corners, length)
    if cut:
        edges = _edges_above_horizon(corners, normal, planes)
    else:
        edges = make_great_circle_arcs(units, _next_corners(units), planes)
    return LightSilhouette(center, reach, edges, edges, None)


def circular_silhouette(light: CircularSilhouette, normal: Array, cut: bool) -> LightSilhouette:
    """Return the silhouette of a round light; parameters as for `polygon_silhouette`."""
    center = light.axis
    cone = make_circles(center[:, None], light.sine[None], light.cosine[None], center)
    edges = _horizon_arc(cone, normal) if cut else _no_edges(normal)
    return LightSilhouette(center, light.sine * np.sqrt(2.0), edges, edges, cone)


def elliptic_silhouette(cones: EllipticCones, normal: Array, cut: bool) -> LightSilhouette:
    """Return the silhouette of a light within cones (n,); else as `polygon_silhouette`."""
    ring = map_cones(lambda each: each[..., None, :], cones)
    edges = _horizon_in_cones(ring, normal) if cut else _no_edges(normal)
    reach = np.sqrt(2.0) * cones.a / np.sqrt(1.0 + cones.a * cones.a)
    return LightSilhouette(cones.z, reach, edges, edges, None, ring)


def hemisphere_silhouette(normal: Array) -> LightSilhouette:
    """Return the hemispheres above the horizons of points with unit normals (3, n).

    Their edges are thirds of the horizon, and not a cone of 90 degrees: planes of edges carry
    bounds on their rounding, so that the foot of a wall lies in the horizon of its floor.
    """
    count = normal.shape[1]
    frame = make_circles(normal[:, None], np.ones((1, count)), np.zeros((1, count)), normal)
    turn = (2.0 * np.pi / HORIZON_ARCS) * np.arange(HORIZON_ARCS)[:, None]
    middle = np.cos(turn) * frame.u + np.sin(turn) * frame.w
    planes = HalfSpaces(
        np.repeat(normal[:, None], HORIZON_ARCS, axis=1),
        np.full((HORIZON_ARCS, count), PLANE_ROUNDING * UNIT_ROUNDOFF),
    )
    along, half = cross(planes.normal, middle), np.full((HORIZON_ARCS, count), np.pi / HORIZON_ARCS)
    edges = GreatCircleArcs(planes, middle, along, half, middle, along, None)
    reach = np.full(count, np.sqrt(2.0))
    return LightSilhouette(normal, reach, edges, edges.take(slice(0, 1)), None)


def make_polygon_silhouettes(quads: Array, center: Array) -> PolygonSilhouettes:
    """Return the silhouettes of convex occluders, in anticlockwise order.

    Parameters
    ----------
    quads : (m, j, 3, n) metres, corners from the points, in order.
    center : (3, n) unit vectors to the middle of the light.
    """
    m, j, _, n = quads.shape
    corners = np.ascontiguousarray(quads.transpose(2, 1, 0, 3))
    corners, area, facing = _anticlockwise(corners)
    scale = np.sqrt(dot(area, area)) * np.sqrt(dot(corners[:, 0], corners[:, 0]))
    # sine of the point's elevation over the polygon's plane, seen from its first corner
    elevation = np.abs(facing) / np.maximum(scale, TINY)
    length = np.sqrt(dot(corners, corners))
    units = corners / np.maximum(length, TINY)
    planes = _edge_planes(corners, length)
    # (3, j, m, n) to (3, m * j, n), the edges of each polygon adjacent
    normal, start, end = (
        x.swapaxes(1, 2).reshape(3, m * j, n) for x in (planes.normal, units, _next_corners(units))
    )
    fuzz = planes.angle_error.swapaxes(0, 1).reshape(m * j, n)
    segments = make_great_circle_arcs(start, end, HalfSpaces(normal, fuzz), center)
    return PolygonSilhouettes(segments, elevation <= PLANE_ROUNDING * UNIT_ROUNDOFF)


def _next_corners(corners: Array) -> Array:
    """The next corner of each, along the second axis."""
    return np.concatenate([corners[:, 1:], corners[:, :1]], axis=1)


def _anticlockwise(corners: Array) -> tuple[Array, Array, Array]:
    """Return corners (3, j, ..., n) in anticlockwise order as seen from the point.

    With them come twice the vector areas (3, ..., n) of the corners as given, and their dot
    products (..., n) with the first corners, which are 0 if the polygon is edge-on.
    """
    area = _twice_vector_area(corners)
    facing = dot(area, corners[:, 0])
    away = facing < 0.0
    if away.any():
        turned = np.concatenate([corners[:, :1], corners[:, :0:-1]], axis=1)
        corners = np.where(away, turned, corners)
    return corners, area, facing


def _twice_vector_area(corners: Array) -> Array:
    """Twice the vector area (3, ..., n) of polygons, accurate to roundoff for thin ones too."""
    edges = _next_corners(corners) - corners
    if corners.shape[1] == 4:
        # sum of two triangles: the diagonals of thin quads are nearly parallel
        both: Array = cross(edges[:, 0], edges[:, 1]) + cross(edges[:, 2], edges[:, 3])
        return both
    parts = cross(corners[:, 1:-1] - corners[:, :1], edges[:, 1:-1])
    area: Array = parts[:, 0]
    for i in range(1, parts.shape[1]):
        area = area + parts[:, i]
    return area


def _edge_planes(corners: Array, length: Array) -> HalfSpaces:
    """Planes through the point and the edges from each corner (3, j, ..., n) to the next."""
    plane = cross(corners, _next_corners(corners) - corners)
    area = np.sqrt(dot(plane, plane))
    size = length + np.concatenate([length[1:], length[:1]])
    rounding = np.maximum(PLANE_ROUNDING * UNIT_ROUNDOFF * size * size, TINY)
    return HalfSpaces(plane / np.maximum(area, TINY), rounding / np.maximum(area, rounding))


def _edges_above_horizon(corners: Array, normal: Array, planes: HalfSpaces) -> GreatCircleArcs:
    """Edges of the part of a polygon above the horizon, the last along the horizon: (j + 1, n)."""
    n, end = normal[:, None], _next_corners(corners)
    h0, h1 = dot(n, corners), dot(n, end)
    down, rise = (h0 > 0.0) & (h1 <= 0.0), (h0 <= 0.0) & (h1 > 0.0)
    crossing = corners + (h0 / np.where(down | rise, h0 - h1, 1.0)) * (end - corners)
    leave, enter = crossing[:, 0], crossing[:, 0]
    for i in range(1, corners.shape[1]):
        leave = np.where(down[i], crossing[:, i], leave)
        enter = np.where(rise[i], crossing[:, i], enter)
    below = (h0 <= 0.0) & (h1 <= 0.0)
    first = np.where(rise, crossing, corners)
    last = np.where(down, crossing, np.where(below, corners, end))
    first = np.concatenate([first, leave[:, None]], axis=1)
    last = np.concatenate([last, enter[:, None]], axis=1)
    planes = _with_horizon(planes, normal)
    return make_great_circle_arcs(normalize(first), normalize(last), planes)


def _with_horizon(planes: HalfSpaces, normal: Array) -> HalfSpaces:
    """Append the half-space above the horizon to planes (j, n): (j + 1, n)."""
    fuzz = np.full((1, normal.shape[1]), PLANE_ROUNDING * UNIT_ROUNDOFF)
    return HalfSpaces(
        np.concatenate([planes.normal, normal[:, None]], axis=1),
        np.concatenate([planes.angle_error, fuzz]),
    )


def _no_edges(normal: Array) -> GreatCircleArcs:
    """Arcs of shape (0, n), for a light without straight edges."""
    vectors, numbers = np.zeros((3, 0, normal.shape[1])), np.zeros((0, normal.shape[1]))
    planes = HalfSpaces(vectors, numbers)
    return GreatCircleArcs(planes, vectors, vectors, numbers, vectors, vectors, None)


def _horizon_arc(cone: Circles, normal: Array) -> GreatCircleArcs:
    """The arc of the horizon inside a round light that the horizon cuts."""
    planes = _with_horizon(_no_edges(normal).planes, normal)
    n = planes.normal
    mu = dot(n, cone.axis)
    foot = cone.axis - mu * n
    length = np.sqrt(dot(foot, foot))
    q = np.sqrt(np.maximum((cone.sine - mu) * (cone.sine + mu), 0.0))
    middle = foot / np.maximum(length, TINY)
    along, half = cross(n, middle), np.arctan2(q, cone.cosine)
    return GreatCircleArcs(planes, middle, along, half, middle, along, None)


def _horizon_in_cones(ring: EllipticCones, normal: Array) -> GreatCircleArcs:
    """The arcs of horizons inside lights within elliptic cones (1, n) that the horizons cut."""
    planes = _with_horizon(_no_edges(normal).planes, normal)
    frame = make_circles(planes.normal, np.ones_like(ring.a), np.zeros_like(ring.a), ring.z[:, 0])
    half = np.zeros_like(ring.a)
    around = GreatCircleArcs(planes, frame.u, frame.w, half, frame.u, frame.w, None)
    low, high = (each[0] for each in arcs_inside_elliptic_cones(around, ring))
    turn, half = 0.5 * (low + high), 0.5 * (high - low)
    middle = np.cos(turn) * frame.u + np.sin(turn) * frame.w
    along = cross(planes.normal, middle)
    return GreatCircleArcs(planes, middle, along, half, middle, along, None)
