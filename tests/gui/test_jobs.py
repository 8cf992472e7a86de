# SPDX-License-Identifier: GPL-3.0-or-later
"""The job templates in Open Job Description, run by its own program, which needs no farm.

A worker is one `openjd run` that gets some of the tasks, as a farm hands them out.
"""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from program import ROOT, SECONDS, Program

cli = pytest.importorskip("openjd.cli", reason="openjd-cli is not installed")
exr = pytest.importorskip("exr", reason="OpenEXR is not installed")

TEMPLATES = {name: ROOT / "farms" / name / "template.yaml" for name in ("animation", "parts")}
ENVIRONMENT = ROOT / "farms" / "extension.environment.yaml"
WORK = {"EXACT": ("ViewLayer.Sample Count",), "RAYS": ()}
"""Passes that tell of the work, by method: beside a cut it is not that of the whole picture."""

NEAR = 4
"""Pixels. Blocks of EXACT are as wide; farther from a cut the work is that of the whole picture."""

OPENJD = (sys.executable, "-m", "openjd")


@pytest.mark.parametrize("path", [*TEMPLATES.values(), ENVIRONMENT], ids=lambda path: path.name)
def test_templates_are_valid(path, capsys):
    cli.main(["check", str(path)])
    assert "passes validation checks" in capsys.readouterr().out


def test_frames_are_handed_out_by_chunks(tmp_path):
    """With a program in place of Blender that writes what it was asked."""
    echo = tmp_path / "echo.sh"
    echo.write_text("#!/bin/sh\nprintf '<%s>' \"$@\"\necho\n")
    echo.chmod(0o755)
    values = {"SceneFile": "a.blend", "OutputFolder": "out", "Frames": "1-5,9", "ChunkSize": 3}
    values["Blender"] = echo
    words = [*OPENJD, "run", str(TEMPLATES["animation"]), "--step", "Render", *_parameters(values)]
    told = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=SECONDS)
    assert told.returncode == 0, told
    asked = [line for line in told.stdout.splitlines() if "<adaptive_render>" in line]
    for line, frames in zip(asked, ("1-3", "4-5", "9-9"), strict=True):
        assert f"<{tmp_path}/a.blend><--command>" in line and f"<--frame={frames}>" in line
        assert line.endswith(f"<{tmp_path}/out/frame_####>")


def _parameters(values):
    return [word for name, value in values.items() for word in ("-p", f"{name}={value}")]


