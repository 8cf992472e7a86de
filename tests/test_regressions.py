# SPDX-License-Identifier: GPL-3.0-or-later
"""One test for each bug that was found by other means; each fails without its fix."""

import threading
import time

import numpy as np
import pytest

from adaptive_drt.render import render, render_image
from adaptive_drt.scene import Motion, PointLight, Quad, QuadLight, Scene, Sphere
from adaptive_drt.settings import Settings
from oracle.truth import masks
from random_scenes import look_at

CAMERA = look_at((0.0, -6.0, 4.0), (0.0, 0.0, 0.0), resolution=(40, 40))
FLOOR = Quad((-5.0, -5.0, 0.0), (10.0, 0.0, 0.0), (0.0, 10.0, 0.0))
LAMP = PointLight((2.0, -2.0, 4.0), (30.0,) * 3)
FEW = {"light_rays": 2, "time_rays": 4, "pixel_rays": 4}


@pytest.mark.parametrize("move", [(0.0, -1.5, 0.0), (0.0, 0.0, 0.3)])
@pytest.mark.parametrize("order", [1, 2])
def test_the_seam_of_a_sphere_that_moves_through_the_floor(move, order):
    """Both cover the pixel at every time; which is in front changes within it, off t = 0."""
    scene = Scene(CAMERA, (FLOOR, Sphere((0.0, 0.0, 0.3), 1.0, motion=Motion(move))), (LAMP,))
    found = render_image(scene, Settings(order=order, **FEW)).mask
    assert not (masks(scene) & ~found).any()


def test_a_scene_without_quads_or_without_spheres_renders():
    for shape in (FLOOR, Sphere((0.0, 0.0, 0.0), 1.0)):
        assert render_image(Scene(CAMERA, (shape,), (LAMP,)), Settings(**FEW)).color.any()


def test_a_copy_in_the_same_place_casts_no_shadow_on_the_first():
    """Hits on one of two coincident surfaces lie on the other, to rounding."""
    light = QuadLight((0.0, 0.0, 5.0), (0.0, 0.1, 0.0), (0.1, 0.0, 0.0), (90.0,) * 3)
    alone = {"use_edges": False, "use_motion": False}
    for shape in (FLOOR, Sphere((0.1, 0.2, 0.3), 1.1)):
        one = render_image(Scene(CAMERA, (shape,), (light,)), Settings(**FEW, **alone))
        two = render_image(Scene(CAMERA, (shape, shape), (light,)), Settings(**FEW, **alone))
        np.testing.assert_allclose(two.color, one.color, rtol=1e-9)


def test_a_pixel_cut_by_the_plane_of_a_light_is_distributed():
    """A light that stands on the floor lights one side of its own plane only, and steeply."""
    light = QuadLight((1.0, -1.0, 0.0), (0.0, 0.5, 0.0), (0.0, 0.0, 0.5), (9.0,) * 3)
    scene = Scene(
        look_at((0.0, -6.0, 4.0), (1.0, -1.0, 0.0), resolution=(9, 9)), (FLOOR,), (light,)
    )
    film = render_image(scene, Settings(light_rays=64, pixel_rays=256))
    want = render_image(
        scene, Settings(light_rays=64, pixel_rays=1024, distribution="EVERYWHERE", seed=5)
    )
    assert abs(film.color.max() / want.color.max() - 1.0) < 0.1


def test_closing_the_generator_ends_the_work_within_a_chunk():
    """A cancelled render does not finish its tiles: it takes a fraction of the whole."""
    light = QuadLight((0.0, 0.0, 5.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (9.0,) * 3)
    camera = look_at((0.0, -6.0, 4.0), (0.0, 0.0, 0.0), resolution=(256, 256))
    ball = Sphere((0.0, 0.0, 1.0), 1.0)
    scene = Scene(camera, (FLOOR, ball), (light,))
    settings = Settings(distribution="EVERYWHERE", light_rays=64, pixel_rays=16, threads=1)
    began = time.perf_counter()
    render_image(scene, settings)
    whole = time.perf_counter() - began
    before = threading.active_count()
    began = time.perf_counter()
    steps = render(scene, settings)
    first = next(steps)
    steps.close()
    assert time.perf_counter() - began < 0.5 * whole
    assert first.done < first.total
    assert threading.active_count() == before
