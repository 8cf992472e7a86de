# SPDX-License-Identifier: GPL-3.0-or-later
"""Polygons as seen from points."""

from __future__ import annotations

from dataclasses import dataclass

from ...numerics.arrays import Array, Ints
from ...numerics.gather import columns
from .kernels import PlaneNormals

__all__ = ["PolygonView"]


@dataclass(frozen=True)
class PolygonView:
    """Polygons of k edges as seen from points: vectors (3, ...) from the points, metres.

    Attributes
    ----------
    corner, edge_u, edge_v : as those of `PolygonSet`, relative to the points.
    vertices : the k vertices in order.
    starts, edges : start points and vectors of the k edges, in the order of `planes`.
    planes : the k inward normals of the planes through the point and each edge.
    normal : edge_u x edge_v, turned away from the point.
    height : (...) corner . normal >= 0: the distance of the plane times |normal|.
    """

    corner: Array
    edge_u: Array
    edge_v: Array
    vertices: PlaneNormals
    starts: PlaneNormals
    edges: PlaneNormals
    planes: PlaneNormals
    normal: Array
    height: Array

    def take(self, rows: Ints) -> PolygonView:
        """The polygons selected by an index, for arrays of shape (3, m)."""

        def each(part: PlaneNormals) -> PlaneNormals:
            return tuple(columns(vector, rows) for vector in part)

        q, u, v, normal = each((self.corner, self.edge_u, self.edge_v, self.normal))
        vertices, starts = each(self.vertices), each(self.starts)
        edges, planes = each(self.edges), each(self.planes)
        return PolygonView(q, u, v, vertices, starts, edges, planes, normal, self.height[rows])
