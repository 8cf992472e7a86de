# SPDX-License-Identifier: GPL-3.0-or-later
"""Pickled objects over a pipe. Arrays are sent beside the pickle, not copied into it (PEP 574)."""

from __future__ import annotations

import pickle
import struct
from typing import IO, Any

__all__ = ["receive", "send"]

LENGTH_FORMAT = struct.Struct("<Q")
"""Format of the integers in a message: the number of its parts, then before each part its bytes."""


def send(pipe: IO[bytes], value: Any) -> None:
    """Write an object to a pipe.

    Raises
    ------
    OSError
        The reading end of the pipe is closed.
    """
    buffers: list[pickle.PickleBuffer] = []
    body = pickle.dumps(value, protocol=5, buffer_callback=buffers.append)
    parts = [memoryview(body), *(buffer.raw() for buffer in buffers)]
    pipe.write(LENGTH_FORMAT.pack(len(parts)))
    for part in parts:
        pipe.write(LENGTH_FORMAT.pack(part.nbytes))
        pipe.write(part)
    pipe.flush()


def receive(pipe: IO[bytes]) -> Any:
    """Read an object from a pipe. Its arrays are writable and share no memory with others.

    Raises
    ------
    EOFError
        The writing end of the pipe is closed.
    """
    parts = [_read_exactly(pipe, _read_length(pipe)) for _ in range(_read_length(pipe))]
    return pickle.loads(parts[0], buffers=parts[1:])


def _read_length(pipe: IO[bytes]) -> int:
    value: int = LENGTH_FORMAT.unpack(_read_exactly(pipe, LENGTH_FORMAT.size))[0]
    return value


def _read_exactly(pipe: IO[bytes], size: int) -> bytearray:
    """Read exactly `size` bytes; raises EOFError if the pipe ends before."""
    room = bytearray(size)
    view = memoryview(room)
    while view.nbytes:
        got = pipe.readinto(view)  # type: ignore[attr-defined]
        if not got:
            raise EOFError
        view = view[got:]
    return room
