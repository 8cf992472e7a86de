# SPDX-License-Identifier: GPL-3.0-or-later
"""Record of a mesh of triangles of any shape, with normals of its own and several materials."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from .description import EVERYWHERE, Material, Motion, ShapeBatch, Visibility
from .values import LARGEST_COORDINATE

__all__ = ["TriangleMesh"]


@dataclass(frozen=True, eq=False, repr=False)
class TriangleMesh(ShapeBatch):
    """Mesh of triangles: open or closed, of any topology. Two-sided.

    The faces of one material are one object of the tracer, a part of the mesh; the mesh is a batch
    of as many objects as it has materials in use. Faces without an area are rendered as nothing.

    Attributes
    ----------
    vertices : (3, v) float64, metres.
    faces : (3, f) int64, the vertices of each triangle.
    face_slot : (f,) int64, index of the material of each face among `materials`.
    normals : (3, 3, f) float64 shading normals, of any length: the corner of the face, then its
        components. None: each face is shaded flat.
    uv : (2, 3, f) float64 texture coordinates of the corners, or None; nothing is rendered with
        them yet.
    slot : (parts,) the materials in use, ascending, one for each part.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    face_slot: NDArray[np.int64]
    materials: tuple[Material, ...]
    normals: NDArray[np.float64] | None = None
    uv: NDArray[np.float64] | None = None
    motion: Motion | None = None
    name: str = "Mesh"
    visibility: Visibility = EVERYWHERE
    slot: NDArray[np.int64] = field(init=False)
    single: ClassVar[type]
    arrays: ClassVar[tuple[str, ...]] = ("vertices", "faces", "face_slot")
    plural: ClassVar[str] = "meshes"

    def __post_init__(self) -> None:
        """Find the materials in use."""
        object.__setattr__(self, "slot", np.unique(self.face_slot))

    def __repr__(self) -> str:
        """Text that stands for all the content: arrays are given by a digest."""
        rest = f"{self.materials!r}, {self.motion!r}, {self.name!r}, {self.visibility!r}"
        return f"TriangleMesh({self.faces.shape[1]}, {self._digest().hex()}, {rest})"

    def _digest(self) -> bytes:
        digest = hashlib.blake2b(digest_size=16)
        for array in (self.vertices, self.faces, self.face_slot, self.normals, self.uv):
            digest.update(b"none" if array is None else np.ascontiguousarray(array).tobytes())
        return digest.digest()

    def edges(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the edges (3, f) that leave the faces' first vertices, metres."""
        a, b, c = (self.vertices[:, each] for each in self.faces)
        return b - a, c - a

    def take(self, kept: NDArray[np.bool_] | NDArray[np.int64]) -> TriangleMesh:
        """Return the mesh of the parts selected by a mask or an index array."""
        chosen = np.isin(self.face_slot, self.slot[kept])
        return replace(
            self,
            faces=np.ascontiguousarray(self.faces[:, chosen]),
            face_slot=self.face_slot[chosen],
            normals=None if self.normals is None else self.normals[..., chosen],
            uv=None if self.uv is None else self.uv[..., chosen],
        )

    def record(self, index: int) -> TriangleMesh:  # type: ignore[override]  # a part is a mesh
        """Return one of the parts as a mesh of its own."""
        return self.take(np.array([index]))

    def records(self) -> Iterator[TriangleMesh]:  # type: ignore[override]
        """Yield each part as a mesh of its own."""
        yield from map(self.record, range(self.count))

    def numbers(self) -> NDArray[np.float64]:
        """Return numbers (8, parts) that tell the content of each part: digits of its digest."""
        digests = [part._digest() for part in self.records()]
        words = [np.frombuffer(each, dtype=np.uint16) for each in digests]
        return np.array(words, dtype=np.float64).reshape(self.count, 8).T

    def suspects(self) -> NDArray[np.int64]:
        """Indices of all parts, where the mesh has a defect; else none."""
        return np.arange(self.count if self.defect() else 0)

    def defect(self) -> str | None:
        """Return the reason why it cannot be rendered, or None."""
        used = self.vertices[:, self.faces] if self.faces.size else self.vertices[:, :0]
        if not self.faces.size:
            return "it has no faces"
        if not (np.abs(used) <= LARGEST_COORDINATE).all():
            return f"its vertices are not finite (or beyond {LARGEST_COORDINATE:g} m)"
        if self.motion is not None and not _finite(self.motion.displacement):
            return f"its motion is not finite (or beyond {LARGEST_COORDINATE:g} m)"
        used_materials = [self.materials[each] for each in self.slot.tolist()]
        if not all(_finite(each.color) and _finite(each.emission) for each in used_materials):
            return "its colour is not finite"
        if self.normals is not None and not np.isfinite(self.normals).all():
            return "its normals are not finite"
        return None


TriangleMesh.single = TriangleMesh


def _finite(vector: tuple[float, float, float]) -> bool:
    return all(abs(x) <= LARGEST_COORDINATE for x in vector)
