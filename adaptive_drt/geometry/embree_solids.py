# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays against many solids by embree's own shapes: see `native_solids`.

embreex traces triangles only. The library that its wheel brings also has spheres, which are built
forty times faster than icosahedra and are round, and cones; see `embree_library`.

Embree works in float32. Scenes are therefore scaled to unit size about their centre, so that what
it rounds away is relative to the scene's size: see `SolidScene`.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.floats import FLOAT32_ROUNDOFF
from ..numerics.vector import dot
from .embree_library import (
    FAR_WORD,
    FLOAT3,
    GEOMETRY_WORD,
    HIT_WORDS,
    INDICES,
    INSTANCE_WORD,
    INSTANCED_WORD,
    ITEM_WORD,
    LONGEST_RAY,
    MASK_WORD,
    PACKET,
    RAY_WORDS,
    TIME_WORD,
    VERTICES,
    aligned_words,
    geometry_buffer,
    native_library,
    ray_packets,
    scene_of,
    trace_packets,
    word_of_rays,
)
from .native_solids import NativeSolids
from .ray_counts import count_rays

__all__ = ["SolidScene"]


QUADS, UINT4 = 1, 0x5004
"""Embree's numbers of quadrilaterals, and of the format of their vertices' numbers."""
START_OFFSET = 16.0 * FLOAT32_ROUNDOFF
"""Distance of the start of rays from the surface that they leave, along its normal, and of their
end from the light, as a fraction of the scene's size: more than embree's rounding of centres, radii
and rays, so that no ray meets the solid that it leaves."""
COPIES = 4
"""Number of directions that `SolidScene.open_rays` traces from each point."""
NEAR_RADII = 2.0
"""Distance from the middle of the scene, in radii of the ball around it, up to which rays begin
where they do; others begin where they enter the ball, so that their rounding is as small."""


