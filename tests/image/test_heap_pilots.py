# SPDX-License-Identifier: GPL-3.0-or-later
"""Pilot pixels are few, and the same whatever part of the picture is rendered."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.cubature.error_budget import Goal
from adaptive_drt.cubature.heap_limits import LEAST_PILOT_STEP, PILOT_PIXELS
from adaptive_drt.geometry.embree_solids import native_library
from adaptive_drt.image.frame import Frame, widened_plan
from adaptive_drt.image.heap_pilots import closed_pilots, corrected_pilots, sampled_pilots
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from sphere_heaps import sphere_heap

pytestmark = pytest.mark.skipif(native_library() is None, reason="embree's library is not found")

GOAL = Goal(0.01, 1.0)


def heap_frame(sampled, size=(64, 48)):
    """A frame of pixels with an error of 1, all sampled or all in closed form."""
    plan = make_plan(sphere_heap(0, 120, size=size), Settings(tolerance=0.01))
    frame = Frame(widened_plan(plan, plan.region), plan.region)
    frame.traced[:] = True
    frame.error[:] = 1.0
    frame.sampled[:] = sampled
    return frame, np.ones(frame.height, dtype=bool)


@pytest.mark.parametrize("pilots, sampled", [(sampled_pilots, True), (closed_pilots, False)])
def test_pilots_are_few_of_those_above_the_goal(pilots, sampled):
    frame, rows = heap_frame(sampled)
    found = pilots(frame, rows, GOAL)
    assert 0 < found.size <= min(PILOT_PIXELS, 64 * 48 // LEAST_PILOT_STEP + 1)
    assert frame.inner()[found].all() and (np.diff(found) > 0).all()
    frame.error[found] = 0.0
    assert not np.isin(found, pilots(frame, rows, GOAL)).any()
    other, _ = heap_frame(not sampled)
    assert not pilots(other, rows, GOAL).size


def test_no_pilots_are_done_that_are_too_few_to_tell():
    for size, counts in (((30, 30), (0, 0)), ((40, 24), (0, 48)), ((50, 24), (60, 60))):
        for pilots, sampled, count in zip(
            (sampled_pilots, closed_pilots), (True, False), counts, strict=True
        ):
            assert pilots(*heap_frame(sampled, size), GOAL).size == count, (size, sampled)


def test_pilots_in_closed_form_have_their_corrected_means():
    frame, _ = heap_frame(False)
    frame.color[:] = 0.5
    frame.corrected, frame.change = np.array([900, 950]), np.array([[0.1, -0.7]] * 3)
    found = corrected_pilots(frame, np.array([900, 920, 950]))
    np.testing.assert_allclose(found.color, [[0.6, 0.5, 0.0]] * 3)
    assert found.mean_square == 1.0
