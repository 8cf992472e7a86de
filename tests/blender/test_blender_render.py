# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator, its images and its manners, with a stand-in for the tracer."""

from __future__ import annotations

import importlib
import json
import sys
import types
from collections import namedtuple

import bpy
import numpy as np
import pytest
import things

Progress = namedtuple("Progress", "done total stage film")
STEPS = 4
OURS = ("Adaptive Render", "Adaptive Mask", "Adaptive Samples")


@pytest.fixture
def part(addon):
    return lambda name: importlib.import_module(f"{addon.__name__}.{name}")


@pytest.fixture
def tracer(part, monkeypatch):
    """A tracer that paints the pixel's column and row, and can fail or be watched."""
    module = types.ModuleType("render")
    module.seen, module.fault, module.before = [], None, lambda step: None

    def render(scene, settings):
        module.seen.append((scene, settings))
        camera = part("adaptive_drt.scene.description").validate(scene).camera
        left, bottom, right, top = camera.region
        film = part("adaptive_drt.scene.film").Film(right - left, top - bottom)
        film.color[0], film.color[1] = np.meshgrid(range(left, right), range(bottom, top))
        film.color[2], film.alpha[:] = 7.5, 1.0
        film.mask[1, 0] = True
        film.samples[:] = np.arange(film.width)
        try:
            for step in range(STEPS):
                module.before(step)
                if module.fault is not None and step == 2:
                    raise module.fault
                yield Progress(step + 1, STEPS + 1, "Tracing", film)
        finally:
            module.closed = True
        issues = [{"name": i.name, "reason": i.reason} for i in scene.issues]
        film.stats.update(
            pixels=film.width * film.height,
            a=0.25,
            b=1.5,
            c=49.0,
            predicted_ratio=0.5,
            counts={"penumbra": 1, "motion": 8, "edge": 0, "distributed": 9},
            seconds={"total": 2.0 if settings.distribution == "EVERYWHERE" else 1.0},
            rays={"camera": 64},
            issues=issues,
        )
        return film

    module.render = render
    name = f"{part('adaptive_drt').__name__}.render"
    monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setattr(part("adaptive_drt"), "render", module, raising=False)
    return module


def _pixels(name):
    image = bpy.data.images[name]
    flat = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(flat)
    return flat.reshape(image.size[1], image.size[0], 4)


def _stats():
    return json.loads(bpy.data.images["Adaptive Mask"]["adaptive_drt"])


def test_images(file, tracer):
    things.uv_sphere()
    assert bpy.ops.adaptive_drt.render() == {"FINISHED"}
    picture, mask = _pixels("Adaptive Render"), _pixels("Adaptive Mask")
    assert picture.shape == mask.shape == (8, 8, 4)
    assert (picture[2, 5] == (5.0, 2.0, 7.5, 1.0)).all()
    assert (mask[0] == (0.0, 1.0, 0.0, 1.0)).all() and (mask[1:, :, 1] == 0.0).all()
    samples = _pixels("Adaptive Samples")
    assert (samples[:, 6] == (6.0, 6.0, 6.0, 1.0)).all() and (samples[..., 0] == range(8)).all()
    images = bpy.data.images
    assert images["Adaptive Samples"].colorspace_settings.name == "Non-Color"
    assert images["Adaptive Render"].is_float and images["Adaptive Mask"].is_float
    assert images["Adaptive Mask"].colorspace_settings.name == "Non-Color"
    assert images["Adaptive Render"].colorspace_settings.name == "Linear Rec.709"
    assert images["Adaptive Render"].use_fake_user and images["Adaptive Mask"].use_fake_user


def test_images_are_reused(file, tracer):
    bpy.ops.adaptive_drt.render()
    first = [bpy.data.images[n] for n in OURS]
    bpy.context.scene.render.resolution_x = 12
    bpy.ops.adaptive_drt.render()
    assert [bpy.data.images[n] for n in OURS] == first
    assert len(bpy.data.images) == 3 and _pixels("Adaptive Render").shape == (8, 12, 4)
    assert (_pixels("Adaptive Render")[2, 11] == (11.0, 2.0, 7.5, 1.0)).all()


def test_an_image_of_the_same_name_is_taken_over(file, tracer):
    bpy.data.images.new("Adaptive Render", 3, 5, float_buffer=False)
    bpy.ops.adaptive_drt.render()
    assert bpy.data.images["Adaptive Render"].is_float
    assert (_pixels("Adaptive Render")[2, 5] == (5.0, 2.0, 7.5, 1.0)).all()


def test_blender_s_own_image_of_that_name_is_let_be(file, tracer):
    """No one can write to it, whatever it is called."""
    bpy.context.scene.render.engine = "ADAPTIVE_DRT"
    bpy.ops.render.render()
    theirs = bpy.data.images["Render Result"]
    theirs.name = "Adaptive Render"
    for _ in range(2):
        bpy.ops.adaptive_drt.render()
    assert (_pixels("Adaptive Render")[2, 5] == (5.0, 2.0, 7.5, 1.0)).all()
    assert theirs.name == "Render Result"


