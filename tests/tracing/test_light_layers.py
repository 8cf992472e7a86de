# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights that the camera sees, against plain rays: what they add to a picture, still and moving."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.render import render_image
from adaptive_drt.scene.description import (
    DiskLight,
    Ellipse,
    EllipseLight,
    Motion,
    PointLight,
    Quad,
    QuadLight,
    Scene,
    SkyLight,
    Sphere,
    SphereLight,
    SpotLight,
    SunLight,
)
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.light_layers import make_light_layers
from plain_hits import oracle_depth, rays
from random_scenes import look_at

EYE = np.array([0.0, -6.0, 1.6])
CAMERA = look_at(EYE, (0.0, 0.0, 1.2), resolution=(30, 20), focal_length=35.0)
SHAPES = (
    Quad((-8.0, -8.0, 0.0), (16.0, 0.0, 0.0), (0.0, 16.0, 0.0)),
    Sphere((0.0, 0.0, 1.0), 0.7),
    Quad((-1.5, -0.4, 0.4), (1.0, 0.2, 0.1), (0.1, 0.1, 1.2)),
)
WHITE = (3.0, 2.0, 1.0)
LIGHTS = {
    "quad": QuadLight((0.6, 0.3, 1.6), (-0.6, 0.1, -0.2), (0.1, 0.3, -0.6), WHITE),
    "ellipse": EllipseLight((0.6, 0.3, 1.6), (0.6, 0.1, 0.2), (0.1, 0.3, 0.7), WHITE),
    "sphere": SphereLight((-0.8, 0.1, 1.3), 0.6, WHITE),
    "facing disk": DiskLight((-0.8, 0.2, 1.3), 0.6, WHITE),
    "sun": SunLight((0.1, -1.0, -0.05), (0.1, 0.2, 0.1), 0.3),
}
SAMPLES = 8192
SETTINGS = Settings(tolerance=1e-3, threads=1)


def facing_disk(light):
    """The disk as the camera sees it at the middle of the shutter."""
    axis = np.array(light.center) - EYE
    axis /= np.linalg.norm(axis)
    u = np.cross(axis, (0.0, 0.0, 1.0))
    u *= light.radius / np.linalg.norm(u)
    return Ellipse(light.center, tuple(u), tuple(np.cross(axis, u)), motion=light.motion)


def visible(light):
    """The shape of a light, as a record for the plain rays."""
    if isinstance(light, QuadLight):
        center, u, v = (np.array(part) for part in (light.center, light.half_u, light.half_v))
        return Quad(tuple(center - u - v), tuple(2.0 * u), tuple(2.0 * v), motion=light.motion)
    if isinstance(light, EllipseLight):
        return Ellipse(light.center, light.half_u, light.half_v, motion=light.motion)
    if isinstance(light, SphereLight):
        return Sphere(light.center, light.radius, motion=light.motion)
    if isinstance(light, DiskLight):
        return facing_disk(light)
    way = -np.array(light.direction) / np.linalg.norm(light.direction)
    far = 1e6
    return Sphere(tuple(EYE + far * way), far * np.sin(light.angle / 2.0))


def shares(light, shapes, moving):
    """Share (height, width) of each pixel and the shutter in which the light is seen."""
    width, height = CAMERA.resolution
    steps = np.array([0.8191725133961645, 0.6710436067037893, 0.5497004779019703])
    x, y, t = ((np.arange(SAMPLES) + 0.5)[None] * steps[:, None]) % 1.0
    t = t - 0.5 if moving else 0.0 * t
    found, shape = np.zeros((height, width)), visible(light)
    for row in range(height):
        for column in range(width):
            ray = rays(CAMERA, column + x, row + y)
            own = oracle_depth(shape, ray, t, EYE[:, None])
            others = [oracle_depth(each, ray, t, EYE[:, None]) for each in shapes]
            found[row, column] = (np.isfinite(own) & (own < np.min(others, axis=0))).mean()
    return found


def film_of(*lights, settings=None, shapes=SHAPES, **fields):
    """The film of lights that are seen and light nothing."""
    only_seen = tuple(light.met(seen=True, lights_surfaces=False) for light in lights)
    return render_image(Scene(CAMERA, shapes, only_seen, **fields), settings or SETTINGS)


def radiance(light):
    if isinstance(light, SunLight):
        return np.array(light.irradiance) / (np.pi * np.sin(light.angle / 2.0) ** 2)
    return np.array(light.radiance)


