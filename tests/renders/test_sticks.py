# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of balls and sticks, cones among them, and their masks, against plain rays."""

import numpy as np
import pytest

from adaptive_drt.render import render_image
from adaptive_drt.scene.settings import Settings
from stick_scenes import LIGHTS, plain_mask, plain_picture, solid_scene, stick_scene

FEW = {"method": "RAYS", "light_rays": 2, "time_rays": 2, "pixel_rays": 2, "threads": 1}


def missed(seed, light, tapers):
    """Numbers of pixels that depend, penumbra and edge, and of those that the mask leaves out."""
    scene = stick_scene(seed, light, resolution=(40, 30), tapers=tapers)
    truth = plain_mask(scene)
    found = render_image(scene, Settings(**FEW)).mask
    flags = found[0], found[2]
    return [(t.sum(), (t & ~f).sum()) for t, f in zip(truth, flags, strict=True)]


@pytest.mark.slow
@pytest.mark.parametrize("tapers", [False, True])
@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("seed", range(10))
def test_the_mask_leaves_out_no_pixel(seed, light, tapers):
    (penumbra, gone), (edge, lost) = missed(seed, light, tapers)
    assert gone == 0 and lost == 0 and penumbra > 30 and edge > 30


def off(seed, light, tolerance, samples, moving=False, tapers=False):
    """Error of a picture over its mean, without that of the plain one, and the stated error."""
    scene = stick_scene(seed, light, moving, resolution=(40, 30), tapers=tapers)
    film = render_image(scene, Settings(threads=1, tolerance=tolerance))
    plain, error = plain_picture(scene, samples)
    square = ((film.color - plain) ** 2).mean() - (error**2).mean()
    noise = np.sqrt((error**2).mean() * 2.0 / np.sqrt(error.size)) / plain.mean()
    return np.sqrt(max(square, 0.0)) / plain.mean(), noise, film.stats["error_estimate"]


@pytest.mark.parametrize("tapers", [False, True])
@pytest.mark.parametrize("light", LIGHTS)
def test_a_picture_is_that_of_plain_rays(light, tapers):
    error, noise, _ = off(3, light, 0.02, 16, tapers=tapers)
    assert error < 0.02 + 3.0 * noise


@pytest.mark.slow
@pytest.mark.parametrize("tapers", [False, True])
@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("light", LIGHTS)
def test_pictures_keep_their_tolerance(light, moving, tapers):
    for seed in range(4):
        error, noise, stated = off(seed, light, 0.01, 256, moving, tapers)
        assert error < 0.01 + 2.0 * noise and stated < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_all_shapes_of_degree_two_keep_their_tolerance(seed):
    """Balls, ellipsoids, cylinders, cones; every second scene moves; the truth's noise is known."""
    pytest.importorskip("numba")
    from oracle.dense import dense_picture

    scene = solid_scene(seed)
    truth, error = dense_picture(scene, 3e-4, seed, most=4e7)
    mean, noise = truth.mean(), (error**2).mean()
    for tolerance in (0.01, 0.001):
        color = render_image(scene, Settings(threads=1, tolerance=tolerance)).color
        square = ((color - truth) ** 2).mean() - noise
        print(seed, tolerance, np.sqrt(max(square, 0.0)) / mean, np.sqrt(noise) / mean)
        assert np.sqrt(max(square, 0.0)) < (tolerance + np.sqrt(noise) / mean) * mean