@pytest.mark.parametrize("crop", [False, True])
def test_border(file, tracer, crop):
    render = bpy.context.scene.render
    render.use_border, render.use_crop_to_border = True, crop
    render.border_min_x, render.border_max_x = 0.25, 0.75
    render.border_min_y, render.border_max_y = 0.5, 0.75
    bpy.ops.adaptive_drt.render()
    picture = _pixels("Adaptive Render")
    if crop:
        assert picture.shape == (2, 4, 4)
        assert (picture[0, 0] == (2.0, 4.0, 7.5, 1.0)).all()
    else:
        assert picture.shape == (8, 8, 4)
        assert (picture[4, 2] == (2.0, 4.0, 7.5, 1.0)).all()
        assert np.count_nonzero(picture[..., 3]) == 8


def test_saved_and_loaded_and_rendered_again(file, tracer, tmp_path):
    path = str(tmp_path / "saved.blend")
    for width in (8, 12):
        bpy.context.scene.render.resolution_x = width
        bpy.ops.adaptive_drt.render()
        before = *(_pixels(name) for name in OURS), _stats()
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
        assert len(bpy.data.images) == 3
        for name, pixels in zip(OURS, before, strict=False):
            assert (_pixels(name) == pixels).all()
        assert _stats() == before[-1]


def test_statistics(file, tracer):
    things.light("AREA", "Odd", spread=0.0)
    bpy.ops.adaptive_drt.render()
    stats = _stats()
    assert stats["a"] == 0.25 and stats["counts"]["motion"] == 8
    assert [i["name"] for i in stats["issues"]] == ["Odd"]
    assert "measured_ratio" not in stats
    bpy.context.scene.adaptive_drt.distribution = "EVERYWHERE"
    bpy.ops.adaptive_drt.render()
    assert _stats()["measured_ratio"] == 0.5 and _stats()["predicted_ratio"] == 0.5
    things.uv_sphere()  # another scene: the pair is no pair
    bpy.ops.adaptive_drt.render()
    assert "measured_ratio" not in _stats()


def test_settings_arrive(file, tracer, part):
    values = dict(
        order="1", distribution="EVERYWHERE", light_rays=5, time_rays=6, pixel_rays=7, seed=-3,
        threads=1, use_penumbra=False, use_motion=False, use_edges=False,
    )  # fmt: skip
    chosen = bpy.context.scene.adaptive_drt
    assert (chosen.light_rays, chosen.time_rays, chosen.pixel_rays) == (49, 128, 16)
    defaults = part("adaptive_drt.scene.settings").Settings()
    assert (chosen.method, chosen.order, chosen.distribution) == (defaults.method, "2", "ADAPTIVE")
    assert chosen.tolerance == pytest.approx(defaults.tolerance, rel=1e-7)
    for key, value in values.items():
        setattr(chosen, key, value)
    bpy.ops.adaptive_drt.render()
    settings = tracer.seen[0][1]
    assert settings.tolerance == defaults.tolerance and settings.order == 1
    for method in part("adaptive_drt.scene.settings").METHODS:
        chosen.method = method
        chosen.tolerance = 0.0123
        bpy.ops.adaptive_drt.render()
        assert (tracer.seen[-1][1].method, tracer.seen[-1][1].tolerance) == (method, 0.0123)
    assert all(getattr(settings, k) == v for k, v in values.items() if k != "order")


def _manners():
    scene = bpy.context.scene
    return (
        scene.frame_current,
        scene.frame_subframe,
        scene.render.engine,
        scene.camera,
        bpy.context.view_layer.objects.active,
        [o.name for o in bpy.context.selected_objects],
        sorted(i.name for i in bpy.data.images if not i.name.startswith("Adaptive")),
        len(bpy.data.objects),
        len(bpy.data.meshes),
        tuple(bpy.data.images["Mine"].pixels),
    )


@pytest.mark.parametrize("outcome", ["success", "failure", "no camera", "cancelled"])
def test_manners(file, tracer, part, tmp_path, monkeypatch, outcome):
    monkeypatch.chdir(tmp_path)
    ball = things.uv_sphere()
    things.keyed(ball, "location", (0.0, 0.0, 0.0), (10.0, 0.0, 0.0))
    bpy.data.images.new("Mine", 2, 2, float_buffer=True)
    scene = bpy.context.scene
    scene.render.use_motion_blur = True
    scene.frame_set(5, subframe=0.75)
    # a marker of the timeline knows another camera than the one that the user has chosen since
    scene.timeline_markers.new("Cut", frame=1).camera = things.link(scene.camera.copy())
    bpy.context.view_layer.objects.active = ball
    ball.select_set(True)
    if outcome == "failure":
        tracer.fault = ZeroDivisionError("by the stand-in")
    elif outcome == "no camera":
        scene.camera = None
    elif outcome == "cancelled":
        tracer.before = lambda step: part("operators.state").state.job.cancel() if step else None
    before = _manners()
    if outcome in ("success", "cancelled"):
        bpy.ops.adaptive_drt.render()
        assert _stats().get("cancelled", False) == (outcome == "cancelled")
    else:
        with pytest.raises(RuntimeError):
            bpy.ops.adaptive_drt.render()
    assert _manners() == before and list(tmp_path.iterdir()) == []


