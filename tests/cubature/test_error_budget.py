# SPDX-License-Identifier: GPL-3.0-or-later
"""The goal of a picture: the greatest for which the whole keeps its tolerance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.cubature.error_budget import (
    ACHIEVED_ERROR,
    ACHIEVED_RISE,
    BUDGETED_SHARE,
    GOAL_GROWTH,
    GOAL_RATIO,
    MAX_ACHIEVED_ERROR,
    MIN_ACHIEVED_ERROR,
    MOTION_ERROR_SHARE,
    STILL_ACHIEVED_ERROR,
    MotionErrors,
    make_goal,
)
from adaptive_drt.exact import MAX_GOAL_RAISE
from adaptive_drt.image.frame import Frame
from adaptive_drt.render import render_image
from adaptive_drt.scene.settings import Settings
from random_scenes import random_scene


def picture(seed, spread):
    """Colours (3, n), errors (n,) and cut pixels (n,) of no picture in particular."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(200, 3_000))
    color = rng.uniform(0.0, 2.0, (3, n))
    error = 1e-4 * np.exp(spread * rng.normal(size=n))
    return color, error, np.zeros(n, dtype=np.bool_)


def left(error, goal, moves):
    """What pixels are off by in the end, if stars leave a fifth of what moves not."""
    power = GOAL_GROWTH / (1.0 + GOAL_GROWTH)
    still = STILL_ACHIEVED_ERROR * goal * (0.2 * error / goal) ** power
    cells = np.maximum(MOTION_ERROR_SHARE * error / goal, 1.0) ** (power / GOAL_GROWTH)
    reached = ACHIEVED_ERROR + ACHIEVED_RISE * np.log2(cells)
    reached = np.clip(reached, MIN_ACHIEVED_ERROR, MAX_ACHIEVED_ERROR)
    moving = reached * goal * cells**GOAL_GROWTH
    return np.where(error > goal, np.where(moves, moving, still), error)


def motion(moves, hard, steps=0.0, standing=0.0, crowded=False):
    """What is known of pixels in which something moves."""
    nothing = np.zeros(hard.size)
    crowd = np.full(hard.size, crowded)
    return MotionErrors(crowd, moves, hard, nothing + standing, nothing + steps)


@pytest.mark.parametrize("spread", [0.5, 2.0, 4.0])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-4])
def test_the_whole_keeps_its_tolerance_and_the_next_goal_would_not(spread, tolerance):
    for seed in range(20):
        color, error, cut = picture(seed, spread)
        moves = np.arange(error.size) % 3 < seed % 4
        target = BUDGETED_SHARE * tolerance * color.mean()
        some = motion(moves, error) if moves.any() else None
        goal = make_goal(tolerance, color, error, 0.2 * error, cut, motion=some).error
        over = [
            np.sqrt((left(error, g, moves) ** 2).mean()) / target for g in (goal, GOAL_RATIO * goal)
        ]
        assert over[0] <= 1.0 + 1e-12 or goal < 0.02 * tolerance * color.mean(), f"seed {seed}"
        assert over[1] > 1.0 or goal > 500.0 * tolerance * color.mean(), f"seed {seed}"


def test_pixels_that_outlines_cut_ask_for_a_goal_of_their_own():
    color, error, cut = picture(1, 0.5)
    easy = make_goal(1e-2, color, error, error, cut).error
    cut[::3] = True
    assert make_goal(1e-2, color, error, error, cut).error < 0.1 * easy


def test_cut_pixels_that_many_objects_meet_in_ask_for_less():
    """Their errors are greater than those of pixels that one outline cuts."""
    color, error, cut = picture(4, 0.5)
    cut[::3] = True
    few, many = (
        make_goal(1e-2, color, error, error, cut, motion=motion(cut, error, crowded=crowded)).error
        for crowded in (False, True)
    )
    assert 0.5 * few < many < 0.9 * few


def test_only_steps_that_stand_are_left_to_cells():
    color, error, cut = picture(2, 2.0)

    def goal(*known):
        return make_goal(1e-3, color, error, error, cut, motion=motion(~cut, *known)).error

    fast = goal(0.1 * error, 0.9 * error, 0.0)
    assert fast == goal(0.1 * error)
    # shadows of points of light are steps in any case
    assert goal(0.1 * error, 0.9 * error, np.inf) == goal(error)
    # pixels above the goal have steps above it
    assert goal(0.1 * error, 0.9 * error, error) == goal(error) < fast


def test_what_stars_settle_lets_the_goal_rise():
    color, error, cut = picture(3, 2.0)
    hard, easy = (make_goal(1e-3, color, error, part * error, cut).error for part in (0.5, 0.005))
    # half of `STILL_ACHIEVED_ERROR` gives 1.04, and twice as much 1.75
    assert 1.1 * hard < easy < 1.25 * hard


def test_darkness_asks_for_nothing_and_no_pixels_either():
    nothing = np.zeros(5)
    assert make_goal(1e-3, np.zeros((3, 5)), nothing, nothing, nothing > 0.0).error == np.inf
    assert make_goal(1e-3, np.zeros((3, 0)), *np.zeros((2, 0)), np.zeros(0, bool)).error == np.inf


def rendered(monkeypatch, second):
    """The goals that a still picture asks for when it is said to need `second` after outlines."""
    asked, rows, final, kept = [], [], [], (Frame.goal, Frame.chosen)

    def goal(frame, inside, *found):
        rows.append(inside[frame.region_slices[0]])
        asked.append(kept[0](frame, inside, *found))
        return asked[-1] if len(asked) == 1 else replace(asked[-1], error=second(asked[0].error))

    def chosen(frame, goal):
        final.append(goal.error)
        return kept[1](frame, goal)

    monkeypatch.setattr(Frame, "goal", goal)
    monkeypatch.setattr(Frame, "chosen", chosen)
    render_image(random_scene(220), Settings(tolerance=1e-3, threads=1))
    return asked[0].error, final[0], rows


def test_outlines_raise_the_goal_by_no_more_than_rows_can_tell(monkeypatch):
    """Rows without a picture's hard pixels asked for nothing: it was 1.9 times off."""
    first, final, _ = rendered(monkeypatch, lambda _: 1e9)
    assert final == MAX_GOAL_RAISE * first


def test_outlines_may_lower_the_goal(monkeypatch):
    first, final, _ = rendered(monkeypatch, lambda error: 0.5 * error)
    assert final == 0.5 * first


def test_all_rows_of_small_pictures_count(monkeypatch):
    *_, rows = rendered(monkeypatch, lambda error: error)
    assert len(rows) == 2
    assert all(inside.all() for inside in rows)
