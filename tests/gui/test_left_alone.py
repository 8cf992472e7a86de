# SPDX-License-Identifier: GPL-3.0-or-later
"""What a person may do to the window while a picture is rendered, and finds afterwards."""

from __future__ import annotations

import json
import os

import pytest

pytestmark = pytest.mark.slow

SHARED = 6.0
"""Times as long as a save takes that packs nothing while nothing is rendered: two threads or
processes render on two processors, and the window is drawn by them as well."""


@pytest.fixture(scope="module")
def facts(installed, scene, copied):
    if os.environ.get("ADAPTIVE_DRT_BLENDER"):
        pytest.skip("the window is tested in the Blender that `make blender` makes")
    copied("desk.py")
    script = copied("left_alone.py")
    told = installed.run(copied("window.sh"), scene, script, installed.folder, command="sh")
    assert told.returncode == 0, told.stdout[-3000:] + told.stderr[-3000:]
    found = json.loads((installed.folder / "left_alone.json").read_text())
    found["log"] = told.stdout + told.stderr
    assert "Traceback" not in found["log"], found["log"]
    return found


def test_something_is_said_before_the_scene_is_read(facts):
    assert facts["first"] == "preparing"


def test_saving_meanwhile_does_not_pack_the_picture_in_progress(facts):
    """What is left is Blender's own time to save, with the processors shared with the render."""
    assert facts["rendering"]
    assert facts["dirty"] and facts["clean"]
    assert facts["saved_meanwhile"] < SHARED * facts["saved_again"], facts


def test_closing_the_window_keeps_what_is_done_and_says_so(facts):
    assert facts["closing"] and facts["windows"] == 1 and facts["idle"]
    assert facts["part"] > 0.0
    assert facts["figures"]["cancelled"] and 0.0 < facts["figures"]["done"] < 1.0
    assert "the window was closed" in facts["log"]
    assert facts["again"]
