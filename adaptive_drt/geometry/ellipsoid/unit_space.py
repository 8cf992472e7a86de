# SPDX-License-Identifier: GPL-3.0-or-later
"""Ellipsoids as unit spheres: the linear maps to the spaces in which they are such.

A ray, a segment or a plane stays one in an ellipsoid's own space, and keeps its parameters; the
order along rays is the same. Only lengths and angles differ, by factors between the reciprocals of
the longest and of the shortest half axis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...numerics.arrays import Array, Ints
from ...numerics.gather import columns
from ...numerics.vector import dot
from ..light_protocol import LinearSpan

__all__ = ["UnitSpace"]


@dataclass(frozen=True)
class UnitSpace:
    """Maps to the spaces of n ellipsoids, or of some of them in any shape.

    Attributes
    ----------
    half_axes : (3, 3, ...) metres; the first axis counts components, the second the half axes.
    inverse : (3, 3, ...) 1 / m; the first axis counts coordinates, the second components.
    longest, shortest : (...) metres, the principal half axes.
    """

    half_axes: Array
    inverse: Array
    longest: Array
    shortest: Array

    @classmethod
    def make(cls, half_axes: Array) -> UnitSpace:
        """Return the maps of ellipsoids with half axes (3, 3, n)."""
        matrices = np.moveaxis(half_axes, -1, 0)
        sizes = np.linalg.svd(matrices, compute_uv=False)
        inverse = np.ascontiguousarray(np.moveaxis(np.linalg.inv(matrices), 0, -1))
        return cls(half_axes, inverse, sizes[:, 0].copy(), sizes[:, 2].copy())

    def take(self, index: Ints) -> UnitSpace:
        """The maps of ellipsoids given by an index of any shape."""
        return UnitSpace(*(
            columns(each, index, -1)
            for each in (self.half_axes, self.inverse, self.longest, self.shortest)
        ))  # fmt: skip

    def coordinates(self, vector: Array) -> Array:
        """Coordinates (3, ...), in units of half axes, of vectors (3, ...) in metres."""
        inverse = self.inverse
        return np.stack([dot(inverse[0], vector), dot(inverse[1], vector), dot(inverse[2], vector)])

    def vectors(self, coordinates: Array) -> Array:
        """Vectors (3, ...) in metres of coordinates (3, ...)."""
        h, c = self.half_axes, coordinates
        vector: Array = h[:, 0] * c[0] + h[:, 1] * c[1] + h[:, 2] * c[2]
        return vector

    def covectors(self, direction: Array) -> Array:
        """Dot products (3, ...) of the half axes with vectors (3, ...), as normals are mapped."""
        h = self.half_axes
        return np.stack([dot(h[:, 0], direction), dot(h[:, 1], direction), dot(h[:, 2], direction)])

    def normals(self, place: Array) -> Array:
        """Unit normals (3, ...) at coordinates (3, ...) on the unit sphere."""
        g = self.inverse
        normal = g[0] * place[0] + g[1] * place[1] + g[2] * place[2]
        unit: Array = normal / np.sqrt(dot(normal, normal))
        return unit

    def span(self, span: LinearSpan) -> LinearSpan:
        """A light's span in the ellipsoids' spaces, (3, m)."""
        normal = self.covectors(span.normal)
        normal = normal / np.sqrt(dot(normal, normal))
        return LinearSpan(self.coordinates(span.half_u), self.coordinates(span.half_v), normal)

    @property
    def stretch(self) -> Array:
        """Ratios (...) of the longest to the shortest half axis, at least 1."""
        return self.longest / self.shortest
