# SPDX-License-Identifier: GPL-3.0-or-later
"""The command `adaptive_join`: parts of a picture become the whole, to the last bit."""

from __future__ import annotations

import importlib
import json

import bpy
import numpy as np
import pytest
import things

OpenEXR = pytest.importorskip("OpenEXR", reason="OpenEXR is not installed")
import exr  # noqa: E402  (it needs OpenEXR)

WIDTH, HEIGHT = 19, 35
"""Odd, and more than two blocks of 16 rows."""


@pytest.fixture
def render(addon):
    return importlib.import_module(f"{addon.__name__}.operators.command").run


@pytest.fixture
def join(addon):
    return importlib.import_module(f"{addon.__name__}.operators.join").run


@pytest.fixture
def saved(file, tmp_path):
    """A saved file with a ball on a floor, and the passes that can be switched on."""
    scene = bpy.context.scene
    things.uv_sphere().location.z = 1.5
    things.plane("Floor")
    things.light("AREA", energy=500.0, size=1.0).location.z = 5.0
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    layer = scene.view_layers[0]
    layer.use_pass_z = layer.use_pass_normal = True
    scene.adaptive_drt.method, scene.adaptive_drt.light_rays = "RAYS", 4
    scene.frame_set(3)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    return scene


@pytest.mark.parametrize(
    "name, depth, codec",
    [
        ("OPEN_EXR_MULTILAYER", "32", "DWAA"),
        ("OPEN_EXR", "16", "ZIPS"),
        pytest.param("OPEN_EXR", "32", "NONE", marks=pytest.mark.slow),
    ],
)
def test_parts_become_the_whole(saved, render, join, tmp_path, name, depth, codec):
    settings = saved.render.image_settings
    settings.file_format, settings.exr_codec = "OPEN_EXR", codec
    before = settings.exr_codec, saved.render.use_border
    shared = f"--format {name} --depth {depth} --frame=3 --tolerance= --no-strict".split()
    for row in "12":
        for column in "123":
            part = f"--parts 3,2 --part {column},{row} --output //part_####_{column}_{row}"
            assert render([*shared, *part.split()]) == 0
    assert (settings.exr_codec, saved.render.use_border) == before
    settings.exr_codec = "ZIP"
    assert render([*shared, "--output", "//whole_"]) == 0
    pattern = tmp_path / "part_####_{column}_{row}.exr"
    joined = tmp_path / "new" / "joined_####.exr"
    assert join(f"--parts 3,2 --frame=3 --output {joined} {pattern}".split()) == 0
    exr.assert_same_bits(joined.with_name("joined_0003.exr"), tmp_path / "whole_0003.exr")
    assert not list(joined.parent.glob("*.unfinished"))


@pytest.fixture
def drawn(tmp_path):
    """Write a file of random half and float values; returns its path."""
    numbers = np.random.default_rng(1)

    def write(name, region, compression=OpenEXR.ZIP_COMPRESSION, images=2, size=(WIDTH, HEIGHT)):
        parts = []
        for number in range(images):
            shape = size[::-1]
            channels = {
                "Z": numbers.random(shape).astype(np.float32),
                "A": np.round(numbers.random(shape)).astype(np.float16),
            }
            header = {
                "compression": compression,
                "type": OpenEXR.scanlineimage,
                "name": f"{number}",
            }
            if region is not None:
                header["adaptive_drt.ViewLayer"] = json.dumps({"region": region})
            parts.append(OpenEXR.Part(header, channels))
        path = tmp_path / name
        OpenEXR.File(parts).write(str(path))
        return path

    return write


@pytest.mark.parametrize("images", [1, 2])
@pytest.mark.parametrize("codec", ["NO", "ZIPS", "ZIP"])
def test_what_it_writes_others_read(join, drawn, tmp_path, codec, images):
    """Several images in a file, as Blender 5 writes them, of values that hardly become shorter."""
    compression = getattr(OpenEXR, f"{codec}_COMPRESSION")
    regions = (0, 0, WIDTH, 7), (0, 7, 5, HEIGHT), (5, 7, WIDTH, HEIGHT)
    paths = [drawn(f"{i}.exr", r, compression, images) for i, r in enumerate(regions)]
    assert join(["--output", str(tmp_path / "joined.exr"), *map(str, paths)]) == 0
    joined = exr.read_exr(tmp_path / "joined.exr")
    for (left, bottom, right, top), path in zip(regions, paths, strict=True):
        for name, channels in exr.read_exr(path).items():
            for letter, pixels in channels.items():
                there = joined[name][letter][bottom:top, left:right]
                assert there.tobytes() == pixels[bottom:top, left:right].tobytes()
    header = exr.read_header(tmp_path / "joined.exr")
    assert not any(key.startswith("adaptive_drt") for key in header)


def _cut(path):
    path.write_bytes(path.read_bytes()[:-400])
    return path


MIDDLE = 8
WHOLE, LEFT, RIGHT = (0, 0, WIDTH, HEIGHT), (0, 0, MIDDLE, HEIGHT), (MIDDLE, 0, WIDTH, HEIGHT)


@pytest.mark.parametrize(
    "make, said",
    [
        (lambda draw: [draw("a.exr", LEFT)], "385 of 665 pixels are in no part"),
        (lambda draw: [draw("a.exr", LEFT), draw("b.exr", WHOLE)], "overlap"),
        (lambda draw: [draw("a.exr", None)], "is not from adaptive_render"),
        (lambda draw: [draw("a.exr", WHOLE, OpenEXR.PIZ_COMPRESSION)], "neither ZIP nor none"),
        (lambda draw: [draw("a.exr", RIGHT, size=(9, 35))], "is cropped to the part"),
        (lambda draw: [draw("a.exr", LEFT), draw("b.exr", RIGHT, images=1)], "differs from"),
        (lambda draw: [draw("a.exr", LEFT), _cut(draw("b.exr", RIGHT))], "its end is missing"),
        (lambda draw: [draw("a.exr", LEFT), "there_is_none.exr"], "there_is_none.exr"),
        (lambda draw: [__file__], "it is no OpenEXR file"),
        (lambda draw: ["--frame", "x"], "invalid int value"),
    ],
)
def test_what_it_refuses(join, drawn, tmp_path, capfd, make, said):
    inputs = [str(one) for one in make(drawn)]
    assert join(["--output", str(tmp_path / "joined.exr"), *inputs]) == 1
    assert said in capfd.readouterr().err
    assert not list(tmp_path.glob("joined*"))


@pytest.mark.parametrize(
    "arguments, said",
    [
        ("--part 3,1 --parts 2,2", "there is no column 3 among 2"),
        ("--part 1,3 --parts 2,2", "there is no row 3 among 2"),
        ("--part 0,1", "0,1 holds a number below 1"),
        ("--part 1", "'1' is not like 4,3"),
        ("--part 1,1 --border 0,0,1,1", "not allowed with"),
        ("--part 1,1 --format PNG", "the format PNG cannot be joined"),
    ],
)
def test_parts_that_cannot_be(saved, render, tmp_path, capfd, arguments, said):
    assert render(arguments.split()) == 1
    assert said in capfd.readouterr().err and not list(tmp_path.glob("*.exr"))


def test_frames_as_render_farms_write_them(addon):
    parse = importlib.import_module(f"{addon.__name__}.operators.command").parse_frames
    assert parse("1-3,7,10-10,0..4") == [(1, 3), (7, 7), (10, 10), (0, 4)]
