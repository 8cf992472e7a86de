# SPDX-License-Identifier: GPL-3.0-or-later
"""Bounding volumes of the faces of a mesh: clusters along the Morton curve, and a tree over them.

Clusters are proofs: what hides nothing of a light by its bounding ball is no occluder. The tree
also finds the faces that rays meet where embree is not available.
"""

from __future__ import annotations

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.morton import morton_order
from ...numerics.vector import cross, dot

__all__ = ["CLUSTER_SIZE", "BoxTree", "FaceTree", "face_clusters"]


CLUSTER_SIZE = 32
"""Number of faces of a cluster."""
FANOUT = 4
"""Number of children of a node of the tree."""
EDGE_TOLERANCE = 2.0**-40
"""Barycentric coordinate by which a ray may pass beside a face and still meet it, so that none
passes between two faces that share an edge."""


def face_clusters(vertices: Array, faces: Ints) -> tuple[Ints, Array, Array]:
    """Clusters of neighbouring faces, of `CLUSTER_SIZE` each but the last.

    Returns
    -------
    order : (f,) the faces, cluster after cluster.
    center, radius : (3, c) and (c,), balls that enclose the clusters, metres.
    """
    corners = vertices[:, faces]
    order = morton_order(corners.mean(axis=1))
    starts = np.arange(0, order.size, CLUSTER_SIZE)
    low = np.minimum.reduceat(corners.min(axis=1)[:, order], starts, axis=1)
    high = np.maximum.reduceat(corners.max(axis=1)[:, order], starts, axis=1)
    center = 0.5 * (low + high)
    own = np.repeat(np.arange(starts.size), np.diff(starts, append=order.size))
    square = np.zeros(order.size)
    for corner in range(3):
        gap = corners[:, corner, order] - center[:, own]
        square = np.maximum(square, dot(gap, gap))
    radius = np.sqrt(np.maximum.reduceat(square, starts)) * (1.0 + 2.0**-50)
    return order, center, radius


class BoxTree:
    """Tree over bounding boxes; rays descend it in batches."""

    def __init__(self, low: Array, high: Array) -> None:
        """Build the tree of boxes (3, n); those that are neighbours should follow each other."""
        self._levels = [(low, high)]
        while self._levels[-1][0].shape[1] > 1:
            low, high = self._levels[-1]
            starts = np.arange(0, low.shape[1], FANOUT)
            self._levels.append(
                (
                    np.minimum.reduceat(low, starts, axis=1),
                    np.maximum.reduceat(high, starts, axis=1),
                )
            )

    def meeting(self, start: Array, inverse: Array, length: Array) -> tuple[Ints, Ints]:
        """Pairs of rays and boxes that meet: indices (m,) of both.

        Parameters
        ----------
        start : (3, n).  inverse : (3, n) one over the components of the rays' ways.
        length : (n,) ray parameters at which they end.
        """
        ray = np.arange(start.shape[1])
        node = np.zeros(ray.size, dtype=np.int64)
        for level in range(len(self._levels) - 1, -1, -1):
            low, high = self._levels[level]
            if level < len(self._levels) - 1:
                first = node * FANOUT
                count = np.minimum(first + FANOUT, low.shape[1]) - first
                ray = np.repeat(ray, count)
                step = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
                node = np.repeat(first, count) + step
            kept = _meets_box(low, high, start, inverse, length, ray, node)
            ray, node = ray[kept], node[kept]
        return ray, node


class FaceTree:
    """Tree of bounding boxes over the faces of a mesh; rays descend it in batches."""

    def __init__(self, vertices: Array, faces: Ints) -> None:
        """Build the tree of a mesh: vertices (3, v), faces (3, f)."""
        corners = vertices[:, faces]
        self._order = morton_order(corners.mean(axis=1))
        corners = corners[:, :, self._order]
        self._corner = corners[:, 0]
        self._edges = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        slack = 2.0**-40 * float(np.abs(corners).max())
        self._tree = BoxTree(corners.min(axis=1) - slack, corners.max(axis=1) + slack)

    def nearest(self, start: Array, way: Array) -> Ints:
        """The first face (n,) that each ray from `start` (3, n) along `way` (3, n) meets, or -1."""
        ray, face, t = self._hits(start, way, np.full(start.shape[1], np.inf))
        found = np.full(start.shape[1], -1, dtype=np.int64)
        order = np.lexsort((face, t, ray))[::-1]
        found[ray[order]] = face[order]
        return found

    def blocked(self, start: Array, way: Array, length: Array) -> Mask:
        """Whether a face lies within `length` (n,) of the starts of rays, times `way`: (n,)."""
        found = np.zeros(start.shape[1], dtype=np.bool_)
        found[self._hits(start, way, length)[0]] = True
        return found

    def _hits(self, start: Array, way: Array, length: Array) -> tuple[Ints, Ints, Array]:
        """All hits of rays: the ray, the face and the ray parameter of each."""
        with np.errstate(divide="ignore"):
            inverse = 1.0 / way
        ray, node = self._tree.meeting(start, inverse, length)
        t = self._face_hits(start[:, ray], way[:, ray], node)
        met = ((t > 0.0) & (t < length[ray])).nonzero()[0]
        return ray[met], self._order[node[met]], t[met]

    def _face_hits(self, start: Array, way: Array, face: Ints) -> Array:
        """Ray parameters (m,) of the hits of rays with faces, inf for none (Moeller, Trumbore)."""
        u, v = self._edges[0][:, face], self._edges[1][:, face]
        gap = start - self._corner[:, face]
        p, q = cross(way, v), cross(gap, u)
        det = dot(u, p)
        with np.errstate(divide="ignore", invalid="ignore"):
            a, b, t = dot(gap, p) / det, dot(way, q) / det, dot(v, q) / det
            inside = (a >= -EDGE_TOLERANCE) & (b >= -EDGE_TOLERANCE) & (a + b <= 1 + EDGE_TOLERANCE)
        return np.where(inside & (det != 0.0), t, np.inf)


def _meets_box(
    low: Array, high: Array, start: Array, inverse: Array, length: Array, ray: Ints, node: Ints
) -> Ints:
    """Indices of the pairs of rays and boxes that meet (slabs: Kay and Kajiya 1986)."""
    first, last = np.zeros(ray.size), length[ray].copy()
    for axis in range(3):
        o, k = start[axis, ray], inverse[axis, ray]
        with np.errstate(invalid="ignore"):
            a, b = (low[axis, node] - o) * k, (high[axis, node] - o) * k
        # a ray within the plane of a side gives 0 * inf
        a, b = np.nan_to_num(a, nan=-np.inf), np.nan_to_num(b, nan=np.inf)
        first, last = np.maximum(first, np.minimum(a, b)), np.minimum(last, np.maximum(a, b))
    kept: Ints = (first <= last).nonzero()[0]
    return kept
