# SPDX-License-Identifier: GPL-3.0-or-later
"""Record of many copies of one mesh, each placed by a matrix that may change during the shutter."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from .description import EVERYWHERE, Material, Motion, ShapeBatch, Visibility
from .triangle_mesh import TriangleMesh
from .values import LARGEST_COORDINATE

__all__ = ["MeshInstances", "is_regular"]


LEAST_VOLUME = 1e-12
"""Least determinant of a matrix over the product of the lengths of its columns. Instances that are
flatter have no inverse that is exact enough for rays; they are to be rendered as meshes of their
own."""


@dataclass(frozen=True, eq=False, repr=False)
class MeshInstances(ShapeBatch):
    """n copies of a mesh, which is stored once. All of one material are one object of the tracer.

    Attributes
    ----------
    mesh : the mesh in its own space, without a motion; its name, its visibility and its materials
        do not count.
    matrices : (k, 3, 4, n) float64, from the mesh's own space to the world, metres, at k
        equidistant times of the shutter, the first and the last of which are its ends; k = 1 for
        instances at rest. Between these times rotation, scale and translation are interpolated
        apart, as Cycles does.
    materials : for the slots of the mesh.
    motion : always None; the matrices tell it.
    slot : (parts,) the materials in use, ascending, one for each part.
    """

    mesh: TriangleMesh
    matrices: NDArray[np.float64]
    materials: tuple[Material, ...]
    motion: Motion | None = None
    name: str = "Instances"
    visibility: Visibility = EVERYWHERE
    slot: NDArray[np.int64] = field(init=False)
    single: ClassVar[type] = TriangleMesh
    arrays: ClassVar[tuple[str, ...]] = ("matrices",)

    def __post_init__(self) -> None:
        """Take the materials in use from the mesh."""
        object.__setattr__(self, "slot", self.mesh.slot)

    def __repr__(self) -> str:
        """Text that stands for all the content: arrays are given by a digest."""
        digest = hashlib.blake2b(np.ascontiguousarray(self.matrices).tobytes(), digest_size=16)
        rest = f"{self.materials!r}, {self.name!r}, {self.visibility!r}"
        return f"MeshInstances({self.mesh!r}, {digest.hexdigest()}, {rest})"

    @property
    def instances(self) -> int:
        """Number of copies."""
        return int(self.matrices.shape[3])

    def edges(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the edges (3, f) of the mesh's faces in its own space."""
        return self.mesh.edges()

    def at_rest(self) -> MeshInstances:
        """Return the copies as they are at the middle of the shutter."""
        return self if len(self.matrices) == 1 else replace(self, matrices=self.middle())

    def middle(self) -> NDArray[np.float64]:
        """Return the matrices (1, 3, 4, n) at the middle of the shutter; of an even number of times
        it is the mean of the two in the middle."""
        last = len(self.matrices) - 1
        low, high = self.matrices[last // 2], self.matrices[(last + 1) // 2]
        return np.ascontiguousarray(0.5 * (low + high))[None]

    def take(self, kept: NDArray[np.bool_] | NDArray[np.int64]) -> MeshInstances:
        """Return the copies of the parts selected by a mask or an index array."""
        return replace(self, mesh=self.mesh.take(kept))

    def record(self, index: int) -> MeshInstances:  # type: ignore[override]  # a part is many
        """Return the copies of one of the parts."""
        return self.take(np.array([index]))

    def records(self) -> Iterator[MeshInstances]:  # type: ignore[override]
        """Yield the copies of each part."""
        yield from map(self.record, range(self.count))

    def numbers(self) -> NDArray[np.float64]:
        """Return numbers (8, parts) that tell the content of each part: digits of its digest."""
        places = np.ascontiguousarray(self.matrices).tobytes()
        found = []
        for part in self.records():
            digest = hashlib.blake2b(places, digest_size=16)
            digest.update(repr(part.mesh).encode())
            found.append(np.frombuffer(digest.digest(), dtype=np.uint16))
        return np.array(found, dtype=np.float64).reshape(self.count, 8).T

    def suspects(self) -> NDArray[np.int64]:
        """Indices of all parts, where there is a defect; else none."""
        return np.arange(self.count if self.defect() else 0)

    def defect(self) -> str | None:
        """Return the reason why they cannot be rendered, or None."""
        if self.matrices.ndim != 4 or self.matrices.shape[1:3] != (3, 4) or not self.instances:
            return "it has no matrices of 3 rows and 4 columns"
        if not (np.abs(self.matrices) <= LARGEST_COORDINATE).all():
            return f"its matrices are not finite (or beyond {LARGEST_COORDINATE:g})"
        if not is_regular(self.middle()[0]).all():
            return "its matrices flatten it"
        if self._extent() > LARGEST_COORDINATE:
            return f"its vertices are beyond {LARGEST_COORDINATE:g} m"
        return replace(self.mesh, materials=self.materials, motion=None).defect()

    def _extent(self) -> float:
        """Bound on the magnitude of the coordinates of all copies, metres."""
        used = self.mesh.vertices[:, self.mesh.faces] if self.mesh.faces.size else np.zeros((3, 1))
        with np.errstate(all="ignore"):
            most = np.nan_to_num(np.abs(used).reshape(3, -1).max(axis=1), nan=0.0)
            linear, offset = np.abs(self.matrices[:, :, :3]), np.abs(self.matrices[:, :, 3])
            reach = (linear * most[:, None]).sum(axis=2) + offset
        return float(reach.max())


def is_regular(matrices: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether matrices (3, 4, n), or (3, 3, n), keep enough of a volume: (n,)."""
    with np.errstate(all="ignore"):
        a, b, c = (matrices[:, k] / np.linalg.norm(matrices[:, k], axis=0) for k in range(3))
        volume = np.abs((np.cross(a, b, axis=0) * c).sum(axis=0))
    regular: NDArray[np.bool_] = volume > LEAST_VOLUME
    return regular