@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("kind", LIGHTS)
def test_a_light_is_seen_exactly(kind, moving):
    light, shapes = LIGHTS[kind], SHAPES
    if moving:
        if kind != "sun":
            light = replace(light, motion=Motion((0.5, 0.0, 0.2)))
        shapes = (SHAPES[0], replace(SHAPES[1], motion=Motion((0.0, 0.3, 0.8))), SHAPES[2])
    want = radiance(light)[:, None, None] * shares(light, shapes, moving)
    film = film_of(light, shapes=shapes)
    assert want.max() > 0.7 * radiance(light).max() and (want == 0.0).any()
    off = np.sqrt(((film.color - want) ** 2).mean())
    assert off < 2e-3 * radiance(light).mean()
    assert film.color.mean() == pytest.approx(want.mean(), rel=2e-3)
    assert film.stats["error_estimate"] < 1e-3
    assert film.mask[1].any() == moving and film.mask[2].any()


def test_both_methods_agree():
    rays_settings = Settings(method="RAYS", pixel_rays=1024, threads=1)
    exact = film_of(LIGHTS["ellipse"])
    sampled = film_of(LIGHTS["ellipse"], settings=rays_settings)
    assert np.sqrt(((exact.color - sampled.color) ** 2).mean()) < 5e-3
    assert (exact.mask[2] == sampled.mask[2]).all()


def test_lights_hide_nothing():
    """Their light is added to what is behind, and alpha is that of the objects alone."""
    sky = np.array([0.1, 0.2, 0.3])
    black, open_ = film_of(LIGHTS["sphere"]), film_of(LIGHTS["sphere"], transparent=True)
    blue = film_of(LIGHTS["sphere"], background=tuple(sky))
    none = film_of(background=tuple(sky))
    assert np.allclose(blue.color - none.color, black.color, atol=1e-12)
    assert np.allclose(open_.color, black.color) and (open_.alpha == 0.0).any()


def test_lights_add_up():
    one, other = LIGHTS["sphere"], LIGHTS["facing disk"]
    apart = film_of(one).color + film_of(other).color
    assert np.allclose(film_of(one, other).color, apart, atol=1e-12)


@pytest.mark.parametrize(
    "light",
    [
        QuadLight((0.6, 0.3, 1.6), (0.1, 0.3, -0.6), (-0.6, 0.1, -0.2), WHITE),
        PointLight((0.6, 0.3, 1.6), WHITE),
        SkyLight(WHITE),
        SphereLight((0.0, -9.0, 1.0), 0.5, WHITE),
        SunLight((0.1, -1.0, -0.05), WHITE, 0.0),
    ],
)
def test_what_is_not_seen(light):
    """The dark side of a flat light, points, the sky, and what is behind the camera."""
    plan = make_plan(Scene(CAMERA, SHAPES, (replace(light, seen=True),)), Settings())
    assert len(plan.lights) == 1 and make_light_layers(plan) == []


def test_a_light_that_lights_nothing():
    film = film_of(LIGHTS["sphere"])
    lit = film.color.any(axis=0)
    assert 0 < lit.sum() < 0.2 * lit.size
    assert not film.stats["issues"]


def test_a_border_is_a_part_of_the_picture():
    light = LIGHTS["ellipse"].met(seen=True, lights_surfaces=False)
    scene = Scene(CAMERA, SHAPES, (light,))
    border = replace(CAMERA, border=(13, 4, 22, 13))
    part = render_image(replace(scene, camera=border), SETTINGS)
    assert part.color.any() and (part.color == film_of(light).color[:, 4:13, 13:22]).all()


def test_the_profile_of_a_spot_is_seen():
    """A disk that is seen from the edge of its cone is as bright as what it sends there."""
    place = np.array((0.9, 0.5, 1.6))
    way = (EYE - place) / np.linalg.norm(EYE - place)
    side = np.cross(way, (0.0, 0.0, 1.0))
    side /= np.linalg.norm(side)
    whole = film_of(SpotLight(tuple(place), tuple(way), WHITE, 1.0, 1.0, 0.4)).color
    assert whole.max() == pytest.approx(WHITE[0] / (np.pi * 0.16), rel=1e-3)
    for turn in (0.1, 0.3, 0.45, 0.6):
        axis = np.cos(turn) * way + np.sin(turn) * side
        seen = film_of(SpotLight(tuple(place), tuple(axis), WHITE, 1.0, 1.0, 0.4)).color
        x = np.clip((np.cos(turn) - np.cos(0.5)) / (1.0 - np.cos(0.5)), 0.0, 1.0)
        assert seen.sum() / whole.sum() == pytest.approx(x * x * (3.0 - 2.0 * x), abs=0.02)
