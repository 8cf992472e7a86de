# SPDX-License-Identifier: GPL-3.0-or-later
"""Suns: closed forms, penumbrae, hard shadows, and that distance is no matter."""

from __future__ import annotations

import math
from dataclasses import replace

import mpmath
import numpy as np
import pytest

from adaptive_drt.lights.emitter import LightMotion
from adaptive_drt.lights.occluded_form_factor import visible_factor
from adaptive_drt.lights.registry import make_emitter
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import (
    Motion,
    PointLight,
    Quad,
    Scene,
    SceneError,
    Sphere,
    SphereLight,
    SunLight,
    validate,
)
from adaptive_drt.scene.settings import Settings
from light_checks import BALL, CAMERA, EXACT, FLOOR, assert_agrees, assert_no_pixel_is_left_out
from oracle.picture import reference
from random_scenes import look_at, random_scene

WHITE = (1.0, 1.0, 1.0)
EARTH = 0.00918
"""Blender's default angle of a sun, in radians: 0.526 degrees."""
ANGLES = {"earth": EARTH, "20 degrees": math.radians(20.0), "120 degrees": math.radians(120.0)}
RAYS = Settings(method="RAYS", light_rays=64, pixel_rays=64, time_rays=64, threads=1)
CARD = Quad((1.2, -0.5, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.3))
SUN = SunLight((0.3, 0.5, -1.0), (3.0, 2.0, 1.0))


def emitter_of(sun):
    return make_emitter(sun, LightMotion(np.array((5.0, -3.0, 2.0)), np.array((0.1, 0.0, 0.0))))


def scene_of(sun, *shapes, **fields):
    return Scene(CAMERA, shapes or (FLOOR, BALL, CARD), (sun,), **fields)


def cap(tilt, half):
    """Integral of max(0, n.w) over a circular cone: exact in azimuth, quadrature in the angle."""

    def ring(angle):
        a, b = mpmath.cos(tilt) * mpmath.cos(angle), mpmath.sin(tilt) * mpmath.sin(angle)
        if a >= abs(b):
            return 2 * mpmath.pi * a * mpmath.sin(angle)
        if a <= -abs(b):
            return mpmath.mpf(0)
        phi = mpmath.acos(-a / b)
        return 2 * (a * phi + b * mpmath.sin(phi)) * mpmath.sin(angle)

    kink = abs(mpmath.pi / 2 - tilt)
    return mpmath.quad(ring, [0, kink, half] if kink < half else [0, half])


@pytest.mark.parametrize("half", [1e-9, 1e-5, EARTH / 2.0, 0.2, 1.0, 1.5])
@pytest.mark.parametrize("share", [-3.0, -0.999, -0.5, 0.0, 0.3, 0.999, 3.0, "zenith"])
def test_irradiance_is_that_of_a_cone(half, share):
    """Of a sun wholly above the horizon it is the cosine, whatever the angle."""
    half = float(half)
    elevation = 9.0 if share == "zenith" else share * half
    elevation = float(np.clip(elevation, -math.pi / 2.0, math.pi / 2.0))
    emitter = emitter_of(
        SunLight((-math.cos(elevation), 0.0, -math.sin(elevation)), WHITE, 2 * half)
    )
    point, up = np.array([[1.0], [2.0], [3.0]]), np.array([[0.0], [0.0], [1.0]])
    got = emitter.power[0] * emitter.irradiance_factor(emitter.to_center(point), point, up)[0]
    with mpmath.workdps(40):
        exact = mpmath.atan2(mpmath.mpf(math.sin(elevation)), mpmath.mpf(math.cos(elevation)))
        want = cap(mpmath.pi / 2 - exact, mpmath.mpf(half)) / (mpmath.pi * mpmath.sin(half) ** 2)
    assert got == pytest.approx(float(want), rel=1e-9, abs=4e-14)
    if elevation >= half:
        assert got == pytest.approx(math.sin(elevation), rel=1e-13)


