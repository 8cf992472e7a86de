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
from ctypes.util import find_library
from functools import cache
from importlib.util import find_spec
from itertools import repeat
from pathlib import Path
from typing import Any

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.vector import dot
from .ray_counts import count_rays

__all__ = ["SphereScene", "native_library", "native_version"]


TESTED_VERSIONS = range(40_400, 40_500)
"""Versions of embree whose structures are known: major times 10,000, minor times 100, patch."""
SYSTEM_LIBRARY = "embree4"
"""Name of the library where it is installed for the whole system, as with Debian's Blender. Worker
processes find it there as well, but not what only a program of its own brings."""
VERSION_PROPERTY = 0
"""Number of the device's property that holds its version (RTC_DEVICE_PROPERTY_VERSION)."""
SPHERE_POINTS, VERTICES, FLOAT4, ROBUST = 50, 1, 0x9004, 4
"""Embree's numbers of the kind of shape, the buffer, its format, and the scene's flag."""
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


def _library_paths() -> list[Path | str]:
    """Files that may be embree's library: as wheels for Linux, Windows and macOS place them, then
    that of the system.
    """
    system = find_library(SYSTEM_LIBRARY)
    installed: list[Path | str] = [] if system is None else [system]
    found = find_spec("embreex")
    if found is None or found.origin is None:
        return installed
    package = Path(found.origin).parent
    folders = (package.parent / "embreex.libs", package / ".dylibs", package)
    own = (path for folder in folders for path in sorted(folder.glob("*embree4*")))
    return [*own, *installed]


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

    def __init__(self, center: Array, radius: Array, displacement: Array | None = None) -> None:
        """Take n spheres; what embree needs is built when the first ray is traced.

        Parameters
        ----------
        center : (3, n) metres, at the middle of the shutter.  radius : (n,) metres.
        displacement : (3, n) metres, over the shutter; None at rest.
        """
        self._middle, sides = self.extent(center, radius, displacement)
        self.size = float(sides.max())
        self._center = (center - self._middle) / self.size
        self._radius = radius / self.size
        self._shift = None if displacement is None else displacement / self.size
        self._ball = 0.5 * float(np.sqrt(((sides / self.size) ** 2).sum()))
        self._lock = threading.Lock()
        self._scene: int | None = None

    @staticmethod
    def extent(center: Array, radius: Array, displacement: Array | None) -> tuple[Array, Array]:
        """Middle (3, 1) and sides (3,) of the box around spheres over the shutter, metres."""
        path = 0.0 if displacement is None else 0.5 * np.abs(displacement)
        low, high = (center - path - radius).min(axis=1), (center + path + radius).max(axis=1)
        return 0.5 * (low + high)[:, None], high - low

    @staticmethod
    def rounding_of(sides: Array) -> float:
        """The `rounding` of a scene that fills a box with such sides (3,), metres."""
        return 2.0 * START_OFFSET * float(sides.max())

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
        rays = self._packets(origin, unit, away.reshape(-1), RAY_WORDS, time)
        count_rays("sphere shadow", unit.shape[1])
        self._run("rtcOccluded16", rays, unit.shape[1])
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
        return self._first_met(origin, unit, away, time)

    def _first_met(self, origin: Array, unit: Array, away: Array, time: Array | float) -> Ints:
        """The first sphere (m,) that rays of lengths `away` meet, or -1, in the scene's units."""
        rays = self._packets(origin, unit, away, RAY_WORDS + HIT_WORDS, time)
        rays[:, ITEM_WORD].view(np.int32)[:] = -1
        count_rays("sphere nearest", unit.shape[1])
        self._run("rtcIntersect16", rays, unit.shape[1])
        found = rays[:, ITEM_WORD].view(np.int32).reshape(-1)[: unit.shape[1]]
        item: Ints = found.astype(np.int64)
        item[away < 0.0] = -1
        return item

    def first_blocking(self, start: Array, normal: Array, to: Array) -> Ints:
        """The first sphere (n,) between `start` and `start + to`, at rest, or -1.

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
        return self._first_met(origin, unit, away, 0.0)

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
        packets = -(-count // PACKET)
        room = np.zeros(packets * words * PACKET + ALIGNMENT // 4, dtype=np.float32)
        skip = -room.ctypes.data % ALIGNMENT // 4
        rays: Any = room[skip : skip + packets * words * PACKET].reshape(packets, words, PACKET)
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

    def _run(self, query: str, rays: Any, count: int) -> None:
        """Trace packets of rays, in place."""
        if not count:
            return
        library, scene = native_library(), self._committed()
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
            place = library.rtcSetNewGeometryBuffer(
                geometry, VERTICES, slot, FLOAT4, 4 * ctypes.sizeof(ctypes.c_float), count
            )
            floats = (ctypes.c_float * (4 * count)).from_address(place)
            values = np.ctypeslib.as_array(floats).reshape(count, 4)
            shift = 0.0 if self._shift is None else end * self._shift
            values[:, :3] = (self._center + shift).T
            values[:, 3] = self._radius
        library.rtcCommitGeometry(geometry)
        library.rtcAttachGeometry(scene, geometry)
        library.rtcReleaseGeometry(geometry)
        library.rtcCommitScene(scene)
        return scene
