# SPDX-License-Identifier: GPL-3.0-or-later
"""Irradiance of unhidden environments by normal, to the accuracy that is asked for."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.lights.environment_factor import Environment
from adaptive_drt.lights.environment_map import make_environment_map
from adaptive_drt.lights.open_irradiance import OpenIrradiance
from adaptive_drt.scene.description import EnvironmentLight
from sphere_images import glow, noise, random_turn, unit

RNG = np.random.default_rng(7)


@pytest.mark.parametrize("pixels", [glow(), noise(RNG)], ids=["glow", "noise"])
def test_factors_are_accurate(pixels):
    environment = Environment(
        make_environment_map(EnvironmentLight(pixels, rotation=random_turn(RNG)))
    )
    found = OpenIrradiance(environment, 1e-3)
    normal = unit(RNG, 60)
    normal[:, :2] = np.array([environment.map.turn[2], -environment.map.turn[2]]).T
    want, _ = environment.open_factor(normal, np.full(60, 1e-7))
    assert np.abs(found.factor(normal) - want).max() <= found.accuracy


def test_answers_do_not_depend_on_what_was_asked_before():
    environment = Environment(make_environment_map(EnvironmentLight(glow())))
    normal = unit(RNG, 40)
    one, two = (OpenIrradiance(environment, 1e-3) for _ in range(2))
    every = one.factor(normal)
    assert np.array_equal(
        np.concatenate([two.factor(normal[:, 20:]), two.factor(normal[:, :20])], axis=1)[:, :20],
        every[:, 20:],
    )


def test_shared_normals_are_integrated():
    environment = Environment(make_environment_map(EnvironmentLight(glow())))
    normal = np.repeat(unit(RNG, 2), 20, axis=1)
    value = OpenIrradiance(environment, 1e-4).factor(normal)
    want, _ = environment.open_factor(normal[:, ::20], np.full(2, 1e-7))
    assert value == pytest.approx(np.repeat(want, 20, axis=1), abs=1e-4 * want.max())
