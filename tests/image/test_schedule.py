# SPDX-License-Identifier: GPL-3.0-or-later
"""Sizes of parts, and the results of tasks with the pixels that they belong to."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from adaptive_drt.image import schedule
from adaptive_drt.image.memory_bound import MIN_LISTED
from adaptive_drt.image.schedule import (
    BACKGROUND_CALL_COST,
    MAX_PIXELS,
    MIN_THREAD_PIXELS,
    Scheduler,
    StageTimer,
)
from adaptive_drt.parallel.pool import WorkerPool, worker_pool
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.occluder_culling import Occluders
from random_scenes import random_scene


def test_a_worker_may_get_ready_while_parts_are_cut(monkeypatch):
    plan = make_plan(random_scene(207), Settings(threads=2))
    work, ready = Scheduler(plan, Occluders(plan)), iter((0, 1, 1, 1))
    monkeypatch.setattr(WorkerPool, "ready_count", property(lambda _: next(ready)))
    assert work.background_pixels_per_call(5_000, 1.0) == 0
    assert work.background_pixels_per_call(5_000, 1.0) == 5_000
    # what has much in it is cut up
    assert work.background_pixels_per_call(5_000, 3.0 * BACKGROUND_CALL_COST) == 1_667


def tasks_of(count, size):
    """Parts of some pixels, with their pixels as what is to be done."""
    rows = np.arange(count)
    return [(part, SimpleNamespace(rows=part)) for part in np.split(rows, range(size, count, size))]


def squared(plan, occluders, task):
    """Result of a task: three points a pixel, and as colour its number squared."""
    return SimpleNamespace(color=task.rows**2, samples=np.full(task.rows.size, 3))


@pytest.fixture
def scheduler():
    plan = make_plan(random_scene(207), Settings(threads=2, batch=10_000))
    made = Scheduler(plan, Occluders(plan))
    yield made
    made.close()


def test_results_come_with_the_pixels_of_their_tasks(scheduler):
    worker_pool.stop()
    seen = np.zeros(1_000, dtype=np.int64)
    for outcome in scheduler.run(squared, tasks_of(1_000, 70), "a stage"):
        if outcome is not None:
            rows, done = outcome
            assert not seen[rows].any()
            seen[rows] = done.color
    np.testing.assert_array_equal(seen, np.arange(1_000) ** 2)
    # of each pixel's three points one is that of the first pass
    assert scheduler.shaded == 2_000
    assert scheduler.seconds.keys() == {"a stage"} and scheduler.seconds["a stage"] > 0.0


@pytest.mark.parametrize("count", [1, 5_000, 40_000, 10**6])
def test_parts_are_neither_too_large_nor_too_small(scheduler, count):
    worker_pool.stop()
    part = scheduler.pixels_per_call(count)
    assert part <= min(MAX_PIXELS, 10_000)
    assert part >= min(MIN_THREAD_PIXELS, 10_000, count)
    assert scheduler.background_pixels_per_call(count, 1.0) == 0  # there is no worker


def test_calls_are_smaller_where_objects_are_very_many(scheduler):
    """A point may then have thousands of occluders; rays against spheres need no list of them."""
    worker_pool.stop()
    settings = Settings(threads=2)
    for count, most in ((1_000, MAX_PIXELS), (10**6, MIN_LISTED)):
        scheduler._plan = SimpleNamespace(object_count=count, settings=settings, threads=2)
        assert scheduler.pixels_per_call(10**6) == most


def test_a_timer_adds_up_stages(monkeypatch):
    now = iter([0.0, 1.0, 3.0, 10.0, 10.5])
    monkeypatch.setattr(schedule.time, "perf_counter", lambda: next(now))
    clock = StageTimer()
    clock("one")
    clock("two")
    clock.restart()
    clock("one")
    assert clock.seconds == {"one": 1.5, "two": 2.0}
