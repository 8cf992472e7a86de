# SPDX-License-Identifier: GPL-3.0-or-later
"""Parallelograms: intersection and occlusion by edge functions linear in a ray's direction.

Seen from a ray's origin, the parallelogram q, q + a, q + a + b, q + b is the cone of directions w
with w.m >= 0 for the four planes m through the origin and an edge. The planes are oriented by the
side of the quad that the origin is on, so the four signs also imply that the hit lies ahead, and
visibility is decided without a division.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from ...numerics.arrays import Array, Mask
from ...numerics.floats import TINY
from ...numerics.vector import cross, dot

__all__ = [
    "EDGE_FUNCTION_OPERATIONS",
    "PlaneNormals",
    "distance_at_closest_approach",
    "distance_to_edge",
    "distance_to_polygon",
    "distance_to_quad",
    "edge_planes",
    "intersect_quad",
    "moves_in_own_plane",
    "plane_hits",
    "quad_blocks_segment",
    "quad_edges",
    "snapped_height",
]

EDGE_FUNCTION_OPERATIONS = 32
"""Number of rounded operations behind one edge function w.plane.

Its rounding error is at most so many unit roundoffs of |w| |plane|."""
PlaneNormals: TypeAlias = tuple[Array, ...]
"""Normals (3, ...) of the planes through the origin and each edge of a polygon, inwards."""

TRIPLE_PRODUCT_ROUNDING = 2.0**-48
"""Generous bound on the rounding error of the triple product of a displacement and two edges.

