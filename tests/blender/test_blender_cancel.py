# SPDX-License-Identifier: GPL-3.0-or-later
"""Whoever cancels does not wait for threads that have yet to end, and nothing changes after."""

from __future__ import annotations

import importlib
import threading
import types

import bpy
import numpy as np
import pytest

WAIT = 20.0
"""Seconds that a stand-in is held at the very most."""


@pytest.fixture
def part(addon):
    return lambda name: importlib.import_module(f"{addon.__name__}.{name}")


@pytest.fixture
def busy(file, part, export):
    """A job whose thread does not look up before `go` is set, half of its picture done."""
    reached, go = threading.Event(), threading.Event()

    def render(scene, settings):
        film = part("adaptive_drt.scene.film").Film(8, 8)
        film.color[:], film.alpha[:4] = 0.5, 1.0
        yield types.SimpleNamespace(film=film, done=1, total=2, stage="Rendering")
        reached.set()
        assert go.wait(WAIT)
        film.stats.update(seconds={"total": 1.0})
        return film

    job = part("operators.job").Job(export(), part("adaptive_drt.scene.settings").Settings())
    job._render = render
    job.start()
    assert reached.wait(WAIT)
    job.go = go
    yield job
    go.set()
    part("operators.state").state.join()
    job.join()


def _operator():
    """What `modal` uses of its operator; Blender makes none for us."""
    seen = []
    return types.SimpleNamespace(
        _leave=lambda context: seen.append("window"),
        _finish=lambda job: seen.append((job.running, job.cancelled, job.factor)) or {"FINISHED"},
        seen=seen,
    )


def _event(kind, value="PRESS"):
    return types.SimpleNamespace(type=kind, value=value)


def test_escape_does_not_wait_for_threads(busy, part):
    state = part("operators.state").state
    state.job, operator = busy, _operator()
    modal = part("operators.render").ADRT_OT_render.modal
    assert modal(operator, None, _event("MOUSEMOVE")) == {"PASS_THROUGH"}
    assert modal(operator, None, _event("ESC")) == {"FINISHED"}
    assert busy.alive and state.job is None
    assert operator.seen == ["window", (False, True, 0.5)]
    # what the thread still finds out is nobody's business
    busy.go.set()
    state.join()
    assert not busy.alive and not busy.finished and busy.cancelled and busy.factor == 0.5


def test_the_cancel_button_does_as_escape_does(busy, part):
    state = part("operators.state").state
    assert not bpy.ops.adaptive_drt.cancel.poll()
    state.job, operator = busy, _operator()
    assert bpy.ops.adaptive_drt.cancel() == {"FINISHED"} and state.job is busy
    modal = part("operators.render").ADRT_OT_render.modal
    assert modal(operator, None, _event("TIMER")) == {"FINISHED"}
    assert busy.alive and state.job is None


def test_the_next_render_may_begin_at_once(busy, part):
    state = part("operators.state").state
    state.job = busy
    state.leave()
    assert busy.alive and bpy.ops.adaptive_drt.render() == {"FINISHED"}
    flat = np.empty(8 * 8 * 4, dtype=np.float32)
    bpy.data.images["Adaptive Render"].pixels.foreach_get(flat)
    assert (flat[3::4] == 1.0).all(), "the picture is the second one's"


def test_switching_the_add_on_off_waits(busy, part):
    part("operators.state").state.job = busy
    threading.Timer(0.2, busy.go.set).start()
    part("operators.render").stop()
    assert not busy.alive and not part("operators.state").state.left


def test_the_pointer_stays_a_pointer(busy, part):
    """One works on while it renders; Blender's progress would turn the pointer into digits."""
    operator, said = types.SimpleNamespace(_said="", _timer="timer", _drew=None), []
    manager = types.SimpleNamespace(event_timer_remove=said.append)
    workspace = types.SimpleNamespace(status_text_set=said.append)
    context = types.SimpleNamespace(window_manager=manager, workspace=workspace)
    part("operators.state").state.job = busy
    button = part("operators.render").ADRT_OT_render
    button._show_progress(operator, context, busy.text)
    button._leave(operator, context)
    assert said[0].startswith("Adaptive Render: Rendering 50 %") and said[1:] == ["timer", None]
    part("operators.state").state.leave()
