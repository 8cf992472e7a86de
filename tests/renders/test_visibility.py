# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes that the camera does not see, that hide no light or are not lit, and shapes that shine."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.render import render_image
from adaptive_drt.scene.description import (
    Ellipse,
    Material,
    Motion,
    Quad,
    QuadLight,
    Scene,
    Sphere,
    SphereLight,
    Visibility,
)
from adaptive_drt.scene.settings import Settings
from light_checks import rms
from random_scenes import look_at

CAMERA = look_at((0.0, -6.0, 3.0), (0.0, 0.0, 0.8), resolution=(36, 24), focal_length=35.0)
FLOOR = Quad((-4.0, -4.0, 0.0), (8.0, 0.0, 0.0), (0.0, 8.0, 0.0))
BALL = Sphere((0.0, 0.0, 0.9), 0.6)
ONE = QuadLight((-1.0, 1.0, 4.0), (0.4, 0.0, 0.0), (0.0, -0.4, 0.0), (9.0, 5.0, 3.0), name="One")
TWO = SphereLight((2.0, -1.0, 3.0), 0.3, (2.0, 9.0, 9.0), name="Two")
EXACT = Settings(tolerance=1e-3, threads=1)
RAYS = Settings(method="RAYS", light_rays=256, pixel_rays=256, time_rays=256, threads=1)
METHODS = pytest.mark.parametrize("settings", [EXACT, RAYS], ids=["EXACT", "RAYS"])


def film_of(*shapes, lights=(ONE, TWO), settings=EXACT):
    return render_image(Scene(CAMERA, shapes, lights), settings)


def close(a, b, settings):
    return rms(a - b) < (2e-3 if settings is EXACT else 2e-2) * np.mean(b)


@METHODS
def test_a_shape_that_the_camera_does_not_see(settings):
    unseen = replace(BALL, visibility=Visibility(camera=False))
    film = film_of(FLOOR, unseen, settings=settings)
    plain, none = film_of(FLOOR, BALL, settings=settings), film_of(FLOOR, settings=settings)
    behind = plain.depth != film.depth
    assert behind.any() and np.allclose(film.depth, none.depth)
    # its shadow on the floor is the same, where the ball does not hide that
    away = ~behind & ~plain.mask[2] & ~film.mask[2]
    assert np.allclose(film.color[:, away], plain.color[:, away], rtol=2e-2, atol=1e-3)
    assert film.color.mean() < 0.99 * none.color.mean()


@METHODS
def test_a_shape_that_hides_no_light(settings):
    film = film_of(FLOOR, replace(BALL, visibility=Visibility(shadow=False)), settings=settings)
    plain, none = film_of(FLOOR, BALL, settings=settings), film_of(FLOOR, settings=settings)
    floor = (film.depth == none.depth) & ~plain.mask[2]
    assert np.allclose(film.color[:, floor], none.color[:, floor], rtol=1e-3, atol=1e-4)
    ball = (film.depth != none.depth) & ~plain.mask[2]
    assert np.allclose(film.color[:, ball], plain.color[:, ball], rtol=1e-3, atol=1e-3)


@METHODS
@pytest.mark.parametrize("moving", [False, True])
def test_linked_lights_add_up(settings, moving):
    """A picture is the sum of those of single lights, each with what is linked to it."""
    motion = Motion((0.5, 0.0, 0.2)) if moving else None
    ball = replace(BALL, motion=motion)
    floor = replace(FLOOR, visibility=Visibility(unlit_by=frozenset({"One"})))
    passed = replace(ball, visibility=Visibility(passed_by=frozenset({"Two"})))
    both = film_of(floor, passed, settings=settings).color
    dark = replace(FLOOR, material=Material((0.0, 0.0, 0.0)))
    clear = replace(ball, visibility=Visibility(shadow=False))
    one = film_of(dark, ball, lights=(ONE,), settings=settings).color
    two = film_of(FLOOR, clear, lights=(TWO,), settings=settings).color
    assert close(both, one + two, settings)


