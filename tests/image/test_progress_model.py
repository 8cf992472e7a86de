# SPDX-License-Identifier: GPL-3.0-or-later
"""Predicted shares of the work: they follow from motion, tolerance and size."""

from dataclasses import replace

import pytest

from adaptive_drt.image.progress_model import LEVEL_SHARES, progress_shares
from adaptive_drt.scene.description import Motion, Sphere
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from moving_floor import moving_scene

BALL = Sphere((0.0, 0.0, 1.0), 0.8)
STILL, MOVING = (BALL,), (replace(BALL, motion=Motion((1.0, 0.0, 0.0))),)


def shares(shapes, tolerance, size=(480, 320), beside=False):
    plan = make_plan(moving_scene(shapes, size), Settings(tolerance=tolerance))
    return progress_shares(plan, beside)


def test_the_first_pass_is_less_of_the_work_where_more_follows():
    """With a smaller tolerance, in a moving scene; but not in a larger picture."""
    assert shares(STILL, 1e-2)[0] > shares(STILL, 1e-3)[0] > shares(MOVING, 1e-3)[0]
    assert shares(STILL, 1e-3)[0] < shares(STILL, 1e-3, (960, 640))[0]


def test_blocks_are_more_of_the_work_where_workers_do_the_rest_beside_them():
    (first, alone), (same, beside) = (shares(MOVING, 1e-3, beside=each) for each in (False, True))
    assert same == first < alone < beside < 1.0


def test_work_after_the_first_pass_grows_as_the_root_of_one_over_the_tolerance():
    def rest(tolerance, size=(480, 320)):
        first = shares(STILL, tolerance, size)[0]
        return (1.0 - first) / first

    assert rest(1e-4) == pytest.approx(10.0 * rest(1e-2), rel=1e-12)
    assert rest(1e-3, (960, 640)) == pytest.approx(0.5 * rest(1e-3), rel=1e-12)


def test_shares_of_levels_are_a_whole():
    assert sum(LEVEL_SHARES) == pytest.approx(1.0, abs=1e-15)
