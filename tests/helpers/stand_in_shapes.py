# SPDX-License-Identifier: GPL-3.0-or-later
"""Kinds of shapes of tests only: polygons of three edges, and shapes that answer nothing more than
they must."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from adaptive_drt.geometry.polygon.shape import PolygonSet
from adaptive_drt.geometry.shape import ShapeSet
from adaptive_drt.geometry.sphere.shape import SphereSet
from adaptive_drt.numerics.vector import cross

__all__ = ["EnclosedSet", "TriangleSet"]


@dataclass(frozen=True)
class TriangleSet(PolygonSet):
    """Triangles q, q + u, q + v: polygons whose number of edges is not four."""

    @classmethod
    def from_records(cls, records, origin, displacement):
        raise NotImplementedError

    @staticmethod
    def vertices(q, u, v):
        return q, q + u, q + v

    @staticmethod
    def edges(q, u, v):
        return (q, q + u, q + v), (u, v - u, -v)

    @staticmethod
    def planes(q, u, v):
        normal = cross(u, v)
        height = (q * normal).sum(axis=0)
        side = np.where(height < 0.0, -1.0, 1.0)
        planes = tuple(
            side * cross(start, edge)
            for start, edge in zip(*TriangleSet.edges(q, u, v), strict=True)
        )
        return planes, side * normal, side * height

    @staticmethod
    def distance(q, u, v):
        raise NotImplementedError


@dataclass(frozen=True)
class EnclosedSet(ShapeSet):
    """A kind of shape with the required methods only; the shapes are spheres."""

    spheres: SphereSet

    @property
    def displacement(self):
        return self.spheres.displacement

    @classmethod
    def from_records(cls, records, origin, displacement):
        return cls(SphereSet.from_records(records, origin, displacement))

    @property
    def bounding_spheres(self):
        return self.spheres.bounding_spheres

    def intersect(self, index, w, time):
        return self.spheres.intersect(index, w, time)

    def surface(self, index, w, point, time):
        return self.spheres.surface(index, w, point, time)

    def blocks(self, index, start, to, time):
        return self.spheres.blocks(index, start, to, time)

    def line_forms(self, index, rows, rays):
        return self.spheres.line_forms(index, rows, rays)
