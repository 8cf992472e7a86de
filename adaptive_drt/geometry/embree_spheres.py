# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays against many spheres by embree's own spheres.

embreex traces triangles only. The library that its wheel brings also has spheres, which are built
forty times faster than icosahedra and are round; see `embree_library`.

Embree works in float32. Scenes are therefore scaled to unit size about their centre, so that what
it rounds away is relative to the scene's size: see `SphereScene`.
"""

from __future__ import annotations

import threading

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.vector import dot
from .embree_library import (
    FAR_WORD,
    HIT_WORDS,
    ITEM_WORD,
    LONGEST_RAY,
    RAY_WORDS,
    ROBUST,
    geometry_buffer,
    native_library,
    ray_packets,
    trace_packets,
    word_of_rays,
)
from .ray_counts import count_rays

__all__ = ["SphereScene"]


SPHERE_POINTS, VERTICES, FLOAT4 = 50, 1, 0x9004
"""Embree's numbers of the kind of shape, of the buffer and of its format."""
FLOAT32_ROUNDOFF = 2.0**-24
"""Largest relative rounding error of a float32 operation."""
START_OFFSET = 16.0 * FLOAT32_ROUNDOFF
"""Distance of the start of rays from the surface that they leave, along its normal, and of their
end from the light, as a fraction of the scene's size: more than embree's rounding of centres, radii
and rays, so that no ray meets the sphere that it leaves."""
NEAR_RADII = 2.0
"""Distance from the middle of the scene, in radii of the ball around it, up to which rays begin
where they do; others begin where they enter the ball, so that their rounding is as small."""


class SphereScene:
    """A scene of spheres that rays are traced against.

    Where a ray passes the surface of a sphere at less than `rounding` metres, whether it meets the
    sphere is decided by rounding; elsewhere the answers are those of exact arithmetic.
    """

    def __init__(self, center: Array, radius: Array, displacement: Array | None = None) -> None:
        """Take n spheres; what embree needs is built when the first ray is traced.

        Parameters
        ----------
        center : (3, n) metres, at the middle of the shutter.  radius : (n,) metres.
        displacement : (3, n) metres, over the shutter; None at rest.
        """
        path = 0.0 if displacement is None else 0.5 * np.abs(displacement)
        low, high = (center - path - radius).min(axis=1), (center + path + radius).max(axis=1)
        self._middle = 0.5 * (low + high)[:, None]
        self.size = float((high - low).max())
        self._center = (center - self._middle) / self.size
        self._radius = radius / self.size
        self._shift = None if displacement is None else displacement / self.size
        self._ball = 0.5 * float(np.sqrt((((high - low) / self.size) ** 2).sum()))
        self._lock = threading.Lock()
        self._scene: int | None = None

    @property
    def rounding(self) -> float:
        """Distance in metres to the surface of a sphere below which rounding decides."""
        return 2.0 * START_OFFSET * self.size

    def __del__(self) -> None:
        """Release embree's scene."""
        library, scene = native_library(), self.__dict__.get("_scene")
        if library is not None and scene is not None:
            library.rtcReleaseScene(scene)

    def blocked(self, start: Array, normal: Array, to: Array, time: Array | float = 0.0) -> Mask:
        """Whether spheres lie between `start` and `start + to`: (n, k).

        Parameters
        ----------
        start, normal : (3, n) metres, points of surfaces, and their unit normals on the rays' side.
        to : (3, n, k) metres.  time : shutter times (n, k) or one number.
        """
        length = np.sqrt(dot(to, to)) / self.size
        unit = (to / (length * self.size)).reshape(3, -1)
        away = np.minimum(length - START_OFFSET, LONGEST_RAY)
        begin = (start - self._middle) / self.size + START_OFFSET * normal
        origin = np.broadcast_to(begin[:, :, None], to.shape).reshape(3, -1)
        far = (dot(begin, begin) > (NEAR_RADII * self._ball) ** 2).nonzero()[0]
        if far.size:
            away = away.copy()
            origin = origin.copy()
            rows = (far[:, None] * to.shape[2] + np.arange(to.shape[2])).ravel()
            gone, met = self._entry(origin[:, rows], unit[:, rows])
            origin[:, rows] += gone * unit[:, rows]
            left = away.reshape(-1)
            left[rows] = np.where(met, left[rows] - gone, -1.0)
        rays = ray_packets(origin, unit, away.reshape(-1), RAY_WORDS, time=time)
        count_rays("sphere shadow", unit.shape[1])
        trace_packets("rtcOccluded16", self._committed(), rays, unit.shape[1])
        found: Mask = (rays[:, FAR_WORD].reshape(-1)[: unit.shape[1]] == -np.inf) & (
            away.reshape(-1) > 0.0
        )
        return found.reshape(to.shape[1:])

    def nearest(self, way: Array, time: Array | float = 0.0) -> Ints:
        """The first sphere (m,) that rays from the origin along `way` (3, m) meet, or -1.

        time : shutter times (m,) or one number.
        """
        unit = way / np.sqrt(dot(way, way))
        origin = np.broadcast_to(-self._middle / self.size, unit.shape)
        away = np.full(unit.shape[1], LONGEST_RAY)
        if float((origin[:, :1] ** 2).sum()) > (NEAR_RADII * self._ball) ** 2:
            gone, met = self._entry(origin, unit)
            origin, away = origin + gone * unit, np.where(met, away, -1.0)
        rays = ray_packets(origin, unit, away, RAY_WORDS + HIT_WORDS, time=time)
        count_rays("sphere nearest", unit.shape[1])
        trace_packets("rtcIntersect16", self._committed(), rays, unit.shape[1])
        item = word_of_rays(rays, ITEM_WORD, unit.shape[1])
        item[away < 0.0] = -1
        return item

    def _entry(self, origin: Array, unit: Array) -> tuple[Array, Mask]:
        """Lengths (m,) of rays up to the ball around the scene, and whether they meet it."""
        along = -dot(unit, origin)
        aside = origin + along * unit
        room = (self._ball * (1.0 + START_OFFSET)) ** 2 - dot(aside, aside)
        half = np.sqrt(np.maximum(room, 0.0))
        return np.maximum(along - half, 0.0), (room > 0.0) & (along + half > 0.0)

    def _committed(self) -> int:
        """Embree's scene, built once."""
        with self._lock:
            if self._scene is None:
                self._scene = self._build()
        return self._scene

    def _build(self) -> int:
        library = native_library()
        assert library is not None
        scene: int = library.rtcNewScene(library.device)
        library.rtcSetSceneFlags(scene, ROBUST)
        geometry = library.rtcNewGeometry(library.device, SPHERE_POINTS)
        ends = (0.0,) if self._shift is None else (-0.5, 0.5)
        library.rtcSetGeometryTimeStepCount(geometry, len(ends))
        count = self._radius.size
        for slot, end in enumerate(ends):
            values = geometry_buffer(geometry, VERTICES, FLOAT4, np.float32, (count, 4), slot)
            shift = 0.0 if self._shift is None else end * self._shift
            values[:, :3] = (self._center + shift).T
            values[:, 3] = self._radius
        library.rtcCommitGeometry(geometry)
        library.rtcAttachGeometry(scene, geometry)
        library.rtcReleaseGeometry(geometry)
        library.rtcCommitScene(scene)
        return scene
