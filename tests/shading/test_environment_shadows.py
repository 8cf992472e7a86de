# SPDX-License-Identifier: GPL-3.0-or-later
"""Depths of shadows in environments."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from adaptive_drt.lights.emitter import LightMotion
from adaptive_drt.lights.environment_light import make_environment_emitter
from adaptive_drt.scene.description import EnvironmentLight
from adaptive_drt.shading.environment_shadows import shadow_emphasis
from adaptive_drt.tracing.intersect import Pairs
from sphere_images import glow

MOTION = LightMotion(np.zeros(3), np.zeros(3))


def emphasis(pixels, centers):
    light = make_environment_emitter(EnvironmentLight(pixels), MOTION)
    count = centers.shape[1]
    shapes = SimpleNamespace(bounding_spheres=(centers, np.full(count, 0.1)))
    surface = SimpleNamespace(
        point=np.zeros((3, 1)), normal=np.array([[0.0], [0.0], [1.0]]), item=np.zeros(1, dtype=int)
    )
    pairs = Pairs(np.zeros(count, dtype=np.int64), np.arange(count))
    return shadow_emphasis(SimpleNamespace(shapes=shapes), surface, light, pairs)


def test_it_is_one_under_a_uniform_sky():
    centers = np.random.default_rng(1).normal(size=(3, 20)) * 2.0
    assert emphasis(np.full((4, 8, 3), 0.5), centers) == pytest.approx(np.ones(20))


def test_shadows_of_the_glow_are_deep():
    psi, theta = np.pi * (1.0 - 1.2), 0.3 * np.pi
    toward = np.array([np.sin(theta) * np.cos(psi), np.sin(theta) * np.sin(psi), np.cos(theta)])
    away = toward * (-1.0, -1.0, 1.0)
    bright, dim = emphasis(glow(48, 96), 3.0 * np.array([toward, away]).T)
    assert bright > 2.0 > 1.0 > dim
