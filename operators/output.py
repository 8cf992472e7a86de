# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that a render has written: whether they are whole.

On a full disk Blender 4.2 to 5.2 ends without an error, and leaves the beginning of a file, where
the format is PNG, BMP, Targa, OpenEXR or a movie. It reports an error for the other formats.
"""

from __future__ import annotations

import os
import struct
import tempfile
import time
from dataclasses import dataclass
from typing import Any, BinaryIO

import bpy

COARSE = 3.0
"""Seconds. A file system may keep times in steps of 2 s: a file younger than this is new."""

SMALLEST = 16
"""Octets: no picture in any format is shorter."""

PROBE = 1 << 16
"""Octets; more than what a program keeps back until it closes a file."""

PNG, BMP, EXR, RIFF = b"\x89PNG\r\n\x1a\n", b"BM", b"v/1\x01", b"RIFF"
PNG_END = b"\x00\x00\x00\x00IEND\xaeB`\x82"
TARGA_END = b"TRUEVISION-XFILE.\x00"
TARGA_SUFFIXES = (".tga", ".targa")
MULTIPART = 0x1000
"""Bit of an OpenEXR file's version field."""


@dataclass(frozen=True)
class Stamp:
    """What tells one state of a file from another; all None: there is no file."""

    changed: int | None = None
    size: int | None = None
    node: int | None = None


def stamp_of(path: str) -> Stamp:
    """Return the stamp of a file."""
    try:
        found = os.stat(path)
    except OSError:
        return Stamp()
    return Stamp(found.st_mtime_ns, found.st_size, found.st_ino)


def fault_of(path: str, before: Stamp) -> str:
    """Return what is wrong with a file that was to be written, or "".

    Parameters
    ----------
    before : stamp of the file before it was written.
    """
    now = stamp_of(path)
    if now.changed is None:
        return "it was not written"
    if now == before and time.time() - now.changed / 1e9 > COARSE:
        return "it is the file of before: it was not written anew"
    if not now.size:
        return "it is empty; is the disk full?"
    try:
        with open(path, "rb") as file:
            whole = _is_whole(file, now.size, path)
    except OSError as error:
        return f"it cannot be read: {error.strerror}"
    if whole is None:
        return _probe(os.path.dirname(path))
    return "" if whole else "its end is missing; is the disk full?"


def _probe(folder: str) -> str:
    """Return why nothing more can be written to a folder, or "".

    For formats whose length is not known here: what Blender has yet to write when it closes a file
    fails without an error, but then this fails as well.
    """
    try:
        with tempfile.NamedTemporaryFile(dir=folder) as file:
            file.write(bytes(PROBE))
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        return f"its end may be missing: nothing more can be written there: {error.strerror}"
    return ""


def _is_whole(file: BinaryIO, size: int, path: str) -> bool | None:
    """Whether a file is as long as its format says; None for formats that are not known."""
    if size < SMALLEST:
        return False
    start = file.read(8)
    if start == PNG:
        return _ends_with(file, size, PNG_END)
    if start.startswith(RIFF):  # WebP, AVI: the size is what follows it
        return len(start) == 8 and _number(start[4:]) + 8 <= size
    if start.startswith(BMP):
        return len(start) == 8 and _number(start[2:6]) <= size
    if start.startswith(EXR):
        try:
            return _is_whole_exr(file, size, bool(_number(start[4:]) & MULTIPART))
        except (struct.error, ValueError):
            return False
    if path.lower().endswith(TARGA_SUFFIXES):
        return _ends_with(file, size, TARGA_END)
    return None


def _number(octets: bytes) -> int:
    return int.from_bytes(octets, "little")


def _ends_with(file: BinaryIO, size: int, end: bytes) -> bool:
    file.seek(max(0, size - len(end)))
    return file.read() == end


def _is_whole_exr(file: BinaryIO, size: int, multipart: bool) -> bool:
    """Whether each chunk of an OpenEXR file lies within it.

    After the headers stand the places of the chunks, eight bytes each; they are written last.
    The number of chunks is in the header where there are several parts; otherwise the first chunk
    lies behind its table (OpenEXR, "File Layout"). A chunk is its part's number if there are
    several, the row, the size and the data.
    """
    counts = []
    while (count := _read_header(file)) is not None:
        counts.append(count)
        if not multipart:
            break
    if multipart:
        total = sum(counts)
    else:
        table = file.tell()
        (first,) = struct.unpack("<Q", file.read(8))
        file.seek(table)
        total = (first - table) // 8
    if not 0 < total <= size // 8:
        return False
    places = struct.unpack(f"<{total}Q", file.read(8 * total))
    if min(places) == 0:
        return False
    last, head = max(places), 12 if multipart else 8
    file.seek(last)
    octets = file.read(head)
    return len(octets) == head and last + head + _number(octets[-4:]) <= size


def _read_header(file: BinaryIO) -> int | None:
    """Read a header and return its number of chunks, 0 if unsaid; None: it has no attribute."""
    count: int | None = None
    while name := _read_word(file):
        kind = _read_word(file)
        (length,) = struct.unpack("<i", file.read(4))
        value = file.read(length)
        if not kind or length < 0 or len(value) != length:
            raise ValueError("the header ends too early")
        count = _number(value) if name == b"chunkCount" else count or 0
    return count


def _read_word(file: BinaryIO) -> bytes:
    """Return what stands before the next zero byte."""
    word = b""
    while (one := file.read(1)) != b"\x00":
        if not one:
            raise ValueError("the header ends too early")
        word += one
    return word


def paths_of(scene: Any, frame: int) -> list[str]:
    """Return the files that Blender writes for a frame: one for each view of stereoscopy.

    Of a movie it is the one file of all frames from the scene's first to its last.
    """
    render = scene.render
    if not render.use_multiview or render.image_settings.views_format != "INDIVIDUAL":
        return [render.frame_path(frame=frame)]
    shown = [view for view in render.views if view.use]
    if render.views_format == "STEREO_3D":
        shown = [view for view in shown if view.name in ("left", "right")]
    return [render.frame_path(frame=frame, view=view.name) for view in shown]


def movie_fault(path: str, frames: int) -> str:
    """Return what is wrong with a movie of so many frames, or ""."""
    clip = bpy.data.movieclips.load(path)
    try:
        found = clip.frame_duration
    finally:
        bpy.data.movieclips.remove(clip)
    return "" if found >= frames else f"it holds {found} frames of {frames}; is the disk full?"
