# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine: passes, files, frames, layers, borders, and its manners when it fails."""

from __future__ import annotations

import importlib
import json
from dataclasses import replace

import bpy
import numpy as np
import pytest
import things

exr = pytest.importorskip("exr", reason="OpenEXR is not installed")


@pytest.fixture
def part(addon):
    return lambda name: importlib.import_module(f"{addon.__name__}.{name}")


@pytest.fixture
def stage(file):
    """A ball over a floor under a lamp, 24 x 16 pixels, to be rendered by the engine."""
    scene = bpy.context.scene
    things.uv_sphere(radius=1.0).location.z = 1.0
    things.plane(size=12.0)
    things.light("AREA", energy=500.0, size=1.5).location = (1.0, 0.0, 5.0)
    render = scene.render
    render.engine = "ADAPTIVE_DRT"
    render.resolution_x, render.resolution_y = 24, 16
    layer = scene.view_layers[0]
    layer.use_pass_z = layer.use_pass_normal = True
    chosen = scene.adaptive_drt
    chosen.method = "RAYS"
    chosen.light_rays, chosen.time_rays, chosen.pixel_rays = 9, 8, 4
    return scene


@pytest.fixture
def render(stage, tmp_path):
    """Render to a multilayer EXR of 32 bits and read it back."""
    settings = stage.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format, settings.color_depth = "OPEN_EXR_MULTILAYER", "32"
    path = tmp_path / "picture.exr"
    stage.render.filepath = str(path)

    def run():
        assert bpy.ops.render.render(write_still=True) == {"FINISHED"}
        return exr.read_exr(path)

    run.path = path
    return run


@pytest.fixture
def core_film(export, part):
    """The core's own film of the scene as it stands."""

    def run(**changes):
        scene = replace(export(), **changes)
        settings = part("operators.settings").settings_of(bpy.context.scene)
        return part("adaptive_drt.render").render_image(scene, settings)

    return run


def _move_ball():
    ball = bpy.data.objects["Sphere"]
    things.keyed(ball, "location", (-5.0, 0.0, 1.0), (5.0, 0.0, 1.0))
    scene = bpy.context.scene
    scene.render.use_motion_blur = True
    scene.render.motion_blur_position = "CENTER"
    scene.frame_set(6, subframe=0.25)


def _assert_equal(written, film, part, layer="ViewLayer"):
    for one in part("adaptive_drt.scene.film").PASSES:
        read = exr.flat(written[f"{layer}.{one.name}"], one.channels)
        np.testing.assert_array_equal(read, film.pixels(one.name), err_msg=one.name)


def test_the_file_holds_the_core_s_arrays(render, core_film, part):
    _move_ball()
    written, film = render(), core_film()
    _assert_equal(written, film, part)
    assert film.mask.any(axis=(1, 2)).all() and film.samples.max() > 8
    header = exr.read_header(render.path)
    figures = json.loads(header["adaptive_drt.ViewLayer"])
    assert figures["pixels"] == 24 * 16 and figures["counts"] == film.stats["counts"]
    state = part("operators.state")
    (shown,) = state.state.figures.values()  # what the panel shows
    assert shown["counts"] == film.stats["counts"]


def test_the_file_holds_the_core_s_arrays_when_exact(render, stage, core_film, part):
    stage.adaptive_drt.method = "EXACT"
    _move_ball()
    written, film = render(), core_film()
    _assert_equal(written, film, part)
    assert film.stats["tolerance"] == 0.001


def test_motion_leaves_the_frame(render, stage):
    _move_ball()
    render()
    assert (stage.frame_current, stage.frame_subframe) == (6, 0.25)
    assert bpy.data.objects["Sphere"].location.x == pytest.approx(0.25)


