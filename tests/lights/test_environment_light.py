# SPDX-License-Identifier: GPL-3.0-or-later
"""Environments as lights: emitters, pictures against brute force, and the tolerance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.lights.emitter import LightMotion
from adaptive_drt.lights.environment_light import make_environment_emitter
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import (
    EnvironmentLight,
    Material,
    Motion,
    Quad,
    Scene,
    SkyLight,
    Sphere,
    SunLight,
    validate,
)
from adaptive_drt.scene.settings import Settings
from light_checks import BALL, CAMERA, FLOOR, rms
from random_scenes import random_scene
from sphere_images import glow, noise, radiance_of, random_turn, unit

GLOW = EnvironmentLight(glow(), rotation=random_turn(np.random.default_rng(1)))
FLAT = EnvironmentLight(np.full((4, 8, 3), 0.5), (1.0, 0.8, 0.6))
CARD = Quad((1.2, -0.5, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.3), Material((0.3, 0.8, 0.4)))
EXACT = Settings(tolerance=3e-3, threads=1)
RAYS = Settings(method="RAYS", light_rays=256, pixel_rays=64, time_rays=64, threads=1)


def emitter(light):
    return make_environment_emitter(light, LightMotion(np.zeros(3), np.zeros(3)))


def scene_of(*shapes, light=GLOW, **fields):
    return Scene(CAMERA, shapes, (light,), **fields)


def test_channels_add_up():
    rng, light = np.random.default_rng(2), emitter(GLOW)
    normal = unit(rng, 20)
    point = rng.normal(size=(3, 20))
    to = light.to_center(point)
    every = light.irradiance_factor(to, point, normal)
    assert every.shape == (3, 20)
    for channel, part in enumerate(light.channels()):
        assert np.array_equal(part.power, np.eye(3)[channel])
        assert part.irradiance_factor(to, point, normal) == pytest.approx(
            every[channel], abs=2.0 * light.factor_error
        )
    grey = emitter(EnvironmentLight(np.repeat(glow()[:, :, :1], 3, axis=2)))
    assert grey.channels() == (grey,) and grey.irradiance_factor(to, point, normal).ndim == 1


def test_samples_have_the_irradiance_as_mean():
    rng, light = np.random.default_rng(3), emitter(GLOW).channels()[1]
    normal = unit(rng, 5, 1)
    point = np.zeros((3, 5, 1))
    a, b = rng.random((2, 5, 40_000))
    to, weight = light.sample(light.to_center(point), point, normal, a, b)
    want = light.irradiance_factor(to[:, :, 0], point[..., 0], normal[..., 0])
    assert weight.mean(axis=1) == pytest.approx(want, rel=0.03)
    way = to / np.sqrt((to * to).sum(axis=0))
    assert weight == pytest.approx(np.pi * radiance_of(GLOW, way)[1], rel=1e-9)


def test_a_constant_image_is_a_uniform_sky():
    shapes = (FLOOR, BALL, CARD)
    want = render_image(scene_of(*shapes, light=SkyLight((0.5, 0.4, 0.3))), EXACT).color
    assert render_image(scene_of(*shapes, light=FLAT), EXACT).color == pytest.approx(want, abs=1e-9)


@pytest.mark.parametrize("moves", [False, True], ids=["still", "moving"])
def test_pictures_against_distributed_rays(moves):
    ball = replace(BALL, motion=Motion((0.8, 0.0, 0.2))) if moves else BALL
    scene = scene_of(FLOOR, ball, CARD)
    want = render_image(scene, RAYS).color
    got = render_image(scene, EXACT).color
    assert rms(got - want) < 0.03 * want.mean()
    assert got.mean() == pytest.approx(want.mean(), rel=3e-3)


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in range(1, 10))]
)
def test_the_tolerance_is_kept(seed):
    rng = np.random.default_rng(seed)
    image = noise(rng) if seed % 3 == 2 else glow()
    light = EnvironmentLight(image, rotation=random_turn(rng))
    made = random_scene(seed)
    still = tuple(replace(shape, motion=None) for shape in made.shapes)
    camera = replace(made.camera, resolution=(18, 12), border=None, motion=None)
    scene = validate(Scene(camera, still, (light,), backdrop=light))
    want = render_image(scene, replace(EXACT, tolerance=1e-3)).color
    got = render_image(scene, replace(EXACT, tolerance=1e-2)).color
    assert rms(got - want) < 1e-2 * want.mean()


def test_beside_other_lights_and_without_penumbrae():
    sun = SunLight((0.3, 0.2, -1.0), (1.0, 0.9, 0.8))
    both = render_image(replace(scene_of(FLOOR, BALL), lights=(GLOW, sun)), EXACT).color
    parts = [render_image(scene_of(FLOOR, BALL, light=each), EXACT).color for each in (GLOW, sun)]
    assert rms(both - sum(parts)) < 3e-3 * both.mean()
    hard = replace(EXACT, use_penumbra=False)
    open_ = render_image(scene_of(FLOOR, BALL), hard).color
    assert open_.mean() > render_image(scene_of(FLOOR, BALL), EXACT).color.mean()


def test_what_is_wrong_is_told():
    bad = EnvironmentLight(np.full((2, 4, 3), np.nan))
    empty = EnvironmentLight(np.zeros((0, 4, 3)))
    bent = replace(GLOW, rotation=((1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 1.0)))
    scene = validate(Scene(CAMERA, (FLOOR,), (bad, empty, bent), backdrop=bad))
    assert not scene.lights and scene.backdrop is None and len(scene.issues) == 4
    assert GLOW == replace(GLOW) and hash(GLOW) == hash(replace(GLOW)) and GLOW != FLAT
    assert GLOW.brightened(2.0).radiance == (2.0, 2.0, 2.0)
    black = render_image(scene_of(FLOOR, light=EnvironmentLight(np.zeros((2, 4, 3)))), EXACT)
    assert not black.color.any()


def test_a_point_within_a_ball_is_lit_by_rays():
    scene = scene_of(FLOOR, Sphere((0.0, -1.0, 0.0), 2.0), BALL)
    assert np.isfinite(render_image(scene, EXACT).color).all()