class SolidScene:
    """A scene of solids that rays are traced against.

    Where a ray passes the surface of a solid at less than `rounding` metres, whether it meets the
    solid is decided by rounding; elsewhere the answers are those of exact arithmetic.
    """

    def __init__(self, solids: Sequence[NativeSolids], faces: Array | None = None) -> None:
        """Take solids; what embree needs is built when the first ray is traced.

        Parameters
        ----------
        solids : of one or several kinds; they are numbered through in this order.
        faces : (3, 4, q) metres, vertices of quadrilaterals that `open_rays` traces as well.
        """
        self._middle, sides = self.extent(solids)
        self.size = float(sides.max())
        # copies in embree's units are made when they are needed: of a million spheres 32 MB
        self._solids = solids
        self._first = np.cumsum([0, *(each.count for each in solids)])
        self._ball = 0.5 * float(np.sqrt(((sides / self.size) ** 2).sum()))
        self._faces = None
        if faces is not None and faces.size:
            self._faces = (faces - self._middle[:, :, None]) / self.size
        self._lock = threading.Lock()
        self._scenes: dict[bool, int] = {}

    @staticmethod
    def extent(solids: Sequence[NativeSolids]) -> tuple[Array, Array]:
        """Middle (3, 1) and sides (3,) of the box around solids over the shutter, metres."""
        boxes = [each.box() for each in solids]
        low = np.min([each[0] for each in boxes], axis=0)
        high = np.max([each[1] for each in boxes], axis=0)
        return 0.5 * (low + high)[:, None], high - low

    @staticmethod
    def rounding_of(sides: Array) -> float:
        """The `rounding` of a scene that fills a box with such sides (3,), metres."""
        return 2.0 * START_OFFSET * float(sides.max())

    @property
    def rounding(self) -> float:
        """Distance in metres to the surface of a solid below which rounding decides."""
        return 2.0 * START_OFFSET * self.size

    def __del__(self) -> None:
        """Release embree's scene."""
        library = native_library()
        for scene in self.__dict__.get("_scenes", {}).values():
            if library is not None:
                library.rtcReleaseScene(scene)

    def blocked(self, start: Array, normal: Array, to: Array, time: Array | float = 0.0) -> Mask:
        """Whether solids lie between `start` and `start + to`: (n, k).

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
        count_rays("solid shadow", unit.shape[1])
        trace_packets("rtcOccluded16", self._committed(), rays, unit.shape[1])
        found: Mask = (rays[:, FAR_WORD].reshape(-1)[: unit.shape[1]] == -np.inf) & (
            away.reshape(-1) > 0.0
        )
        return found.reshape(to.shape[1:])

    def is_near(self, point: Array) -> Mask:
        """Whether points (3, n) are so near that `open_rays` may begin rays there: (n,)."""
        begin = (point - self._middle) / self.size
        near: Mask = dot(begin, begin) <= (NEAR_RADII * self._ball) ** 2
        return near

    def open_rays(
        self, start: Array, normal: Array, a: Array, b: Array, ways: bool
    ) -> tuple[Mask, NDArray[np.float32] | None]:
        """Which of `COPIES` directions from n points at rest no solid or face blocks: (k, n).

        With `ways`, the directions (3, k, n) come with it.

        Parameters
        ----------
        start, normal : (3, n) metres, points of surfaces, one at least, that are near (`is_near`),
            and their unit normals on the rays' side.
        a, b : (n,) coordinates in the unit square. One direction is that of each point (a, b), by
            Malley's map: its density is the cosine over pi. The others are those of the same
            point in the other quarters of the square (`sobol_points.stratified_copies`).
        ways : whether the directions are asked for.
        """
        count = a.size
        packets = -(-count // PACKET)
        rays = aligned_words((COPIES, packets, RAY_WORDS, PACKET))
        n = _packed(normal)
        rays[:, :, 0:3] = _packed((start - self._middle) / self.size + START_OFFSET * normal)
        turn = _packed(b) * np.float32(2.0 * np.pi)
        aside = _tangents(n, np.cos(turn), np.sin(turn))
        first, pair = _packed(a), np.empty_like(n)
        for half in range(2):
            part = first if not half else (first + np.float32(0.5)) % np.float32(1.0)
            np.multiply(n, np.sqrt(1.0 - part)[:, None], out=pair)
            across = aside * np.sqrt(part)[:, None]
            # half a turn reverses what is aside of the normal
            np.add(pair, across, out=rays[2 * half, :, 4:7])
            np.subtract(pair, across, out=rays[2 * half + 1, :, 4:7])
        rays[:, :, TIME_WORD] = 0.5
        rays[:, :, FAR_WORD] = LONGEST_RAY
        rays[:, :, MASK_WORD].view(np.uint32)[:] = 0xFFFFFFFF
        count_rays("solid shadow", COPIES * count)
        # rays that only fill the last packet are ended
        rays[:, -1, FAR_WORD, count - packets * PACKET + PACKET :] = -1.0
        rows = rays.reshape(COPIES * packets, RAY_WORDS, PACKET)
        scene = self._committed(self._faces is not None)
        trace_packets("rtcOccluded16", scene, rows, rows.shape[0] * PACKET)
        free: Mask = (rays[:, :, FAR_WORD] != -np.inf).reshape(COPIES, -1)[:, :count]
        if not ways:
            return free, None
        way = np.moveaxis(rays[:, :, 4:7], 2, 0).reshape(3, COPIES, -1)[:, :, :count]
        return free, way

    def nearest(self, way: Array, time: Array | float = 0.0) -> tuple[Ints, Array]:
        """The first solid (m,) that rays from the origin along `way` (3, m) meet, or -1.

        With it comes the ray parameter (m,) of the hit, to embree's accuracy.

        time : shutter times (m,) or one number.
        """
        length = np.sqrt(dot(way, way))
        unit = way / length
        origin = np.broadcast_to(-self._middle / self.size, unit.shape)
        away, gone = np.full(unit.shape[1], LONGEST_RAY), np.zeros(1)
        if float((origin[:, :1] ** 2).sum()) > (NEAR_RADII * self._ball) ** 2:
            gone, met = self._entry(origin, unit)
            origin, away = origin + gone * unit, np.where(met, away, -1.0)
        item, reach = self._first_met(origin, unit, away, time)
        return item, (gone + reach) * (self.size / length)

    def _first_met(
        self, origin: Array, unit: Array, away: Array, time: Array | float
    ) -> tuple[Ints, Array]:
        """The first solid (m,) that rays of lengths `away` meet, or -1, and the lengths (m,) up to
        it, in the scene's units.
        """
        rays = ray_packets(origin, unit, away, RAY_WORDS + HIT_WORDS, time=time)
        count = unit.shape[1]
        count_rays("solid nearest", count)
        trace_packets("rtcIntersect16", self._committed(), rays, count)
        item = word_of_rays(rays, ITEM_WORD, count)
        if len(self._solids) > 1 or self._solids[0].instanced:
            instanced = word_of_rays(rays, INSTANCED_WORD, count)
            own = np.where(instanced < 0, item, word_of_rays(rays, INSTANCE_WORD, count))
            kind = np.where(instanced < 0, word_of_rays(rays, GEOMETRY_WORD, count), instanced)
            item = np.where(item < 0, -1, own + self._first[kind])
        item[away < 0.0] = -1
        return item, rays[:, FAR_WORD].reshape(-1)[:count].astype(np.float64)

    def first_blocking(self, start: Array, normal: Array, to: Array) -> Ints:
        """The first solid (n,) between `start` and `start + to`, at rest, or -1.

        start, normal : (3, n) as those of `blocked`.  to : (3, n) metres.
        """
        length = np.sqrt(dot(to, to)) / self.size
        unit = to / (length * self.size)
        away = np.minimum(length - START_OFFSET, LONGEST_RAY)
        origin = (start - self._middle) / self.size + START_OFFSET * normal
        gone, met = self._entry(origin, unit)
        far = dot(origin, origin) > (NEAR_RADII * self._ball) ** 2
        origin = np.where(far, origin + gone * unit, origin)
        away = np.where(far, np.where(met, away - gone, -1.0), away)
        return self._first_met(origin, unit, away, 0.0)[0]

    def _entry(self, origin: Array, unit: Array) -> tuple[Array, Mask]:
        """Lengths (m,) of rays up to the ball around the scene, and whether they meet it."""
        along = -dot(unit, origin)
        aside = origin + along * unit
        room = (self._ball * (1.0 + START_OFFSET)) ** 2 - dot(aside, aside)
        half = np.sqrt(np.maximum(room, 0.0))
        return np.maximum(along - half, 0.0), (room > 0.0) & (along + half > 0.0)

    def _committed(self, faces: bool = False) -> int:
        """Embree's scene, built once, with or without the faces."""
        with self._lock:
            if faces not in self._scenes:
                self._scenes[faces] = self._build(faces)
        return self._scenes[faces]

    def _build(self, faces: bool) -> int:
        geometries = [each.geometry(self._middle, self.size) for each in self._solids]
        if faces:
            assert self._faces is not None
            geometries.append(_quad_geometry(self._faces.T.reshape(-1, 3)))
        return scene_of(*geometries)