def test_no_camera_says_what_to_do(file, tracer):
    bpy.context.scene.camera = None
    with pytest.raises(RuntimeError, match="The scene has no camera: add one, or make one active"):
        bpy.ops.adaptive_drt.render()
    assert len(bpy.data.images) == 0


def test_a_failure_is_told_and_not_the_last(file, tracer):
    tracer.fault = ZeroDivisionError("by the stand-in")
    with pytest.raises(RuntimeError, match="by the stand-in"):
        bpy.ops.adaptive_drt.render()
    assert len(bpy.data.images) == 0
    tracer.fault = None
    assert bpy.ops.adaptive_drt.render() == {"FINISHED"}


def test_invoke_in_background_runs_to_the_end(file, tracer):
    assert bpy.ops.adaptive_drt.render("INVOKE_DEFAULT") == {"FINISHED"}
    assert "Adaptive Render" in bpy.data.images


def test_no_click_while_one_runs(file, tracer, part):
    tracer.before = lambda step: polls.append(bpy.ops.adaptive_drt.render.poll())
    polls = []
    bpy.ops.adaptive_drt.render()
    assert polls == [False] * STEPS and bpy.ops.adaptive_drt.render.poll()


def test_pixels_in_bands(file, part, export):
    """All of a pass, whatever its height and channels; and no preview for one who has left."""
    module = part("operators.job")
    random = np.random.default_rng(3)
    for height in (1, module.BAND - 1, module.BAND, 2 * module.BAND + 5):
        job = module.Job(export(), part("adaptive_drt.scene.settings").Settings())
        job.film = film = part("adaptive_drt.scene.film").Film(7, height)
        film.color[:], film.normal[:] = random.random((2, 3, height, 7))
        film.samples[:], film.mask[1] = random.integers(1, 99, (height, 7)), True
        for one in (
            *part("adaptive_drt.scene.film").PASSES,
            *part("adaptive_drt.scene.film").PASSES,
        ):
            np.testing.assert_array_equal(job.pixels(one.name), film.pixels(one.name))
        job.factor = 0.5
        job.cancel()
        job.want_preview()
        job._make_preview()
        assert job.take_preview() is None


@pytest.mark.skipif(sys.platform != "linux", reason="threads have no priority of their own there")
def test_a_watched_render_gives_way(file, tracer, part, export):
    """Its thread and those that it starts; nobody else, and only for a window."""
    import os
    import threading

    found = []

    def look(_step):
        other = threading.Thread(target=lambda: found.append(priority()))
        other.start()
        other.join()
        found.append(priority())

    def priority():
        return os.getpriority(os.PRIO_PROCESS, threading.get_native_id())

    tracer.before = look
    mine = priority()
    for watched in (False, True):
        found.clear()
        job = part("operators.job").Job(
            export(), part("adaptive_drt.scene.settings").Settings(), watched
        )
        job.start()
        job.wait()
        gentle = part("operators.job").GENTLE if watched else 0
        assert job.finished and set(found) == {min(19, mine + gentle)}
    assert priority() == mine


def test_cancelled_job_keeps_its_film(file, tracer, part, export):
    import threading

    reached, go_on = threading.Event(), threading.Event()

    def pause(step):
        if step == 2:
            reached.set()
            assert go_on.wait(10.0)

    tracer.before = pause
    settings = part("adaptive_drt.scene.settings").Settings()
    job = part("operators.job").Job(export(), settings)
    job.start()
    assert reached.wait(10.0) and job.running
    assert job.factor == pytest.approx(0.4) and job.text.startswith("Tracing 40 %")
    job.cancel()
    go_on.set()
    job.wait()
    assert job.cancelled and job.film is not None and not job.running
    assert tracer.closed and job.factor < 1.0 and job.error is None


def test_check_lists_without_rendering(file, tracer, part):
    things.light("AREA", "Odd", spread=0.0)
    assert bpy.ops.adaptive_drt.check() == {"FINISHED"}
    panels = part("ui.panels")
    (issue,) = panels.known_issues(bpy.context.scene)
    assert issue.name == "Odd" and tracer.seen == [] and len(bpy.data.images) == 0


def test_panel_figures(file, tracer, part):
    panels = part("ui.panels")
    assert panels.known_issues(bpy.context.scene) is None
    bpy.ops.adaptive_drt.render()
    lines = dict(panels.figure_lines(_stats()))
    assert lines["Time"] == "1.00 s" and lines["Motion Pixels"] == "8 (12.5 %)"
    assert panels.known_issues(bpy.context.scene) == ()
    assert panels.wrapped("a few words that are long", 10) == ["a few", "words that", "are long"]
