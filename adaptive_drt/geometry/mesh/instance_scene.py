# SPDX-License-Identifier: GPL-3.0-or-later
"""Many instances of a mesh in one scene of embree, which takes rays to them itself.

Embree works in float32: it maps each ray into the own space of an instance with rounding errors
that are relative to the size of all instances, not to that of one. So its answers are decided again
in float64 near the starts of rays and near hits: see `instance_tracer`.
"""

from __future__ import annotations

import threading
from typing import Any

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.floats import FLOAT32_ROUNDOFF
from ...numerics.gather import columns
from ...numerics.vector import dot
from ..embree_library import (
    FAR_WORD,
    FLOAT3,
    FLOAT3X4_COLUMNS,
    HIT_WORDS,
    INDICES,
    INSTANCE_ARRAY,
    INSTANCE_WORD,
    ITEM_WORD,
    LONGEST_RAY,
    RAY_WORDS,
    TRANSFORMS,
    VERTICES,
    geometry_buffer,
    native_library,
    ray_packets,
    scene_of,
    trace_packets,
    word_of_rays,
)
from ..ray_counts import count_rays
from .placements import Placements, applied, stretch
from .tracer import entering_rays

__all__ = ["InstanceScene"]


TRIANGLES, UINT3 = 0, 0x5003
"""Embree's numbers of triangles, and of the format of their vertices' numbers."""
ROUNDING = 16.0 * FLOAT32_ROUNDOFF
"""Distance by which embree may misplace a ray in an instance, as a fraction of the size of all
instances and times the condition of the instance's matrix: a generous bound on what is rounded of
the ray, of the matrix, of its inverse and of their products."""
MAX_ROUNDING = 2.0**-6
"""Largest such distance as a fraction of the size of an instance. It only counts far from the
starts of rays: there it shifts the outlines of shadows, by a fifth of the bound or less, at
random."""


MAX_CONDITION = 16.0
"""Largest condition of the matrix of an instance: more would make a coarse bound for all."""


