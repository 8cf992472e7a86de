# SPDX-License-Identifier: GPL-3.0-or-later
"""What a progress bar is told: it moves in every stage, never goes back, and ends whole."""

import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks"))

from bench_scenes import bench_scene

from adaptive_drt import render as render_module
from adaptive_drt.parallel import executor as threads_module
from adaptive_drt.render import render
from adaptive_drt.scene.description import Quad, QuadLight, Scene, SceneError, Sphere, vector_of
from adaptive_drt.scene.settings import Settings
from random_scenes import look_at

STEPS = 8
"""Different places, at least, that the bar stands at."""

STANDS = 0.6
"""Of a render's time, at most: how long the bar stands at one place, with other work going on."""
LOOKS = 12
"""Different places, at least, that it stands at in the first stage of a heap of balls: without news
from within calls it is one for each of them."""


def heap(count, size=(64, 48)):
    """So many balls that overlap, on a floor, under a wide light."""
    rng = np.random.default_rng(1)
    balls = [
        Sphere(vector_of(rng.uniform((-2.0, -2.0, 0.0), (2.0, 2.0, 4.0))), rng.uniform(0.2, 0.7))
        for _ in range(count)
    ]
    floor = Quad((-9.0, -9.0, 0.0), (18.0, 0.0, 0.0), (0.0, 18.0, 0.0))
    light = QuadLight((2.0, -2.0, 12.0), (2.0, 0.0, 0.0), (0.0, -2.0, 0.0), (9.0,) * 3)
    camera = look_at((0.0, -9.0, 5.0), (0.0, 0.0, 2.0), resolution=size)
    return Scene(camera, (floor, *balls), (light,))


def _places(name, **settings):
    scene = bench_scene(name, 200, 150)
    told = list(render(scene, Settings(batch=1_024, threads=1, **settings)))
    return np.array([progress.done / progress.total for progress in told])


@pytest.mark.parametrize("name", ["contact shadows", "moving sphere"])
@pytest.mark.parametrize("method", ["EXACT", "RAYS"])
def test_the_bar_moves(name, method):
    places = _places(name, method=method, tolerance=0.01, time_rays=8)
    assert (np.diff(places) >= 0.0).all() and 0.0 <= places[0] and places[-1] == 1.0
    assert np.unique(places).size >= STEPS


@pytest.mark.parametrize("method", ["EXACT", "RAYS"])
def test_the_bar_moves_in_a_heap_of_balls(method, monkeypatch):
    """However few calls a picture is, and from within them. Asked often: a second is soon over."""
    monkeypatch.setattr(threads_module, "POLL_INTERVAL", 0.002)
    parts, note = [], threads_module._Job.update_progress

    def noted(job, part):
        parts.append(part)
        note(job, part)

    monkeypatch.setattr(threads_module._Job, "update_progress", noted)
    settings = Settings(
        method=method, tolerance=0.01, light_rays=16, pixel_rays=4, threads=1, batch=2_000
    )
    times, places, stages = [time.monotonic()], [-1.0], [""]
    for progress in render(heap(500), settings):
        place = progress.done / progress.total
        assert places[-1] <= place <= 1.0
        if place > places[-1]:
            times.append(time.monotonic())
            places.append(place)
            stages.append(progress.stage)
    times.append(time.monotonic())
    longest = float(np.diff(times).max()) / (times[-1] - times[0])
    looks = stages.count("First pass" if method == "EXACT" else "Tracing rays")
    print(f"{len(places)} places, {looks} of them at first; longest at one: {longest:.2f}")
    assert longest < STANDS
    assert 0.0 <= min(parts) and max(parts) <= 1.0 + 1e-9
    assert looks >= LOOKS


@pytest.mark.parametrize("name", ["make_plan", "Occluders", "measure_pixel_costs"])
def test_there_is_progress_while_a_scene_is_read(monkeypatch, name):
    """However long one call before and after the tiles takes: it comes at each heartbeat."""
    go, made = threading.Event(), getattr(render_module, name)

    def slow(*arguments, **named):
        assert go.wait(60.0)
        return made(*arguments, **named)

    monkeypatch.setattr(render_module, name, slow)
    monkeypatch.setattr(render_module, "affordable_pixels", lambda *_: 1_000)
    steps, seen = render(heap(3), Settings(method="RAYS", threads=1)), []
    for progress in steps:
        seen.append(progress)
        if sum(one.stage == progress.stage for one in seen) > 8:
            go.set()
    assert go.is_set()
    assert seen[0].stage == "Reading the scene" and seen[0].done == 0
    assert (np.diff([one.done for one in seen]) >= 0).all()


def test_the_first_progress_comes_before_the_scene_is_read(monkeypatch):
    monkeypatch.setattr(render_module, "make_plan", lambda *_, **__: 1 / 0)
    steps = render(heap(3))
    assert next(steps).film.width == 64
    with pytest.raises(ZeroDivisionError):
        list(steps)
    with pytest.raises(SceneError, match="no camera"):
        next(render(Scene()))
