# SPDX-License-Identifier: GPL-3.0-or-later
"""The command `adaptive_render`, called as Blender calls it."""

from __future__ import annotations

import importlib
import json

import bpy
import pytest
import things

exr = pytest.importorskip("exr", reason="OpenEXR is not installed")


@pytest.fixture
def run(addon):
    return importlib.import_module(f"{addon.__name__}.operators.command").run


@pytest.fixture
def saved(file, tmp_path):
    """A saved file of 12 x 8 pixels with a ball that moves over frames 1 to 11."""
    scene = bpy.context.scene
    things.keyed(things.uv_sphere(), "location", (-3.0, 0.0, 0.0), (3.0, 0.0, 0.0))
    things.light("AREA", energy=500.0, size=1.0).location.z = 5.0
    scene.render.resolution_x, scene.render.resolution_y = 12, 8
    scene.adaptive_drt.method = "RAYS"
    scene.adaptive_drt.light_rays = 4
    scene.frame_set(3)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    return scene


def _written(folder):
    return sorted(p.name for p in folder.iterdir() if p.suffix != ".blend")


def _manners(scene):
    render = scene.render
    return (
        scene.frame_current, scene.frame_start, scene.frame_end, scene.frame_step, render.engine,
        render.filepath, render.image_settings.file_format, scene.adaptive_drt.light_rays,
        scene.adaptive_drt.use_edges, render.use_motion_blur, render.use_border,
        render.border_max_x, list(bpy.app.handlers.render_write),
    )  # fmt: skip


def test_frames(saved, run, tmp_path, capfd):
    before = _manners(saved)
    code = run(
        "--frame 1..2,5 --output //out_#### --format OPEN_EXR_MULTILAYER "
        "--light-rays 9 --distribution EVERYWHERE --no-use-edges".split()
    )
    told = capfd.readouterr()
    assert code == 0 and "Traceback" not in told.err
    assert _written(tmp_path) == [f"out_{n:04d}.exr" for n in (1, 2, 5)]
    assert "adaptive_render: frame 5:" in told.out and "out_0005.exr" in told.out
    counts = exr.read_exr(tmp_path / "out_0005.exr")["ViewLayer.Sample Count"]["X"]
    assert counts.max() == 9.0
    assert _manners(saved) == before


def test_the_current_frame_in_the_file_s_own_format(saved, run, tmp_path):
    saved.render.filepath = str(tmp_path / "one_")
    assert run(["--"]) == 0
    assert _written(tmp_path) == ["one_0003.png"]


@pytest.mark.parametrize("asked, kept", [("32", "16"), ("16", "32")])
def test_depth(saved, run, tmp_path, asked, kept):
    settings = saved.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format, settings.color_depth = "OPEN_EXR_MULTILAYER", kept
    assert run(f"--format OPEN_EXR --depth {asked} --output //asked".split()) == 0
    assert run("--format OPEN_EXR --output //kept".split()) == 0
    for name, bits in (("asked", asked), ("kept", kept)):
        (channels,) = exr.read_exr(tmp_path / f"{name}0003.exr").values()
        assert channels["R"].dtype == f"float{bits}"
    assert (settings.file_format, settings.color_depth) == ("OPEN_EXR_MULTILAYER", kept)
    assert run("--format OPEN_EXR --depth 8 --output //wrong".split()) == 1


def test_border(saved, run, tmp_path):
    both = "--format OPEN_EXR_MULTILAYER --output"
    assert run(f"{both} //whole".split()) == 0
    assert run(f"{both} //part --border 0.5,0,1,0.5".split()) == 0
    assert run(f"{both} //crop --border 0.5,0,1,0.5 --crop".split()) == 0
    whole, part, crop = (
        exr.read_exr(tmp_path / f"{name}0003.exr")["ViewLayer.Combined"]["R"]
        for name in ("whole", "part", "crop")
    )
    assert crop.shape == (4, 6) and (crop == whole[:4, 6:]).all()
    assert part.shape == whole.shape and (part[:4, 6:] == crop).all()
    assert not part[4:].any() and not part[:, :6].any()


@pytest.mark.parametrize(
    "arguments, said",
    [
        ("--frame 3..1", "3..1 runs backwards"),
        ("--frame x", "'x' is not like 5, 1..10 or 1..3,7"),
        ("--frame=-3", "'-3' is not like 5, 1..10 or 1..3,7"),
        ("--light-rays 0", "0 is not in 1..1048576"),
        ("--tolerance 0", "0 is not in"),
        ("--tolerance nan", "nan is not in"),
        ("--method EXACTLY", "invalid choice"),
        ("--order 3", "invalid choice"),
        ("--format TGAA", "invalid choice"),
        ("--border 0,0,2,1", "holds nothing of the picture"),
        ("--colour red", "unrecognized arguments"),
    ],
)
def test_what_it_does_not_understand(saved, run, tmp_path, capfd, arguments, said):
    assert run(arguments.split()) == 1
    assert said in capfd.readouterr().err and _written(tmp_path) == []


def test_help(saved, run, capfd):
    assert run(["--help"]) == 0
    told = capfd.readouterr().out
    options = (p.identifier for p in saved.adaptive_drt.bl_rna.properties)
    for name in ("frame", "output", "format", "border", *options):
        if name not in ("rna_type", "name"):
            assert f"--{name.replace('_', '-')}" in told


def test_motion_blur_is_the_scene_s_own_switch(saved, run, tmp_path):
    before = _manners(saved)
    shared = "--format OPEN_EXR --frame 6 --output"
    assert run(f"{shared} //still".split()) == 0
    assert run(f"{shared} //moving --use-motion".split()) == 0
    still, moving = (
        next(iter(exr.read_exr(tmp_path / f"{name}0006.exr").values()))["R"]
        for name in ("still", "moving")
    )
    assert (still != moving).any() and _manners(saved) == before


def test_settings_of_the_other_method_are_told(saved, run, capfd):
    assert run("--light-rays 9 --tolerance 0.01 --output //rays".split()) == 0
    told = capfd.readouterr().err
    assert "--tolerance does nothing with the method RAYS" in told and "--light" not in told


def test_tolerance(saved, run, tmp_path, capfd):
    """The line of the manual, of the method that a tolerance is for."""
    before = _manners(saved)
    code = run(
        "--frame 1..2 --output //out_#### --format OPEN_EXR_MULTILAYER --method EXACT "
        "--tolerance 0.001".split()
    )
    assert code == 0 and "does nothing" not in capfd.readouterr().err
    assert _written(tmp_path) == ["out_0001.exr", "out_0002.exr"]
    figures = exr.read_header(tmp_path / "out_0002.exr")["adaptive_drt.ViewLayer"]
    assert json.loads(figures)["tolerance"] == 0.001
    assert _manners(saved) == before and saved.adaptive_drt.method == "RAYS"


def test_failures(saved, run, tmp_path, capfd):
    saved.camera.data.type = "ORTHO"
    before = _manners(saved)
    assert run(["--output", "//out_"]) == 1
    assert "set its type to Perspective" in capfd.readouterr().err
    saved.camera.data.type = "PERSP"
    assert run(["--output", "/dev/null/out_"]) == 1
    assert _manners(saved) == before and _written(tmp_path) == []


def test_no_file(file, run, capfd):
    assert run([]) == 1
    assert "no file is open" in capfd.readouterr().err
