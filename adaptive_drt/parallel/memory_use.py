# SPDX-License-Identifier: GPL-3.0-or-later
"""Memory that a render takes in this process and its workers, where the system tells: on Linux."""

from __future__ import annotations

import ctypes
import os
from contextlib import suppress
from pathlib import Path

from .pool import worker_pool

__all__ = ["MemoryWatch", "own_bytes", "return_freed_memory"]


TRIM_STEP = 96 << 20
"""Bytes by which this process grows before freed memory is looked for: that takes some 10 ms."""


def own_bytes(process: int) -> int | None:
    """Bytes in memory that a process shares with no file; None where the system does not tell."""
    with suppress(OSError, ValueError, IndexError):
        sizes = Path(f"/proc/{process}/statm").read_text(encoding="ascii").split()
        # size, resident, resident of files, ... in pages
        return (int(sizes[1]) - int(sizes[2])) * int(os.sysconf("SC_PAGE_SIZE"))
    return None


def return_freed_memory() -> None:
    """Return to the system what is freed but kept by glibc's allocator, all over its heap.

    By itself it returns only what lies at the heap's end. It does nothing with other C libraries.
    """
    with suppress(OSError, AttributeError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)


class MemoryWatch:
    """Watches the memory of a render.

    Attributes
    ----------
    peak : the most bytes seen: those of the workers, and of this process beyond what it had before;
        None where the system does not tell.
    """

    def __init__(self) -> None:
        """Note what this process has before the render."""
        self._before = own_bytes(os.getpid())
        self.peak: int | None = None if self._before is None else 0
        self._kept = self._before or 0

    def look(self, trim: bool = False) -> None:
        """Take in what is used now.

        trim : whether to return what this process has freed, if it has grown by `TRIM_STEP`.
        """
        now = own_bytes(os.getpid())
        if now is None or self._before is None or self.peak is None:
            return
        others = sum(own_bytes(each) or 0 for each in worker_pool.process_ids)
        self.peak = max(self.peak, now - self._before + others)
        self._kept = min(self._kept, now)
        if trim and now > self._kept + TRIM_STEP:
            return_freed_memory()
            self._kept = own_bytes(os.getpid()) or now
