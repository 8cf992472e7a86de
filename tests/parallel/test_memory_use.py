# SPDX-License-Identifier: GPL-3.0-or-later
"""The memory of this process, where the system tells."""

import os

import numpy as np
import pytest

from adaptive_drt.parallel.memory_use import MemoryWatch, own_bytes


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
