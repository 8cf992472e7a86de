# SPDX-License-Identifier: GPL-3.0-or-later
"""Kinds of shapes of tests only: shapes that answer nothing more than they must."""

from __future__ import annotations

from dataclasses import dataclass

from adaptive_drt.geometry.shape import ShapeSet
from adaptive_drt.geometry.sphere.shape import SphereSet

__all__ = ["EnclosedSet"]


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