def test_passes_that_are_not_asked_for(render, stage, part):
    stage.view_layers[0].use_pass_z = stage.view_layers[0].use_pass_normal = False
    names = {name.rpartition(".")[2] for name in render()}
    assert names >= {"Combined", "Adaptive Mask", "Sample Count"}
    assert names == {one.name for one in part("adaptive_drt.scene.film").PASSES} - {
        "Depth",
        "Normal",
    }


def test_the_compositor_offers_the_passes(stage):
    if bpy.app.version >= (5, 0):
        tree = bpy.data.node_groups.new("Tree", "CompositorNodeTree")
        stage.compositing_node_group = tree
    else:
        stage.use_nodes = True
        tree = stage.node_tree
    node = tree.nodes.new("CompositorNodeRLayers")
    kinds = {s.name: s.type for s in node.outputs if s.enabled}
    expected = {"Depth": "VALUE", "Normal": "VECTOR", "Image": "RGBA"}
    expected |= {"Adaptive Mask": "RGBA", "Sample Count": "VALUE"}
    assert {name: kinds.get(name) for name in expected} == expected


def test_two_layers(render, stage, core_film, part):
    """Each view layer is a picture of its own."""
    hidden = bpy.data.collections.new("Hidden")
    stage.collection.children.link(hidden)
    ball = bpy.data.objects["Sphere"]
    hidden.objects.link(ball)
    stage.collection.objects.unlink(ball)
    second = stage.view_layers.new("Second")
    second.use_pass_z = second.use_pass_normal = True
    second.layer_collection.children["Hidden"].exclude = True
    written = render()
    _assert_equal(written, core_film(), part)
    ball.hide_render = True
    _assert_equal(written, core_film(), part, "Second")


@pytest.mark.parametrize("crop", [False, True])
def test_border(render, stage, core_film, part, crop):
    settings = stage.render
    whole = core_film()
    settings.use_border, settings.use_crop_to_border = True, crop
    settings.border_min_x, settings.border_max_x = 0.25, 0.75
    settings.border_min_y, settings.border_max_y = 0.3, 0.8
    rows, columns = slice(4, 12), slice(6, 18)
    red = render()["ViewLayer.Combined"]["R"]
    expected = whole.color[0, rows, columns].astype(np.float32)
    if not crop:
        assert red.shape == (16, 24) and np.count_nonzero(red) <= expected.size
        red = red[rows, columns]
    np.testing.assert_array_equal(red, expected)


def test_borders_are_cut_where_blender_cuts_them(render, stage, export):
    """Blender rounds in float32; a column too many would be an error, one too few black."""
    for thing in list(bpy.data.objects):
        if thing.type != "CAMERA":
            bpy.data.objects.remove(thing)
    settings = stage.render
    settings.use_border = settings.use_crop_to_border = True
    random = np.random.default_rng(4)
    for seed in range(12):
        settings.resolution_x, settings.resolution_y = (int(x) for x in random.integers(9, 60, 2))
        (low_x, low_y), (high_x, high_y) = random.integers(0, 4, 2), random.integers(6, 11, 2)
        settings.border_min_x, settings.border_max_x = low_x / 10.0, high_x / 10.0
        settings.border_min_y, settings.border_max_y = low_y / 10.0, high_y / 10.0
        left, bottom, right, top = export().camera.region
        written = render()["ViewLayer.Sample Count"]["X"]
        assert written.shape == (top - bottom, right - left), seed
        assert written.min() >= 1, seed


def test_transparent_film(render, stage):
    stage.world = bpy.data.worlds.new("World")
    bpy.data.objects["Plane"].hide_render = True
    assert render()["ViewLayer.Combined"]["A"].min() == 1.0
    stage.render.film_transparent = True
    alpha = render()["ViewLayer.Combined"]["A"]
    assert alpha.min() == 0.0 and alpha.max() == 1.0


