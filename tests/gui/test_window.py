# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension in a real window, driven by a mouse and keys that an X server makes.

ADAPTIVE_DRT_PICTURES=folder keeps the screenshots.
"""

from __future__ import annotations

import re
import statistics

import pytest

pytestmark = pytest.mark.slow
SHOTS = ("running", "finished", "engine", "compositor", "failed")

AT_ONCE = 1.5
"""Times as long as the same window needs, just after ESC and with no render, to draw a 1920 x 1080
picture and to do 0.1 s of work in a thread that gives way: that is what ESC may have to wait for.
On a quiet machine of two cores it is the promised half second. Other work on the machine, and
drawing without a graphics card, slow both alike."""


@pytest.fixture(scope="module")
def facts(in_window, scene):
    return in_window("window.py", "facts", scene, {f"window-{name}": name for name in SHOTS})


def test_a_click_renders_and_the_picture_fills_in(facts):
    assert facts["running"] and re.match(r"[A-Z][a-z ]+ \d+ %", facts["text"]), facts["text"]
    assert facts["shown_while_running"] == "Adaptive Render"


def test_escape_keeps_what_is_there(facts):
    assert facts["figures"]["cancelled"] and 0.0 < facts["figures"]["done"] < 1.0
    # all pixels may have been seen once by then: `done` counts those that are finished
    assert facts["cancelled"]["size"] == [1920, 1080] and 0.0 < facts["cancelled"]["part"] <= 1.0


def test_escape_answers_at_once(facts):
    """Mostly; a single one may have come at the worst of moments."""
    for presses in (facts[f"{who}escapes"] for who in ("", "exact_", "engine_")):
        ratios = [seconds / (drawing + chunk) for seconds, drawing, chunk in presses]
        assert statistics.median(ratios) < AT_ONCE, presses


def test_the_window_stays_alive(facts):
    """It is drawn again and again, and never stands still for long."""
    filling = facts["gaps"]["filling"]
    slowest = max(drawing + chunk for _, drawing, chunk in facts["escapes"])
    assert filling["looks"] > 5 and filling["longest"] < 2.0 * AT_ONCE * slowest, facts["gaps"]


def test_a_click_renders_to_the_end(facts):
    assert facts["finished"] == {"size": [480, 320], "part": 1.0}


def test_the_engine_obeys_escape(facts):
    assert facts["engine_running"] and len(facts["engine_escapes"]) == 3


def test_the_button_is_offered_again_after_the_engine(facts):
    assert facts["after_engine"]


def test_the_x_beside_the_bar_cancels(facts):
    assert facts["button"] and facts["button"]["cancelled"]


def test_undo_takes_no_picture_away(facts):
    assert facts["undone"] == {"same": True, "shown": ["Adaptive Render"]}


def test_the_compositor_shows_the_mask(facts):
    assert facts["viewer"] == [480, 320]


def test_a_file_loaded_meanwhile_ends_the_render(facts):
    assert facts["before_load"] and facts["after_load"]


def test_undo_and_a_deleted_scene_harm_nothing(facts):
    assert facts["before_trouble"]
    assert facts["after_trouble"]["size"] == [960, 640]
