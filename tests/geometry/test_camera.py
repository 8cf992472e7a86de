# SPDX-License-Identifier: GPL-3.0-or-later
"""The camera's rays against another camera, written after Blender's manual."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.geometry.camera import make_pinhole_camera
from oracle.camera import rays
from random_scenes import look_at

FITS = ("AUTO", "HORIZONTAL", "VERTICAL")


def random_camera(rng, fit):
    width, height = (int(x) for x in rng.integers(3, 500, 2))
    return look_at(
        rng.normal(size=3) * 10.0, rng.normal(size=3), focal_length=float(rng.uniform(8, 200)),
        sensor_width=float(rng.uniform(5, 50)), sensor_height=float(rng.uniform(5, 50)),
        sensor_fit=fit, resolution=(width, height),
        shift_x=float(rng.normal()), shift_y=float(rng.normal()),
        pixel_aspect=tuple(rng.uniform(0.3, 3.0, 2).tolist()),
    )  # fmt: skip


@pytest.mark.parametrize("fit", FITS)
@pytest.mark.parametrize("seed", range(10))
def test_rays_are_those_of_blenders_camera(fit, seed):
    rng = np.random.default_rng(seed)
    camera = random_camera(rng, fit)
    x, y = rng.uniform((0.0, 0.0), camera.resolution, (50, 2)).T
    lens = make_pinhole_camera(camera)
    origin, direction = rays(camera, x, y, np.zeros(50))
    found = lens.directions(x, y)
    np.testing.assert_allclose(lens.origin, origin[0], rtol=1e-13)
    np.testing.assert_allclose(found / np.linalg.norm(found, axis=0), direction.T, atol=1e-13)
    # their parameter is the depth along the axis
    np.testing.assert_allclose(lens.forward @ found, 1.0, rtol=1e-12)


@pytest.mark.parametrize("scale", [1e-20, 3.0, 1e20])
def test_scale_of_the_matrix_does_not_matter(scale):
    camera = look_at((1.0, -4.0, 2.0), (0.0, 0.0, 0.0))
    rows = [[*(scale * x for x in row[:3]), row[3]] for row in camera.matrix[:3]]
    grown = make_pinhole_camera(replace(camera, matrix=(*map(tuple, rows), camera.matrix[3])))
    plain = make_pinhole_camera(camera)
    for name in ("origin", "base", "right", "up", "forward"):
        np.testing.assert_allclose(getattr(grown, name), getattr(plain, name), atol=1e-14)


def test_directions_keep_the_shape_of_coordinates():
    lens = make_pinhole_camera(look_at((1.0, -4.0, 2.0), (0.0, 0.0, 0.0)))
    x = np.random.default_rng(1).uniform(0, 300, (2, 3, 4))
    many = lens.directions(x, x[::-1])
    one = lens.directions(x[1, 2], x[0, 2])
    assert many.shape == (3, 2, 3, 4)
    np.testing.assert_array_equal(many[:, 1, 2], one)
