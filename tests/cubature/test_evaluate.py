# SPDX-License-Identifier: GPL-3.0-or-later
"""Stars: their quadrature on boxes, and what their samples say of what was foreseen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.cubature.evaluate import Subdomains, estimate_means
from adaptive_drt.cubature.nodes import ROTATION_COUNT, make_nodes, rotation_index
from adaptive_drt.cubature.posteriori import (
    UNDETECTED_SHARE,
    UNPREDICTED_RATIO,
    UNPREDICTED_SHARE,
    correct_errors,
)
from adaptive_drt.cubature.safety_factor import MAX_FACTOR, update_factors
from adaptive_drt.scene.settings import Settings
from adaptive_drt.shading.variation import KINK_KIND, SMOOTH_KIND, STEP_KIND, zero_variation
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Pairs, intersect_pairs, nearest_hits
from adaptive_drt.tracing.occluder_culling import Occluders
from adaptive_drt.visibility.fragments import empty_fragments
from random_scenes import random_scene

DIAGONAL = (0, 2, 5)


def volume_above(slope, place):
    """Of the cube [0, 1] x [0, 1] x [1/2, 3/2], what a plane leaves above it."""
    rest = place - 0.5 * slope[2]
    # sums over corners, Marichal and Mossinghoff 2008
    below = sum(
        (-1.0) ** (i + j + k) * max(rest - i * slope[0] - j * slope[1] - k * slope[2], 0.0) ** 3
        for i in range(2) for j in range(2) for k in range(2)
    )  # fmt: skip
    return 1.0 - below / (6.0 * np.prod(slope))


def mean_over(arms, values, center):
    """What `stars` makes of samples' values (k,) and a centroid's."""
    mean = np.bincount(arms.region, values) / arms.count
    return (1.0 - arms.middle) * mean + arms.middle * center


def box_arms(wide, time=0.3, box=True, turn=0):
    """The star of one box of half extents 1 along some axes, about the origin."""
    half = np.array(wide, dtype=float)[:, None]
    spread = np.zeros((6, 1))
    spread[list(DIAGONAL)] = half / np.sqrt(3.0)
    place = np.array([[0.0], [0.0], [time]])
    true = np.ones(1, dtype=bool)
    return make_nodes(place, spread, half > 0.0, true, true & box, np.array([turn]))


@pytest.mark.parametrize("wide", [(0, 0, 1), (1, 0, 0), (1, 1, 0), (0, 1, 1), (1, 1, 1)])
@pytest.mark.parametrize("time", [0.0, 0.3, -0.3])
@pytest.mark.parametrize("box", [True, False])
def test_quadratics_come_out_exact(wide, time, box):
    rng = np.random.default_rng(7)
    for turn in range(20):
        arms = box_arms(wide, time, box, 13 * turn)
        a, b = rng.normal(size=(3, 3)), rng.normal(size=3)
        x = arms.offset
        values = np.einsum("ik,ij,jk->k", x, a, x) + b @ x + 1.0
        truth = 1.0 + (np.diag(a) * np.array(wide)).sum() / 3.0
        # arms end a thousandth short of sides
        assert mean_over(arms, values, 1.0)[0] == pytest.approx(truth, abs=0.01)


@pytest.mark.parametrize("wide", [(0, 0, 1), (1, 1, 0), (1, 1, 1)])
@pytest.mark.parametrize("time", [0.0, 0.3])
@pytest.mark.parametrize("box", [True, False])
def test_no_sample_lies_outside_its_box(wide, time, box):
    for turn in range(ROTATION_COUNT):
        arms = box_arms(wide, time, box, turn)
        assert (np.abs(arms.offset) < np.array(wide)[:, None] + 1e-12).all()


def test_turns_are_those_of_places_in_the_pixel_and_the_shutter():
    rng = np.random.default_rng(23)
    cells = rng.integers(0, 2**10, (3, 4_000)) / 2**10
    cells[2] -= 0.5
    found = rotation_index(cells)
    for shift in ([[3.0], [0.0], [0.0]], [[-2.0], [700.0], [0.0]]):
        np.testing.assert_array_equal(rotation_index(cells + np.array(shift)), found)
    np.testing.assert_array_equal(rotation_index(cells * np.array([[1.0], [1.0], [-1.0]])), found)
    # as even as chance: 4,000 over 256 leave 16 to each, give or take 4
    number = np.bincount(found % ROTATION_COUNT, minlength=ROTATION_COUNT)
    assert 0 < number.min() and number.max() < 40


def test_an_edge_through_many_cells_meets_stars_of_both_signs():
    """A plane through 32^3 cells of a cube: what stars are off by is as of chance, or less."""
    cells = (np.stack(np.meshgrid(*[np.arange(32)] * 3)).reshape(3, -1) + 0.5) / 32.0
    cells[2] += 0.5  # the later half of the shutter
    count = cells.shape[1]
    spread = np.zeros((6, count))
    spread[list(DIAGONAL)] = 0.5 / 32.0 / np.sqrt(3.0)
    true = np.ones(count, dtype=bool)
    ratio = []
    for turn in (rotation_index(cells), np.zeros(count, dtype=np.int64)):
        arms = make_nodes(cells, spread, np.ones((3, count)) > 0, true, true, turn)
        off = []
        for slope in ((1.0, 0.5, 0.25), (1.0, 1.0, 0.5), (0.25, 1.0, 0.5)):
            for place in np.linspace(0.9, 1.3, 9):
                lit = (np.array(slope) @ (cells[:, arms.region] + arms.offset) > place) * 1.0
                center = (np.array(slope) @ cells > place) * 1.0
                off.append(mean_over(arms, lit, center).mean() - volume_above(slope, place))
        ratio.append(np.sqrt(np.mean(np.square(off))))
    assert ratio[0] < 0.4 * ratio[1]


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
    return correct_errors(
        deviation, foreseen, off, np.zeros(4, dtype=int), np.tile(away, (3, 1)), offset
    )


def test_what_no_sample_met_counts_for_less():
    foreseen = zero_variation(1)
    foreseen[KINK_KIND, 0], foreseen[STEP_KIND, 1], foreseen[SMOOTH_KIND, 0] = 0.02, 0.08, 0.01
    same = star([0.5, 0.5, 0.5, 0.5], 0.5, foreseen)
    assert np.allclose(same[SMOOTH_KIND], 0.5 * foreseen[SMOOTH_KIND])
    assert np.allclose(same[1:], 0.5 * UNDETECTED_SHARE * foreseen[1:])
    met = star([0.5, 0.5, 0.5, 0.1], 0.5, foreseen)
    assert np.allclose(met, 0.5 * foreseen)


def test_what_was_not_foreseen_counts_along_the_axis_that_shows_it():
    foreseen = zero_variation(1)
    foreseen[STEP_KIND, 0] = 0.01
    found = star([0.5, 0.5, 0.5, 0.1], 0.5, foreseen) - 0.5 * foreseen
    assert found.sum() == pytest.approx(UNPREDICTED_SHARE * (0.1 - UNPREDICTED_RATIO * 0.01))
    assert found[STEP_KIND, 1] > 2.0 * found[STEP_KIND, 0]
    assert not found[:STEP_KIND].any()
    assert not found[STEP_KIND, 2].any()


def test_means_that_move_farther_than_foreseen_raise_a_pixels_error():
    change = np.array([[0.03, 0.001, 9.0], [0.03, 0.001, 9.0], [0.03, 0.001, 9.0]])
    factor = update_factors(np.ones(3), change, np.full(3, 0.01))
    assert np.allclose(factor, [3.0, 1.0, MAX_FACTOR])
    # and it is forgotten by halves
    assert np.allclose(update_factors(factor, np.zeros((3, 3)), np.full(3, 0.01)), [1.5, 1.0, 4.0])


def test_an_error_of_nothing_is_no_error():
    assert np.array_equal(
        update_factors(np.ones(2), np.array([[0.0, 1.0]] * 3), np.zeros(2)), [1.0, MAX_FACTOR]
    )


def test_centroids_that_are_known_are_not_shaded_again():
    """Every other part's is: stars come out the same, for a point less."""
    plan = make_plan(random_scene(5), Settings())
    width, height = plan.picture
    y, x = (each.ravel() for each in np.mgrid[0:height, 0:width])
    place = np.stack([x + 0.5, y + 0.5, np.zeros(x.size)])
    objects = np.arange(plan.object_count)
    pairs = Pairs(np.tile(np.arange(x.size), objects.size), np.repeat(objects, x.size))
    w = plan.lens.directions(place[0], place[1])
    _, item = nearest_hits(x.size, pairs, intersect_pairs(plan, w[:, pairs.pixel], pairs.item))
    place, item = place[:, item >= 0], item[item >= 0]
    m = item.size
    half = np.repeat([[0.5], [0.5], [0.0]], m, axis=1)
    spread = np.zeros((6, m))
    spread[list(DIAGONAL)] = half / np.sqrt(3.0)
    no, one = np.zeros(m, dtype=bool), np.ones(m)
    bare = Subdomains(
        place, spread, half, item, np.arange(m), no, rotation_index(place), one,
        np.ones(m, dtype=int), no, np.zeros((3, 0)), zero_variation(0),
    )  # fmt: skip
    occluders, nothing = Occluders(plan), np.zeros(0, dtype=int)

    def sampled(parts):
        return estimate_means(plan, occluders, parts, empty_fragments(), nothing)

    light = sampled(bare).light
    starred = replace(bare, star=~no, stake=np.full(m, 1e3 / light.color.mean()))
    known = np.arange(m) % 2 == 0
    kept = light.color[:, known], light.deviation[..., known]
    fresh = sampled(starred)
    again = sampled(replace(starred, known=known, color=kept[0], deviation=kept[1]))
    assert (fresh.points[known] > 1).mean() > 0.2
    np.testing.assert_array_equal(again.points, fresh.points - known)
    np.testing.assert_array_equal(again.vain, fresh.vain)
    size = {"rtol": 1e-12, "atol": 1e-12 * light.color.mean()}
    np.testing.assert_allclose(again.light.color, fresh.light.color, **size)
    np.testing.assert_allclose(again.light.deviation, fresh.light.deviation, **size)
