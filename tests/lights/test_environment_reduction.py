# SPDX-License-Identifier: GPL-3.0-or-later
"""Images of the sphere with fewer pixels: means, and the error that is stated."""

import numpy as np
import pytest

from adaptive_drt.lights import environment_map
from adaptive_drt.lights.environment_factor import Environment
from adaptive_drt.lights.environment_map import make_environment_map
from adaptive_drt.lights.environment_reduction import MOST_TEXELS, reduced_image
from adaptive_drt.scene.description import EnvironmentLight
from sphere_images import noise, random_turn, unit

MOST = 512
"""Pixels to which the images are reduced here."""


def flux(pixels):
    """Integral (3,) of the radiance over solid angle."""
    rows, columns, _ = pixels.shape
    theta = np.linspace(0.0, np.pi, rows + 1)
    area = (np.cos(theta[:-1]) - np.cos(theta[1:])) * 2.0 * np.pi / columns
    return (pixels * area[:, None, None]).sum(axis=(0, 1))


@pytest.mark.parametrize("shape", [(64, 128), (50, 111), (33, 64)])
def test_the_light_stays_the_same(shape):
    image = noise(np.random.default_rng(2), *shape).astype(np.float32)
    small, error = reduced_image(image, MOST)
    assert small.shape[0] * small.shape[1] <= MOST
    assert error > 0.0
    assert flux(small) == pytest.approx(flux(image.astype(float)), rel=5e-3)


def test_small_images_stay_as_they_are():
    image = noise(np.random.default_rng(3))
    same, error = reduced_image(image)
    assert np.array_equal(same, image) and error == 0.0


def test_the_error_behind_occluders_is_as_stated(monkeypatch):
    rng = np.random.default_rng(4)
    light = EnvironmentLight(noise(rng, 64, 128), rotation=random_turn(rng))
    fine = Environment(make_environment_map(light))
    monkeypatch.setattr(environment_map, "reduced_image", lambda image: reduced_image(image, MOST))
    rough = Environment(make_environment_map(light))
    count = 200
    normal, way = unit(rng, count), unit(rng, count)
    none = np.zeros((0, 4, 3, count))
    balls = 2.0 * way[None], np.full((1, count), 1.2)
    found = [
        each.visible_factor(normal, balls, none, np.full(count, 1e-4))[0] for each in (fine, rough)
    ]
    off = np.sqrt(((found[0] - found[1]) ** 2).mean())
    stated = rough.map.reduction_error
    assert 0.05 * stated < off < stated, f"{off}, stated {stated}"


def test_an_image_of_8192_columns_takes_less_than_a_gigabyte():
    """Its tables; and what is seen of it is kept in float32."""
    shape = (4096, 8192, 3)
    image = np.broadcast_to(np.float32(0.5), shape)
    small, _ = reduced_image(image[:8, :16], 32)
    assert small == pytest.approx(np.full(small.shape, 0.5))
    assert MOST_TEXELS * 3 * environment_map.TEXEL_BYTES < 0.35e9