def test_animation(render, stage, core_film, part, tmp_path):
    _move_ball()
    stage.frame_start, stage.frame_end = 5, 7
    stage.render.filepath = str(tmp_path / "frame_####")
    bpy.ops.render.render(animation=True)
    written = sorted(p.name for p in tmp_path.iterdir())
    assert written == [f"frame_{n:04d}.exr" for n in (5, 6, 7)]
    stage.frame_set(7)
    _assert_equal(exr.read_exr(tmp_path / "frame_0007.exr"), core_film(), part)


def test_an_error_is_told_and_writes_no_file(render, stage, part, monkeypatch):
    def fault(*_):
        raise ZeroDivisionError("by the test")

    stage.camera.data.type = "ORTHO"
    with pytest.raises(RuntimeError, match="orthographic: set its type to Perspective"):
        render()
    stage.camera.data.type = "PERSP"
    for place, name in (
        ("adaptive_drt.scene.film", "Film.pixels"),
        ("adaptive_drt.distributed", "trace_center_rays"),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(f"{part(place).__name__}.{name}", fault)
            with pytest.raises(RuntimeError, match="by the test"):
                render()
    assert not render.path.exists() and part("operators.state").state.job is None
    assert render()["ViewLayer.Combined"]["R"].max() > 0.0


def test_cancel_keeps_what_is_there(render, stage, part, monkeypatch):
    engine = part("operators.engine")
    asked = []
    # Blender's own test_break() cannot be replaced
    monkeypatch.setattr(engine.ADRT_RE_engine, "_is_over", lambda self: asked.append(1) or True)
    jobs = []
    made = engine.Job
    monkeypatch.setattr(engine, "Job", lambda *a, **k: jobs.append(made(*a, **k)) or jobs[-1])
    stage.adaptive_drt.light_rays, stage.adaptive_drt.distribution = 1 << 14, "EVERYWHERE"
    bpy.ops.render.render()
    assert asked and jobs[0].cancelled and not jobs[0].running
    assert part("operators.state").state.job is None


@pytest.mark.parametrize("outcome", ["success", "failure", "cancelled"])
def test_what_is_the_user_s_stays(stage, part, tmp_path, monkeypatch, outcome):
    """Frame, selection, engine, images and files, after F12."""
    _move_ball()
    monkeypatch.chdir(tmp_path)
    bpy.data.images.new("Mine", 2, 2, float_buffer=True)
    ball = bpy.context.view_layer.objects.active = bpy.data.objects["Sphere"]
    ball.select_set(True)

    def owned():
        images = [(i.name, *i.pixels) for i in bpy.data.images if i.type == "IMAGE"]
        chosen = [o.name for o in bpy.context.selected_objects]
        things_there = [len(kind) for kind in (bpy.data.objects, bpy.data.meshes, bpy.data.scenes)]
        frame = stage.frame_current, stage.frame_subframe, ball.location.x
        active = bpy.context.view_layer.objects.active
        return frame, chosen, active, stage.render.engine, images, things_there

    before = owned()
    if outcome == "failure":
        monkeypatch.setattr(f"{part('adaptive_drt.scene.film').__name__}.Film.pixels", None)
        with pytest.raises(RuntimeError):
            bpy.ops.render.render()
    else:
        engine = part("operators.engine").ADRT_RE_engine
        monkeypatch.setattr(engine, "_is_over", lambda self: outcome == "cancelled")
        bpy.ops.render.render()
    assert owned() == before and list(tmp_path.iterdir()) == []


def test_a_busy_operator_does_not_matter(render, stage, part):
    """F12 while the button's render runs: both end, and the button's stays the one shown."""
    state = part("operators.state").state
    state.job = other = object()
    try:
        assert render()["ViewLayer.Combined"]["R"].max() > 0.0
        assert state.job is other
    finally:
        state.job = None


def test_blender_s_panels_are_left_as_they_were(addon):
    addon.unregister()
    try:
        for panel in bpy.types.Panel.__subclasses__():
            assert "ADAPTIVE_DRT" not in getattr(panel, "COMPAT_ENGINES", ())
    finally:
        addon.register()
