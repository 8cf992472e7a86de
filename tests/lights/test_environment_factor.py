# SPDX-License-Identifier: GPL-3.0-or-later
"""Environments behind spheres and polygons against brute force that shares no code."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.silhouettes import Hemisphere
from adaptive_drt.lights.environment_factor import Environment
from adaptive_drt.lights.environment_map import make_environment_map
from adaptive_drt.lights.occluded_form_factor import (
    CROSSING_CIRCLES,
    CROSSING_POLYGONS,
    visible_factor,
)
from adaptive_drt.scene.description import EnvironmentLight
from sphere_images import brute_force, glow, noise, random_turn, unit

RNG = np.random.default_rng(5)


def occluders(spheres, triangles, count):
    center = unit(RNG, spheres, count).swapaxes(0, 1) * RNG.uniform(1.0, 3.0, (spheres, 1, count))
    radius = RNG.uniform(0.05, 0.6, (spheres, count))
    middle = unit(RNG, triangles, count).swapaxes(0, 1)[:, None]
    corners = middle + 0.4 * RNG.normal(size=(triangles, 3, 3, count))
    return (center, radius), corners


def hidden_by(spheres, corners, point):
    def hides(way):
        hidden = np.zeros(way.shape[1], dtype=bool)
        for c, r in zip(spheres[0][..., point], spheres[1][:, point], strict=True):
            hidden |= c @ way > np.sqrt(c @ c - r * r)
        for a, b, c in corners[..., point]:
            sides = np.stack([np.cross(*pair) @ way for pair in ((a, b), (b, c), (c, a))])
            hidden |= (sides * np.sign(np.linalg.det([a, b, c])) > 0.0).all(axis=0)
        return hidden

    return hides


@pytest.mark.parametrize(
    "spheres, triangles",
    [(0, 0), (3, 0), (0, 3), (2, 2), (CROSSING_CIRCLES + 4, 1), (1, CROSSING_POLYGONS + 2)],
)
def test_against_brute_force(spheres, triangles):
    for pixels in (noise(RNG), glow()):
        light = EnvironmentLight(pixels, (1.0, 0.7, 1.3), random_turn(RNG))
        environment = Environment(make_environment_map(light))
        normal = unit(RNG, 4)
        balls, corners = occluders(spheres, triangles, 4)
        value, error = environment.visible_factor(normal, balls, corners, np.full(4, 1e-6))
        assert error.max() <= 1e-6
        scale = environment.level.max() * np.pi
        for k in range(4):
            want = brute_force(light, normal[:, k], hidden_by(balls, corners, k))
            assert value[:, k] == pytest.approx(want, abs=5e-4 * scale)


def test_a_constant_image_is_a_uniform_sky():
    environment = Environment(make_environment_map(EnvironmentLight(np.full((4, 8, 3), 0.7))))
    normal = unit(RNG, 50)
    balls, corners = occluders(4, 2, 50)
    value, error = environment.visible_factor(normal, balls, corners, np.full(50, 1e-3))
    want = 0.7 * visible_factor(Hemisphere(), normal, balls, corners)
    assert value == pytest.approx(np.broadcast_to(want, (3, 50)), abs=1e-12)
    assert not error.any()


def test_what_is_wholly_hidden_is_black():
    environment = Environment(make_environment_map(EnvironmentLight(noise(RNG))))
    normal = np.array([[0.0], [0.0], [1.0]])
    lid = np.array([(-1e3, -1e3, 1e-3), (1e3, -1e3, 1e-3), (0.0, 2e3, 1e-3)])[None, ..., None]
    none = np.zeros((0, 3, 1)), np.zeros((0, 1))
    value, _ = environment.visible_factor(normal, none, lid, np.full(1, 1e-4))
    assert value.max() < 2e-5


def test_brightness_tells_where_the_glow_is():
    light = EnvironmentLight(glow(48, 96))
    environment = Environment(make_environment_map(light))
    # the glow is at 0.6 of the width and 0.3 of the height, from the left and from the top
    psi, theta = np.pi * (1.0 - 1.2), 0.3 * np.pi
    toward = np.array([np.sin(theta) * np.cos(psi), np.sin(theta) * np.sin(psi), np.cos(theta)])
    way = np.array([toward, -toward]).T
    near, far = environment.brightness(way, np.full(2, 0.05)).T
    assert (near > 4.0 * far).all()
    wide = environment.brightness(way, np.full(2, 1.5))
    assert (wide[:, 0] < near).all()
