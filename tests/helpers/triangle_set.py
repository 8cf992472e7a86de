# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles for tests of what polygons of any number of edges have in common."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from adaptive_drt.geometry.polygon.kernels import distance_to_polygon
from adaptive_drt.geometry.polygon.shape import PolygonSet
from adaptive_drt.numerics.vector import cross, dot

__all__ = ["TriangleSet"]


@dataclass(frozen=True)
class TriangleSet(PolygonSet):
    """Triangles corner + x * edge_u + y * edge_v, with x, y and 1 - x - y in 0..1."""

    @classmethod
    def from_records(cls, records, origin, displacement):
        raise NotImplementedError

    @staticmethod
    def vertices(q, u, v):
        return (q, q + u, q + v)

    @staticmethod
    def edges(q, u, v):
        return (q, q, q + u), (v, u, v - u)

    @staticmethod
    def planes(q, u, v):
        normal = cross(u, v)
        height = dot(q, normal)
        side = np.where(height < 0.0, -1.0, 1.0)
        planes = (side * cross(v, q), side * cross(q, u), side * cross(q + u, v - u))
        return planes, side * normal, side * height

    @staticmethod
    def distance(q, u, v):
        return distance_to_polygon(TriangleSet.vertices(q, u, v))
