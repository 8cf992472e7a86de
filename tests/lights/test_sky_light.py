# SPDX-License-Identifier: GPL-3.0-or-later
"""Skies: closed forms behind occluders, pictures and masks against brute force."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.geometry.silhouettes import Hemisphere
from adaptive_drt.lights.emitter import LightMotion
from adaptive_drt.lights.occluded_form_factor import visible_factor
from adaptive_drt.lights.registry import make_emitter
from adaptive_drt.lights.sky_light import make_sky_emitter
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import Motion, Quad, Scene, SkyLight, Sphere, SunLight, validate
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import MAX_BATCH_PAIRS, make_plan
from light_checks import BALL, CAMERA, EXACT, FLOOR, assert_agrees, assert_no_pixel_is_left_out, rms
from oracle.picture import reference
from random_scenes import look_at, random_scene

SKY = SkyLight((1.0, 0.8, 0.6))
RAYS = Settings(method="RAYS", light_rays=64, pixel_rays=64, time_rays=64, threads=1)
CARD = Quad((1.2, -0.5, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.3))
WALL = Quad((-4.0, 2.0, 0.0), (8.0, 0.0, 0.0), (0.0, 0.0, 2.0))
UP = np.array([[0.0], [0.0], [1.0]])
NO_BALLS = np.zeros((0, 3, 1)), np.zeros((0, 1))
NO_FACES = np.zeros((0, 4, 3, 1))


def box(corner, x, y, z):
    """The six sides of a box."""
    p, u, v, w = corner, (x, 0.0, 0.0), (0.0, y, 0.0), (0.0, 0.0, z)
    far = [tuple(a + b for a, b in zip(p, e, strict=True)) for e in (u, v, w)]
    sides = ((p, u, v), (p, u, w), (p, v, w), (far[2], u, v), (far[1], u, w), (far[0], v, w))
    return [Quad(*side) for side in sides]


CUBE = box((-2.0, -1.0, 0.0), 1.0, 1.2, 0.8)


def scene_of(*shapes, light=SKY, **fields):
    return Scene(CAMERA, shapes, (light,), **fields)


def emitter():
    return make_sky_emitter(SKY, LightMotion(np.array((5.0, -3.0, 2.0)), np.array((0.1, 0.0, 0.0))))


def unit(rng, *shape):
    vector = rng.normal(size=(3, *shape))
    return vector / np.sqrt((vector * vector).sum(axis=0))


def test_an_open_sky_gives_pi_wherever_a_surface_faces():
    rng, sky = np.random.default_rng(1), emitter()
    point = rng.normal(size=(3, 50)) * np.logspace(-9, 30, 50)
    normal, to = unit(rng, 50), sky.to_center(point, 0.3)
    assert np.array_equal(to, np.broadcast_to(to[:, :1], to.shape))
    assert np.all(sky.irradiance_factor(to, point, normal) == np.pi)
    assert not np.any(sky.horizon(to, point, normal, 1e3, 1.0))
    assert sky.is_above_horizon(to, point, normal, 1e3, 1.0).all()
    away, distance = sky.falloff_offset(point)
    assert np.isfinite(away).all() and distance.min() > 1e30


def test_samples_are_in_proportion_to_the_cosine():
    rng, sky = np.random.default_rng(2), emitter()
    a, b = rng.random((2, 5, 20_000))
    point, normal = rng.normal(size=(3, 5, 1)), unit(rng, 5, 1)
    to, weight = sky.sample(sky.to_center(point), point, normal, a, b)
    w = to / np.sqrt((to * to).sum(axis=0))
    assert np.all(weight == np.pi)
    cosine = (w * normal).sum(axis=0)
    assert cosine.min() >= -1e-15
    # of the density cos / pi: mean 2/3, mean square 1/2, and nothing aside
    assert cosine.mean(axis=1) == pytest.approx(2.0 / 3.0, abs=5e-3)
    assert (cosine**2).mean(axis=1) == pytest.approx(0.5, abs=5e-3)
    assert w.mean(axis=2) == pytest.approx(2.0 / 3.0 * normal[:, :, 0], abs=1e-2)


@pytest.mark.parametrize("far", [1e-9, 0.3, 1.0, 7.0, 1e5])
def test_a_ball_on_a_floor(far):
    """Of the sky over a floor a ball hides (r / d)^2 cos, also where it touches the floor."""
    v = np.array([far, 0.0, 1.0])
    want = math.pi * (1.0 - (far * far + 1.0) ** -1.5)
    got = visible_factor(Hemisphere(), UP, (v[None, :, None], np.ones((1, 1))), NO_FACES)[0]
    assert got == pytest.approx(want, abs=1e-15)


@pytest.mark.parametrize("lift", [0.0, 1e-17, -1e-17, 1e-15, -1e-15, -0.5])
@pytest.mark.parametrize("far", [1e-6, 0.1, 1.0, 50.0])
def test_an_endless_wall(far, lift):
    """Its foot lies in the horizon, or near it by rounding, or below it."""
    wide = 1e6
    foot, top = (np.array([far, -wide, z]) for z in (lift, 1.0))
    along = np.array([0.0, 2.0 * wide, 0.0])
    wall = np.array([foot, foot + along, top + along, top])[None, :, :, None]
    got = visible_factor(Hemisphere(), UP, NO_BALLS, wall)[0]
    assert got == pytest.approx(0.5 * math.pi * (1.0 + far / math.hypot(far, 1.0)), abs=1e-5)


@pytest.mark.parametrize("seed", range(30))
def test_it_is_the_sum_of_two_suns_of_half_the_sky_each(seed):
    """These stop 1.3e-6 radians before their common edge."""
    rng = np.random.default_rng(seed)
    n, k, m = 40, rng.integers(0, 20), rng.integers(0, 4)
    normal, point = unit(rng, n), np.zeros((3, n))
    v = rng.normal(scale=2.0, size=(k, 3, n))
    radius = np.sqrt((v * v).sum(axis=1)) * rng.uniform(0.02, 0.6, (k, n))
    corner, a, b = rng.normal(size=(3, m, 3, n))
    faces = np.stack([corner, corner + a, corner + a + b, corner + b], axis=1)
    got = visible_factor(Hemisphere(), normal, (v, radius), faces)
    want = np.zeros(n)
    for z in (1.0, -1.0):
        sun = SunLight((0.0, 0.0, z), (1.0, 1.0, 1.0), math.pi)
        half = make_emitter(sun, LightMotion(np.zeros(3), np.zeros(3)))
        outline = half.silhouette(half.to_center(point), normal)
        want += visible_factor(outline, normal, (v, radius), faces)
    assert got == pytest.approx(want, abs=1e-5)


def test_floors_and_balls_in_the_open_are_as_bright_as_the_sky():
    want = 0.8 * np.array(SKY.radiance)[:, None]
    for shape in (BALL, FLOOR):
        film = render_image(scene_of(shape), EXACT)
        inner = (film.color[0] > 0.0) & ~film.mask[2]
        assert inner.sum() > 20 and np.abs(film.color[:, inner] - want).max() < 1e-12
        assert not film.mask[0].any() and not film.mask[1].any()


@pytest.mark.parametrize(
    "shapes",
    [
        (FLOOR, BALL),
        (FLOOR, CARD),
        (FLOOR, WALL, BALL),
        pytest.param((FLOOR, *CUBE, BALL), marks=pytest.mark.slow),
    ],
    ids=["ball", "card", "wall", "cube"],
)
def test_pictures_agree_with_brute_force(shapes):
    scene = scene_of(*shapes)
    want, error = reference(scene, 1024)
    noise, mean = rms(error), want.mean()
    exact, rays = (render_image(scene, settings).color for settings in (EXACT, RAYS))
    # the samples of a pixel may be all alike by chance
    off = np.abs(exact - want) > 7.0 * np.maximum(error, 0.5 * noise) + 5e-3 * mean
    assert not off.any(), np.argwhere(off).tolist()
    assert rms(exact - want) < 1.5 * noise + 1e-3 * mean
    assert rms(rays - want) < 1.5 * noise + 0.03 * mean
    assert exact.mean() == pytest.approx(mean, rel=1e-3)
    assert rays.mean() == pytest.approx(mean, rel=3e-3)


@pytest.mark.slow
@pytest.mark.parametrize("settings", [EXACT, RAYS], ids=["exact", "rays"])
def test_motion(settings):
    ball = replace(BALL, motion=Motion((1.5, 0.5, 0.3)))
    scene = scene_of(FLOOR, *CUBE, WALL, ball)
    assert_agrees(scene, settings, 1024, 1e-3 if settings is EXACT else 0.03)


def with_sky(seed):
    """A random scene under a sky, with or without another light."""
    scene = random_scene(seed)
    return replace(scene, lights=(SKY, *scene.lights[: seed % 2]))


@pytest.mark.parametrize("seed", [*range(13), pytest.param(13, marks=pytest.mark.slow)])
def test_no_pixel_that_depends_is_left_out(seed):
    scene = with_sky(seed)
    assert_no_pixel_is_left_out(scene, seed)


@pytest.mark.parametrize("seed", range(8))
def test_random_scenes_agree_with_brute_force(seed):
    scene = with_sky(seed)
    assert_agrees(scene, replace(EXACT, tolerance=3e-3), 256, 5e-3)


@pytest.mark.parametrize("shapes", [[Sphere((0, 0, 0.0), 3.0)], box((-2, -2, -2.0), 4, 4, 4)])
def test_it_is_dark_inside(shapes):
    camera = look_at((0.1, -1.0, 0.2), (0.0, 0.0, 0.0), resolution=(12, 8), focal_length=20.0)
    for settings in (EXACT, replace(RAYS, light_rays=8)):
        film = render_image(Scene(camera, tuple(shapes), (SKY,)), settings)
        assert film.color.max() < 1e-12 and film.alpha.min() == 1.0


@pytest.mark.parametrize("settings", [EXACT, RAYS], ids=["exact", "rays"])
def test_without_penumbrae_or_shadows_nothing_hides_it(settings):
    """A sky has no centre from which it could cast hard shadows."""
    shapes = (FLOOR, *CUBE, BALL)
    open_ = render_image(scene_of(*shapes, light=replace(SKY, casts_shadow=False)), settings)
    off = render_image(scene_of(*shapes), replace(settings, use_penumbra=False))
    assert open_.color == pytest.approx(off.color, abs=1e-12)
    middle = off.color[:, off.color[0] == off.color[0].max()]
    assert middle == pytest.approx(0.8 * np.array(SKY.radiance)[:, None] + 0.0 * middle)
    skipped = make_plan(scene_of(*shapes), replace(settings, use_penumbra=False)).skipped
    said = next(each["why"] for each in skipped if each["what"] == "penumbrae")
    assert said.endswith("what surrounds the scene casts no shadows")


@pytest.mark.parametrize("settings", [EXACT, RAYS], ids=["exact", "rays"])
def test_batches_do_not_matter(settings):
    rng = np.random.default_rng(4)
    balls = [Sphere(tuple(rng.uniform((-2, -2, 0.3), (2, 2, 2))), 0.4) for _ in range(24)]
    scene = scene_of(FLOOR, *balls)
    one, two = (render_image(scene, replace(settings, batch=size)) for size in (64, 65_536))
    assert np.array_equal(one.color, two.color) and np.array_equal(one.mask, two.mask)


def test_batches_are_small_where_there_are_many_objects():
    balls = [Sphere((float(x), 0.0, 1.0), 0.4) for x in range(2000)]
    assert make_plan(scene_of(FLOOR), EXACT).settings.batch == EXACT.batch
    # where all occluders of a point are listed
    plan = make_plan(scene_of(*balls), replace(EXACT, accelerator="ARRAYS"))
    assert plan.settings.batch == MAX_BATCH_PAIRS // 2000
    lamp = SunLight((0.0, 0.0, -1.0), (1.0, 1.0, 1.0))
    assert make_plan(scene_of(*balls, light=lamp), EXACT).settings.batch == EXACT.batch


def test_defects_and_brightness():
    bad = (
        replace(SKY, radiance=(math.nan, 0.0, 0.0), name="nan"),
        replace(SKY, radiance=(0.0, math.inf, 0.0), name="endless"),
    )
    scene = validate(replace(scene_of(FLOOR), lights=(*bad, SKY)))
    assert scene.lights == (SKY,)
    assert [issue.name for issue in scene.issues] == ["nan", "endless"]
    assert SKY.brightened(2.0).radiance == (2.0, 1.6, 1.2)
