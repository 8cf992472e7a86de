# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension in a real Blender without a window, by the command lines that users type."""

from __future__ import annotations

import os
import shutil

import numpy as np
import pytest
from program import ROOT

exr = pytest.importorskip("exr", reason="OpenEXR is not installed")

ROUNDED = 1e-6
"""Of the largest value: another NumPy rounds otherwise."""

PART_OF_TOLERANCE = 0.1
"""What may be left of the difference between two exact pictures."""


def _assert_alike(path, other, allowed=ROUNDED):
    first, second = exr.read_exr(path), exr.read_exr(other)
    assert first.keys() == second.keys() and len(first) >= 5
    for name, channels in first.items():
        assert channels.keys() == second[name].keys(), name
        for letter, pixels in channels.items():
            limit = allowed * max(1.0, float(np.abs(pixels).max()))
            worst = float(np.abs(pixels - second[name][letter]).max())
            assert worst <= limit, f"{name}.{letter} differs by {worst}"


@pytest.mark.slow
def test_the_zip_is_valid(program, extension):
    told = program.run("--command", "extension", "validate", extension)
    assert told.returncode == 0 and "ERROR" not in told.stdout + told.stderr, told


def test_animation_of_the_engine(installed, scene):
    """As the manual has it: -E, -o and -F before -a."""
    told = installed.run(
        *("-b", scene, "-E", "ADAPTIVE_DRT", "-o", "//out_####", "-F", "OPEN_EXR_MULTILAYER", "-a")
    )
    assert told.returncode == 0, told
    for frame in (11, 12):
        mine = scene.parent / f"out_{frame:04d}.exr"
        _assert_alike(mine, scene.parent / f"bpy_{frame:04d}.exr")


def test_command(installed, scene):
    told = installed.run(
        *("-b", scene, "-c", "adaptive_render", "--frame", "11..12", "--output", "//cmd_####"),
        *("--format", "OPEN_EXR_MULTILAYER"),
    )
    assert told.returncode == 0 and "frame 12:" in told.stdout, told
    for frame in (11, 12):
        mine = scene.parent / f"cmd_{frame:04d}.exr"
        _assert_alike(mine, scene.parent / f"bpy_{frame:04d}.exr")


def test_command_with_a_tolerance(installed, scene):
    """Where another NumPy rounds otherwise, a pixel may be worked on more: within the tolerance."""
    told = installed.run(
        *("-b", scene, "-c", "adaptive_render", "--frame", "11..12", "--output", "//tol_####"),
        *("--format", "OPEN_EXR_MULTILAYER", "--method", "EXACT", "--tolerance", "0.001"),
    )
    assert told.returncode == 0, told
    for frame in (11, 12):
        mine = exr.read_exr(scene.parent / f"tol_{frame:04d}.exr")
        theirs = exr.read_exr(scene.parent / f"exact_{frame:04d}.exr")
        first, second = (
            np.array([f["ViewLayer.Combined"][c] for c in "RGB"]) for f in (mine, theirs)
        )
        difference = np.sqrt(((first - second) ** 2).mean()) / second.mean()
        assert difference < PART_OF_TOLERANCE * 0.001
        alike = mine["ViewLayer.Sample Count"]["X"] == theirs["ViewLayer.Sample Count"]["X"]
        assert alike.mean() > 0.98


@pytest.mark.slow
def test_command_says_what_it_can(installed):
    told = installed.run("-b", "-c", "adaptive_render", "--help")
    assert told.returncode == 0 and "--light-rays" in told.stdout, told
    assert "adaptive_render" in installed.run("-b", "-c", "help").stdout


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments, said",
    [
        (("missing.blend", "-c", "adaptive_render"), "no file is open"),
        (("-c", "adaptive_render", "--frame", "x"), "is not like 5, 1..10 or 1..3,7"),
    ],
)
def test_command_fails_with_1(installed, arguments, said):
    told = installed.run("-b", *arguments)
    assert told.returncode == 1 and said in told.stderr, told


