# SPDX-License-Identifier: GPL-3.0-or-later
"""Clear squares of pixels: shaded at a few points, to the same picture and the same mask."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.image import block_interpolation as clear
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import (
    Motion,
    Quad,
    QuadLight,
    Scene,
    SkyLight,
    Sphere,
    SphereLight,
)
from adaptive_drt.scene.settings import Settings
from oracle.converged import relative_rmse
from oracle.kept import converged_color
from random_scenes import look_at, random_scene

pytestmark = pytest.mark.filterwarnings("error")

NEVER = -1.0
"""Of the tolerance: what a square may be off by, so that none is taken."""
TOLERANCE = 1e-2
SHARE = 0.2
"""Of the tolerance: what squares may change in a picture."""


def with_and_without(scene, monkeypatch, **settings):
    chosen = Settings(**{"tolerance": TOLERANCE, "threads": 1, **settings})
    film = render_image(scene, chosen)
    monkeypatch.setattr(clear, "ALLOWED_ERROR", NEVER)
    return film, render_image(scene, chosen)


def assert_alike(film, alone):
    np.testing.assert_array_equal(film.mask, alone.mask)
    # pixels may be cut into other cells, whose shares add up but for rounding
    for name in ("alpha", "depth", "normal"):
        np.testing.assert_allclose(getattr(film, name), getattr(alone, name), 1e-12, 1e-12, name)
    off = np.sqrt(((film.color - alone.color) ** 2).mean())
    assert off <= SHARE * TOLERANCE * np.abs(alone.color).mean()


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("seed", range(30, 38))
def test_random_scenes_come_out_alike(seed, order, monkeypatch):
    assert_alike(*with_and_without(random_scene(seed), monkeypatch, order=order))


@pytest.mark.slow
def test_floors_behind_many_spheres_under_a_sky(monkeypatch):
    """Blocks are interpolated though a part of the sky is hidden, and are marked as penumbrae."""
    rng = np.random.default_rng(9)
    place = rng.uniform((-1.0, -1.0, 0.3), (1.0, 1.0, 2.0), (70, 3))
    balls = [Sphere(tuple(each), 0.25) for each in place.tolist()]
    scene = Scene(EYE, (*balls, FLOOR), (SkyLight((1.0, 1.0, 1.0)),))
    film, alone = with_and_without(scene, monkeypatch)
    assert_alike(film, alone)
    assert film.mask[0].mean() > 0.5
    assert film.stats["rays"]["shaded"] < alone.stats["rays"]["shaded"] - 1_000


FLOOR = Quad((-9.0, -9.0, 0.0), (18.0, 0.0, 0.0), (0.0, 18.0, 0.0))
LAMP = QuadLight((-1.0, -1.0, 4.0), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (9.0, 8.0, 7.0))
EYE = look_at((0.0, -7.0, 3.0), (0.0, 0.0, 0.5), resolution=(96, 72))


@pytest.mark.parametrize(
    "shapes, lights",
    [
        ([Sphere((0.1, 0.2, 0.01), 0.01), FLOOR], [LAMP]),  # a crumb between all nodes
        ([FLOOR], [SphereLight((0.0, 0.0, 0.35), 0.3, (1.0, 1.0, 1.0))]),  # a light on the floor
        ([FLOOR], [replace(LAMP, center=(0.0, 0.0, 0.2), half_u=(0.0, 0.0, 0.2))]),  # through it
        ([Sphere((0.0, 0.0, 1.0), 1.0)], [LAMP]),  # a terminator
        ([Sphere((0.0, 0.0, 1.0), 1.0), FLOOR], []),
        ([], [LAMP]),
    ],
    ids=["crumb", "near light", "light cuts floor", "terminator", "no light", "nothing"],
)
@pytest.mark.parametrize("transparent", [False, True])
@pytest.mark.parametrize("penumbra", [False, True])
def test_hard_squares_come_out_alike(shapes, lights, transparent, penumbra, monkeypatch):
    scene = Scene(EYE, tuple(shapes), tuple(lights), (0.2, 0.1, 0.3), transparent)
    film, alone = with_and_without(scene, monkeypatch, use_penumbra=penumbra)
    assert_alike(film, alone)


def test_most_of_a_plain_picture_takes_few_points():
    eye = replace(EYE, resolution=(320, 240))
    scene = Scene(eye, (Sphere((0.0, 0.0, 1.0), 0.6), FLOOR), (LAMP,))
    film = render_image(scene, Settings(tolerance=1e-2, threads=1))
    assert film.stats["rays"]["shaded"] < 0.6 * film.width * film.height


def test_a_shadow_far_off_on_a_floor_seen_aslant_is_not_lost(monkeypatch):
    """One square of pixels there holds hundreds of metres of floor."""
    eye = look_at((0.0, 0.0, 1.0), (0.0, 10.0, 0.98), resolution=(64, 64))
    floor = Quad((-3e3, -10.0, 0.0), (6e3, 0.0, 0.0), (0.0, 9e3, 0.0))
    balls = [Sphere((0.1 * y, y, 0.2 * y + 3), 0.04 * y) for y in (30.0, 90.0, 400.0, 900.0)]
    lamp = QuadLight((0.0, 300.0, 900.0), (20.0, 0.0, 0.0), (0.0, -20.0, 0.0), (1e3, 1e3, 1e3))
    assert_alike(*with_and_without(Scene(eye, (*balls, floor), (lamp,)), monkeypatch))


def test_squares_under_a_light_that_moves_get_their_mean_over_the_shutter(monkeypatch):
    way = Motion((1.5, 0.5, 0.3))
    eye = replace(EYE, resolution=(160, 120))
    scene = Scene(eye, (Sphere((0.0, 0.0, 1.0), 0.3), FLOOR), (replace(LAMP, motion=way),))
    film, alone = with_and_without(scene, monkeypatch, tolerance=1e-3)
    np.testing.assert_array_equal(film.mask, alone.mask)
    assert film.stats["rays"]["shaded"] < 0.9 * alone.stats["rays"]["shaded"]
    x, y = np.random.default_rng(4).integers((0, 0), (160, 120), (600, 2)).T
    assert film.mask[1, y, x].mean() > 0.7  # the rest is backdrop
    truth = converged_color(scene, np.stack([x, y], axis=1), 1e-4)
    assert relative_rmse(film.color[:, y, x].T, truth) < 1e-3