@pytest.mark.parametrize("half", [1e-6, 1e-4, EARTH / 2.0, 0.2, 1.2])
@pytest.mark.parametrize("size", [0.3, 1.0, 1.7])
@pytest.mark.parametrize("apart", [0.1, 0.75, 0.9])
def test_partly_occluded_suns_do_not_cancel(half, size, apart):
    """A sphere before a sun at the zenith, against the integral over rings of the sun.

    size : of the sphere, in half angles of the sun.  apart : of their centres, as a share of the
    least distance at which both are seen whole.
    """
    sun = emitter_of(SunLight((0.0, 0.0, -1.0), WHITE, 2.0 * half))
    other, lean = min(size * half, 1.5), apart * (1.0 + size) * half
    point, up = np.zeros((3, 1)), np.array([[0.0], [0.0], [1.0]])
    v = np.array([math.sin(lean), 0.0, math.cos(lean)])
    radius = np.array([[math.sin(other)]])
    outline = sun.silhouette(sun.to_center(point), up)
    none = np.zeros((0, 4, 3, 1))
    got = sun.power[0] * visible_factor(outline, up, (v[None, :, None], radius), none)[0]
    with mpmath.workdps(40):
        alpha, beta = mpmath.mpf(half), mpmath.asin(mpmath.mpf(float(radius[0, 0])))
        delta = mpmath.atan2(mpmath.mpf(v[0]), mpmath.mpf(v[2]))

        def hidden(angle):
            both = mpmath.sin(angle) * mpmath.sin(delta)
            turn = (mpmath.cos(beta) - mpmath.cos(angle) * mpmath.cos(delta)) / both
            arc = mpmath.acos(min(max(turn, -1), 1))
            return 2 * arc * mpmath.cos(angle) * mpmath.sin(angle)

        kinks = {abs(delta - beta), min(delta + beta, alpha)}
        steps = sorted(k for k in kinks if 0 < k < alpha)
        covered = mpmath.quad(hidden, [mpmath.mpf(0), *steps, alpha])
        want = 1 - covered / (mpmath.pi * mpmath.sin(alpha) ** 2)
    # the angles of sun and sphere are known to a few roundoffs of a radian
    assert got == pytest.approx(float(want), abs=1e-14 + 64.0 * 2.0**-53 / half)


@pytest.mark.parametrize("angle", [0.0, EARTH, 1.0, math.pi])
def test_all_points_see_the_same(angle):
    sun = emitter_of(replace(SUN, angle=angle))
    point = np.random.default_rng(1).normal(size=(3, 50)) * np.logspace(-9, 30, 50)
    to = sun.to_center(point, 0.3)
    assert np.array_equal(to, np.broadcast_to(to[:, :1], to.shape))
    cone = sun.view_cone(to)
    assert cone.sine == pytest.approx(math.sin(angle / 2.0), rel=1e-11)
    way = -np.array(SUN.direction) / np.linalg.norm(SUN.direction)
    assert cone.axis == pytest.approx(np.broadcast_to(way[:, None], to.shape))
    assert sun.extended == (angle > 0.0) and sun.displacement is None
    # as a point it is in the same place, and so are its parts
    spot = sun.point_at(0.5 * sun.radius * np.array([[0.0], [0.0], [1.0]]))
    assert np.array_equal(sun.as_point().to_center(point), to)
    assert not spot.extended and np.ptp(spot.to_center(point), axis=1).max() == 0.0


@pytest.mark.parametrize("angle", [EARTH, 0.35, 2.0])
def test_samples_are_uniform_over_the_disk(angle):
    sun = emitter_of(replace(SUN, angle=angle))
    rng = np.random.default_rng(2)
    a, b = rng.random((2, 1, 20_000))
    point, up = np.zeros((3, 1, 1)), np.array([[[0.0]], [[0.0]], [[1.0]]])
    to, weight = sun.sample(sun.to_center(point), point, up, a, b)
    axis = sun.view_cone(sun.to_center(point)).axis[:, 0, 0]
    drop = 1.0 - axis @ (to[:, 0] / np.linalg.norm(to[:, 0], axis=0))
    most = 1.0 - math.cos(angle / 2.0)
    assert drop.max() <= most + 1e-15
    assert np.mean(drop) == pytest.approx(most / 2.0, rel=0.02)
    factor = sun.irradiance_factor(sun.to_center(point)[:, :, 0], point[:, :, 0], up[:, :, 0])
    assert weight.mean() == pytest.approx(factor[0], rel=0.02)


