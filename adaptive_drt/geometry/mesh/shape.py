# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes as a kind of shape: rays decide what is seen and what is hidden.

A mesh of several materials is one object for each. Nothing about meshes is known in closed form:
see `ShapeSet.sampled`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.gather import columns
from ...scene.triangle_mesh import TriangleMesh
from ..camera import PinholeCamera
from ..line_crossings import LightLines, LineCrossings
from ..line_forms import BoxRays, LineForms
from ..pixel_coverage import PixelCoverage
from ..shape import ShapeSet
from ..smooth_surface import SmoothSurface
from .faces import MeshFaces
from .pixel_coverage import may_meet, mesh_coverage
from .pixel_lines import edges_on_lines

__all__ = ["MeshSet"]


@dataclass(frozen=True)
class MeshSet(ShapeSet):
    """n meshes of one material each.

    Attributes
    ----------
    meshes : the faces of each.  displacement : see `ShapeSet`.
    """

    meshes: tuple[MeshFaces, ...]
    displacement: Array | None
    sampled: ClassVar[bool] = True

    @classmethod
    def from_records(
        cls, records: Sequence[TriangleMesh], origin: Array, displacement: Array | None
    ) -> MeshSet:
        """Meshes relative to the camera at `origin` (3, 1), metres, each split by material."""
        meshes = []
        for record in records:
            for slot in record.slot.tolist():
                own = (record.face_slot == slot).nonzero()[0]
                normals = None if record.normals is None else columns(record.normals, own, -1)
                faces = columns(record.faces, own)
                meshes.append(MeshFaces.make(record.vertices - origin, faces, normals))
        return cls(tuple(meshes), displacement)

    @cached_property
    def bounding_spheres(self) -> tuple[Array, Array]:
        """See `ShapeSet.bounding_spheres`."""
        balls = [each.ball for each in self.meshes]
        center = np.array([ball[0] for ball in balls]).reshape(-1, 3).T
        return np.ascontiguousarray(center), np.array([ball[1] for ball in balls])

    def enclosing_balls(self, index: int) -> tuple[Array, Array] | None:
        """See `ShapeSet.enclosing_balls`: those of clusters of faces."""
        mesh = self.meshes[index]
        return mesh.clusters if mesh.faces.size else None

    def intersect(self, index: Ints, w: Array, time: Array | float) -> Array:
        """See `ShapeSet.intersect`."""
        shape = w.shape[1:]
        t = np.empty(shape)
        for mesh, item, rows in self._groups(index, shape[0]):
            part = columns(w, rows).reshape(3, -1)
            start = self._starts(item, part.shape[1], _times(time, rows, shape))
            t[rows] = mesh.intersect(start, part).reshape(t[rows].shape)
        return t

    def surface(
        self, index: Ints, w: Array, point: Array, time: Array | float
    ) -> tuple[Array, Array, Mask]:
        """See `ShapeSet.surface`: a mesh may hide light from itself on either side."""
        return self.smooth_surface(index, w, point, time)[0]

    def smooth_surface(
        self, index: Ints, w: Array, point: Array, time: Array | float
    ) -> tuple[tuple[Array, Array, Mask], SmoothSurface | None]:
        """See `ShapeSet.smooth_surface`."""
        place, normal, rise, facet = (np.zeros_like(point) for _ in range(4))
        shape, any_smooth = point.shape[1:], False
        for mesh, item, rows in self._groups(index, shape[0]):
            start = self._starts(item, rows.size, _times(time, rows, shape))
            at, facing, smooth = mesh.surface(start, columns(w, rows), columns(point, rows) + start)
            place[:, rows], normal[:, rows] = at - start, facing
            if smooth is not None:
                any_smooth, rise[:, rows], facet[:, rows] = True, smooth.rise, smooth.facet
        found = place, normal, np.ones(shape, dtype=np.bool_)
        return found, SmoothSurface(rise, facet) if any_smooth else None

    def blocks(self, index: Ints, start: Array, to: Array, time: Array | float) -> Mask:
        """See `ShapeSet.blocks`."""
        shape = to.shape[1:]
        found = np.empty(shape, dtype=np.bool_)
        for mesh, item, rows in self._groups(index, shape[0]):
            part = columns(to, rows)
            own = np.broadcast_to(columns(start, rows), part.shape).reshape(3, -1)
            own = own + self._starts(item, own.shape[1], _times(time, rows, shape))
            found[rows] = mesh.blocked(own, part.reshape(3, -1)).reshape(part.shape[1:])
        return found

    def coverage(self, index: Ints, w: Array, camera: PinholeCamera, order: int) -> PixelCoverage:
        """See `ShapeSet.coverage`."""
        del order
        m = w.shape[1]
        flags, bounds = np.empty((2, m), dtype=np.bool_), np.empty((2, m))
        for mesh, _, rows in self._groups(index, m):
            part = mesh_coverage(mesh, columns(w, rows), camera)
            flags[:, rows] = part.may_hit, part.covers
            bounds[:, rows] = part.near, part.far
        return PixelCoverage(*flags, *bounds)

    def block_coverage(
        self, index: Ints, w: Array, camera: PinholeCamera, order: int
    ) -> PixelCoverage:
        """See `ShapeSet.block_coverage`: blocks that show meshes are never smooth."""
        del order
        m = w.shape[1]
        met, near = np.zeros(m, dtype=np.bool_), np.full(m, np.inf)
        for mesh, _, rows in self._groups(index, m):
            met[rows], near[rows] = may_meet(mesh, columns(w, rows), camera)
        return PixelCoverage(met, np.zeros(m, dtype=np.bool_), near, np.full(m, np.inf))

    def outline_crossings(
        self, index: int, point: Array, lines: LightLines
    ) -> LineCrossings | None:
        """See `ShapeSet.outline_crossings`."""
        if self.displacement is not None and self.displacement[:, index].any():
            return None
        return self.meshes[index].outlines.crossings(point, lines)

    def figures(self) -> dict[str, float]:
        """Number of faces, seconds that embree's trees took, and bytes of the arrays of faces."""
        if not self.meshes:
            return {}
        return {
            "mesh_faces": sum(each.faces.shape[1] for each in self.meshes),
            "mesh_build_seconds": round(sum(each.build_seconds for each in self.meshes), 6),
            "mesh_bytes": sum(each.bytes for each in self.meshes),
        }

    def edges_on_lines(
        self, index: int, camera: PinholeCamera, x: Ints, y: Ints, count: int
    ) -> tuple[Ints, Array] | None:
        """See `ShapeSet.edges_on_lines`."""
        if self.displacement is not None and self.displacement[:, index].any():
            return None
        mesh = self.meshes[index]
        return edges_on_lines(mesh, camera, x, y, count) if mesh.faces.size else None

    def line_forms(self, index: Ints, rows: Ints, rays: BoxRays) -> LineForms:
        """Meshes have none: pixels that may show one are sampled."""
        raise NotImplementedError("pixels that show meshes are sampled")

    def _groups(self, index: Ints, count: int) -> Iterator[tuple[MeshFaces, int, Ints]]:
        """Split rows by mesh: the mesh, its index and the rows (r,) that ask for it."""
        each = np.broadcast_to(index.ravel(), (count,))
        for item in np.unique(each).tolist():
            yield self.meshes[item], item, (each == item).nonzero()[0]

    def _starts(self, item: int, count: int, time: Array | float) -> Array:
        """The camera's positions (3, count) relative to a mesh at rest, metres."""
        if self.displacement is None:
            return np.zeros((3, count))
        way = -np.asarray(time) * self.displacement[:, item, None]
        return np.broadcast_to(way, (3, count))


def _times(time: Array | float, rows: Ints, shape: tuple[int, ...]) -> Array | float:
    """Times of some rows, one for each of their rays, of times that broadcast to `shape`."""
    if not isinstance(time, np.ndarray):
        return time
    every = np.broadcast_to(time, shape)
    chosen: Array = every[rows].reshape(-1)
    return chosen
