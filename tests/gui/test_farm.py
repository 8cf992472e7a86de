# SPDX-License-Identifier: GPL-3.0-or-later
"""What separate processes render joins to the last bit; the commands are those of docs/farms.md.

Flamenco's own job types call `blender -b -y FILE --render-output … --render-frame 1..10`.
"""

from __future__ import annotations

import pytest

exr = pytest.importorskip("exr", reason="OpenEXR is not installed")
pytestmark = pytest.mark.slow

WORK = {"farm_EXACT": ("ViewLayer.Sample Count",), "farm_RAYS": ()}
"""Passes that tell of the work, by file: beside a cut it is not that of the whole picture."""


@pytest.fixture(scope="module", params=["EXACT", "RAYS"])
def farm(scene, request):
    """The .blend, of each method."""
    return scene.parent / f"farm_{request.param}.blend"


@pytest.fixture(scope="module")
def together(installed, farm):
    """Both frames, rendered by one process."""
    folder = farm.with_suffix("")
    folder.mkdir()
    told = installed.run(
        *("-b", "-y", farm, "--render-output", folder / "######"),
        *("--render-format", "OPEN_EXR_MULTILAYER", "--render-frame", "11..12"),
    )
    assert told.returncode == 0, told
    return folder


def test_frames(installed, farm, together):
    for frame in ("11", "12"):
        told = installed.run(
            *("-b", "-y", farm, "--render-output", together / "apart_######"),
            *("--render-format", "OPEN_EXR_MULTILAYER", "--render-frame", frame),
        )
        assert told.returncode == 0, told
        exr.assert_same_bits(together / f"apart_0000{frame}.exr", together / f"0000{frame}.exr")


def test_parts(installed, farm, together):
    """Halves, by processes of different numbers of threads, joined with all passes."""
    for column, threads in ("1", "1"), ("2", "2"):
        told = installed.run(
            *("-b", "-y", farm, "-c", "adaptive_render", "--frame", "12", "--parts", "2,1"),
            *("--part", f"{column},1", "--threads", threads, "--format", "OPEN_EXR_MULTILAYER"),
            *("--output", together / f"part_####_{column}_1"),
        )
        assert told.returncode == 0, told
    told = installed.run(
        *("-b", "-c", "adaptive_join", "--frame", "12", "--parts", "2,1"),
        *("--output", together / "joined_####.exr", together / "part_####_{column}_{row}.exr"),
    )
    assert told.returncode == 0, told
    exr.assert_same_bits(together / "joined_0012.exr", together / "000012.exr", WORK[farm.stem])
