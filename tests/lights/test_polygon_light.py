# SPDX-License-Identifier: GPL-3.0-or-later
"""Convex polygon lights: their irradiance, bounds and samples, and pictures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.lights.emitter import LightMotion
from adaptive_drt.lights.polygon_light import PolygonEmitter, make_polygon_emitter
from adaptive_drt.lights.quad_light import make_quad_emitter
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import (
    EllipseLight,
    Motion,
    PolygonLight,
    Quad,
    QuadLight,
    Scene,
)
from light_checks import (
    BALL,
    CAMERA,
    EXACT,
    FLOOR,
    assert_agrees,
    assert_both_methods_agree,
    assert_no_pixel_is_left_out,
    assert_tolerance_is_kept,
    rms,
)
from random_scenes import lights_spanned, look_at, random_scene

CARD = Quad((0.7, -0.9, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.3))
GLOW = (9.0, 8.0, 7.0)
AT_REST = LightMotion(np.zeros(3), np.zeros(3))


def placed(*corners):
    """A polygon of corners (x, y) around (1, -1, 3.5), which shines downwards, a little tilted."""
    u, v, middle = (0.9, 0.0, 0.3), (0.1, -0.8, 0.1), (1.0, -1.0, 3.5)
    rows = (np.array(middle) + x * np.array(u) + y * np.array(v) for x, y in corners)
    return PolygonLight(tuple(tuple(row.tolist()) for row in rows), GLOW)


def disk(sides, radius=0.6):
    turns = 2.0 * np.pi * np.arange(sides) / sides
    return placed(*zip(radius * np.cos(turns), radius * np.sin(turns), strict=True))


LIGHTS = {
    "triangle": placed((-0.5, -0.4), (0.6, -0.5), (0.1, 0.7)),
    "right triangle": placed((-0.5, -0.4), (0.9, -0.4), (-0.5, 0.3)),
    "pentagon": placed((-0.6, -0.2), (0.1, -0.5), (0.6, -0.3), (0.4, 0.4), (-0.5, 0.3)),
    "disk": disk(32),
}
EACH = pytest.mark.parametrize("kind", LIGHTS)
COUNT = 1_000


def seen(kind, seed, count=COUNT):
    """A light, vectors (3, n) from points before it to its centre, and normals towards it."""
    rng, light = np.random.default_rng(seed), make_polygon_emitter(LIGHTS[kind], AT_REST)
    away = rng.normal(size=(3, count)) * 10.0 ** rng.uniform(-0.3, 0.7, count)
    away *= np.sign((away * light.span.normal).sum(axis=0))
    normal = -away / np.sqrt((away * away).sum(axis=0)) + 0.7 * rng.normal(size=(3, count))
    normal /= np.sqrt((normal * normal).sum(axis=0))
    return rng, light, -away, normal


def sampled(rng, light, to, normal, count):
    a, b = rng.random((2, to.shape[1], count))
    return light.sample(to[..., None], -to[..., None], normal[..., None], a, b)


@pytest.mark.parametrize("seed", range(3))
def test_a_parallelogram_is_a_quad_light(seed):
    rng = np.random.default_rng(seed)
    center, u, v = rng.normal(size=(3, 3))
    one = make_quad_emitter(QuadLight(tuple(center), tuple(u), tuple(v), GLOW), AT_REST)
    corners = tuple(tuple((center + a * u + b * v).tolist()) for a, b in
                    ((1, 1), (-1, 1), (-1, -1), (1, -1)))  # fmt: skip
    light = PolygonLight(corners, GLOW)
    other = make_polygon_emitter(light, AT_REST)
    assert light.defect() is None and isinstance(one, PolygonEmitter)
    to, normal = rng.normal(size=(2, 3, 500)) * np.array([3.0, 1.0])[:, None, None]
    normal /= np.sqrt((normal * normal).sum(axis=0))
    for name, args in (
        ("irradiance_factor", (to, -to, normal)),
        ("height_range", (to, normal)),
        ("extent", (normal,)),
        ("horizon", (to, -to, normal)),
        ("is_above_horizon", (to, -to, normal, np.full(500, 0.1), np.zeros(500))),
    ):
        want, got = (np.array(getattr(each, name)(*args), dtype=float) for each in (one, other))
        assert got == pytest.approx(want, rel=1e-10, abs=1e-12), name


@EACH
def test_samples_have_the_irradiance_as_their_mean(kind):
    rng, light, to, normal = seen(kind, 1, 40)
    way, weight = sampled(rng, light, to, normal, 20_000)
    want = light.irradiance_factor(to, -to, normal)
    assert weight.mean(axis=1) == pytest.approx(want, rel=0.05, abs=1e-3)
    off = way - to[..., None]
    assert np.abs((off * light.span.normal[..., None]).sum(axis=0)).max() < 1e-12


@EACH
def test_bounds_of_the_light_hold(kind):
    rng, light, to, normal = seen(kind, 2)
    way, _ = sampled(rng, light, to, normal, 200)
    off = way - to[..., None]
    height = (way * normal[..., None]).sum(axis=0)
    extent, (low, high) = light.extent(normal), light.height_range(to, normal)
    assert np.all(np.abs((off * normal[..., None]).sum(axis=0)).max(axis=1) <= extent + 1e-12)
    assert np.all(height.min(axis=1) >= low - 1e-12) and np.all(height.max(axis=1) <= high + 1e-12)
    assert np.sqrt((off * off).sum(axis=0)).max() <= light.radius + 1e-12
    for half in (light.span.half_u, light.span.half_v):
        assert np.abs((off * half[..., None]).sum(axis=0)).max() <= (half * half).sum() + 1e-12
    dark, cut = light.horizon(to, -to, normal)
    below = height < 0.0
    assert not np.any(dark & ~below.all(axis=1)) and not np.any(below.any(axis=1) & ~(dark | cut))


@EACH
def test_the_nearest_point_is_that_of_the_samples(kind):
    rng, light, to, normal = seen(kind, 3, 60)
    way, _ = sampled(rng, light, to, normal, 10_000)
    nearest = light._from_nearest(to)
    got, least = np.sqrt((nearest * nearest).sum(axis=0)), (way * way).sum(axis=0).min(axis=1)
    assert np.all(got <= np.sqrt(least) + 1e-12) and np.all(np.sqrt(least) - got < 0.05)


@EACH
def test_probes_and_clearances_tell_what_is_on_the_light(kind):
    rng, light, to, _ = seen(kind, 4)
    corners = light.offsets
    following = np.roll(corners, -1, axis=1)
    inward = np.cross(light.span.normal, following - corners, axis=0)
    for half in light.probe_sides:
        for sign in (-0.5, 0.5):
            assert np.all((inward * (sign * half - corners)).sum(axis=0) >= -1e-12)
    a, b = rng.uniform(-1.3, 1.3, (2, COUNT))
    spot = a * light.span.half_u + b * light.span.half_v
    inside = (inward[..., None] * (spot[:, None] - corners[..., None])).sum(axis=0).min(axis=0)
    far = np.sqrt((to * to).sum(axis=0))
    room = light.outline_clearance(to / far, to + spot, far)
    assert np.all((room > 0.0) == (inside > 0.0)) and 0.1 < np.mean(inside > 0.0) < 0.9


@pytest.mark.parametrize(
    "corners, said",
    [
        (((0, 0), (1, 0)), "fewer than three"),
        (((0, 0), (1, 0), (0.2, 0.2), (0, 1)), "not convex"),
        (((0, 0), (1, 0), (1, 0), (0, 1)), "same"),
        (((0, 0), (1, 0), (2, 0)), "no area"),
        (tuple((np.cos(0.8 * np.pi * k), np.sin(0.8 * np.pi * k)) for k in range(5)), "not convex"),
    ],
)
def test_what_is_no_convex_polygon_is_told(corners, said):
    assert said in placed(*corners).defect()


def test_a_bent_polygon_is_told():
    bent = tuple((x, y, 0.2 * x * y) for x, y in ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)))
    assert "planar" in PolygonLight(bent, GLOW).defect()


@pytest.mark.slow
def test_a_disk_of_many_sides_is_an_ellipse():
    corners = disk(512).vertices
    middle = np.mean(corners, axis=0)
    round_ = EllipseLight(
        tuple(middle), *(tuple(corners[k] - middle) for k in (0, 128)), GLOW, seen=True
    )
    scene = Scene(CAMERA, (FLOOR, BALL, CARD), (round_,))
    want = render_image(scene, replace(EXACT, tolerance=1e-2)).color
    many = replace(disk(64), seen=True)
    got = render_image(replace(scene, lights=(many,)), replace(EXACT, tolerance=1e-2)).color
    assert rms(got - want) < 1.5e-2 * want.mean()


def test_it_is_seen_as_it_is():
    light = replace(LIGHTS["pentagon"], seen=True, lights_surfaces=False)
    scene = Scene(look_at((1.0, -2.0, 0.5), (1.0, -1.0, 3.5)), (FLOOR,), (light,))
    up = PolygonLight(light.vertices[::-1], GLOW, seen=True, lights_surfaces=False)
    dark, shown = (render_image(replace(scene, lights=(x,)), EXACT).color for x in (light, up))
    assert dark.max() == 0.0 or shown.max() == 0.0
    assert max(dark.max(), shown.max()) == pytest.approx(9.0, rel=1e-6)


QUICK = ("triangle",)
FEW = pytest.mark.parametrize(
    "kind", [pytest.param(k, marks=() if k in QUICK else pytest.mark.slow) for k in LIGHTS]
)


@pytest.mark.slow
@EACH
def test_pictures_agree_with_brute_force(kind):
    scene = Scene(CAMERA, (FLOOR, BALL, CARD), (LIGHTS[kind],))
    assert_both_methods_agree(scene)


@pytest.mark.slow
def test_motion():
    ball = replace(BALL, motion=Motion((0.7, 0.3, 0.2)))
    light = replace(LIGHTS["pentagon"], motion=Motion((0.4, 0.0, 0.2)))
    scene = Scene(CAMERA, (FLOOR, CARD, ball), (light,))
    assert_agrees(scene, EXACT, 1024, 2e-3)


def with_polygons(seed):
    """A random scene whose lights are polygons of any place and size."""
    scene, rng = random_scene(seed), np.random.default_rng(seed)
    lights = []
    for light, u, v in lights_spanned(scene, rng):
        turns = np.sort(rng.uniform(0.0, 2.0 * np.pi, rng.integers(3, 8)))
        corners = [np.array(light.center) + np.cos(t) * u + np.sin(t) * v for t in turns]
        lights.append(
            PolygonLight(tuple(tuple(c.tolist()) for c in corners), (9.0,) * 3, light.motion)
        )
    return replace(scene, lights=tuple(lights))


SEEDS = pytest.mark.parametrize("seed", range(8))


@pytest.mark.slow
@SEEDS
def test_random_scenes_agree_with_brute_force(seed):
    assert_agrees(with_polygons(seed), replace(EXACT, tolerance=3e-3), 256, 6e-3, 1e-9)


@pytest.mark.slow
@SEEDS
def test_no_pixel_that_depends_is_left_out(seed):
    assert_no_pixel_is_left_out(with_polygons(seed), seed)


@pytest.mark.parametrize("tolerance", [1e-2, pytest.param(1e-3, marks=pytest.mark.slow)])
@FEW
def test_the_tolerance_is_kept(kind, tolerance):
    scene = Scene(CAMERA, (FLOOR, BALL, CARD), (LIGHTS[kind],))
    assert_tolerance_is_kept(scene, tolerance)
