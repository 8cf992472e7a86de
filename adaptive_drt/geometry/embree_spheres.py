# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays against many spheres by embree's own spheres.

embreex traces triangles only. The library that its wheel brings also has spheres, which are built
forty times faster than icosahedra and are round. It is called through ctypes, 16 rays at a time: a
call takes some 4 microseconds, of which Python takes a tenth.

Embree works in float32. Scenes are therefore scaled to unit size about their centre, so that what
it rounds away is relative to the scene's size: see `SphereScene`.
"""

from __future__ import annotations

import ctypes
import threading
from collections import deque
from functools import cache
from importlib.util import find_spec
from itertools import repeat
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.vector import dot
from .ray_counts import count_rays

__all__ = ["SphereScene", "native_library", "native_version"]


TESTED_VERSIONS = range(40_400, 40_500)
"""Versions of embree whose structures are known: major times 10,000, minor times 100, patch."""
VERSION_PROPERTY = 0
"""Number of the device's property that holds its version (RTC_DEVICE_PROPERTY_VERSION)."""
SPHERE_POINTS, VERTICES, FLOAT4, ROBUST = 50, 1, 0x9004, 4
"""Embree's numbers of the kind of shape, the buffer, its format, and the scene's flag."""
QUADS, INDICES, FLOAT3, UINT4 = 1, 0, 0x9003, 0x5004
"""The same of quadrilaterals, the buffer of their vertices' numbers, and the formats of both."""
PACKET = 16
"""Number of rays in one call."""
RAY_WORDS, HIT_WORDS, ITEM_WORD = 12, 9, 17
"""Numbers of 4-byte words of a ray and a hit, and the place of the sphere's number in both."""
TIME_WORD, FAR_WORD, MASK_WORD = 7, 8, 9
"""Places of the shutter time, of the end and of the mask in a ray."""
ALIGNMENT = 64
"""Alignment in bytes that embree requires of packets."""
FLOAT32_ROUNDOFF = 2.0**-24
"""Largest relative rounding error of a float32 operation."""
START_OFFSET = 16.0 * FLOAT32_ROUNDOFF
"""Distance of the start of rays from the surface that they leave, along its normal, and of their
end from the light, as a fraction of the scene's size: more than embree's rounding of centres, radii
and rays, so that no ray meets the sphere that it leaves."""
LONGEST_RAY = 1e30
"""Length of rays from which they count as endless, in sizes of the scene; float32 ends at 3e38."""
COPIES = 4
"""Number of directions that `SphereScene.open_rays` traces from each point."""
NEAR_RADII = 2.0
"""Distance from the middle of the scene, in radii of the ball around it, up to which rays begin
where they do; others begin where they enter the ball, so that their rounding is as small."""


@cache
def native_library() -> Any | None:
    """Embree's library with spheres, or None where it is not found or is of an untested version."""
    for path in _library_paths():
        try:
            library = _declared(ctypes.CDLL(str(path)))
            device = library.rtcNewDevice(None)
            if device and library.rtcGetDeviceProperty(device, VERSION_PROPERTY) in TESTED_VERSIONS:
                library.device = device  # one for the whole process
                return library
        except (OSError, AttributeError):
            continue
    return None


def native_version() -> str:
    """Version of embree whose spheres are traced, for the statistics; 'none' without one."""
    library = native_library()
    if library is None:
        return "none"
    number = library.rtcGetDeviceProperty(library.device, VERSION_PROPERTY)
    return f"embree {number // 10_000}.{number // 100 % 100}.{number % 100}"


def _library_paths() -> list[Path]:
    """Files that may be embree's library, as wheels for Linux, Windows and macOS place them."""
    found = find_spec("embreex")
    if found is None or found.origin is None:
        return []
    package = Path(found.origin).parent
    folders = (package.parent / "embreex.libs", package / ".dylibs", package)
    return [path for folder in folders for path in sorted(folder.glob("*embree4*"))]


def _declared(library: Any) -> Any:
    """The library with the types of the functions that are used."""
    pointer, size = ctypes.c_void_p, ctypes.c_size_t
    declared = {
        "rtcNewDevice": (pointer, [ctypes.c_char_p]),
        "rtcGetDeviceProperty": (ctypes.c_ssize_t, [pointer, ctypes.c_int]),
        "rtcNewScene": (pointer, [pointer]),
        "rtcSetSceneFlags": (None, [pointer, ctypes.c_int]),
        "rtcNewGeometry": (pointer, [pointer, ctypes.c_int]),
        "rtcSetGeometryTimeStepCount": (None, [pointer, ctypes.c_uint]),
        "rtcSetNewGeometryBuffer": (
            pointer, [pointer, ctypes.c_int, ctypes.c_uint, ctypes.c_int, size, size],
        ),
        "rtcCommitGeometry": (None, [pointer]),
        "rtcAttachGeometry": (ctypes.c_uint, [pointer, pointer]),
        "rtcReleaseGeometry": (None, [pointer]),
        "rtcCommitScene": (None, [pointer]),
        "rtcReleaseScene": (None, [pointer]),
        "rtcOccluded16": (None, [pointer] * 4),
        "rtcIntersect16": (None, [pointer] * 4),
    }  # fmt: skip
    for name, (result, arguments) in declared.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library


