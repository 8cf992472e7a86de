# SPDX-License-Identifier: GPL-3.0-or-later
"""Images of the sphere, mapped and projected, as environment lights."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.scene.environment_images import (
    EQUIRECTANGULAR,
    MIRROR_BALL,
    MappedImage,
    make_environment_light,
)
from sphere_images import glow, noise, radiance_of, random_turn, unit

RNG = np.random.default_rng(4)
ONE = (1.0, 1.0, 1.0)


def image(pixels, matrix=None, projection=EQUIRECTANGULAR, color=ONE):
    full = np.eye(3, 4) if matrix is None else matrix
    return MappedImage(np.asarray(pixels, dtype=np.float32), projection, full, color)


def affine(linear, shift=(0.0, 0.0, 0.0)):
    return np.concatenate([linear, np.reshape(shift, (3, 1))], axis=1)


@pytest.mark.parametrize("sign", [1.0, -1.0], ids=["turned", "mirrored"])
def test_rotations_are_exact(sign):
    turn = np.array(random_turn(RNG)) @ np.diag([1.0, sign, 1.0])
    one = image(noise(RNG), affine(3.0 * turn), color=(2.0, 1.0, 0.5))
    light = make_environment_light([one], name="World")
    assert light.pixels.shape == one.pixels.shape and light.defect() is None
    way = unit(RNG, 500)
    want = np.moveaxis(one.radiance(np.moveaxis(way, 0, -1)), -1, 0)
    assert radiance_of(light, way) == pytest.approx(want, abs=1e-6)


@pytest.mark.parametrize("projection", [EQUIRECTANGULAR, MIRROR_BALL])
def test_others_are_looked_up(projection):
    stretch = affine(np.diag([1.0, 0.8, 1.2]), (0.1, 0.0, 0.05))
    one = image(glow(64, 128), stretch, projection)
    light = make_environment_light([one, image(glow(32, 64))], (0.1, 0.2, 0.3))
    way = unit(RNG, 500)
    rows = np.moveaxis(way, 0, -1)
    want = one.radiance(rows) + image(glow(32, 64)).radiance(rows) + (0.1, 0.2, 0.3)
    off = radiance_of(light, way) - np.moveaxis(want, -1, 0)
    assert np.sqrt((off * off).mean()) < 0.02 * want.mean()


def test_a_mirror_ball_shows_what_is_behind_it_at_its_rim():
    pixels = np.zeros((8, 8, 3), dtype=np.float32)
    pixels[3:5, 3:5] = 1.0
    ball = image(pixels, projection=MIRROR_BALL)
    toward, up = np.array([[0.0, -1.0, 0.0]]), np.array([[0.0, 0.0, 1.0]])
    assert ball.radiance(toward)[0] == pytest.approx((1.0, 1.0, 1.0))
    assert ball.radiance(up)[0] == pytest.approx((0.0, 0.0, 0.0))
