# SPDX-License-Identifier: GPL-3.0-or-later
"""What a progress bar is told: it moves in every stage, never goes back, and ends whole."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))

from bench_scenes import bench_scene

from adaptive_drt.course import course
from adaptive_drt.plan import make_plan
from adaptive_drt.render import render
from adaptive_drt.settings import Settings

STEPS = 8
"""Different places, at least, that the bar stands at."""


def _places(name, **settings):
    scene = bench_scene(name, 200, 150)
    told = list(render(scene, Settings(batch=1_024, threads=1, **settings)))
    return np.array([progress.done / progress.total for progress in told])


@pytest.mark.parametrize("name", ["contact shadows", "moving sphere"])
@pytest.mark.parametrize("method", ["EXACT", "RAYS"])
def test_the_bar_moves(name, method):
    places = _places(name, method=method, tolerance=0.01, time_rays=8)
    assert (np.diff(places) >= 0.0).all() and 0.0 <= places[0] and places[-1] == 1.0
    assert np.unique(places).size >= STEPS


def test_the_survey_is_less_of_the_bar_where_more_follows():
    """With a smaller tolerance, in a moving scene; but not in a larger picture."""

    def surveyed(name, tolerance, size=(480, 320)):
        plan = make_plan(bench_scene(name, *size), Settings(tolerance=tolerance))
        return course(plan)[0]

    assert surveyed("quad light", 1e-2) > surveyed("quad light", 1e-3)
    assert surveyed("quad light", 1e-3) > surveyed("moving sphere", 1e-3)
    assert surveyed("quad light", 1e-3) < surveyed("quad light", 1e-3, (960, 640))


def test_blocks_are_more_of_the_bar_where_workers_do_the_rest_beside_them():
    plan = make_plan(bench_scene("moving sphere", 480, 320), Settings())
    (surveyed, alone), (same, beside) = course(plan), course(plan, True)
    assert same == surveyed < alone < beside < 1.0
