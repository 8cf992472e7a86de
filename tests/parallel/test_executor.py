# SPDX-License-Identifier: GPL-3.0-or-later
"""The hands of a render: what they are given comes back, and closing them ends all of it."""

import math
import threading
import time
from contextlib import closing

import numpy as np
import pytest

from adaptive_drt.image import schedule as work_module
from adaptive_drt.parallel.cancellation import RenderCancelled
from adaptive_drt.parallel.executor import RenderExecutor
from adaptive_drt.parallel.pool import Call, SharedArguments, worker_pool
from adaptive_drt.render import render, render_image
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from random_scenes import random_scene
from workers import mustered, wait_for

SEED = 207
"""A scene in which things move, some of it before pixels that no block of pixels may settle."""


def plan_for(threads):
    return make_plan(random_scene(SEED), Settings(threads=threads))


def executor_for(threads):
    plan = plan_for(threads)
    return RenderExecutor(plan.stop, plan.threads)


def roots(numbers):
    return [Call(math.sqrt, SharedArguments(()), (float(n) ** 2,)) for n in numbers]


def found(outcomes):
    return {outcome[0]: outcome[1] for outcome in outcomes if outcome is not None}


@pytest.fixture
def worker(monkeypatch):
    with mustered(monkeypatch, 1) as one:
        yield one


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_every_call_is_answered_by_its_number(threads):
    with closing(executor_for(threads)) as executor:
        deferred = executor.defer(roots(range(50, 60)))
        assert found(executor.run(roots(range(40)))) == {n: n for n in range(40)}
        assert found(executor.run([])) == {}
        assert found(executor.finish_deferred(deferred)) == {n: n + 50 for n in range(10)}
    assert not any(thread.is_alive() for thread in executor._threads)


def test_what_is_aside_waits_for_a_hand_that_is_free():
    """With one hand it begins when it is gathered, and not before."""
    with closing(executor_for(1)) as executor:
        deferred = executor.defer(roots([3]))
        assert found(executor.run(roots(range(5)))) == {n: n for n in range(5)}
        time.sleep(0.1)
        assert deferred.outcomes.empty()
        assert found(executor.finish_deferred(deferred)) == {0: 3}


@pytest.mark.parametrize("aside", [False, True])
def test_an_exception_comes_out_and_the_rest_is_stopped(aside):
    plan = plan_for(2)
    calls = [
        Call(math.sqrt, SharedArguments(()), (-1.0,)),
        Call(time.sleep, SharedArguments(()), (0.2,)),
    ]
    with (
        closing(RenderExecutor(plan.stop, plan.threads)) as executor,
        pytest.raises(ValueError, match="math domain"),
    ):
        list(executor.finish_deferred(executor.defer(calls)) if aside else executor.run(calls))
    assert plan.stop.is_set()


def test_closing_stops_what_is_under_way():
    plan = plan_for(2)
    executor = RenderExecutor(plan.stop, plan.threads)

    def until_stopped():
        wait_for(plan.stop.is_set)
        raise RenderCancelled

    executor.defer([Call(until_stopped, SharedArguments(()), ())] * 3)
    wait_for(lambda: executor._running)
    executor.close()
    assert plan.stop.is_set() and not any(thread.is_alive() for thread in executor._threads)


def test_closing_when_all_is_done_stops_nothing():
    plan = plan_for(2)
    with closing(RenderExecutor(plan.stop, plan.threads)) as executor:
        assert found(executor.run(roots([2]))) == {0: 2}
    assert not plan.stop.is_set()


def test_pixels_refined_aside_are_the_same(worker, monkeypatch):
    """Those that blocks cannot settle, by a worker while this process is asked for blocks."""
    put, lent = work_module.Scheduler.start_background, []

    def watched(self, tasks):
        lent.append(sum(rows.size for rows, _ in tasks))
        put(self, tasks)

    monkeypatch.setattr(work_module.Scheduler, "start_background", watched)
    alone, beside = (
        render_image(random_scene(SEED), Settings(tolerance=1e-3, threads=threads))
        for threads in (1, 2)
    )
    assert len(lent) == 1 and lent[0] > 0, "nothing was put aside, or by one thread too"
    for name in ("color", "alpha", "samples"):
        assert np.array_equal(getattr(alone, name), getattr(beside, name)), name
    assert alone.stats["rays"] == beside.stats["rays"]


def test_a_render_cancelled_while_pixels_are_aside(worker):
    steps = render(random_scene(SEED), Settings(tolerance=1e-4, threads=2, batch=256))
    place = 0.0
    while place < 0.5:
        progress = next(steps)
        place = progress.done / progress.total
    steps.close()
    assert not worker_pool._busy
    assert not [thread for thread in threading.enumerate() if thread.name == "Render"]
