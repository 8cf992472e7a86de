# SPDX-License-Identifier: GPL-3.0-or-later
"""The law of the errors of pixels in heaps: what is expected, and what pilot pixels correct."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from adaptive_drt.cubature.error_budget import make_goal
from adaptive_drt.cubature.heap_limits import (
    LEAST_CLOSED,
    LEAST_PILOTS,
    NET_SPREAD,
    PILOT_RANGE,
    Pilots,
    SamplingErrors,
    SamplingLaw,
    first_limit,
)


def errors_of(error, law=None, interpolated=False):
    yes = np.ones(error.size, dtype=bool)
    rays = np.full(error.size, 32)
    return SamplingErrors(yes, error, rays, yes & interpolated, law or SamplingLaw())


def pilots(rng, count, stated, true):
    """Pilots with a stated error, and a reference that is as good as exact."""
    color = rng.normal(0.5, true, (3, count))
    exact = Pilots(np.full((3, count), 0.5), np.full(count, 1e-3 * stated))
    return Pilots(color, np.full(count, stated)), exact


def test_expected_errors_grow_with_the_goal_and_with_first_errors():
    error = np.geomspace(1e-4, 10.0, 30)
    levels = [errors_of(error).expected(goal) for goal in (0.01, 0.1, 1.0)]
    for low, high in pairwise(levels):
        assert (low <= high).all()
    assert (np.diff(levels[1]) >= 0.0).all()
    small = error <= first_limit(0.1)
    assert np.array_equal(levels[1][small], error[small])


def test_interpolated_pixels_are_expected_to_end_lower():
    error = np.geomspace(0.5, 10.0, 9)
    assert (
        errors_of(error, interpolated=True).budgeted(0.1) < errors_of(error).budgeted(0.1)
    ).all()


def test_the_goal_leaves_what_is_expected_of_sampled_pixels_within_the_tolerance():
    rng = np.random.default_rng(1)
    error, none = rng.uniform(0.1, 1.0, 500), np.zeros(500, dtype=bool)
    law = errors_of(error)
    goal = make_goal(0.01, np.ones((3, 500)), error, error, none, by_rays=law).error
    end = np.sqrt((law.expected(goal) ** 2).mean())
    assert 0.8 * 0.01 < end < 0.01
    lower = errors_of(error, SamplingLaw(end=0.5))
    assert make_goal(0.01, np.ones((3, 500)), error, error, none, by_rays=lower).error > goal


@pytest.mark.parametrize("true", [0.5, 0.8, 1.1])
def test_pilots_tell_how_far_the_spread_is_to_be_believed(true):
    rng = np.random.default_rng(2)
    found, exact = pilots(rng, 4_000, 0.01, 0.01 * true)
    law = SamplingLaw().corrected(np.full(4_000, 0.02), found, exact)
    assert law.spread == pytest.approx(true * NET_SPREAD, rel=0.04)
    assert law.end == pytest.approx(0.5, rel=1e-9)


def test_the_end_counts_what_no_ray_may_have_met():
    rng = np.random.default_rng(4)
    found, exact = pilots(rng, 1_000, 0.01, 0.01)
    found = replace(found, whole=np.full(1_000, 0.02))
    law = SamplingLaw().corrected(np.full(1_000, 0.02), found, exact)
    assert law.end == pytest.approx(1.0, rel=1e-9) and law.spread == pytest.approx(
        NET_SPREAD, rel=0.04
    )
    assert found.end_as(np.full(1_000, 0.021)) and not found.end_as(np.full(1_000, 0.03))


def test_few_pilots_and_wild_ones_are_not_believed():
    rng = np.random.default_rng(3)
    found, exact = pilots(rng, LEAST_PILOTS - 1, 0.01, 0.01)
    assert SamplingLaw().corrected(found.error, found, exact) == SamplingLaw()
    wild, exact = pilots(rng, 1_000, 0.01, 1.0)
    assert SamplingLaw().corrected(wild.error, wild, exact).spread < PILOT_RANGE[1] * NET_SPREAD
    few, exact = pilots(rng, LEAST_CLOSED - 1, 0.01, 1e-4)
    assert SamplingLaw().with_closed([few], exact) == SamplingLaw()


def test_pilots_in_closed_form_lower_what_is_foreseen_but_never_raise_it():
    rng = np.random.default_rng(4)
    found, exact = pilots(rng, 2_000, 0.01, 0.002)
    assert SamplingLaw().with_closed([found], exact).closed == pytest.approx(0.3, rel=0.05)
    bad, exact = pilots(rng, 2_000, 0.01, 0.05)
    assert SamplingLaw().with_closed([found, bad], exact).closed == 1.0
