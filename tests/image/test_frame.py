# SPDX-License-Identifier: GPL-3.0-or-later
"""Image buffers: places of pixels, what is entered, and what is left to refine."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from adaptive_drt.cubature.error_budget import Goal
from adaptive_drt.image.frame import (
    Frame,
    interleaved_parts,
    sampled_limits,
    widened_plan,
)
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from moving_floor import moving_scene


def frame_of(region=None, size=(40, 24)):
    plan = make_plan(moving_scene([], size), Settings())
    region = region or plan.region
    return Frame(widened_plan(plan, region), region)


@pytest.mark.parametrize("count, size", [(1, 5), (17, 5), (100, 100), (101, 100), (30, 1)])
def test_parts_are_every_so_many_pixels(count, size):
    rows = np.random.default_rng(count).permutation(1_000)[:count]
    parts = interleaved_parts(rows, size)
    assert sorted(np.concatenate(parts)) == sorted(rows)
    assert max(part.size for part in parts) <= size
    assert max(part.size for part in parts) - min(part.size for part in parts) <= 1


@pytest.mark.parametrize("region", [(0, 0, 40, 24), (3, 5, 9, 6), (8, 8, 16, 16), (37, 1, 40, 24)])
def test_regions_are_widened_to_whole_blocks_with_a_border(region):
    plan = make_plan(moving_scene([], (40, 24)), Settings())
    left, bottom, right, top = widened_plan(plan, region).region
    assert left + 3 <= region[0] and right - 3 >= region[2]
    assert bottom + 3 <= region[1] and top - 3 >= region[3]
    assert (left + 3) % 8 == 0 and (bottom + 3) % 8 == 0
    assert (right - 3) % 8 == 0 or right - 3 == 40
    frame = Frame(widened_plan(plan, region), region)
    y, x = (part.ravel() for part in np.mgrid[region[1] : region[3], region[0] : region[2]])
    index = frame.pixel_indices(x, y)
    np.testing.assert_array_equal(np.flatnonzero(frame.inner()), np.sort(index))
    np.testing.assert_array_equal(frame.region_pixels(np.ones(frame.height, dtype=bool)), index)
    np.testing.assert_allclose(frame._pixel_centers(index), [x + 0.5, y + 0.5, 0.0 * x])


def test_what_is_chosen_is_unknown_or_beyond_the_goal_and_neither_settled_nor_held():
    frame, rng = frame_of((8, 8, 24, 16)), np.random.default_rng(4)
    n = frame.item.size
    frame.error[:], frame.outline = rng.random(n), rng.random(n) < 0.3
    frame.regions_shaded[:] = rng.random(n) < 0.5
    settled, held = rng.permutation(n)[:40], rng.permutation(n)[:40]
    frame.settle(settled, np.ones((3, 40)), np.ones(40), np.zeros(40), np.zeros(40))
    frame.mark_in_progress(held)
    found = frame.chosen(Goal(0.7, 1.0))
    for k in range(n):
        want = (frame.outline[k] and not frame.regions_shaded[k]) or frame.error[k] > 0.7
        want &= frame.inner()[k] and k not in settled and k not in held
        assert found[k] == want, k
    assert (frame.color[:, settled] == 1.0).all()


def test_refined_pixels_are_entered_and_their_points_counted():
    frame, rows = frame_of(), np.array([50, 7])
    done = SimpleNamespace(
        color=np.arange(6.0).reshape(3, 2), alpha=np.array([0.5, 1.0]), error=np.array([0.1, 0.2]),
        samples=np.array([9, 4]), sampling=np.zeros(2),
    )  # fmt: skip
    frame.enter_refined(rows, done)
    np.testing.assert_array_equal(frame.color[:, rows], done.color)
    assert frame.alpha[7] == 1.0 and frame.error[50] == 0.1


def test_estimates_are_root_mean_squares_over_the_mean():
    frame = frame_of((8, 8, 24, 16))
    inner = np.flatnonzero(frame.inner())
    rng = np.random.default_rng(1)
    frame.color[:], frame.error[:] = 1e9, 1e9  # the border does not count
    frame.color[:, inner] = rng.random((3, inner.size))
    frame.error[inner] = rng.random(inner.size)
    want = np.sqrt((frame.error[inner] ** 2).mean()) / frame.color[:, inner].mean()
    assert frame.estimate_error() == pytest.approx(want, rel=1e-12)


def test_tasks_hold_whole_pixels_or_their_centres():
    frame = frame_of()
    rows = np.flatnonzero(frame.inner())[[3, 60, 100]]
    frame.mask[1, rows[1]] = True
    ((index, whole),) = frame.tasks(rows, Goal(0.1, 1.0), 10)
    ((_, points),) = frame.point_tasks(rows, Goal(0.1, 1.0), 10)
    np.testing.assert_array_equal(index, rows)
    size = whole.cells.high - whole.cells.low
    np.testing.assert_array_equal(size, [[1.0] * 3, [1.0] * 3, [0.0, 1.0, 0.0]])
    assert not (points.cells.high - points.cells.low)[:2].any()
    middle = 0.5 * (whole.cells.high + whole.cells.low)
    np.testing.assert_allclose(middle, frame._pixel_centers(rows))


def test_limits_of_sampled_pixels_grow_with_their_errors():
    error = np.array([0.0, 0.5, 1.0, 10.0, 100.0])
    for motion in (False, True):
        limits = sampled_limits(error, 1.0, motion)
        assert (np.diff(limits) >= 0.0).all() and limits[0] == limits[2] < limits[3] < 2.0
