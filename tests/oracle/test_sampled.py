# SPDX-License-Identifier: GPL-3.0-or-later
"""The truth by samples against the truth by closed forms, and where the light is known at once."""

import numpy as np
import pytest

pytest.importorskip("numba")

from adaptive_drt.scene.description import DiskLight, Material, Quad, QuadLight, Scene, SphereLight
from oracle.converged import converged
from oracle.sampled import sampled
from random_scenes import look_at, random_scene

NOISE = 2e-3
"""Of a picture's mean: of each pixel and half, about."""
FLOOR = Quad((-5.0, -5.0, 0.0), (10.0, 0.0, 0.0), (0.0, 10.0, 0.0), Material((0.5, 0.25, 1.0)))
ABOVE = look_at((0.0, 0.0, 10.0), (0.0, 0.0, 0.0), resolution=(12, 12))


@pytest.mark.parametrize(
    "seed", [10, 11, *(pytest.param(k, marks=pytest.mark.slow) for k in (3, 6))]
)
def test_it_agrees_with_closed_forms_where_nothing_touches(seed):
    scene = random_scene(seed)
    got = sampled(scene, noise=NOISE, seed=seed)
    want = converged(scene, goal=1e-3).picture(scene.camera)
    one, other = got.halves
    noise = np.sqrt(((one - other) ** 2).mean()) / 2.0
    off = np.sqrt(((got.color - want) ** 2).mean())
    assert off <= 1.3 * noise + 3e-4 * want.mean(), f"seed {seed}: {off} with noise {noise}"
    size, spread = got.relative_error(want)
    assert size <= 3e-4 + 3.0 * spread, f"seed {seed}"


def test_the_error_of_a_picture_is_found_below_the_noise():
    """Pixels that are off by half of the samples' noise, at random.

    The square of the noise itself would be added to that of the error if it were not removed. What
    is left of it is uncertain by its square over the root of the number of pixels that have most of
    it: a sixth of 891 pixels or less, as many are smooth.
    """
    truth = sampled(random_scene(6), noise=NOISE)
    one, other = truth.halves
    noise = np.sqrt(((one - other) ** 2).mean() / 2.0)
    best = sampled(random_scene(6), noise=NOISE / 8.0, seed=1)
    assert np.sqrt(((best.halves[0] - best.halves[1]) ** 2).mean()) / 2.0 < 0.15 * noise
    error = 0.5 * noise * np.random.default_rng(0).choice((-1.0, 1.0), best.color.shape)
    square, spread = truth.square_error(best.color + error)
    assert abs(square - (0.5 * noise) ** 2) <= 3.0 * spread
    assert spread < 0.33 * noise**2


def test_no_few_pixels_have_most_of_the_noise():
    """Two pixels of 891 had most of it: two rough estimates of them agreed by chance."""
    one, other = sampled(random_scene(6), noise=NOISE).halves
    square = np.sort(((one - other) ** 2).mean(axis=0).ravel())[::-1]
    assert square[:5].sum() < 0.6 * square.sum()
    assert np.sqrt(square[0] / 2.0) < 4.0 * NOISE * one.mean()


def test_within_a_ball_of_light_all_directions_are_lit():
    scene = Scene(ABOVE, (FLOOR,), (SphereLight((1.0, 0.5, 0.3), 20.0, (1.0, 2.0, 3.0)),))
    want = np.array((0.5, 0.5, 3.0))[:, None, None]
    assert np.allclose(sampled(scene, noise=1e-2).color, want, rtol=1e-12)


def test_a_light_that_stands_in_the_floor_lights_its_front_alone():
    """Just before a wide upright light half of all directions are lit, and none behind it."""
    light = QuadLight((0.0, 0.0, 0.0), (0.0, 400.0, 0.0), (0.0, 0.0, 400.0), (1.0, 1.0, 1.0))
    got = sampled(Scene(ABOVE, (FLOOR,), (light,)), noise=1e-3).color
    assert np.allclose(
        got[:, :, 6:], 0.5 * np.array(FLOOR.material.color)[:, None, None], rtol=2e-2
    )
    assert not got[:, :, :6].any()


def test_a_disk_faces_each_point():
    light = DiskLight((0.0, 0.0, 2.0), 1.0, (1.0, 1.0, 1.0))
    got = sampled(Scene(ABOVE, (FLOOR,), (light,)), noise=1e-3).color[0, 6, 6]
    step = 36.0 / 50.0 / 12.0 * 10.0 / 2.0
    square = 4.0 + 2.0 * step * step
    assert got == pytest.approx(0.5 / (1.0 + square) * 2.0 / np.sqrt(square), rel=2e-2)
