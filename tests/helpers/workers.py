# SPDX-License-Identifier: GPL-3.0-or-later
"""Workers for tests, and how to wait for what they do."""

import time
from contextlib import contextmanager

from adaptive_drt import render as render_module
from adaptive_drt.parallel.pool import worker_pool

LONG = 60.0
"""Seconds: nobody waits so long, but for a worker that loads on a busy machine."""


def wait_for(condition):
    end = time.monotonic() + LONG
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


@contextmanager
def mustered(monkeypatch, count):
    """The crew with so many workers, used for pictures of any size."""
    monkeypatch.setattr(render_module, "WORKERS_PIXELS", 0)
    worker_pool.start_workers(count)
    wait_for(lambda: worker_pool.ready_count == count)
    yield worker_pool
    worker_pool.stop()