@pytest.mark.parametrize("method", ["EXACT", "RAYS"])
@pytest.mark.parametrize("angle", [*ANGLES.values(), 0.0])
def test_it_is_the_limit_of_lights_far_off(angle, method):
    sun, far = replace(SUN, angle=angle), 1e6
    place = tuple(-far * np.array(SUN.direction) / np.linalg.norm(SUN.direction))
    power = np.array(SUN.irradiance)
    if angle:
        half = math.sin(angle / 2.0)
        lamp = SphereLight(place, far * half, tuple(power / (math.pi * half**2)))
    else:
        lamp = PointLight(place, tuple(power * far**2))
    settings = EXACT if method == "EXACT" else RAYS
    one, two = (render_image(scene_of(light), settings) for light in (sun, lamp))
    off, mean = np.abs(one.color - two.color), one.color.mean()
    assert np.sqrt((off**2).mean()) < 1e-3 * mean and off.max() < 0.02 * mean
    assert (one.mask != two.mask).sum() <= 2


@pytest.mark.parametrize("blocker", [BALL, CARD], ids=["sphere", "quad"])
@pytest.mark.parametrize("angle", [*ANGLES.values(), 0.0])
def test_shadows_agree_with_brute_force(angle, blocker):
    scene = scene_of(replace(SUN, angle=angle), FLOOR, blocker)
    want, error = reference(scene, 1024)
    noise, mean = np.sqrt((error**2).mean()), want.mean()
    exact, rays = (render_image(scene, settings).color for settings in (EXACT, RAYS))
    # the tolerance is an RMS: a pixel may be beyond it
    off = np.abs(exact - want) / (7.0 * error + 5e-3 * mean)
    assert (off > 1.0).any(axis=0).sum() <= 1, np.argwhere(off > 1.0).tolist()
    assert off.max() < 2.0
    assert np.sqrt(((exact - want) ** 2).mean()) < 1.5 * noise + 1e-3 * mean
    # rays do not average over a pixel in a penumbra
    assert np.sqrt(((rays - want) ** 2).mean()) < 1.5 * noise + 0.02 * mean
    assert rays.mean() == pytest.approx(mean, rel=2e-3)


def test_penumbrae_are_flagged_and_hard_edges_are_edges():
    soft, hard = (
        render_image(scene_of(replace(SUN, angle=angle)), RAYS).mask
        for angle in (math.radians(5.0), 0.0)
    )
    assert soft[0].sum() > 5 and not hard[0].any() and not hard[1].any()
    # of the pixels that a hard shadow's edge crosses, a soft one's are flagged one way or other
    assert hard[2].sum() > 20 and soft.any(axis=0)[hard[2]].all()


def with_suns(seed):
    """A random scene whose lights are suns, some without penumbrae."""
    rng, scene = np.random.default_rng([seed, 7]), random_scene(seed)
    suns = []
    for light in scene.lights:
        way = rng.normal((0.0, 0.0, -1.5))
        angle = float(rng.choice([0.0, EARTH, 0.1, 0.8, 2.5]))
        suns.append(SunLight(tuple(way), WHITE, angle, casts_shadow=light.casts_shadow))
    return replace(scene, lights=tuple(suns))


@pytest.mark.parametrize(
    "seed", [pytest.param(8, marks=pytest.mark.slow), *range(8), *range(9, 14)]
)
def test_no_pixel_that_depends_is_left_out(seed):
    scene = with_suns(seed)
    assert_no_pixel_is_left_out(scene, seed)