@dataclass
class Farm:
    """Workers of a job, with Blenders that find the extension in different places."""

    program: Program
    template: Path
    values: dict[str, object]

    def worker(self, step, tasks=None, blender="ready", options=()):
        """Start a worker on tasks of a step, all of them where none are given.

        blender : "ready", with the extension; "bare", without it; "session", which takes the
            profile that the job's environment names.
        """
        values = {**self.values, "Blender": self._blender(blender)}
        words = ["run", self.template, "--step", step, *_parameters(values), *options]
        # Blender may see the folders in another place than whoever submits the job
        here, there = self.program.folder, self.program.inside(self.program.folder)
        rule = {"source_path_format": "POSIX", "source_path": str(here), "destination_path": there}
        rules = {"version": "pathmapping-1.0", "path_mapping_rules": [rule]}
        words += ["--path-mapping-rules", json.dumps(rules)]
        if tasks is not None:
            words += ["--tasks", json.dumps(tasks)]
        return subprocess.Popen(
            [*OPENJD, *map(str, words)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env={**os.environ, "TMPDIR": str(self.program.folder)},
        )

    def _blender(self, kind):
        profile = self.program.profile if kind == "ready" else self.program.folder / kind
        profile.mkdir(exist_ok=True)
        words = shlex.join(self.program.words(profile=profile))
        if kind == "session":
            named = f"${{BLENDER_USER_RESOURCES#{str(self.program.root).rstrip('/')}}}"
            words = words.replace(self.program.inside(profile), f'"{named}"')
        path = self.program.folder / f"{kind}.sh"
        path.write_text(f'#!/bin/sh\nexec {words} "$@"\n')
        path.chmod(0o755)
        return path


def _end(worker):
    """Wait for a worker; returns its exit code and its log."""
    said, _ = worker.communicate(timeout=SECONDS)
    return worker.returncode, said


@pytest.fixture(scope="module")
def whole(installed, scene):
    """Render frames of a file by one process, by Blender's own options; returns the folder."""

    def render(farm, frames):
        folder = farm.with_name(f"whole_{farm.stem}")
        told = installed.run(
            *("-b", "-y", farm, "--render-output", folder / "####"),
            *("--render-format", "OPEN_EXR_MULTILAYER", "--render-frame", frames),
        )
        assert told.returncode == 0, told
        return folder

    return render


@pytest.mark.slow
def test_animation(installed, scene, whole):
    """Two workers at once. The one whose Blender lacks the extension fails; its task runs again."""
    file, folder = scene.with_name("farm_EXACT.blend"), scene.parent / "animation"
    values = {"SceneFile": file, "OutputFolder": folder, "Frames": "11-12", "ChunkSize": 1}
    farm = Farm(installed, TEMPLATES["animation"], values)
    first = farm.worker("Render", [{"Frame": "11-11"}])
    second = farm.worker("Render", [{"Frame": "12-12"}], blender="bare")
    (code, said), (failed, reason) = _end(first), _end(second)
    assert code == 0, said
    assert failed == 1 and "adaptive_render" in reason, reason
    assert [path.name for path in folder.iterdir()] == ["frame_0011.exr"]
    code, said = _end(farm.worker("Render", [{"Frame": "12-12"}]))
    assert code == 0, said
    together = whole(file, "11..12")
    for frame in ("0011", "0012"):
        exr.assert_same_bits(folder / f"frame_{frame}.exr", together / f"{frame}.exr")


@pytest.mark.slow
def test_chunk(installed, scene):
    """Both frames by one task, in another format; no object is missing, so it is not refused."""
    file, folder = scene.with_name("farm_RAYS.blend"), scene.parent / "chunk"
    values = {"SceneFile": file, "OutputFolder": folder, "Frames": "11-12", "Format": "PNG"}
    farm = Farm(installed, TEMPLATES["animation"], {**values, "Missing": "strict"})
    code, said = _end(farm.worker("Render"))
    assert code == 0, said
    assert sorted(path.name for path in folder.iterdir()) == ["frame_0011.png", "frame_0012.png"]


@pytest.mark.slow
@pytest.mark.parametrize("method", ["EXACT", "RAYS"])
def test_parts(installed, scene, method):
    """Two workers at once, one of which fails: nothing is joined until its parts are there."""
    file, folder = scene.with_name(f"farm_{method}.blend"), scene.parent / f"parts_{method}"
    values = {"SceneFile": file, "OutputFolder": folder, "Frames": "12", "Columns": 2, "Rows": 2}
    farm = Farm(installed, TEMPLATES["parts"], {**values, "Tolerance": "0.002"})
    lower, upper = (
        [{"Frame": "12", "Column": column, "Row": row} for column in "12"] for row in "12"
    )
    first = farm.worker("Render", lower)
    second = farm.worker("Render", upper, blender="bare")
    (code, said), (failed, reason) = _end(first), _end(second)
    assert code == 0, said
    assert failed == 1, reason
    failed, reason = _end(farm.worker("Join"))
    assert failed == 1 and "picture_0012_part_1_2.exr" in reason, reason
    assert not (folder / "picture_0012.exr").exists()
    code, said = _end(farm.worker("Render", upper))
    assert code == 0, said
    code, said = _end(farm.worker("Join"))
    assert code == 0, said
    told = installed.run(
        *("-b", file, "-c", "adaptive_render", "--frame", "12", "--tolerance", "0.002"),
        *("--format", "OPEN_EXR_MULTILAYER", "--output", folder / "whole_"),
    )
    assert told.returncode == 0, told
    joined, single = folder / "picture_0012.exr", folder / "whole_0012.exr"
    exr.assert_same_bits(joined, single, WORK[method])
    first, second = (exr.read_exr(p)["ViewLayer.Sample Count"]["X"] for p in (joined, single))
    rows, columns = np.nonzero(first != second)
    height, width = first.shape
    assert (np.minimum(abs(rows + 0.5 - height / 2), abs(columns + 0.5 - width / 2)) < NEAR).all()


@pytest.mark.slow
def test_parts_by_one_worker(installed, scene, extension, whole):
    """The join with all that it depends on; the extension is installed for the session alone."""
    file, folder = scene.with_name("farm_EXACT.blend"), scene.parent / "alone"
    values = {"SceneFile": file, "OutputFolder": folder, "Frames": "12", "Columns": 3, "Rows": 1}
    farm = Farm(installed, TEMPLATES["parts"], {**values, "ExtensionFile": extension})
    options = ["--run-dependencies", "--environment", ENVIRONMENT]
    code, said = _end(farm.worker("Join", blender="session", options=options))
    assert code == 0, said
    assert not list((installed.folder / "session").iterdir())
    exr.assert_same_bits(folder / "picture_0012.exr", whole(file, "12") / "0012.exr", WORK["EXACT"])
