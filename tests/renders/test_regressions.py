# SPDX-License-Identifier: GPL-3.0-or-later
"""One test for each bug that was found by other means; each fails without its fix."""

import threading
import time

import numpy as np
import pytest

from adaptive_drt.render import render, render_image
from adaptive_drt.scene.description import (
    Material,
    Motion,
    PointLight,
    Quad,
    QuadLight,
    Scene,
    Sphere,
    SphereLight,
)
from adaptive_drt.scene.settings import Settings
from oracle.truth import masks
from random_scenes import look_at

CAMERA = look_at((0.0, -6.0, 4.0), (0.0, 0.0, 0.0), resolution=(40, 40))
FLOOR = Quad((-5.0, -5.0, 0.0), (10.0, 0.0, 0.0), (0.0, 10.0, 0.0))
LAMP = PointLight((2.0, -2.0, 4.0), (30.0,) * 3)
FEW = {"method": "RAYS", "light_rays": 2, "time_rays": 4, "pixel_rays": 4}


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
    film = render_image(scene, Settings(method="RAYS", light_rays=64, pixel_rays=256))
    want = render_image(
        scene,
        Settings(method="RAYS", light_rays=64, pixel_rays=1024, distribution="EVERYWHERE", seed=5),
    )
    assert abs(film.color.max() / want.color.max() - 1.0) < 0.1


def test_closing_the_generator_ends_the_work_within_a_chunk():
    """A cancelled render does not finish its tiles: it takes a fraction of the whole."""
    light = QuadLight((0.0, 0.0, 5.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (9.0,) * 3)
    camera = look_at((0.0, -6.0, 4.0), (0.0, 0.0, 0.0), resolution=(256, 256))
    ball = Sphere((0.0, 0.0, 1.0), 1.0)
    scene = Scene(camera, (FLOOR, ball), (light,))
    settings = Settings(
        method="RAYS", distribution="EVERYWHERE", light_rays=64, pixel_rays=16, threads=1
    )
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


def test_without_embreex_arrays_do_its_work(monkeypatch):
    """A scene of many spheres renders where embreex is not installed, and to the same picture."""
    rng = np.random.default_rng(11)
    balls = tuple(Sphere(tuple(c), 0.1) for c in rng.uniform((-2, -2, 0.1), (2, 2, 1), (150, 3)))
    scene = Scene(CAMERA, (*balls, FLOOR), (LAMP,))
    monkeypatch.setattr("adaptive_drt.tracing.compile.EMBREE_CROSSOVER", 100)
    one = render_image(scene, Settings(**FEW))
    assert one.stats["plan"]["accelerator"] == ["EMBREE"]
    monkeypatch.setattr("adaptive_drt.tracing.compile.find_spec", lambda name: None)
    two = render_image(scene, Settings(**FEW))
    assert two.stats["plan"]["accelerator"] == ["ARRAYS"]
    np.testing.assert_array_equal(one.color, two.color)


@pytest.mark.parametrize("half", [0.02, 0.6])
def test_embree_finds_what_arrays_find_in_a_crowd(half):
    """Rays that start inside inflated proxies, and proxies whose sides nearly coincide."""
    rng = np.random.default_rng(12)
    balls = tuple(
        Sphere(tuple(c), r)
        for c, r in zip(
            rng.uniform((-2, -2, 0.1), (2, 2, 1.5), (200, 3)),
            rng.uniform(0.03, 0.1, 200),
            strict=True,
        )
    )
    light = QuadLight((0.0, 0.0, 5.0), (0.0, half, 0.0), (half, 0.0, 0.0), (9.0,) * 3)
    scene = Scene(CAMERA, (*balls, FLOOR), (light,))
    pictures = [
        render_image(
            scene, Settings(method="RAYS", accelerator=name, use_edges=False, light_rays=9)
        ).color
        for name in ("ARRAYS", "EMBREE")
    ]
    np.testing.assert_array_equal(*pictures)


def test_a_dark_picture_that_is_all_clear_squares():
    """Light is looked for in pixels, none of which was traced by itself: a ValueError."""
    camera = look_at((0.0, -1.0, 0.0), (0.0, 0.0, 0.0), resolution=(6, 5), focal_length=145.0)
    ball = Sphere((0.0, 0.0, 0.0), 1000.0, Material((0.0, 1.0, 0.0)))
    light = SphereLight((0.0, 0.0, 0.0), 1.0, (0.0, -1.0, 0.0), casts_shadow=False)
    film = render_image(Scene(camera, (ball,), (light,)), Settings(tolerance=1e-2, threads=1))
    assert np.isfinite(film.color).all()