class SphereScene:
    """A scene of spheres that rays are traced against.

    Where a ray passes the surface of a sphere at less than `rounding` metres, whether it meets the
    sphere is decided by rounding; elsewhere the answers are those of exact arithmetic.
    """

    def __init__(
        self,
        center: Array,
        radius: Array,
        displacement: Array | None = None,
        faces: Array | None = None,
    ) -> None:
        """Take n spheres; what embree needs is built when the first ray is traced.

        Parameters
        ----------
        center : (3, n) metres, at the middle of the shutter.  radius : (n,) metres.
        displacement : (3, n) metres, over the shutter; None at rest.
        faces : (3, 4, q) metres, vertices of quadrilaterals that `open_rays` traces as well.
        """
        self._middle, sides = self.extent(center, radius, displacement)
        self.size = float(sides.max())
        self._center = (center - self._middle) / self.size
        self._radius = radius / self.size
        self._shift = None if displacement is None else displacement / self.size
        self._ball = 0.5 * float(np.sqrt(((sides / self.size) ** 2).sum()))
        self._faces = None
        if faces is not None and faces.size:
            self._faces = (faces - self._middle[:, :, None]) / self.size
        self._lock = threading.Lock()
        self._scenes: dict[bool, int] = {}

    @staticmethod
    def extent(center: Array, radius: Array, displacement: Array | None) -> tuple[Array, Array]:
        """Middle (3, 1) and sides (3,) of the box around spheres over the shutter, metres."""
        path = 0.0 if displacement is None else 0.5 * np.abs(displacement)
        low, high = (center - path - radius).min(axis=1), (center + path + radius).max(axis=1)
        return 0.5 * (low + high)[:, None], high - low

    @property
    def rounding(self) -> float:
        """Distance in metres to the surface of a sphere below which rounding decides."""
        return 2.0 * START_OFFSET * self.size

    def __del__(self) -> None:
        """Release embree's scene."""
        library = native_library()
        for scene in self.__dict__.get("_scenes", {}).values():
            if library is not None:
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
        rays = self._packets(origin, unit, away.reshape(-1), RAY_WORDS, time)
        count_rays("sphere shadow", unit.shape[1])
        self._run("rtcOccluded16", rays, unit.shape[1])
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
        """Which of `COPIES` directions from n points at rest no sphere or face blocks: (k, n).

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
        rays = _aligned((COPIES, packets, RAY_WORDS, PACKET))
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
        count_rays("sphere shadow", COPIES * count)
        # rays that only fill the last packet are ended
        rays[:, -1, FAR_WORD, count - packets * PACKET + PACKET :] = -1.0
        rows = rays.reshape(COPIES * packets, RAY_WORDS, PACKET)
        self._run("rtcOccluded16", rows, rows.shape[0] * PACKET, True)
        free: Mask = (rays[:, :, FAR_WORD] != -np.inf).reshape(COPIES, -1)[:, :count]
        if not ways:
            return free, None
        way = np.moveaxis(rays[:, :, 4:7], 2, 0).reshape(3, COPIES, -1)[:, :, :count]
        return free, way

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
        rays = self._packets(origin, unit, away, RAY_WORDS + HIT_WORDS, time)
        rays[:, ITEM_WORD].view(np.int32)[:] = -1
        count_rays("sphere nearest", unit.shape[1])
        self._run("rtcIntersect16", rays, unit.shape[1])
        found = rays[:, ITEM_WORD].view(np.int32).reshape(-1)[: unit.shape[1]]
        item: Ints = found.astype(np.int64)
        item[away < 0.0] = -1
        return item

    def _entry(self, origin: Array, unit: Array) -> tuple[Array, Mask]:
        """Lengths (m,) of rays up to the ball around the scene, and whether they meet it."""
        along = -dot(unit, origin)
        aside = origin + along * unit
        room = (self._ball * (1.0 + START_OFFSET)) ** 2 - dot(aside, aside)
        half = np.sqrt(np.maximum(room, 0.0))
        return np.maximum(along - half, 0.0), (room > 0.0) & (along + half > 0.0)

    def _packets(
        self, origin: Array, unit: Array, away: Array, words: int, time: Array | float
    ) -> Any:
        """Rays in packets (p, words, `PACKET`) of float32; those at the end may be unused."""
        count = away.size
        rays = _aligned((-(-count // PACKET), words, PACKET))
        full, rest = divmod(count, PACKET)
        end = full * PACKET
        moment = (
            np.broadcast_to(np.asarray(time) + 0.5, away.size)
            if np.ndim(time) == 0
            else (np.asarray(time).reshape(-1) + 0.5)
        )
        for word, values in (
            *enumerate(origin), *enumerate(unit, 4), (TIME_WORD, moment), (FAR_WORD, away),
        ):  # fmt: skip
            rays[:full, word] = values[:end].reshape(full, PACKET)
            if rest:
                rays[full, word, :rest] = values[end:]
        rays[:, MASK_WORD].view(np.uint32)[:] = 0xFFFFFFFF
        return rays

    def _run(self, query: str, rays: Any, count: int, faces: bool = False) -> None:
        """Trace packets of rays, in place. faces : against the faces as well."""
        if not count:
            return
        library, scene = native_library(), self._committed(faces and self._faces is not None)
        call = getattr(library, query)
        used = np.zeros(2 * PACKET + ALIGNMENT // 4, dtype=np.int32)
        skip = -used.ctypes.data % ALIGNMENT // 4
        every, last = used[skip : skip + PACKET], used[skip + PACKET : skip + 2 * PACKET]
        every[:] = -1
        full, rest = divmod(count, PACKET)
        last[:rest] = -1
        first, step = rays.ctypes.data, rays[0].nbytes
        places = range(first, first + full * step, step)
        # `deque` runs the calls without a step of the interpreter between them
        deque(map(call, repeat(every.ctypes.data), repeat(scene), places, repeat(None)), maxlen=0)
        if rest:
            call(last.ctypes.data, scene, first + full * step, None)

    def _committed(self, faces: bool) -> int:
        """Embree's scene, built once, with or without the faces."""
        with self._lock:
            if faces not in self._scenes:
                self._scenes[faces] = self._build(faces)
        return self._scenes[faces]

    def _build(self, faces: bool) -> int:
        library = native_library()
        assert library is not None
        scene: int = library.rtcNewScene(library.device)
        library.rtcSetSceneFlags(scene, ROBUST)
        geometry = library.rtcNewGeometry(library.device, SPHERE_POINTS)
        ends = (0.0,) if self._shift is None else (-0.5, 0.5)
        library.rtcSetGeometryTimeStepCount(geometry, len(ends))
        count = self._radius.size
        for slot, end in enumerate(ends):
            values = _new_buffer(geometry, (VERTICES, slot, FLOAT4), (count, 4), ctypes.c_float)
            shift = 0.0 if self._shift is None else end * self._shift
            values[:, :3] = (self._center + shift).T
            values[:, 3] = self._radius
        _attach(scene, geometry)
        if faces:
            assert self._faces is not None
            geometry = library.rtcNewGeometry(library.device, QUADS)
            corners = self._faces.T.reshape(-1, 3)
            _new_buffer(geometry, (VERTICES, 0, FLOAT3), corners.shape, ctypes.c_float)[:] = corners
            shape = (len(corners) // 4, 4)
            numbers = _new_buffer(geometry, (INDICES, 0, UINT4), shape, ctypes.c_uint)
            numbers[:] = np.arange(len(corners)).reshape(shape)
            _attach(scene, geometry)
        library.rtcCommitScene(scene)
        return scene


def _new_buffer(
    geometry: int, kind: tuple[int, int, int], shape: tuple[int, ...], number: Any
) -> Any:
    """A new buffer of a geometry: its kind, slot and format, and its shape, of 4-byte numbers."""
    library = native_library()
    assert library is not None
    place = library.rtcSetNewGeometryBuffer(geometry, *kind, 4 * shape[1], shape[0])
    numbers = (number * (shape[0] * shape[1])).from_address(place)
    return np.ctypeslib.as_array(numbers).reshape(shape)


def _attach(scene: int, geometry: int) -> None:
    """Give a geometry to a scene."""
    library = native_library()
    assert library is not None
    library.rtcCommitGeometry(geometry)
    library.rtcAttachGeometry(scene, geometry)
    library.rtcReleaseGeometry(geometry)


def _aligned(shape: tuple[int, ...]) -> Any:
    """An array of float32 zeros that is aligned as embree requires."""
    size = int(np.prod(shape))
    room = np.zeros(size + ALIGNMENT // 4, dtype=np.float32)
    skip = -room.ctypes.data % ALIGNMENT // 4
    return room[skip : skip + size].reshape(shape)


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
