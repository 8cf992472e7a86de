# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes of the multi-node rules: their quadrature on boxes, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.cubature.nodes import ROTATION_COUNT, make_nodes, rotation_index

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
    mean = np.bincount(arms.subdomain, values) / arms.count
    return (1.0 - arms.centroid_weight) * mean + arms.centroid_weight * center


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
                lit = (np.array(slope) @ (cells[:, arms.subdomain] + arms.offset) > place) * 1.0
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
    mean = (1.0 - arms.centroid_weight) * ramp(arms.offset[:2]).mean(
        axis=1
    ) + arms.centroid_weight * center
    left, before = (np.sqrt(((value - truth) ** 2).mean()) for value in (mean, center))
    assert left < most * before
