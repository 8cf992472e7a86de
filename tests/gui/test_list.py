# SPDX-License-Identifier: GPL-3.0-or-later
"""The report of a render in a real window: shown at once, clicked on, and opened.

ADAPTIVE_DRT_PICTURES=folder keeps the screenshots.
"""

from __future__ import annotations

import pytest

pytestmark = pytest.mark.slow
SHOTS = "notes missing selected material data render report".split()


@pytest.fixture(scope="module")
def facts(in_window, scene):
    return in_window("list_window.py", "list", scene, {f"list-{n}": f"list-{n}" for n in SHOTS})


def test_the_figures_of_f12_are_shown_without_a_touch(facts):
    assert facts["shown"]


def test_the_button_is_offered_again_after_f12_was_cancelled(facts):
    assert facts["offered_again"]


def test_notes_are_not_red_and_missing_objects_are(facts):
    assert facts["red_without_missing"] == [] and len(facts["red"]) > 5


def test_a_click_selects_the_objects(facts):
    assert facts["selected"] == ["Far 0", "Far 1", "Far 2"]


def test_the_text_names_each(facts):
    assert "3 objects missing" in facts["text"]
    assert all(f'"Far {number}"' in facts["text"] for number in range(3))


def test_the_report_opens_in_a_window_of_its_own(facts):
    assert facts["windows"][1:] == [["TEXT_EDITOR"]]
    assert facts["editor"] == ["Adaptive Render Report"]