@pytest.mark.parametrize("seed", range(6))
def test_random_scenes_agree_with_brute_force(seed):
    """Motion of camera and objects, too: the sun stays where it is."""
    scene = with_suns(seed)
    assert_agrees(scene, replace(EXACT, tolerance=3e-3), 256, 5e-3)


def test_a_moving_camera_does_not_move_the_sun():
    scene = scene_of(SUN)
    moving = replace(scene, camera=replace(CAMERA, motion=Motion((0.2, 0.0, 0.1))))
    shapes = tuple(replace(s, motion=Motion((-0.2, 0.0, -0.1))) for s in scene.shapes)
    one, two = (render_image(x, EXACT) for x in (moving, replace(scene, shapes=shapes)))
    assert one.color == pytest.approx(two.color, abs=1e-9)
    assert np.array_equal(one.mask, two.mask)


@pytest.mark.parametrize("far", [1e3, 1e8])
def test_every_occluder_counts_however_far(far):
    """A ball that covers the sun but for a ring: an annular eclipse."""
    half = EARTH / 2.0
    moon = Sphere((0.0, 0.0, far), far * math.sin(0.9 * half))
    noon = SunLight((0.0, 0.0, -1.0), WHITE, EARTH)
    small = Quad((-1e-3, -1e-3, 0.0), (2e-3, 0.0, 0.0), (0.0, 2e-3, 0.0))
    camera = look_at((0.0, 0.0, 1e-3), (0.0, 1e-6, 0.0), resolution=(6, 4), focal_length=35.0)
    for settings in (EXACT, replace(RAYS, light_rays=4096)):
        film = render_image(Scene(camera, (small, moon), (noon,)), settings)
        want = 0.8 / math.pi * (1.0 - (math.sin(0.9 * half) / math.sin(half)) ** 2)
        assert film.color == pytest.approx(want, rel=1e-3 if settings is EXACT else 0.03)


@pytest.mark.parametrize("angle", [0.0, EARTH, 1.0])
def test_embree_finds_the_same_occluders(angle):
    pytest.importorskip("embreex")
    rng = np.random.default_rng(3)
    balls = [Sphere(tuple(rng.uniform((-3, -3, 0.2), (3, 3, 2))), 0.15) for _ in range(40)]
    scene = scene_of(replace(SUN, angle=angle), FLOOR, *balls)
    pictures = [
        render_image(scene, replace(RAYS, accelerator=name)).color for name in ("EMBREE", "ARRAYS")
    ]
    assert np.array_equal(*pictures)


def test_without_shadow_and_without_penumbrae():
    plain = render_image(scene_of(replace(SUN, casts_shadow=False, angle=0.5)), EXACT).color
    open_ = render_image(scene_of(SUN, FLOOR), EXACT).color
    assert plain[:, 0] == pytest.approx(open_[:, 0])
    hard = render_image(scene_of(replace(SUN, angle=0.0)), RAYS).color
    off = render_image(scene_of(replace(SUN, angle=0.05)), replace(RAYS, use_penumbra=False)).color
    assert off == pytest.approx(hard, abs=2e-2 * hard.mean())


def test_defects():
    bad = (
        replace(SUN, angle=-0.1, name="negative"),
        replace(SUN, angle=math.nan, name="nan"),
        replace(SUN, angle=4.0, name="more than half of all directions"),
        replace(SUN, direction=(0.0, 0.0, 0.0), name="nowhere"),
        replace(SUN, direction=(math.inf, 0.0, 0.0), name="endless"),
        replace(SUN, irradiance=(math.nan, 0.0, 0.0), name="bright"),
    )
    good = (SUN, replace(SUN, direction=(0.0, 0.0, -1e-30)), replace(SUN, angle=math.pi))
    scene = validate(replace(scene_of(SUN), lights=(*bad, *good)))
    assert scene.lights == good
    assert [issue.name for issue in scene.issues] == [light.name for light in bad]
    with pytest.raises(SceneError):
        validate(replace(scene, camera=None))


def test_brightened():
    assert SUN.brightened(2.0).irradiance == (6.0, 4.0, 2.0)
