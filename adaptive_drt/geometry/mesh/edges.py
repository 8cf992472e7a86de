# SPDX-License-Identifier: GPL-3.0-or-later
"""Edges of a mesh at which its picture may have an edge: outlines, borders and creases.

The edges inside of a smooth surface are none of these. Vertices at the same place count as one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.gather import columns
from ...numerics.vector import cross, dot, norm, normalize
from .welding import welded_vertices

__all__ = ["MeshEdges"]


MAX_SMOOTH_TURN = 1e-4
"""Largest difference of unit normals across an edge that is no crease: far more than float32 makes
of one normal, and a change of radiance by that part of itself."""
SIDE_ROUNDING = 2.0**-44
"""Rounding error of the side of a plane through the camera and an edge on which a vertex lies,
relative to the product of the three lengths."""


@dataclass(frozen=True)
class MeshEdges:
    """The edges of a mesh that belong to one face, or to two.

    Attributes
    ----------
    ends : (2, e) vertices at the ends.
    apex : (2, e) the third vertices of two faces that meet in the edge.
    sharp : (e,) whether the edge is one of the picture wherever it is seen: a border, a crease, or
        one where more than two faces meet.
    """

    ends: Ints
    apex: Ints
    sharp: Mask

    @classmethod
    def make(cls, vertices: Array, faces: Ints, normals: Array | None) -> MeshEdges:
        """The edges of a mesh: vertices (3, v), faces (3, f), corner normals (3, 3, f) or None."""
        place = welded_vertices(vertices)
        first, last = faces.ravel(), np.roll(faces, -1, axis=0).ravel()
        apex = np.roll(faces, -2, axis=0).ravel()
        if normals is None:
            a, b, c = (columns(vertices, each) for each in faces)
            plain = normalize(cross(b - a, c - a))
            starts = ends = np.tile(plain, 3)
        else:
            starts = normals.transpose(1, 0, 2).reshape(3, -1)
            ends = np.roll(normals, -1, axis=0).transpose(1, 0, 2).reshape(3, -1)
        low, high = np.minimum(place[first], place[last]), np.maximum(place[first], place[last])
        turned = place[first] > place[last]
        starts, ends = np.where(turned, ends, starts), np.where(turned, starts, ends)
        order = np.argsort(low * np.int64(place.size) + high, kind="stable")
        low, high = low[order], high[order]
        new = np.ones(low.size, dtype=np.bool_)
        new[1:] = (low[1:] != low[:-1]) | (high[1:] != high[:-1])
        begin = new.nonzero()[0]
        count = np.diff(begin, append=order.size)
        one = order[begin]
        other = order[np.minimum(begin + 1, order.size - 1)]
        bent = np.zeros(begin.size)
        for normal in (starts, ends):
            change = columns(normal, one) - columns(normal, other)
            bent = np.maximum(bent, dot(change, change))
        sharp = (count != 2) | (bent > MAX_SMOOTH_TURN**2)
        # an edge of no length, which welding leaves, has no place in the picture
        real = low[begin] != high[begin]
        ends_of = np.array([first[one], last[one]])
        return cls(ends_of[:, real], np.array([apex[one], apex[other]])[:, real], sharp[real])

    def seen_from_origin(self, vertices: Array) -> Ints:
        """The edges that are edges of the picture seen from the origin, whether hidden or not.

        An edge is an outline unless its two faces lie on different sides of the plane through it
        and the eye.
        """
        a, b = (columns(vertices, each) for each in self.ends)
        plane = cross(a, b)
        size = norm(a) * norm(b) * SIDE_ROUNDING
        one, other = (columns(vertices, each) for each in self.apex)
        first, second = dot(plane, one), dot(plane, other)
        apart = (first > size * norm(one)) & (second < -size * norm(other))
        apart |= (first < -size * norm(one)) & (second > size * norm(other))
        found: Ints = (self.sharp | ~apart).nonzero()[0]
        return found