def test_strict_command_fails_with_1(installed, scene, copied):
    told = installed.run(
        *("-b", scene, "-P", copied("lose_object.py"), "-c", "adaptive_render", "--strict"),
        *("--frame", "11", "--output", "//strict_"),
    )
    assert told.returncode == 1 and '"Lost": ' in told.stderr, told
    assert not list(scene.parent.glob("strict_*"))


@pytest.mark.parametrize("name", ["PNG", "OPEN_EXR", "OPEN_EXR_MULTILAYER"])
def test_a_full_disk_fails_with_1(installed, scene, name):
    """A file system of one page, mounted for this run; Blender says that it saved the file."""
    if os.environ.get("ADAPTIVE_DRT_BLENDER"):
        pytest.skip("a file system is mounted in the Blender alone that `make blender` makes")
    shell = 'mkdir -p "$0" && mount -t tmpfs -o size=4k none "$0" && exec blender "$@"'
    disk = installed.folder / "disk"
    told = installed.run(
        *("-c", shell, disk, "-b", scene, "-c", "adaptive_render", "--frame", "11"),
        *("--format", name, "--output", installed.inside(disk) + "/full_"),
        command="sh",
    )
    assert told.returncode == 1 and "is the disk full?" in told.stderr, told
    assert "full_0011" in told.stderr


def test_engine_fails_with_1(installed, scene, copied):
    """A multilayer EXR after an exception would crash Blender 5.2."""
    told = installed.run(
        *("-b", scene, "-P", copied("break_camera.py")),
        *("-E", "ADAPTIVE_DRT", "-o", "//broken_", "-F", "OPEN_EXR_MULTILAYER", "-f", "11"),
    )
    assert told.returncode == 1, told
    assert "set its type to Perspective" in told.stdout + told.stderr
    assert not list(scene.parent.glob("broken_*"))


def test_compositor(installed, scene, copied):
    told = installed.run("-b", scene, "-P", copied("compose.py"))
    assert told.returncode == 0 and "composed" in told.stdout, told
    written = exr.read_exr(scene.parent / "composed.exr")
    (overlay,) = (c for n, c in written.items() if n.startswith("Composite"))
    mask = written["ViewLayer.Adaptive Mask"]
    picture = written["ViewLayer.Combined"]
    flagged = np.max([mask[c] for c in "RGB"], axis=0) > 0.0
    assert 0.0 < flagged.mean() < 1.0
    grey = sum(w * picture[c] for w, c in zip((0.2126, 0.7152, 0.0722), "RGB", strict=True))
    for letter in "RGB":
        expected = np.where(flagged, 0.4 * grey + 0.6 * mask[letter], grey)
        np.testing.assert_allclose(overlay[letter], expected, rtol=2e-5, atol=1e-6)


def test_workers(installed, copied):
    told = installed.run("-b", "-P", copied("count_workers.py"))
    assert told.returncode == 0 and "a worker of its own: True" in told.stdout, told
    assert "gone with the extension: True" in told.stdout, told


def test_panels(installed):
    """As tests/blender/test_blender_panels.py, in this version."""
    script = ROOT / "tests" / "blender" / "panels_shown.py"
    told = installed.run("-b", "-P", shutil.copy(script, installed.folder / script.name))
    assert told.returncode == 0 and " panels, faults: []" in told.stdout, told


@pytest.mark.slow
def test_removed_without_a_trace(program, extension):
    """In a profile of its own: installed, disabled and removed again."""
    import dataclasses

    folder = program.folder / "second"
    folder.mkdir()
    other = dataclasses.replace(program, folder=folder)
    other.profile.mkdir()
    told = other.run(
        "--command", "extension", "install-file", "-r", "user_default", "--enable", extension
    )
    assert told.returncode == 0, told
    place = other.profile / "extensions"
    assert (place / "user_default" / "adaptive_drt" / "__init__.py").exists()
    assert list(place.rglob("embreex")), "its wheel is unpacked"
    assert not list(place.rglob("numpy")), "NumPy is Blender's own"
    told = other.run("--command", "extension", "remove", "user_default.adaptive_drt")
    assert told.returncode == 0 and "ERROR" not in told.stdout + told.stderr, told
    left = [p for p in other.profile.rglob("*") if "adaptive" in p.name or "embree" in p.name]
    assert left == []
