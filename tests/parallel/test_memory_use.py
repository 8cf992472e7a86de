# SPDX-License-Identifier: GPL-3.0-or-later
"""The memory of this process, where the system tells."""

import ctypes
import os

import numpy as np
import pytest

from adaptive_drt.parallel.memory_use import MemoryWatch, own_bytes, return_freed_memory


@pytest.mark.skipif(own_bytes(os.getpid()) is None, reason="the system does not tell")
def test_what_is_taken_is_seen():
    watch = MemoryWatch()
    kept = np.ones(1 << 23)
    watch.look()
    assert watch.peak >= 0.9 * kept.nbytes
    del kept
    before = watch.peak
    watch.look()
    assert watch.peak == before


def test_of_a_process_that_is_not_there_nothing_is_known():
    assert own_bytes(1 << 30) is None


@pytest.mark.skipif(not hasattr(ctypes.CDLL(None), "malloc_trim"), reason="not glibc's allocator")
def test_freed_memory_is_returned():
    # glibc keeps what is smaller than the largest block that was freed, up to 32 MB
    np.empty(33_000_000, dtype=np.uint8)
    blocks = [np.ones(1 << 17) for _ in range(128)]
    last = np.ones(1 << 17)  # the heap's end stays in use
    del blocks
    before = own_bytes(os.getpid())
    return_freed_memory()
    assert before - own_bytes(os.getpid()) > 32 << 20
    assert last.all()


@pytest.mark.skipif(not hasattr(ctypes.CDLL(None), "malloc_trim"), reason="not glibc's allocator")
@pytest.mark.parametrize("trims", [False, True])
def test_what_a_growing_process_has_freed_is_returned_where_asked(trims):
    np.empty(33_000_000, dtype=np.uint8)
    return_freed_memory()
    watch = MemoryWatch()
    blocks = [np.ones(1 << 17) for _ in range(192)]
    last = np.ones(1 << 17)  # the heap's end stays in use
    del blocks
    before = own_bytes(os.getpid())
    watch.look(trims)
    assert (before - own_bytes(os.getpid()) > 64 << 20) is trims
    assert watch.peak > 128 << 20
    assert last.all()
