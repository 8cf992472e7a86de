# SPDX-License-Identifier: GPL-3.0-or-later
"""Suns in images of the sphere become lights, with the same irradiance."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.lights.bright_spots import split_bright_spots
from adaptive_drt.lights.environment_map import make_environment_map
from adaptive_drt.scene.description import EnvironmentLight
from sphere_images import glow, random_turn


def with_suns(rows=128, columns=256):
    image = glow(rows, columns)
    image[30, 60:62] = (3e3, 2e3, 1e3)
    # across the seam
    image[50, [0, columns - 1]] = 2e3
    return EnvironmentLight(image, (1.0, 0.5, 2.0), random_turn(np.random.default_rng(1)))


def test_spots_become_suns():
    light = with_suns()
    rest, suns = split_bright_spots(light)
    assert len(suns) == 2 and rest.pixels.max() < 20.0
    whole, left = make_environment_map(light), make_environment_map(rest)
    # the first moment of the radiance stays
    want = whole.turn.T @ (whole.total - left.total)
    got = -sum(np.outer(sun.direction, sun.irradiance) for sun in suns)
    assert got == pytest.approx(want, rel=2e-3, abs=2e-3 * np.abs(want).max())
    for sun in suns:
        assert np.linalg.norm(sun.direction) == pytest.approx(1.0)
        assert 0.02 < sun.angle < 0.1


def test_images_without_suns_stay():
    light = EnvironmentLight(glow())
    assert split_bright_spots(light) == (light, ())
    flat = EnvironmentLight(np.ones((4, 8, 3)))
    assert split_bright_spots(flat) == (flat, ())
    black = EnvironmentLight(np.zeros((4, 8, 3)))
    assert split_bright_spots(black) == (black, ())


def test_wide_lamps_stay():
    image = np.full((64, 128, 3), 0.01)
    image[10:30, 20:50] = 5.0
    light = EnvironmentLight(image)
    assert split_bright_spots(light)[1] == ()
