# SPDX-License-Identifier: GPL-3.0-or-later
"""Worker processes: the same picture, whatever becomes of them."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from adaptive_drt.parallel import pool as crew_module
from adaptive_drt.parallel.call_progress import report_progress, report_progress_to
from adaptive_drt.parallel.cancellation import RenderCancelled
from adaptive_drt.parallel.pool import Call, CallGroup, SharedArguments, WorkerPool, worker_pool
from adaptive_drt.render import render, render_image
from adaptive_drt.scene.settings import Settings
from random_scenes import random_scene
from workers import LONG, mustered, wait_for

PASSES = ("color", "alpha", "mask", "samples", "depth", "normal")


@pytest.fixture
def workers(monkeypatch):
    with mustered(monkeypatch, 2) as two:
        yield two


def calls_of(monkeypatch):
    """Names of the functions that workers are told to call, as they are."""
    made = []
    report_progress = crew_module._Worker.send_call

    def counted(worker, told):
        made.append(told.function.__name__)
        report_progress(worker, told)

    monkeypatch.setattr(crew_module._Worker, "send_call", counted)
    return made


@pytest.mark.parametrize("method", ["EXACT", "RAYS"])
def test_the_same_picture_to_the_last_bit(workers, monkeypatch, method):
    made = calls_of(monkeypatch)
    scene = random_scene(207)
    alone, together = (
        render_image(scene, Settings(method=method, tolerance=1e-2, threads=threads))
        for threads in (1, 3)
    )
    assert made, "no worker was called"
    for name in PASSES:
        assert np.array_equal(getattr(alone, name), getattr(together, name)), name


def test_one_thread_calls_nobody(workers, monkeypatch):
    made = calls_of(monkeypatch)
    render_image(random_scene(207), Settings(tolerance=1e-2, threads=1))
    assert not made


def test_small_pictures_start_nobody():
    worker_pool.stop()
    render_image(random_scene(207), Settings(tolerance=1e-2, threads=2))
    assert not worker_pool._idle and not worker_pool._busy


def test_a_render_after_one_that_was_cancelled(workers):
    scene, settings = random_scene(207), Settings(tolerance=1e-3, threads=3)
    steps = render(scene, settings)
    next(steps)
    steps.close()
    assert not workers._busy
    workers.start_workers(2)
    wait_for(lambda: workers.ready_count == 2)
    again, alone = render_image(scene, settings), render_image(scene, replace(settings, threads=1))
    assert np.array_equal(again.color, alone.color)


def test_one_that_was_killed_counts_no_more_at_once(workers):
    """Its process may take a while to end: who asked for workers just then got one too few."""
    worker = workers.acquire()
    worker.kill()
    assert not worker.alive
    workers.release(worker)
    workers.start_workers(2)
    assert worker not in workers._idle and len(workers._idle) == 2
    wait_for(lambda: workers.ready_count == 2)


def test_a_call_is_broken_off(workers):
    shift, outcome = CallGroup(), []

    def call():
        try:
            shift.make(Call(time.sleep, SharedArguments(()), (LONG,)))
        except RenderCancelled as end:
            outcome.append(end)

    began = time.monotonic()
    thread = threading.Thread(target=call)
    thread.start()
    wait_for(lambda: workers._busy)
    shift.cancel()
    thread.join()
    assert outcome and time.monotonic() - began < LONG
    with pytest.raises(RenderCancelled):
        shift.make(Call(math.sqrt, SharedArguments(()), (4.0,)))


def test_an_exception_comes_back(workers):
    with pytest.raises(ValueError, match="math domain"):
        CallGroup().make(Call(math.sqrt, SharedArguments((-1.0,)), ()))
    assert CallGroup().make(Call(math.sqrt, SharedArguments((4.0,)), ())) == 2.0


def test_what_is_shared_is_what_was_sent_last(workers):
    two, three = SharedArguments((2.0,)), SharedArguments((3.0,))
    made = [CallGroup().make(Call(math.pow, share, (2.0,))) for share in (two, two, three, two)]
    assert made == [4.0, 4.0, 9.0, 4.0]


def test_the_call_of_a_worker_that_dies_is_made_here(workers):
    outcome = []
    call = Call(time.sleep, SharedArguments(()), (0.5,))
    thread = threading.Thread(target=lambda: outcome.append(CallGroup().make(call)))
    thread.start()
    wait_for(lambda: workers._busy)
    next(iter(workers._busy)).kill()
    thread.join()
    assert outcome == [None]
    # it is not called again
    assert CallGroup().make(Call(os.getpid, SharedArguments(()), ())) != os.getpid()
    workers.start_workers(2)
    wait_for(lambda: workers.ready_count == 2)


def test_nothing_is_left_behind(workers):
    processes = [worker._process for worker in workers._idle]
    workers.stop()
    assert all(process.poll() is not None for process in processes)
    assert workers.ready_count == 0 and workers.concurrency(4) == 4


def test_an_idle_worker_ends_and_leaves_no_zombie(monkeypatch):
    """Seen from outside: whoever asks the process object how it is takes note of its end."""
    monkeypatch.setattr(crew_module, "IDLE_TIMEOUT", 2.0)
    with mustered(monkeypatch, 1) as workers:
        pid = workers._idle[0]._process.pid

        def gone():
            try:
                os.kill(pid, 0)
            except ProcessLookupError:
                return True
            return False

        wait_for(gone)
        # the next render gets another
        monkeypatch.undo()
        assert workers.ready_count == 0
        workers.start_workers(1)
        wait_for(lambda: workers.ready_count == 1)


def test_a_worker_tells_how_far_a_call_is(workers):
    told = []
    with report_progress_to(told.append):
        assert CallGroup().make(Call(report_progress, SharedArguments(()), (0.25,))) is None
    assert told == [0.25]


def test_they_end_with_the_process_that_started_them(tmp_path):
    program = (
        "import os, sys, time; from adaptive_drt.parallel.pool import worker_pool as pool\n"
        "pool.start_workers(1)\n"
        "while not pool.ready_count: time.sleep(0.01)\n"
        "print(pool._idle[0]._process.pid, flush=True); os._exit(0)"
    )
    root = Path(crew_module.__file__).resolve().parents[2]
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=root, capture_output=True, text=True, timeout=LONG
    )
    pid = int(done.stdout)

    def gone():
        try:
            os.kill(pid, 0)
        except OSError:
            return True
        # whoever inherited it may have yet to take note of its end
        try:
            with open(f"/proc/{pid}/stat") as file:
                return file.read().rsplit(")", 1)[1].split()[0] == "Z"
        except OSError:
            return True

    wait_for(gone)


@pytest.mark.parametrize("program", ["", "blender", "python-that-is-not-there"])
def test_without_a_python_there_are_none(monkeypatch, tmp_path, program):
    monkeypatch.setattr(sys, "executable", program and str(tmp_path / program))
    none = WorkerPool()
    none.start_workers(2)
    none.start_workers(2)
    assert not none._idle and none.concurrency(3) == 3


def test_a_python_that_fails_is_tried_once(monkeypatch, tmp_path):
    broken = tmp_path / "python"
    broken.write_text("#!/bin/sh\nexit 3\n")
    broken.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(broken))
    none = WorkerPool()
    none.start_workers(2)
    wait_for(lambda: all(worker.failed and not worker.alive for worker in none._idle))
    assert none.ready_count == 0 and none.acquire() is None
    none.start_workers(2)
    assert not none._idle
