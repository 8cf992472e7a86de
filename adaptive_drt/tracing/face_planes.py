# SPDX-License-Identifier: GPL-3.0-or-later
"""Planes of planar objects, for the culling of occluders."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..geometry.planar_faces import NO_SOLID
from ..geometry.shape_table import ShapeTable
from ..geometry.sphere.kernels import surface_tolerance
from ..lights.bounds import LightBounds
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.vector import dot
from .intersect import Pairs
from .light_view import LightView

__all__ = ["FacePlanes"]


@dataclass(frozen=True)
class FacePlanes:
    """Planes of planar objects: such an object occludes only light from the plane's other side.

    The spheres, which come first, share row 0 of the arrays: there may be a million of them. So
    does what is no object, -1. Every other object has a row of its own: `_row`.

    Attributes
    ----------
    first : number of the first object that has a row of its own.
    planar : (rows,) whether the object lies in a plane.
    normal : (3, rows) unit, 0 for other objects.  offset : (rows,) metres from the origin.
    shift_bound : (rows,) metres that the plane moves along its normal either way during the
        shutter.
    solid : (rows,) the closed solid that each is a face of: normals point out of it.
    body : (rows,) the convex solid of faces of any kind: see `ShapeSet.bodies`.
    """

    first: int
    planar: Mask
    normal: Array
    offset: Array
    shift_bound: Array
    solid: Ints
    body: Ints

    @classmethod
    def make(cls, table: ShapeTable) -> FacePlanes:
        """Take the planes of all objects of a scene."""
        first = table.proxied
        rows = 1 + table.count - first
        planar, normal = np.zeros(rows, dtype=np.bool_), np.zeros((3, rows))
        offset, slack = np.zeros((2, rows))
        solid, body = np.full(rows, NO_SOLID), np.full(rows, -1)
        for shapes, begin in zip(table.sets, table.firsts[:-1], strict=True):
            if begin < first:
                continue
            faces, own = shapes.faces, slice(begin - first + 1, begin - first + 1 + shapes.count)
            planar[own] = shapes.planar
            if shapes.bodies is not None:
                body[own] = shapes.bodies
            if faces is None:
                continue
            normal[:, own] = faces.normal
            offset[own] = dot(faces.normal, faces.vertices[0])
            solid[own] = np.where(faces.solid == NO_SOLID, NO_SOLID, faces.solid + begin)
            if faces.displacement is not None:
                slack[own] = 0.5 * np.abs(dot(faces.normal, faces.displacement))
        return cls(first, planar, normal, offset, slack, solid, body)

    def _row(self, item: Ints) -> Ints:
        """Rows of objects (k,) in the arrays."""
        found: Ints = np.maximum(item - (self.first - 1), 0)
        return found

    def are_planar(self, item: Ints) -> Mask:
        """Whether objects (k,) lie in planes."""
        found: Mask = self.planar[self._row(item)]
        return found

    def may_separate(self, sight: LightView, at: Ints | slice, item: Ints) -> Mask:
        """Whether the planes of planar objects may separate points from some of the light."""
        row = self._row(item)
        place, reach = self._signed_distances(sight, at, row)
        return self._separates(sight.bounds, place, reach, row)

    def part_balls(self, bounds: LightBounds, middle: Array, span: Array, item: Ints) -> Mask:
        """Return whether `may_separate` may be true of a point in balls around blocks of points.

        middle : (3, k) metres.  span : (k,) metres, the radii, which include the points' reach.
        """
        row = self._row(item)
        offset = self.offset[row]
        place = dot(columns(self.normal, row), middle) - offset
        # twice the tolerance, as distances in the ball are rounded as well
        graze = 2.0 * surface_tolerance(middle, np.abs(offset) + span)
        return self._separates(bounds, place, self.shift_bound[row] + span + graze, row)

    def _separates(self, bounds: LightBounds, place: Array, reach: Array, row: Ints) -> Mask:
        """Whether places at signed distances, known to within `reach`, may be apart from a light.

        place, reach : (k,) metres from the planes of `row`.
        """
        light = bounds.height_over_planes(columns(self.normal, row), self.offset[row])
        margin = bounds.radius + self.shift_bound[row]
        parts: Mask = (light <= margin) | (place < reach)
        parts &= (light >= -margin) | (place > -reach)
        return parts

    def _signed_distances(
        self, sight: LightView, at: Ints | slice, row: Ints
    ) -> tuple[Array, Array]:
        """Signed distances (metres) of points from planes, and bounds on their changes."""
        point, offset = columns(sight.surface.point, at), self.offset[row]
        place = dot(columns(self.normal, row), point) - offset
        # a point within rounding of the plane may lie on either side of it
        return place, self.shift_bound[row] + sight.reach[at] + surface_tolerance(
            point, np.abs(offset)
        )

    def without_redundant_faces(self, sight: LightView, pairs: Pairs) -> Pairs:
        """The pairs without faces of closed solids that occlude only what other faces do."""
        if not self._any_solid:
            return pairs
        row = self._row(pairs.item)
        solid, body = self.solid[row] != NO_SOLID, self.body[row] >= 0
        rows = (solid | body).nonzero()[0]
        if not rows.size:
            return pairs
        at, row = pairs.pixel[rows], row[rows]
        solid, body = solid[rows], body[rows]
        place, reach = self._signed_distances(sight, at, row)
        objects = self.first + self.solid.size
        number = np.unique(at * objects + self.solid[row], return_inverse=True)[1]
        outside = np.zeros(number.max() + 1, dtype=np.bool_)
        outside[number[place > reach]] = True
        spare = outside[number] & (place < -reach) & solid
        # from the outer side of a face, all of its solid is below the horizon
        own = self._row(sight.surface.item[at])
        seen = dot(columns(sight.surface.normal, at), columns(self.normal, own)) > 0.0
        spare |= (self.solid[own] == self.solid[row]) & seen & solid
        seen = np.where(self.planar[own], seen, ~sight.surface.inside[at])
        spare |= (self.body[own] == self.body[row]) & seen & body
        keep = np.ones(pairs.item.size, dtype=np.bool_)
        keep[rows[spare]] = False
        return pairs.take(keep)

    @cached_property
    def _any_solid(self) -> bool:
        """Whether any object is a face of a solid."""
        return bool((self.solid != NO_SOLID).any() or (self.body >= 0).any())
