# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes as a kind of shape: rays decide what is seen and what is hidden.

A mesh of several materials is one object for each, and so are all instances of a mesh. Nothing
about meshes is known in closed form: see `ShapeSet.sampled`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, TypeAlias

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.gather import columns
from ...scene.mesh_instances import MeshInstances
from ...scene.triangle_mesh import TriangleMesh
from ..camera import PinholeCamera
from ..light_protocol import LightBall
from ..line_crossings import LightLines, LineCrossings
from ..line_forms import BoxRays, LineForms
from ..pixel_coverage import PixelCoverage
from ..shape import ShapeSet
from ..smooth_surface import SmoothSurface
from .faces import MeshFaces
from .instanced_faces import InstancedFaces
from .outline_shafts import OutlineShafts
from .pixel_coverage import may_meet, mesh_coverage
from .pixel_lines import edges_on_lines

__all__ = ["MeshSet"]

Faces: TypeAlias = MeshFaces | InstancedFaces
"""The faces of one mesh, or of all instances of one."""

MOST_COPIED_FACES = 1 << 16
"""Number of faces of all instances of a mesh at rest up to which they are copied into one mesh: its
rays are quicker, and its memory is small."""


@dataclass(frozen=True)
class MeshSet(ShapeSet):
    """n meshes of one material each.

    Attributes
    ----------
    meshes : the faces of each, or of all instances of one.
    displacement : see `ShapeSet`; where instances move in different ways it is their mean.
    """

    meshes: tuple[Faces, ...]
    displacement: Array | None
    sampled: ClassVar[bool] = True

    @classmethod
    def from_records(
        cls,
        records: Sequence[TriangleMesh | MeshInstances],
        origin: Array,
        displacement: Array | None,
    ) -> MeshSet:
        """Meshes relative to the camera at `origin` (3, 1), metres, each split by material."""
        meshes: list[Faces] = []
        for record in records:
            for slot in record.slot.tolist():
                if isinstance(record, TriangleMesh):
                    meshes.append(_faces_of(record, slot, origin))
                    continue
                faces = _faces_of(record.mesh, slot, np.zeros((3, 1)))
                way = None if displacement is None else displacement[:, len(meshes)]
                way = way if way is not None and way.any() else None
                placed = InstancedFaces.make(faces, record.matrices, origin, way)
                count = placed.placements.count
                few = not placed.moves and count * faces.faces.shape[1] <= MOST_COPIED_FACES
                meshes.append(placed.baked(np.arange(count)) if few else placed)
        return cls(tuple(meshes), _with_own_motion(meshes, displacement))

    @property
    def moves(self) -> Mask:
        """See `ShapeSet.moves`: instances may also turn and grow."""
        turning = [isinstance(each, InstancedFaces) and each.moves for each in self.meshes]
        moves: Mask = super().moves | np.array(turning, dtype=np.bool_)
        return moves

    @cached_property
    def bounding_spheres(self) -> tuple[Array, Array]:
        """See `ShapeSet.bounding_spheres`."""
        balls = [each.ball for each in self.meshes]
        center = np.array([ball[0] for ball in balls]).reshape(-1, 3).T
        return np.ascontiguousarray(center), np.array([ball[1] for ball in balls])

    def enclosing_balls(self, index: int) -> tuple[Array, Array] | None:
        """See `ShapeSet.enclosing_balls`: those of clusters of faces."""
        mesh = self.meshes[index]
        return None if mesh.is_empty else mesh.clusters

    def intersect(self, index: Ints, w: Array, time: Array | float) -> Array:
        """See `ShapeSet.intersect`."""
        shape = w.shape[1:]
        t = np.empty(shape)
        for mesh, item, rows in self._groups(index, shape[0]):
            part = columns(w, rows).reshape(3, -1)
            when = _times(time, rows, shape)
            start = self._starts(item, part.shape[1], when)
            t[rows] = mesh.intersect(start, part, when).reshape(t[rows].shape)
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
            when = _times(time, rows, shape)
            start = self._starts(item, rows.size, when)
            at, facing, smooth = mesh.surface(
                start, columns(w, rows), columns(point, rows) + start, when
            )
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
            when = _times(time, rows, shape)
            own = own + self._starts(item, own.shape[1], when)
            each = max(1, int(np.prod(part.shape[2:])))
            found[rows] = mesh.blocked(own, part.reshape(3, -1), when, each).reshape(part.shape[1:])
        return found

    def coverage(self, index: Ints, w: Array, camera: PinholeCamera, order: int) -> PixelCoverage:
        """See `ShapeSet.coverage`."""
        del order
        m = w.shape[1]
        flags, bounds = np.empty((2, m), dtype=np.bool_), np.empty((2, m))
        for mesh, _, rows in self._groups(index, m):
            part = (
                mesh_coverage(mesh, columns(w, rows), camera)
                if isinstance(mesh, MeshFaces)
                else mesh.coverage(columns(w, rows), camera)
            )
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
            met[rows], near[rows] = (
                may_meet(mesh, columns(w, rows), camera)
                if isinstance(mesh, MeshFaces)
                else mesh.may_meet(columns(w, rows), camera)
            )
        return PixelCoverage(met, np.zeros(m, dtype=np.bool_), near, np.full(m, np.inf))

    def outline_crossings(
        self, index: int, point: Array, lines: LightLines
    ) -> LineCrossings | None:
        """See `ShapeSet.outline_crossings`."""
        return None if self.moves[index] else self.meshes[index].outline_crossings(point, lines)

    def outline_shafts(self, index: int, light: LightBall) -> OutlineShafts | None:
        """See `ShapeSet.outline_shafts`."""
        mesh = self.meshes[index]
        if self.moves[index] or mesh.is_empty or isinstance(mesh, InstancedFaces):
            return None
        return mesh.outline_shafts(light)

    @property
    def has_instances(self) -> bool:
        """See `ShapeSet.has_instances`."""
        return any(isinstance(each, InstancedFaces) and not each.moves for each in self.meshes)

    def figures(self) -> dict[str, Any]:
        """Number of faces, seconds that embree's trees took, and bytes of the arrays of faces; the
        number of instances, and what takes rays to them."""
        if not self.meshes:
            return {}
        found: dict[str, Any] = {
            "mesh_faces": sum(each.face_count for each in self.meshes),
            "mesh_build_seconds": round(sum(each.build_seconds for each in self.meshes), 6),
            "mesh_bytes": sum(each.bytes for each in self.meshes),
        }
        placed = [each for each in self.meshes if isinstance(each, InstancedFaces)]
        if placed:
            found["mesh_instances"] = sum(each.placements.count for each in placed)
            found["instance_rays"] = ", ".join(sorted({each.tracer.engine for each in placed}))
        return found

    def edges_on_lines(
        self, index: int, camera: PinholeCamera, x: Ints, y: Ints, count: int
    ) -> tuple[Ints, Array] | None:
        """See `ShapeSet.edges_on_lines`: pixels that show instances are left to points, which
        reach a pixel's goal in less time there."""
        mesh = self.meshes[index]
        if self.moves[index] or mesh.is_empty or isinstance(mesh, InstancedFaces):
            return None
        return edges_on_lines(mesh, camera, x, y, count)

    def line_forms(self, index: Ints, rows: Ints, rays: BoxRays) -> LineForms:
        """Meshes have none: pixels that may show one are sampled."""
        raise NotImplementedError("pixels that show meshes are sampled")

    def _groups(self, index: Ints, count: int) -> Iterator[tuple[Faces, int, Ints]]:
        """Split rows by mesh: the mesh, its index and the rows (r,) that ask for it."""
        each = np.broadcast_to(index.ravel(), (count,))
        for item in np.unique(each).tolist():
            yield self.meshes[item], item, (each == item).nonzero()[0]

    def _starts(self, item: int, count: int, time: Array | float) -> Array:
        """The camera's positions (3, count) relative to a mesh at rest, metres.

        Instances tell themselves where they are.
        """
        if self.displacement is None or isinstance(self.meshes[item], InstancedFaces):
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


def _faces_of(record: TriangleMesh, slot: int, origin: Array) -> MeshFaces:
    """The faces of one material of a mesh, relative to a point `origin` (3, 1)."""
    own = (record.face_slot == slot).nonzero()[0]
    normals = None if record.normals is None else columns(record.normals, own, -1)
    return MeshFaces.make(record.vertices - origin, columns(record.faces, own), normals)


def _with_own_motion(meshes: Sequence[Faces], displacement: Array | None) -> Array | None:
    """Displacements (3, n), or None if no mesh moves, with those that instances have themselves."""
    if not any(isinstance(each, InstancedFaces) and each.moves for each in meshes):
        return displacement
    found = np.zeros((3, len(meshes))) if displacement is None else displacement.copy()
    for number, mesh in enumerate(meshes):
        if isinstance(mesh, InstancedFaces):
            found[:, number] = mesh.displacement
    return found
