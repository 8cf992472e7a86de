# SPDX-License-Identifier: GPL-3.0-or-later
"""How unhidden light of environments varies over patches of curved surfaces."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from adaptive_drt.lights.emitter import LightMotion
from adaptive_drt.lights.environment_light import make_environment_emitter
from adaptive_drt.lights.sky_light import make_sky_emitter
from adaptive_drt.scene.description import EnvironmentLight, SkyLight
from adaptive_drt.shading.environment_variation import environment_deviations
from sphere_images import glow, unit

MOTION = LightMotion(np.zeros(3), np.zeros(3))
COUNT = 40


def patch(normal, curvature, extent):
    """Patches seen head-on, that turn the normals by curvature times extent along x."""
    aside = np.cross(normal.T, np.array([0.3, 0.5, 0.8])).T
    aside /= np.sqrt((aside * aside).sum(axis=0))
    steps = np.zeros((3, 3, COUNT))
    steps[0] = extent * aside
    lengths = np.zeros((3, COUNT))
    lengths[0] = extent
    bend = np.full(COUNT, curvature)
    return SimpleNamespace(
        steps=steps, surface_steps=lengths, view_steps=lengths, curvature=bend,
        cosine=np.ones(COUNT), axes=(0,),
    ), aside  # fmt: skip


def deviations(light, normal, curvature, extent):
    surface = SimpleNamespace(point=np.zeros((3, COUNT)), normal=normal)
    some, aside = patch(normal, curvature, extent)
    return environment_deviations(light, light.to_center(surface.point), surface, some), aside


def test_nothing_varies_on_planes_and_under_uniform_skies():
    normal = unit(np.random.default_rng(1), COUNT)
    light = make_environment_emitter(EnvironmentLight(glow()), MOTION)
    assert not deviations(light, normal, 0.0, 0.1)[0].any()
    assert not deviations(make_sky_emitter(SkyLight((1.0, 1.0, 1.0)), MOTION), normal, 1.0, 0.1)[
        0
    ].any()


def test_they_are_the_errors_of_midpoints():
    normal = unit(np.random.default_rng(2), COUNT)
    light = make_environment_emitter(EnvironmentLight(glow()), MOTION)
    turn = 0.1
    found, aside = deviations(light, normal, 2.0, turn / 2.0)
    place = np.linspace(-turn, turn, 41)[:, None]
    around = np.cos(place) * normal[:, None] + np.sin(place) * aside[:, None]
    flat = around.reshape(3, -1)
    value = light.irradiance_factor(light.to_center(flat), flat, flat).reshape(3, 41, COUNT)
    middle = value[:, 20]
    weights = np.ones(41)
    weights[[0, -1]] = 0.5
    mean = np.average(value, axis=1, weights=weights)
    off = np.abs(mean - middle).max(axis=0)
    stated = found.sum(axis=(0, 1))
    assert np.all(off < 1.5 * stated + 2.0 * light.factor_error)
    assert stated.mean() < 6.0 * off.mean()
