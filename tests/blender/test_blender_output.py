# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of the command that are not written whole: a full disk, a place that is no folder."""

from __future__ import annotations

import importlib
import os
import resource
from contextlib import contextmanager

import bpy
import pytest
import things

FORMATS = "PNG JPEG BMP TIFF TARGA TARGA_RAW OPEN_EXR OPEN_EXR_MULTILAYER WEBP IRIS DPX HDR".split()
CUT = "PNG BMP TARGA TARGA_RAW OPEN_EXR OPEN_EXR_MULTILAYER WEBP".split()
"""Those of which Blender leaves the beginning without an error."""
FULL = 100
"""Octets that go on the full disk."""


@pytest.fixture
def run(addon):
    return importlib.import_module(f"{addon.__name__}.operators.command").run


@pytest.fixture
def output(addon):
    return importlib.import_module(f"{addon.__name__}.operators.output")


@pytest.fixture
def saved(file, tmp_path):
    scene = bpy.context.scene
    things.plane("Floor")
    things.light("AREA", energy=500.0, size=1.0).location.z = 5.0
    scene.render.resolution_x, scene.render.resolution_y = 32, 24
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    return scene


@contextmanager
def full_disk():
    """No file may be longer than FULL octets."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (FULL, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def _written(folder):
    return sorted(p for p in folder.iterdir() if not p.name.startswith("scene."))


# capsys and not capfd: what is captured in a file would be cut, too
@pytest.mark.parametrize("name", FORMATS)
def test_full_disk(saved, run, tmp_path, capsys, name):
    options = ["--format", name, "--output", "//out_"]
    assert run(options) == 0, "a file that is whole is no error"
    (path,) = _written(tmp_path)
    with full_disk():
        code = run([*options, "--frame", "2..3"])
    said = capsys.readouterr().err
    assert code == 1 and str(path).replace("0001", "0002") in said
    assert not [p for p in _written(tmp_path) if "0003" in p.name], "it stops at once"


@pytest.mark.parametrize("name", CUT)
def test_each_cut_is_found(saved, run, output, tmp_path, name):
    assert run(["--format", name, "--output", "//out_"]) == 0
    (path,) = _written(tmp_path)
    whole = path.read_bytes()
    none = output.Stamp()
    assert output.fault_of(str(path), none) == ""
    for size in {*range(10), len(whole) // 3, len(whole) // 2, *range(len(whole) - 20, len(whole))}:
        path.write_bytes(whole[:size])
        assert "is the disk full?" in output.fault_of(str(path), none), size


def test_movie(saved, run, tmp_path, capsys):
    saved.render.resolution_x, saved.render.resolution_y = 64, 48
    saved.render.ffmpeg.format = "MKV"
    options = ["--format", "FFMPEG", "--frame", "1..3", "--output"]
    assert run([*options, "//whole_"]) == 0
    with full_disk():
        assert run([*options, "//cut_"]) == 1
    assert "cut_0001-0003.mkv" in capsys.readouterr().err
    assert not bpy.data.movieclips, "what was looked at is forgotten"


def test_a_folder_that_is_a_file(saved, run, tmp_path, capfd):
    (tmp_path / "file").touch()
    assert run(["--output", str(tmp_path / "file" / "out_")]) == 1
    assert str(tmp_path / "file" / "out_0001.png") in capfd.readouterr().err


def test_a_file_that_is_not_written_anew(output, tmp_path):
    path = tmp_path / "old.jpg"
    path.write_bytes(b"a picture of old")
    long_ago = path.stat().st_mtime - 100.0
    os.utime(path, (long_ago, long_ago))
    before = output.stamp_of(str(path))
    assert "not written anew" in output.fault_of(str(path), before)
    path.write_bytes(b"another picture.")
    assert output.fault_of(str(path), before) == ""
    assert "not written" in output.fault_of(str(tmp_path / "none.jpg"), output.Stamp())


def test_what_is_there_is_kept_where_overwrite_is_off(saved, run, tmp_path, capfd):
    saved.render.use_overwrite = False
    assert run(["--frame", "1", "--output", "//out_"]) == 0
    before = (tmp_path / "out_0001.png").stat()
    assert run(["--frame", "1..2", "--output", "//out_"]) == 0
    assert "Overwrite is off" in capfd.readouterr().err
    assert (tmp_path / "out_0001.png").stat() == before and (tmp_path / "out_0002.png").exists()


def test_views_of_stereoscopy(saved, run, tmp_path):
    saved.render.use_multiview = True
    saved.render.image_settings.views_format = "INDIVIDUAL"
    assert run(["--output", "//out_"]) == 0
    assert [p.name for p in _written(tmp_path)] == ["out_0001_L.png", "out_0001_R.png"]


@pytest.fixture
def lacking(saved):
    """Two objects that no picture can hold, for one reason."""
    for name in ("Far", "Farther"):
        things.uv_sphere(name).location.x = 1e31
    bpy.ops.wm.save_mainfile()


def test_strict_renders_no_frame_that_lacks_an_object(lacking, run, tmp_path, capfd):
    assert run(["--strict", "--frame", "1..2", "--output", "//out_"]) == 1
    said = capfd.readouterr().err
    assert "frame 1 lacks 2 objects" in said and '"Far", "Farther"' in said
    assert _written(tmp_path) == []


def test_without_it_objects_are_listed_and_the_frame_is_rendered(lacking, run, tmp_path, caplog):
    assert run(["--output", "//out_"]) == 0
    (said,) = (r.getMessage() for r in caplog.records if "Missing" in r.getMessage())
    assert said.startswith("Missing: 2 objects") and '"Farther"' in said
    assert [p.name for p in _written(tmp_path)] == ["out_0001.png"]
    bpy.context.scene.render.engine = "ADAPTIVE_DRT"
    assert bpy.ops.render.render() == {"FINISHED"}, "nor is anything else strict afterwards"


def test_strict_forgives_notes(saved, run, tmp_path):
    material = things.material("Shiny")
    bpy.data.objects["Floor"].data.materials.append(material)
    assert run(["--strict", "--output", "//out_"]) == 0
    assert [p.name for p in _written(tmp_path)] == ["out_0001.png"]