def shining_ball(glow=(3.0, 2.0, 1.0), name="Glow", **fields):
    own = frozenset({name})
    seen = Visibility(unlit_by=own, passed_by=own)
    ball = Sphere((1.4, 0.6, 1.4), 0.4, Material((0.0, 0.0, 0.0), glow), visibility=seen, **fields)
    return ball, SphereLight(ball.center, ball.radius, glow, ball.motion, name=name)


@METHODS
def test_a_ball_that_shines(settings):
    """It lights the floor as a light does, is seen, and casts shadows of other lights."""
    ball, light = shining_ball()
    film = film_of(FLOOR, ball, lights=(light, ONE), settings=settings)
    lamp = film_of(FLOOR, lights=(light,), settings=settings)
    black = replace(ball, material=Material((0.0, 0.0, 0.0)))
    shadow = film_of(FLOOR, black, lights=(ONE,), settings=settings)
    whole = ~film.mask[2] & (film.depth < lamp.depth)
    assert whole.any()
    assert np.allclose(film.color[:, whole], np.array(ball.material.emission)[:, None])
    floor = ~film.mask[2] & (film.depth == lamp.depth)
    want = lamp.color + shadow.color
    assert np.allclose(film.color[:, floor], want[:, floor], rtol=2e-2, atol=2e-3)
    assert film.alpha.all()


def test_a_ball_that_shines_and_moves_agrees_by_both_methods():
    ball, light = shining_ball(motion=Motion((0.8, 0.0, 0.3)))
    scene = (FLOOR, BALL, ball)
    exact = film_of(*scene, lights=(light,))
    rays = film_of(*scene, lights=(light,), settings=replace(RAYS, pixel_rays=1024, time_rays=1024))
    assert rms(exact.color - rays.color) < 3e-2 * exact.color.mean()
    assert exact.color.mean() == pytest.approx(rays.color.mean(), rel=5e-3)


@METHODS
@pytest.mark.parametrize(
    "shape",
    [
        Quad((-1.0, 0.0, 0.5), (1.5, 0.3, 0.2), (0.1, 0.4, 1.5)),
        Ellipse((0.0, 0.0, 1.0), (1.0, 0.3, 0.2), (0.1, 0.4, 0.7)),
        Sphere((0.0, 0.0, 1.0), 0.8),
    ],
    ids=["quad", "ellipse", "sphere"],
)
def test_emission_is_added_to_what_is_reflected(shape, settings):
    glow, color = (0.5, 0.2, 0.1), (0.2, 0.5, 0.6)
    dark = film_of(replace(shape, material=Material(color)), settings=settings)
    film = film_of(replace(shape, material=Material(color, glow)), settings=settings)
    only = film_of(replace(shape, material=Material((0, 0, 0), glow)), lights=(), settings=settings)
    assert close(film.color, dark.color + only.color, settings)
    assert np.allclose(only.color.max(axis=(1, 2)), glow)


@METHODS
@pytest.mark.parametrize("transparent", [False, True])
@pytest.mark.parametrize("moving", [False, True])
def test_a_holdout_is_a_hole(settings, transparent, moving):
    """It is black and of no coverage, hides what is behind it, and casts shadows."""
    motion = Motion((0.5, 0.0, 0.2)) if moving else None
    ball = replace(BALL, motion=motion)
    hole = replace(
        ball, visibility=Visibility(holdout=True), material=Material((0.8,) * 3, (9.0,) * 3)
    )
    black = replace(ball, material=Material((0.0, 0.0, 0.0)))
    light = TWO.met(seen=True, lights_surfaces=True)

    def film(shape):
        scene = Scene(CAMERA, (FLOOR, shape), (ONE, light), (0.3, 0.4, 0.5), transparent)
        return render_image(scene, settings)

    got, want, plain = film(hole), film(black), film(ball)
    assert np.allclose(got.color, want.color, atol=1e-12)
    # coverage of the ball alone, by what it adds to a black picture
    glow = replace(ball, material=Material((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)))
    dark = replace(FLOOR, material=Material((0.0, 0.0, 0.0)))
    share = render_image(Scene(CAMERA, (dark, glow)), settings).color[0]
    assert np.abs(got.alpha - (plain.alpha - share)).max() < 0.03
    assert (got.alpha == 0.0).any() and (got.alpha > 0.9).any()