class InstanceScene:
    """Embree's scene of n instances at rest; what it needs is built when the first ray is traced.

    Attributes
    ----------
    rounding : distance in metres by which a ray may be misplaced.
    """

    def __init__(
        self, vertices: Array, faces: Ints, placements: Placements, box: tuple[Array, Array]
    ) -> None:
        """Take instances of a mesh: vertices (3, v) in its own space, faces (3, f).

        box : lowest and highest coordinates (3,) of all instances, metres.
        """
        low, high = box
        self._middle = (0.5 * (low + high))[:, None]
        self._size = float((high - low).max())
        self._radius = 0.5 * float(np.sqrt((((high - low) / self._size) ** 2).sum())) + 1e-3
        least, most = vertices.min(axis=1), vertices.max(axis=1)
        middle, size = 0.5 * (least + most), float((most - least).max())
        self._vertices, self._faces = (vertices - middle[:, None]) / size, faces
        place = applied(placements.linear, middle[:, None]) + placements.offset - self._middle
        self._matrices = np.empty((4, 3, placements.count), dtype=np.float32)
        self._matrices[:3] = placements.linear.transpose(1, 0, 2) * (size / self._size)
        self._matrices[3] = place / self._size
        self.rounding = ROUNDING * self._size * float(_conditions(placements).max())
        self._lock = threading.Lock()
        self._scenes: tuple[int, int] | None = None

    @staticmethod
    def suited(placements: Placements, size: float, extent: float) -> Mask:
        """Which instances (n,) are large enough for what embree rounds of rays to them.

        size : of the mesh in its own space.  extent : size of all instances, metres.
        """
        least = size / np.maximum(stretch(placements.inverse), 1e-300)
        condition = _conditions(placements)
        fine: Mask = ROUNDING * extent * condition <= MAX_ROUNDING * least
        return fine & (condition <= MAX_CONDITION)

    def __getstate__(self) -> dict[str, Any]:
        """Pickled state, without embree's own."""
        return {k: v for k, v in self.__dict__.items() if k not in ("_lock", "_scenes")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore the pickled state; embree's is built again when it is needed."""
        self.__dict__.update(state, _lock=threading.Lock(), _scenes=None)

    def __del__(self) -> None:
        """Release embree's scenes."""
        library, scenes = native_library(), self.__dict__.get("_scenes")
        if library is not None and scenes is not None:
            for scene in scenes:
                library.rtcReleaseScene(scene)

    def nearest(self, start: Array, way: Array, near: Array) -> tuple[Ints, Ints]:
        """Instances and faces (n,) that rays from `start` along `way` (3, n) meet first, or -1.

        near : (n,) metres before which nothing is met.
        """
        item, face = np.full((2, way.shape[1]), -1)
        rows, origin, unit, gone = self._entering(start, way, np.inf)
        begin = np.maximum(near[rows] / self._size - gone, 0.0)
        far = np.full(rows.size, LONGEST_RAY)
        rays = ray_packets(origin, unit, far, RAY_WORDS + HIT_WORDS, near=begin)
        count_rays("instance nearest", rows.size)
        trace_packets("rtcIntersect16", self._committed(), rays, rows.size)
        item[rows] = word_of_rays(rays, INSTANCE_WORD, rows.size)
        face[rows] = word_of_rays(rays, ITEM_WORD, rows.size)
        item[face < 0] = -1
        return item, face

    def blocked(self, start: Array, to: Array, near: float) -> Mask:
        """Whether a face lies between `start` (3, n) and `start + to`, from `near` metres on."""
        found = np.zeros(to.shape[1], dtype=np.bool_)
        length = np.sqrt(dot(to, to)) / self._size
        rows, origin, unit, gone = self._entering(start, to, length)
        begin = np.maximum(near / self._size - gone, 0.0)
        away = np.minimum(length[rows] - gone - ROUNDING, LONGEST_RAY)
        some = (away > begin).nonzero()[0]
        if some.size < rows.size:
            rows, begin, away = rows[some], begin[some], away[some]
            origin, unit = columns(origin, some), columns(unit, some)
        rays = ray_packets(origin, unit, away, RAY_WORDS, near=begin)
        count_rays("instance shadow", rows.size)
        trace_packets("rtcOccluded16", self._committed(), rays, rows.size)
        found[rows] = rays[:, FAR_WORD].reshape(-1)[: rows.size] == -np.inf
        return found

    def _entering(
        self, start: Array, way: Array, length: Array | float
    ) -> tuple[Ints, Array, Array, Array]:
        """See `entering_rays`; lengths are in sizes of all instances."""
        return entering_rays((start - self._middle) / self._size, way, length, self._radius)

    def _committed(self) -> int:
        """Embree's scene, built once."""
        with self._lock:
            if self._scenes is None:
                self._scenes = self._build()
        return self._scenes[0]

    def _build(self) -> tuple[int, int]:
        """Embree's scenes of the instances, and of the mesh."""
        library = native_library()
        assert library is not None
        mesh = library.rtcNewGeometry(library.device, TRIANGLES)
        for kind, form, values in (
            (VERTICES, FLOAT3, self._vertices.T.astype(np.float32)),
            (INDICES, UINT3, self._faces.T.astype(np.uint32)),
        ):
            count, size = values.shape
            geometry_buffer(mesh, kind, form, values.dtype.type, (count, size))[:] = values
        inner = scene_of(mesh)
        count = self._matrices.shape[2]
        instances = library.rtcNewGeometry(library.device, INSTANCE_ARRAY)
        library.rtcSetGeometryInstancedScene(instances, inner)
        places = geometry_buffer(instances, TRANSFORMS, FLOAT3X4_COLUMNS, np.float32, (count, 12))
        places[:] = self._matrices.reshape(12, count).T
        return scene_of(instances), inner


def _conditions(placements: Placements) -> Array:
    """Upper bounds (n,) on the conditions of the instances' matrices; infinite for flat ones."""
    back = stretch(placements.inverse)
    with np.errstate(over="ignore"):
        found: Array = np.where(back > 0.0, stretch(placements.linear) * back, np.inf)
    return found
