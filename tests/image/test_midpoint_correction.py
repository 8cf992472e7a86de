# SPDX-License-Identifier: GPL-3.0-or-later
"""Means of still pixels by the middles around them, and what deviations are left."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.image.midpoint_correction import PixelCenters
from adaptive_drt.numerics.midpoint import FALLBACK_ERROR_FRACTION
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import PointLight, Quad, Scene
from adaptive_drt.scene.settings import Settings
from adaptive_drt.shading.variation import KINK_KIND, SMOOTH_KIND, STEP_KIND, zero_variation
from oracle.converged import relative_rmse
from oracle.kept import converged_color
from random_scenes import look_at

WIDTH, HEIGHT = 9, 8
INDEX = 4 * WIDTH + 4
Y, X = (table.ravel() - 4.0 for table in np.mgrid[:HEIGHT, :WIDTH].astype(float))


def middles(value, foreseen=1.0, shadow=False):
    """A table of pixels at x and y from one in its middle, all with the same deviation by bends."""
    deviation = zero_variation(X.size)
    deviation[SMOOTH_KIND, :2] = 0.5 * foreseen
    color = np.broadcast_to(value, (3, X.size)).copy()
    item = np.zeros(X.size, dtype=np.int64)
    return PixelCenters(WIDTH, color, item, np.full(X.size, shadow), deviation)


def kinked(place):
    """Pixels across which a slope of 1 begins at a place along x, as a terminator does."""
    table = middles(np.maximum(X - place, 0.0))
    table.deviation[:] = 0.0
    table.deviation[KINK_KIND, 0] = 1.0 / np.sqrt(320.0)
    return table


def corrected(table):
    """What is added at the middle pixel, and what it may be off by then."""
    change = table.correct(np.array([INDEX]), np.array([INDEX]))[0, 0]
    return change, table.deviation[:STEP_KIND, :2, INDEX].sum()


@pytest.mark.parametrize("shadow", [True, False])
def test_quadratics_come_out_exact_with_little_left(shadow):
    change, off = corrected(middles(3.0 * X * X - 0.5 * Y * Y + X * Y, shadow=shadow))
    assert change == pytest.approx((6.0 - 1.0) / 24.0, rel=1e-12)
    assert off < 1e-12


def test_a_kink_in_a_shadow_counts_though_it_was_not_foreseen():
    kink = 20.0 * np.abs(Y - 0.1)
    true = 20.0 * (0.5 * (0.6**2 + 0.4**2) - 0.1)
    change, off = corrected(middles(kink, foreseen=0.01, shadow=True))
    assert abs(change - true) < 0.7 * abs(true) and abs(change - true) < 3.0 * off
    # where no shadow's edge is, neighbours say nothing of what none of it reaches
    change, off = corrected(middles(kink, foreseen=0.01, shadow=False))
    assert off <= 0.01 and abs(change) <= 0.02


def test_steps_stay_as_they_are():
    table = middles(X * X, shadow=True)
    table.deviation[STEP_KIND, :2] = 0.7
    corrected(table)
    assert (table.deviation[STEP_KIND, :2, INDEX] == 0.7).all()


@pytest.mark.parametrize("away", [1, 2])
def test_other_objects_beside_it_are_left_out(away):
    table = middles(X * X, shadow=True)
    table.item[X == away] = 1
    table.color[:, X == away] = 1e3
    change, off = corrected(table)
    assert change == pytest.approx(0.0 if away == 1 else 2.0 / 24.0)
    # three in a row tell less, and none at all nothing
    assert off == pytest.approx(0.5 if away == 1 else 2.0 * FALLBACK_ERROR_FRACTION)


def test_pixels_at_the_sides_have_no_second_neighbours():
    table = middles(X * X + Y * Y, shadow=True)
    rows = np.array([WIDTH + 1, 2 * WIDTH - 2, (HEIGHT - 2) * WIDTH + 1])
    table.correct(rows, rows)
    assert (table.deviation[KINK_KIND] == 0.0).all()


@pytest.mark.parametrize(
    ("eye", "height", "most"),
    [((0.13, -1.0, 7.0), height, 0.6) for height in (0.1, 0.15, 0.2, 0.25)]
    + [((0.3, -6.0, 3.0), 0.35, 0.45)],
)
def test_a_light_a_pixel_away(eye, height, most):
    """Beside its peak light bends little and is yet far from its mean, which neighbours see (first
    four: 1.27 tolerances off without), and stars leave more of it than of what bends (last: 0.65).
    """
    camera = look_at(eye, (0.07, 0.11, 0.0), resolution=(28, 28))
    floor = Quad((-8.0, -8.0, 0.0), (16.0, 0.0, 0.0), (0.0, 16.0, 0.0))
    scene = Scene(camera, (floor,), (PointLight((0.05, 0.02, height), (1.0, 1.0, 1.0)),))
    truth = converged_color(scene, None, 1e-3)
    y, x = np.divmod(np.arange(28 * 28), 28)
    film = render_image(scene, Settings(tolerance=1e-2, threads=1))
    assert relative_rmse(film.color[:, y, x].T, truth) < most * 1e-2


def test_what_is_left_of_kinks_is_foreseen():
    """A parabola through three centres does not follow a kink between them, as a terminator is."""
    places = np.linspace(-0.5, 0.5, 101)
    found = np.array([corrected(kinked(place)) for place in places])
    off = 0.5 * (0.5 - places) ** 2 - np.maximum(-places, 0.0) - found[:, 0]
    assert np.sqrt((off**2).mean()) == pytest.approx(0.0331, abs=1e-3)
    assert 0.9 <= np.sqrt((found[:, 1] ** 2).mean() / (off**2).mean()) <= 1.5
