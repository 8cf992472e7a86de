# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays against the faces of one mesh by embree.

Embree works in float32. The mesh is therefore scaled to unit size about its centre, and rays are
followed in float64 up to a sphere around it: what float32 rounds away is relative to the mesh, not
to its distance. Embree's robust mode leaves no gaps between faces that share vertices.
"""

from __future__ import annotations

import threading
import time
from typing import Any

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.floats import FLOAT32_ROUNDOFF
from ...numerics.vector import dot
from ..embree import has_embree, make_embree_scene
from ..ray_counts import count_rays
from .bvh import FaceTree

__all__ = ["START_OFFSET", "FaceTracer", "entering_rays"]


START_OFFSET = 16.0 * FLOAT32_ROUNDOFF
"""Distance of the start of shadow rays from the face they leave, and of their end from the light,
as a fraction of the mesh's size: more than embree's rounding of vertices, rays and hits."""
LONGEST_RAY = 1e30
"""Length of rays from which they count as endless, in sizes of the mesh; float32 ends at 3e38."""
SPHERE_MARGIN = 1e-3
"""Distance of the sphere at which rays begin from the mesh, in sizes of the mesh."""


class FaceTracer:
    """Finds the faces of a mesh that rays meet, by embree, or by NumPy where embreex is missing."""

    def __init__(self, vertices: Array, faces: Ints) -> None:
        """Take a mesh; what embree needs is built when the first ray is traced.

        Parameters
        ----------
        vertices : (3, v) metres.  faces : (3, f).
        """
        used = vertices[:, np.unique(faces)]
        low, high = used.min(axis=1), used.max(axis=1)
        self._middle = 0.5 * (low + high)[:, None]
        self.size = float((high - low).max()) or 1.0
        self._vertices, self._faces = (vertices - self._middle) / self.size, faces
        self._radius = np.sqrt(dot(self._vertices, self._vertices)[np.unique(faces)].max())
        self._radius += SPHERE_MARGIN
        self._lock = threading.Lock()
        self._scene: Any = None
        self.build_seconds = 0.0

    def __getstate__(self) -> dict[str, Any]:
        """Pickled state, without embree's own."""
        return {k: v for k, v in self.__dict__.items() if k not in ("_lock", "_scene")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore the pickled state; embree's is built again when it is needed."""
        self.__dict__.update(state, _lock=threading.Lock(), _scene=None)

    def nearest(self, start: Array, way: Array) -> Ints:
        """The first face (n,) that each ray from `start` (3, n) along `way` (3, n) meets, or -1."""
        rows, origin, unit, _ = self._entering(start, way, np.inf)
        found = np.full(start.shape[1], -1, dtype=np.int64)
        scene = self._traced()
        count_rays("nearest", rows.size)
        if isinstance(scene, FaceTree):
            found[rows] = scene.nearest(origin, unit)
        elif rows.size:
            found[rows] = scene.run(
                np.ascontiguousarray(origin.T, dtype=np.float32),
                np.ascontiguousarray(unit.T, dtype=np.float32),
                query="INTERSECT",
            )
        return found

    def blocked(self, start: Array, to: Array) -> Mask:
        """Whether a face lies between `start` (3, n) and `start + to`: (n,)."""
        length = np.sqrt(dot(to, to)) / self.size
        rows, origin, unit, gone = self._entering(start, to, length)
        found = np.zeros(start.shape[1], dtype=np.bool_)
        left = np.minimum(length[rows] - gone - START_OFFSET, LONGEST_RAY)
        some = (left > 0.0).nonzero()[0]
        if not some.size:
            return found
        rows, origin, unit, left = rows[some], origin[:, some], unit[:, some], left[some]
        scene = self._traced()
        count_rays("shadow", rows.size)
        if isinstance(scene, FaceTree):
            found[rows] = scene.blocked(origin, unit, left)
        else:
            found[rows] = (
                scene.run(
                    np.ascontiguousarray(origin.T, dtype=np.float32),
                    np.ascontiguousarray(unit.T, dtype=np.float32),
                    dists=left.astype(np.float32),
                    query="OCCLUDED",
                )
                >= 0
            )
        return found

    def _entering(
        self, start: Array, way: Array, length: Array | float
    ) -> tuple[Ints, Array, Array, Array]:
        """The rays that may meet the mesh, from where they enter the sphere around it.

        Returns their indices (k,), origins and unit directions (3, k), and the lengths (k,) before
        the origins; lengths are in sizes of the mesh.
        """
        return entering_rays((start - self._middle) / self.size, way, length, self._radius)

    def _traced(self) -> Any:
        """Embree's scene, or the tree that stands for it, built once."""
        with self._lock:
            if self._scene is None:
                began = time.perf_counter()
                self._scene = self._build()
                self.build_seconds = time.perf_counter() - began
        return self._scene

    def _build(self) -> Any:
        if not has_embree():
            return FaceTree(self._vertices, self._faces)
        scene = make_embree_scene(self._vertices, self._faces)
        # the first query builds embree's tree, which no two threads may do
        ray = np.zeros((1, 3), dtype=np.float32)
        scene.run(ray, ray + np.float32(1.0), query="OCCLUDED")
        return scene


def entering_rays(
    origin: Array, way: Array, length: Array | float, radius: float
) -> tuple[Ints, Array, Array, Array]:
    """The rays that meet a sphere about 0, from where they enter it.

    Parameters
    ----------
    origin : (3, n) starts of rays along `way` (3, n), which may have any length but 0.
    length : (n,) or one, the distance at which rays end.

    Returns
    -------
    Indices (k,) of the rays, their new origins and unit directions (3, k), and the lengths (k,)
    before the origins.
    """
    far = np.sqrt(dot(way, way))
    unit = way / np.where(far > 0.0, far, 1.0)
    along = -dot(unit, origin)
    aside = origin + along * unit
    room = radius**2 - dot(aside, aside)
    half = np.sqrt(np.maximum(room, 0.0))
    meets = (room > 0.0) & (along + half > 0.0) & (along - half < length) & (far > 0.0)
    rows = meets.nonzero()[0]
    gone = np.maximum(along[rows] - half[rows], 0.0)
    unit = unit[:, rows]
    return rows, origin[:, rows] + gone * unit, unit, gone
