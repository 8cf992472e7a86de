# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles as a kind of shape: the polygons of three edges.

Triangles of a mesh share edges. Rounding could let a ray through a shared edge pass both of them,
as each is tested from vertices of its own. So each triangle is made larger by more than rounding:
its edges are moved outwards by `EDGE_MARGIN` of its distance from the camera, far less than a
picture shows, and neighbours overlap.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...numerics.arrays import Array
from ...numerics.axes import SHUTTER_ENDS
from ...numerics.floats import TINY
from ...numerics.vector import cross, dot, norm
from ...scene.description import Triangle, Triangles
from .kernels import PlaneNormals, distance_to_polygon
from .shape import PolygonSet

__all__ = ["EDGE_MARGIN", "TriangleSet"]

EDGE_MARGIN = 2.0**-44
"""Distance by which edges of triangles are moved outwards, as a fraction of the distance of the
triangle's farthest vertex from the camera.

Edge functions of rays from the camera are off by less than 2^-48 of it (see
`kernels.EDGE_FUNCTION_OPERATIONS`), those of shadow rays by less than the margin as long as the ray
is no longer than 16 times that distance."""


MAX_GROWTH = 2.0**-10
"""Largest change of length of a triangle's edges, as a fraction, when they are moved outwards.

It only limits triangles narrower than 2^-33 of their distance, which would become longer than what
they are meant to overlap."""


@dataclass(frozen=True)
class TriangleSet(PolygonSet):
    """Triangles corner + x * edge_u + y * edge_v, with x, y and 1 - x - y in 0..1."""

    @classmethod
    def from_records(
        cls, records: Sequence[Triangle | Triangles], origin: Array, displacement: Array | None
    ) -> TriangleSet:
        """Triangles relative to the camera at `origin` (3, 1), metres."""
        parts = [np.reshape(record.vertices, (3, 3, -1)) for record in records]
        vertices = np.concatenate(parts, axis=2) if parts else np.zeros((3, 3, 0))
        a, b, c = vertices - origin
        away = [norm(vertex) for vertex in (a, b, c)]
        if displacement is not None:
            ends = [vertex + t * displacement for vertex in (a, b, c) for t in SHUTTER_ENDS]
            away = [norm(vertex) for vertex in ends]
        q, u, v = _enlarged(a, b - a, c - a, EDGE_MARGIN * np.maximum.reduce(away))
        return cls(q, u, v, displacement)

    @staticmethod
    def vertices(q: Array, u: Array, v: Array) -> PlaneNormals:
        """See `PolygonSet.vertices`."""
        return (q, q + u, q + v)

    @staticmethod
    def edges(q: Array, u: Array, v: Array) -> tuple[PlaneNormals, PlaneNormals]:
        """See `PolygonSet.edges`."""
        return (q, q + u, q), (u, v - u, v)

    @staticmethod
    def planes(q: Array, u: Array, v: Array) -> tuple[PlaneNormals, Array, Array]:
        """See `PolygonSet.planes`; errors are those of `kernels.edge_planes`."""
        normal = cross(u, v)
        height = dot(q, normal)
        side = np.where(height < 0.0, -1.0, 1.0)
        planes = (side * cross(q, u), side * cross(q + u, v - u), side * cross(v, q))
        return planes, side * normal, side * height

    @staticmethod
    def distance(q: Array, u: Array, v: Array) -> Array:
        """See `PolygonSet.distance`."""
        return distance_to_polygon(TriangleSet.vertices(q, u, v))

    @staticmethod
    def bounding_ball(q: Array, u: Array, v: Array) -> tuple[Array, Array]:
        """See `PolygonSet.bounding_ball`: around the circumcentre of an acute triangle.

        The ball of any other triangle is the one around the middle of its longest edge.
        """
        # the angle at a vertex is not acute where the edges from it have no positive dot product
        uu, vv, uv = dot(u, u), dot(v, v), dot(u, v)
        area = np.maximum(uu * vv - uv * uv, 0.0)
        safe = np.where(area > 0.0, 2.0 * area, 1.0)
        x, y = vv * (uu - uv) / safe, uu * (vv - uv) / safe
        for obtuse, (own_x, own_y) in (
            (uv <= 0.0, (0.5, 0.5)),
            (uu <= uv, (0.0, 0.5)),
            (vv <= uv, (0.5, 0.0)),
        ):
            x, y = np.where(obtuse, own_x, x), np.where(obtuse, own_y, y)
        middle = x * u + y * v
        square = np.maximum(dot(middle, middle), dot(u - middle, u - middle))
        return q + middle, np.sqrt(np.maximum(square, dot(v - middle, v - middle)))


def _enlarged(q: Array, u: Array, v: Array, margin: Array) -> tuple[Array, Array, Array]:
    """Corners and edges (3, n) of triangles whose edges are moved outwards by margins (n,), metres.

    The triangle is enlarged about the centre of its incircle.
    """
    w = v - u
    lengths = norm(w), norm(v), norm(u)
    whole = lengths[0] + lengths[1] + lengths[2]
    middle = (lengths[1] * u + lengths[2] * v) / whole
    radius = norm(cross(u, v)) / whole
    growth = np.minimum(margin / np.maximum(radius, TINY), MAX_GROWTH)
    return q - growth * middle, u * (1.0 + growth), v * (1.0 + growth)