def _quad_geometry(corners: Array) -> int:
    """Quadrilaterals of which each has four of the rows of `corners` (4 q, 3)."""
    library = native_library()
    assert library is not None
    geometry: int = library.rtcNewGeometry(library.device, QUADS)
    geometry_buffer(geometry, VERTICES, FLOAT3, np.float32, (len(corners), 3))[:] = corners
    shape = (len(corners) // 4, 4)
    numbers = geometry_buffer(geometry, INDICES, UINT4, np.uint32, shape)
    numbers[:] = np.arange(len(corners)).reshape(shape)
    return geometry


def _packed(values: Array) -> Any:
    """Values (..., n) as float32 (p, ..., `PACKET`), with zeros at the end."""
    count = values.shape[-1]
    packets = -(-count // PACKET)
    room = np.zeros((*values.shape[:-1], packets * PACKET), dtype=np.float32)
    room[..., :count] = values
    return np.moveaxis(room.reshape(*values.shape[:-1], packets, PACKET), -2, 0)


def _tangents(n: Any, cosine: Any, sine: Any) -> Any:
    """Unit vectors (p, 3, k) across unit vectors n (p, 3, k), at angles given by cosine and sine.

    The frame is that of Duff and others 2017, "Building an orthonormal basis, revisited".
    """
    x, y, z = n[:, 0], n[:, 1], n[:, 2]
    sign = np.copysign(np.float32(1.0), z)
    a = -1.0 / (sign + z)
    b = x * y * a
    out = np.empty_like(n)
    signed = sign * cosine
    out[:, 0] = cosine + x * x * a * signed + b * sine
    out[:, 1] = b * signed + (sign + y * y * a) * sine
    out[:, 2] = -(x * signed + y * sine)
    return out
