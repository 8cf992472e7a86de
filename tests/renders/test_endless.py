# SPDX-License-Identifier: GPL-3.0-or-later
"""What reaches farther than numbers do: scenes that fuzzing found to warn, made smaller."""

from __future__ import annotations

import pytest

from adaptive_drt.render import render_image
from adaptive_drt.scene.description import (
    DiskLight,
    Material,
    Motion,
    PointLight,
    Quad,
    Scene,
    Sphere,
    SphereLight,
)
from adaptive_drt.scene.settings import Settings
from random_scenes import look_at

pytestmark = pytest.mark.filterwarnings("error")

WHITE = (1.0, 1.0, 1.0)
CAMERA = look_at((0.0, -1.0, 0.0), (0.0, 0.0, 0.0), resolution=(6, 5), focal_length=5.0)
ENDLESS = {
    "an outline seen edge-on, under a light that moves": Scene(
        shapes=(
            Quad(
                (0.0, -2.1842058341404957, -4.456451428117694e16),
                (-1.0, 2.0, -3.0),
                (1.0, -4.934450422358017, -1.0),
            ),
        ),
        lights=(
            DiskLight(
                (5.0, 3.4465780653622815, -3.0),
                1.2393658908660954,
                WHITE,
                Motion((-3.0, -7.672671384555708e-12, 0.5)),
            ),
        ),
        camera=CAMERA,
    ),
    "a seam of a quad of 5e16 m and a sphere of 2e23 m": Scene(
        shapes=(
            Sphere((-3.0, 5.601668792797312, -1.0), 2.238313972667043e23),
            Quad(
                (-1.192092896e-07, -1.7553487066191629, 0.0),
                (0.5, -9.804420928139088e-276, -5.5084061972660584e16),
                (-3.0, -1.0, -4.733209980441284),
                motion=Motion((-0.009999769744141627, -3.0, -1.0)),
            ),
        ),
        camera=CAMERA,
    ),
    "a sphere that passes the camera at 4e21 m a shutter": Scene(
        shapes=(
            Sphere(
                (8.870248441853327e-266, -1.0, 0.0),
                1.0,
                motion=Motion((-3.0, -4.369068206516771e21, -1.0)),
            ),
        ),
        camera=CAMERA,
    ),
    "an error 1e240 times its goal": Scene(
        shapes=(Sphere((0.0, 0.0, 0.0), 0.625, Material((0.0, 1.0, 0.0))),),
        lights=(
            SphereLight((0.0, 0.0, 2.0), 1e-13, (0.0, 4e-214, 0.0), casts_shadow=False),
            PointLight(
                (0.0, 0.0, 1.0),
                (0.0, 1e30, 0.0),
                Motion((0.0, 0.0, 1e21)),
                casts_shadow=False,
            ),
        ),
        camera=CAMERA,
    ),
}


@pytest.mark.parametrize("name", ENDLESS)
def test_endless_scenes_render_without_a_warning(name):
    film = render_image(ENDLESS[name], Settings(tolerance=1e-2, threads=1))
    assert film.color.min() >= 0.0
