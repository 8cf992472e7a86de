# SPDX-License-Identifier: GPL-3.0-or-later
"""What a person may do to the window while a picture is rendered, and finds afterwards."""

from __future__ import annotations

import pytest

pytestmark = pytest.mark.slow

SHARED = 6.0
"""Times as long as a save takes that packs nothing while nothing is rendered: two threads or
processes render on two processors, and the window is drawn by them as well."""


@pytest.fixture(scope="module")
def facts(in_window, scene):
    return in_window("left_alone.py", "left_alone", scene)


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
