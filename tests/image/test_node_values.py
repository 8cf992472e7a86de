# SPDX-License-Identifier: GPL-3.0-or-later
"""Values at pixel centres: what is known, what is entered, and how large differences are."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from adaptive_drt.cubature.error_budget import Goal
from adaptive_drt.image.frame import Frame, widened_plan
from adaptive_drt.image.node_values import NodeValues
from adaptive_drt.scene.settings import Settings
from adaptive_drt.shading.variation import KINK_KIND, ROOT_KIND, SMOOTH_KIND, STEP_KIND
from adaptive_drt.tracing.compile import make_plan
from moving_floor import moving_scene, points_of


@pytest.fixture
def frame():
    plan = make_plan(moving_scene([], (24, 16)), Settings())
    made = Frame(widened_plan(plan, plan.region), plan.region)
    rng = np.random.default_rng(2)
    n = made.item.size
    made.mask[1], made.outline, made.settled = rng.random((3, n)) < 0.5
    made.color[:], made.alpha[:] = rng.random((3, n)), rng.random(n)
    made.traced[:] = rng.random(n) < 0.8
    made.variation.enter(made.traced.nonzero()[0], rng.random((4, 3, made.traced.sum())))
    made.error[:] = rng.random(n)
    return made


def test_values_are_known_where_nothing_moves_or_all_is_settled(frame):
    values = NodeValues(frame, Goal(0.5, 1.0))
    for k in range(frame.item.size):
        moving = frame.mask[1, k]
        assert values.known[k] == (frame.settled[k] or not (moving or frame.outline[k]))
        if values.wanted[k]:
            assert moving and not frame.settled[k] and frame.inner()[k]
            assert frame.outline[k] or frame.error[k] > 0.5
    np.testing.assert_array_equal(values.value[:3], frame.color)
    np.testing.assert_array_equal(values.value[3], frame.alpha)


@pytest.mark.parametrize("spacing", [1, 2, 4])
def test_predicted_deviations_grow_with_the_spacing_by_their_kinds(frame, spacing):
    found = NodeValues(frame, Goal(0.5, 1.0)).predicted_deviation(spacing)
    every = frame.variation.of(np.arange(frame.item.size))
    across = every[:, 0] + every[:, 1]
    want = (
        spacing**1.5 * across[ROOT_KIND] + spacing * across[KINK_KIND] + across[STEP_KIND]
    ) * frame.traced
    np.testing.assert_allclose(found, want, rtol=1e-14)
    assert (across[SMOOTH_KIND][frame.traced] > 0.0).any()  # which does not count


def test_what_is_asked_for_is_what_is_not_known(frame):
    values = NodeValues(frame, Goal(0.5, 1.0))
    rows = np.array([[5, 9, 5], [40, 41, 9]])
    want = sorted({k for k in [*rows.ravel().tolist(), 7] if not values.known[k]})
    assert values.unknown(rows, np.array([7])).tolist() == want


def test_what_is_entered_is_known_and_counted():
    values = points_of(lambda x, y: 0.0 * x)
    values.known[:] = False
    rows = np.array([3, 11, 200])
    rng = np.random.default_rng(1)
    done = SimpleNamespace(
        color=rng.random((3, 3)), alpha=rng.random(3), error=rng.random(3),
        samples=np.array([1, 5, 9]), sampling=np.zeros(3),
    )  # fmt: skip
    values.enter(rows, done)
    np.testing.assert_array_equal(values.values(rows), [*done.color, done.alpha])
    np.testing.assert_array_equal(values.error[rows], done.error)
    assert values.known.sum() == 3


def test_means_that_are_settled_are_no_less_than_nothing():
    values = points_of(lambda x, y: 0.0 * x)
    rows = np.array([100, 200])
    values.settle(
        rows, np.array([[-1.0, 2.0], [0.5, 3.0], [0.0, 4.0], [1.5, -0.5]]), np.ones(2), np.zeros(2)
    )
    frame = values.frame
    np.testing.assert_array_equal(frame.color[:, rows], [[0.0, 2.0], [0.5, 3.0], [0.0, 4.0]])
    assert frame.alpha[rows].tolist() == [1.0, 0.0] and frame.settled[rows].all()
    assert not values.wanted[rows].any()


def test_sizes_are_root_mean_squares_over_channels():
    values = points_of(lambda x, y: 0.0 * x)
    change = np.random.default_rng(4).normal(size=(4, 6))
    want = [np.sqrt((change[:3, k] ** 2).mean()) for k in range(6)]
    np.testing.assert_allclose(values.size(change), want, rtol=1e-14)
