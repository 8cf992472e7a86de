# SPDX-License-Identifier: GPL-3.0-or-later
"""Stars: their quadrature on boxes, and what their samples say of what was foreseen."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.arms import make_arms
from adaptive_drt.strain import MOST, learn
from adaptive_drt.surprise import LEFT, SURPRISE, UNMET, weigh
from adaptive_drt.variation import BENDS, KINKS, STEPS, no_variation

DIAGONAL = (0, 2, 5)


def mean_over(arms, values, center):
    """What `stars` makes of samples' values (k,) and a centroid's."""
    mean = np.bincount(arms.region, values) / arms.count
    return (1.0 - arms.middle) * mean + arms.middle * center


def box_arms(wide, time=0.3, box=True):
    """The star of one box of half extents 1 along some axes, about the origin."""
    half = np.array(wide, dtype=float)[:, None]
    spread = np.zeros((6, 1))
    spread[list(DIAGONAL)] = half / np.sqrt(3.0)
    place = np.array([[0.0], [0.0], [time]])
    true = np.ones(1, dtype=bool)
    return make_arms(place, spread, half > 0.0, true, true & box)


@pytest.mark.parametrize("wide", [(0, 0, 1), (1, 0, 0), (1, 1, 0), (0, 1, 1), (1, 1, 1)])
@pytest.mark.parametrize("time", [0.0, 0.3, -0.3])
@pytest.mark.parametrize("box", [True, False])
def test_quadratics_come_out_exact(wide, time, box):
    arms = box_arms(wide, time, box)
    rng = np.random.default_rng(7)
    for _ in range(20):
        a, b = rng.normal(size=(3, 3)), rng.normal(size=3)
        x = arms.offset
        values = np.einsum("ik,ij,jk->k", x, a, x) + b @ x + 1.0
        truth = 1.0 + (np.diag(a) * np.array(wide)).sum() / 3.0
        # arms end a thousandth short of sides
        assert mean_over(arms, values, 1.0)[0] == pytest.approx(truth, abs=0.01)


@pytest.mark.parametrize("wide", [(0, 0, 1), (1, 1, 0), (1, 1, 1)])
@pytest.mark.parametrize("time", [0.0, 0.3])
def test_no_sample_lies_outside_its_box(wide, time):
    arms = box_arms(wide, time)
    assert (np.abs(arms.offset) < np.array(wide)[:, None] + 1e-12).all()


@pytest.mark.parametrize(("power", "wide", "most"), [(1, 1, 0.1), (0, 1, 0.36), (1, 2, 0.16)])
def test_kinks_and_steps_at_random_places_leave_what_is_said(power, wide, most):
    """Of what the centroid's sample leaves, RMS; in an interval and in a square."""
    arms = box_arms((1, 1, 0) if wide == 2 else (0, 1, 0))
    rng = np.random.default_rng(11)
    angle = rng.uniform(0.0, 2.0 * np.pi, 20_000) if wide == 2 else np.full(20_000, np.pi / 2)
    normal = np.stack([np.cos(angle), np.sin(angle)])
    place = rng.uniform(-1.0, 1.0, 20_000) * np.abs(normal).sum(axis=0)
    grid = np.linspace(-1.0, 1.0, 101)[:-1] + 0.01
    points = np.stack(np.meshgrid(grid if wide == 2 else [0.0], grid)).reshape(2, -1)

    def ramp(at):
        height = normal.T @ at - place[:, None]
        return np.where(height > 0.0, height**power, 0.0)

    truth = (
        np.concatenate(
            [ramp(part).sum(1, keepdims=True) for part in np.array_split(points, 50, axis=1)],
            axis=1,
        ).sum(1)
        / points.shape[1]
    )
    center = ramp(np.zeros((2, 1)))[:, 0]
    mean = (1.0 - arms.middle) * ramp(arms.offset[:2]).mean(axis=1) + arms.middle * center
    left, before = (np.sqrt(((value - truth) ** 2).mean()) for value in (mean, center))
    assert left < most * before


def star(colors, center, foreseen):
    """Deviations of one star along x and y, of samples' grey values, and what is made of them."""
    away = np.array(colors) - np.mean(colors)
    offset = np.array([[0.8, -0.8, 0.0, 0.0], [0.0, 0.0, 0.8, -0.8], [0.0] * 4])
    deviation = 0.5 * foreseen
    off = np.full((3, 1), center - np.mean(colors))
    return weigh(deviation, foreseen, off, np.zeros(4, dtype=int), np.tile(away, (3, 1)), offset)


def test_what_no_sample_met_counts_for_less():
    foreseen = no_variation(1)
    foreseen[KINKS, 0], foreseen[STEPS, 1], foreseen[BENDS, 0] = 0.02, 0.08, 0.01
    same = star([0.5, 0.5, 0.5, 0.5], 0.5, foreseen)
    assert np.allclose(same[BENDS], 0.5 * foreseen[BENDS])
    assert np.allclose(same[1:], 0.5 * UNMET * foreseen[1:])
    met = star([0.5, 0.5, 0.5, 0.1], 0.5, foreseen)
    assert np.allclose(met, 0.5 * foreseen)


def test_what_was_not_foreseen_counts_along_the_axis_that_shows_it():
    foreseen = no_variation(1)
    foreseen[STEPS, 0] = 0.01
    found = star([0.5, 0.5, 0.5, 0.1], 0.5, foreseen) - 0.5 * foreseen
    assert found.sum() == pytest.approx(LEFT * (0.1 - SURPRISE * 0.01))
    assert found[STEPS, 1] > 2.0 * found[STEPS, 0]
    assert not found[:STEPS].any()
    assert not found[STEPS, 2].any()


def test_means_that_move_farther_than_foreseen_raise_a_pixels_error():
    change = np.array([[0.03, 0.001, 9.0], [0.03, 0.001, 9.0], [0.03, 0.001, 9.0]])
    factor = learn(np.ones(3), change, np.full(3, 0.01))
    assert np.allclose(factor, [3.0, 1.0, MOST])
    # and it is forgotten by halves
    assert np.allclose(learn(factor, np.zeros((3, 3)), np.full(3, 0.01)), [1.5, 1.0, 4.0])


def test_an_error_of_nothing_is_no_error():
    assert np.array_equal(learn(np.ones(2), np.array([[0.0, 1.0]] * 3), np.zeros(2)), [1.0, MOST])