It is relative to the product of their lengths, and also holds in a scene that was rotated."""


def edge_planes(q: Array, a: Array, b: Array) -> tuple[PlaneNormals, Array, Array]:
    """Return the planes through the origin that bound the directions to a parallelogram.

    Parameters
    ----------
    q : (3, ...) vector from the origin to the corner.  a, b : (3, ...) edges.

    Returns
    -------
    planes : four (3, ...) inward normals, through the edges u = 0, v = 0, u = 1, v = 1.
    normal : (3, ...) a x b, turned away from the origin (w.normal > 0 for hits ahead).
    height : (...) q.normal >= 0, the distance of the plane times |a x b|; 0 where the origin
        lies in the plane, from where the quad is invisible.

    With u = 2^-53, a product w.plane has an error of at most 8 u |w| |c| |e|, c and e the corner
    and edge that made the plane; its sign, and the height's, are certain where |q.n| > 8 u
    |q||a||b|.
    """
    normal = cross(a, b)
    height = dot(q, normal)
    side = np.where(height < 0.0, -1.0, 1.0)
    planes = (
        side * cross(b, q),
        side * cross(q, a),
        side * cross(q + a, b),
        side * cross(a, q + b),
    )
    return planes, side * normal, side * height


def snapped_height(height: Array, normal: Array, graze: Array | float) -> Array:
    """Return the height, set to 0 where the origin is within `graze` metres of the quad's plane.

    A hit on a quad lies off its plane by at most 4 u (|p| + |c - p|) |a||b| / |a x b| metres, p the
    hit and c the quad's corner, relative to the camera: `graze` must be of that size, not of |p|'s.
    """
    size = np.sqrt(dot(normal, normal))
    return np.where(height > graze * size, height, 0.0)


def intersect_quad(w: Array, planes: PlaneNormals, normal: Array, height: Array) -> Array:
    """Ray parameter of the hit, inf for a miss; arguments as `edge_planes` returns them.

    The error is at most 4 u |a||b| (|q| + t |w|) / |w.n|, where all signs are certain.
    """
    inside = _inside(w, planes)
    facing = dot(w, normal)
    found = inside & (facing > 0.0) & (height > 0.0)
    with np.errstate(over="ignore"):  # a grazing hit beyond float64's range is a miss
        t: Array = np.where(found, height, np.inf) / np.where(found, facing, 1.0)
    return t


def quad_blocks_segment(w: Array, planes: PlaneNormals, normal: Array, height: Array) -> Mask:
    """Whether a quad cuts the open segment from the origin to w.

    The answer is certain where each compared quantity exceeds 8 u times the product of its factors'
    lengths: |w||c||e| for the edges, |a||b| (|w| + |q|) for the plane.
    """
    return _inside(w, planes) & (dot(w, normal) > height) & (height > 0.0)


def _inside(w: Array, planes: PlaneNormals) -> Mask:
    """Whether directions w lie in the cone of four inward planes, boundary included."""
    inside = dot(w, planes[0]) >= 0.0
    for plane in planes[1:]:
        inside = inside & (dot(w, plane) >= 0.0)
    return inside


def quad_edges(q: Array, a: Array, b: Array) -> tuple[PlaneNormals, PlaneNormals]:
    """Start points and vectors of the four edges of parallelograms, ordered as `edge_planes`."""
    return (q, q, q + a, q + b), (b, a, b, a)


def distance_at_closest_approach(start: Array, edge: Array, axis: Array) -> Array:
    """Distance (m,) from the origin to the point of an edge that is nearest to a ray's line.

    Parameters
    ----------
    start, edge : (3, m) metres, start point and vector of the edge.
    axis : (3, m) unit vectors along the rays from the origin.
    """
    across = edge - dot(edge, axis) * axis
    square = np.maximum(dot(across, across), TINY)
    place = start + np.clip(-dot(start, across) / square, 0.0, 1.0) * edge
    distance: Array = np.sqrt(dot(place, place))
    return distance


def distance_to_quad(q: Array, a: Array, b: Array) -> Array:
    """Distance (m,) from the origin to parallelograms with corners q and edges a, b (3, m)."""
    aa, ab, bb, qa, qb = dot(a, a), dot(a, b), dot(b, b), dot(q, a), dot(q, b)
    gram = np.maximum(aa * bb - ab * ab, TINY)
    # the origin's projection onto the plane, in units of the edges
    x, y = (ab * qb - bb * qa) / gram, (ab * qa - aa * qb) / gram
    nearest = q + x * a + y * b
    over = (np.abs(x - 0.5) <= 0.5) & (np.abs(y - 0.5) <= 0.5)
    distance = np.where(over, np.sqrt(dot(nearest, nearest)), np.inf)
    for start, edge in zip(*quad_edges(q, a, b), strict=True):
        distance = np.minimum(distance, distance_to_edge(start, edge))
    found: Array = distance
    return found


def distance_to_polygon(vertices: PlaneNormals) -> Array:
    """Distance (m,) from the origin to convex polygons with vertices (3, m) in order, metres."""
    first, count = vertices[0], len(vertices)
    normal = cross(vertices[1] - first, vertices[2] - first)
    distance = np.full(first.shape[1], np.inf)
    left = right = np.ones(first.shape[1], dtype=np.bool_)
    for k, start in enumerate(vertices):
        edge = vertices[(k + 1) % count] - start
        side = dot(cross(normal, edge), start)
        left, right = left & (side <= 0.0), right & (side >= 0.0)
        distance = np.minimum(distance, distance_to_edge(start, edge))
    size = np.sqrt(np.maximum(dot(normal, normal), TINY))
    over: Array = np.where(left | right, np.abs(dot(normal, first)) / size, distance)
    return over


def distance_to_edge(start: Array, edge: Array) -> Array:
    """Distance (m,) from the origin to segments from `start` to `start + edge`, (3, m) each."""
    part = np.clip(-dot(start, edge) / np.maximum(dot(edge, edge), TINY), 0.0, 1.0)
    nearest = start + part * edge
    distance: Array = np.sqrt(dot(nearest, nearest))
    return distance


def plane_hits(w: Array, normal: Array, corner: Array, vertices: PlaneNormals) -> Array:
    """Ray parameters (m,) of the intersections of rays (3, m) with the planes of polygons.

    Quadrature nodes may lie outside the pixels that see a polygon, so its plane is used beyond its
    edges. Where the plane is hit behind the camera, or beyond twice the distance of the farthest
    vertex, the largest ray parameter of the vertices' projections onto the ray is returned.

    Parameters
    ----------
    normal : (3, m) of any length.  corner, vertices : (3, m) metres.
    """
    facing, height = dot(w, normal), dot(corner, normal)
    ww = dot(w, w)
    along = [dot(w, c) / ww for c in vertices]
    limit = 2.0 * np.sqrt(np.maximum.reduce([dot(c, c) for c in vertices]) / ww)
    ahead = np.abs(facing) * limit > np.abs(height)
    ahead &= facing * height > 0.0
    t = np.where(ahead, height, 0.0) / np.where(ahead, facing, 1.0)
    return np.where(ahead, t, np.maximum.reduce(along))


def moves_in_own_plane(d: Array, u: Array, v: Array) -> Mask:
    """Whether displacements d of polygons with edges u, v are in their planes: (n,)."""
    lengths = np.sqrt(dot(d, d)) * np.sqrt(dot(u, u)) * np.sqrt(dot(v, v))
    within: Mask = np.abs(dot(d, cross(u, v))) <= TRIPLE_PRODUCT_ROUNDING * lengths
    return within
