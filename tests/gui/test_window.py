# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension in a real window, driven by a mouse and keys that an X server makes.

ADAPTIVE_DRT_PICTURES=folder keeps the screenshots.
"""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow
SHOTS = ("running", "finished", "engine", "compositor", "failed")

PART = 0.1
"""Of the time that the whole picture would take: less than this is at once, on a machine that may
be busy and draws without a graphics card. The promise is half a second."""


@pytest.fixture(scope="module")
def facts(installed, scene, copied):
    if os.environ.get("ADAPTIVE_DRT_BLENDER"):
        pytest.skip("the window is tested in the Blender that `make blender` makes")
    folder = installed.folder
    script = copied("window.py")
    told = installed.run(copied("window.sh"), scene, script, folder, command="sh")
    kept = os.environ.get("ADAPTIVE_DRT_PICTURES")
    for name in SHOTS if kept else ():
        if (folder / f"{name}.png").exists():
            Path(kept).mkdir(parents=True, exist_ok=True)
            shutil.copy(folder / f"{name}.png", Path(kept) / f"window-{name}.png")
    assert told.returncode == 0, told.stdout[-3000:] + told.stderr[-3000:]
    assert "Traceback" not in told.stderr, told.stderr
    found = json.loads((folder / "facts.json").read_text())
    print(json.dumps(found, indent=2))
    return found


def test_a_click_renders_and_the_picture_fills_in(facts):
    assert facts["running"] and facts["text"].startswith("Rendering")
    assert facts["shown_while_running"] == "Adaptive Render"


def test_escape_keeps_what_is_there(facts):
    assert facts["figures"]["cancelled"] and 0.0 < facts["figures"]["done"] < 1.0
    assert facts["cancelled"]["size"] == [1920, 1080] and 0.0 < facts["cancelled"]["part"] < 1.0
    assert facts["escape_seconds"] < PART * facts["expected_seconds"]


def test_the_window_stays_alive(facts):
    filling = facts["gaps"]["filling"]
    assert filling["looks"] > 5 and filling["longest"] < PART * facts["expected_seconds"]


def test_a_click_renders_to_the_end(facts):
    assert facts["finished"] == {"size": [480, 320], "part": 1.0}


def test_the_engine_obeys_escape(facts):
    assert facts["engine_running"]
    assert facts["engine_escape_seconds"] < PART * facts["expected_seconds"]


def test_the_compositor_shows_the_mask(facts):
    assert facts["viewer"] == [480, 320]


def test_a_file_loaded_meanwhile_ends_the_render(facts):
    assert facts["before_load"] and facts["after_load"]


def test_undo_and_a_deleted_scene_harm_nothing(facts):
    assert facts["before_trouble"]
    assert facts["after_trouble"]["size"] == [960, 640]
