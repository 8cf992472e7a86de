# SPDX-License-Identifier: GPL-3.0-or-later
"""Embree's library by ctypes, for what embreex does not offer: solids, and instances of meshes.

It is the library that the wheel of embreex brings. Rays are traced 16 at a time: a call takes some
4 microseconds, of which Python takes a tenth. Triangles of one mesh are left to embreex, whose
loop is in compiled code: both trace 7 to 12 million rays a second (99,000 faces).
"""

from __future__ import annotations

import ctypes
from collections import deque
from ctypes.util import find_library
from functools import cache
from importlib.util import find_spec
from itertools import repeat
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array, Ints

__all__ = [
    "FAR_WORD",
    "FLOAT3",
    "FLOAT3X4_COLUMNS",
    "FLOAT4",
    "GEOMETRY_WORD",
    "HIT_WORDS",
    "INDICES",
    "INSTANCED_WORD",
    "INSTANCE_ARRAY",
    "INSTANCE_WORD",
    "ITEM_WORD",
    "LONGEST_RAY",
    "MASK_WORD",
    "NEAR_WORD",
    "PACKET",
    "RAY_WORDS",
    "TIME_WORD",
    "TRANSFORMS",
    "VERTICES",
    "aligned_words",
    "geometry_buffer",
    "native_library",
    "native_version",
    "ray_packets",
    "scene_of",
    "trace_packets",
    "word_of_rays",
]


TESTED_VERSIONS = range(40_400, 40_500)
"""Versions of embree whose structures are known: major times 10,000, minor times 100, patch."""
SYSTEM_LIBRARY = "embree4"
"""Name of the library where it is installed for the whole system, as with Debian's Blender. Worker
processes find it there as well, but not what only a program of its own brings."""
VERSION_PROPERTY = 0
"""Number of the device's property that holds its version (RTC_DEVICE_PROPERTY_VERSION)."""
ROBUST = 4
"""Flag of scenes that leave no gaps between faces that share vertices (RTC_SCENE_FLAG_ROBUST)."""
INDICES, VERTICES, FLOAT3, FLOAT4 = 0, 1, 0x9003, 0x9004
"""Embree's numbers of the buffers of vertices and of their numbers, and of the formats of places,
without and with radii."""
INSTANCE_ARRAY, TRANSFORMS, FLOAT3X4_COLUMNS = 122, 23, 0x9234
"""The same of instances, and of the buffer and the format of their matrices."""
PACKET = 16
"""Number of rays in one call."""
RAY_WORDS, HIT_WORDS = 12, 9
"""Numbers of 4-byte words of a ray and of a hit."""
NEAR_WORD, TIME_WORD, FAR_WORD, MASK_WORD = 3, 7, 8, 9
"""Places of the start, of the shutter time, of the end and of the mask in a ray."""
ITEM_WORD, GEOMETRY_WORD, INSTANCED_WORD, INSTANCE_WORD = 17, 18, 19, 20
"""Places, in a ray and its hit, of the number of the solid or the face, of its geometry in the
scene, or of that of an array of instances, and of the instance in it (RTCHit16.primID, .geomID,
.instID and .instPrimID)."""
ALIGNMENT = 64
"""Alignment in bytes that embree requires of packets."""
LONGEST_RAY = 1e30
"""Length of rays from which they count as endless, in sizes of the scene; float32 ends at 3e38."""


@cache
def native_library() -> Any | None:
    """Embree's library, or None where it is not found or is of an untested version."""
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
    """Version of that library, for the statistics; 'none' without one."""
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
        "rtcSetGeometryInstancedScene": (None, [pointer, pointer]),
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


def geometry_buffer(
    geometry: int, kind: int, form: int, dtype: type, shape: tuple[int, int], slot: int = 0
) -> NDArray[Any]:
    """A buffer of a geometry of embree, to be filled: an array of `shape` (items, numbers each).

    Parameters
    ----------
    kind, form : embree's numbers of the buffer (RTCBufferType) and of its format (RTCFormat).
    dtype : of numbers of 4 bytes.  slot : the time step.
    """
    library = native_library()
    assert library is not None
    place = library.rtcSetNewGeometryBuffer(geometry, kind, slot, form, 4 * shape[1], shape[0])
    count = shape[0] * shape[1]
    words = (ctypes.c_uint32 * count).from_address(place)
    return np.ctypeslib.as_array(words).view(dtype).reshape(shape)


def scene_of(*geometries: int) -> int:
    """A scene that owns geometries; no ray passes between faces that share an edge."""
    library = native_library()
    assert library is not None
    scene: int = library.rtcNewScene(library.device)
    library.rtcSetSceneFlags(scene, ROBUST)
    for geometry in geometries:
        library.rtcCommitGeometry(geometry)
        library.rtcAttachGeometry(scene, geometry)
        library.rtcReleaseGeometry(geometry)
    library.rtcCommitScene(scene)
    return scene


def aligned_words(shape: tuple[int, ...]) -> Any:
    """An array of float32 zeros that is aligned as embree requires of packets."""
    size = int(np.prod(shape))
    room = np.zeros(size + ALIGNMENT // 4, dtype=np.float32)
    skip = -room.ctypes.data % ALIGNMENT // 4
    return room[skip : skip + size].reshape(shape)


def ray_packets(
    origin: Array,
    unit: Array,
    away: Array,
    words: int,
    near: Array | None = None,
    time: Array | float = 0.0,
) -> Any:
    """Rays in packets (p, words, `PACKET`) of float32; those at the end may be unused.

    Parameters
    ----------
    origin, unit : (3, n).  away, near : (n,) lengths at which the rays end and begin; None for 0.
    words : `RAY_WORDS`, with `HIT_WORDS` more for rays that look for the nearest hit.
    time : shutter times, n of them or one number.
    """
    count = away.size
    rays = aligned_words((-(-count // PACKET), words, PACKET))
    full, rest = divmod(count, PACKET)
    end = full * PACKET
    moment = np.asarray(time).reshape(-1) + 0.5
    moment = np.broadcast_to(moment, count) if moment.size == 1 else moment
    begin = () if near is None else ((NEAR_WORD, near),)
    for word, values in (
        *enumerate(origin), *begin, *enumerate(unit, 4), (TIME_WORD, moment), (FAR_WORD, away),
    ):  # fmt: skip
        rays[:full, word] = values[:end].reshape(full, PACKET)
        if rest:
            rays[full, word, :rest] = values[end:]
    rays[:, MASK_WORD].view(np.uint32)[:] = 0xFFFFFFFF
    if words > RAY_WORDS:
        rays[:, ITEM_WORD : INSTANCE_WORD + 1].view(np.int32)[:] = -1
    return rays


def trace_packets(query: str, scene: int, rays: Any, count: int) -> None:
    """Trace packets of `count` rays, in place, by a function of the library."""
    if not count:
        return
    call = getattr(native_library(), query)
    every, last = aligned_words((2, PACKET)).view(np.int32)
    every[:] = -1
    full, rest = divmod(count, PACKET)
    last[:rest] = -1
    first, step = rays.ctypes.data, rays[0].nbytes
    places = range(first, first + full * step, step)
    # `deque` runs the calls without a step of the interpreter between them
    deque(map(call, repeat(every.ctypes.data), repeat(scene), places, repeat(None)), maxlen=0)
    if rest:
        call(last.ctypes.data, scene, first + full * step, None)


def word_of_rays(rays: Any, word: int, count: int) -> Ints:
    """One integer (n,) of each ray of packets."""
    found: Ints = rays[:, word].view(np.int32).reshape(-1)[:count].astype(np.int64)
    return found
