# SPDX-License-Identifier: GPL-3.0-or-later
"""What separate processes render joins to the last bit; the commands are those of docs/flamenco.md.

Flamenco's own job types call `blender -b -y FILE --render-output … --render-frame 1..10`.
"""

from __future__ import annotations

import shutil

import numpy as np
import pytest
from program import ROOT

exr = pytest.importorskip("exr", reason="OpenEXR is not installed")
pytestmark = pytest.mark.slow


def _assert_equal(path, other):
    first, second = exr.read_exr(path), exr.read_exr(other)
    assert first.keys() == second.keys()
    for name, channels in first.items():
        for letter, pixels in channels.items():
            np.testing.assert_array_equal(pixels, second[name][letter], err_msg=name)


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
        _assert_equal(together / f"apart_0000{frame}.exr", together / f"0000{frame}.exr")


def test_parts(installed, farm, together):
    """Halves, by processes of different numbers of threads, joined by Blender."""
    join = together / "join.py"
    shutil.copy(ROOT / "scripts" / "join.py", join)
    parts = []
    for index, (border, threads) in enumerate((("0,0,0.4,1", "1"), ("0.4,0,1,1", "2"))):
        parts.append(together / f"part{index}_0012.exr")
        told = installed.run(
            *("-b", "-y", farm, "-c", "adaptive_render", "--frame", "12"),
            *("--border", border, "--threads", threads, "--format", "OPEN_EXR"),
            *("--output", together / f"part{index}_####"),
        )
        assert told.returncode == 0, told
    told = installed.run("-b", "-P", join, "--", together / "joined.exr", *parts)
    assert told.returncode == 0, told
    joined = next(iter(exr.read_exr(together / "joined.exr").values()))
    whole = exr.read_exr(together / "000012.exr")["ViewLayer.Combined"]
    for letter in "RGBA":
        np.testing.assert_array_equal(joined[letter], whole[letter])
