# SPDX-License-Identifier: GPL-3.0-or-later
"""Elliptic lights: their irradiance, what is seen of them in part, and pictures."""

from __future__ import annotations

from dataclasses import replace

import mpmath
import numpy as np
import pytest

from adaptive_drt.lights.ellipse_light import EllipseEmitter, make_ellipse_emitter
from adaptive_drt.lights.emitter import LightMotion
from adaptive_drt.lights.form_factor import polygon_factor
from adaptive_drt.lights.occluded_form_factor import visible_factor
from adaptive_drt.lights.spread_light import make_spread_ellipse_emitter
from adaptive_drt.scene.description import EllipseLight, Motion, Quad, Scene
from light_checks import (
    BALL,
    CAMERA,
    EXACT,
    FLOOR,
    assert_agrees,
    assert_both_methods_agree,
    assert_no_pixel_is_left_out,
    assert_tolerance_is_kept,
)
from random_scenes import random_scene

CARD = Quad((0.7, -0.9, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.3))
DISK = EllipseLight((1.0, -1.0, 3.5), (0.5, 0.0, 0.0), (0.0, -0.5, 0.0), (9.0, 8.0, 7.0))
LIGHTS = {
    "disk": DISK,
    "ellipse": replace(DISK, half_u=(0.7, 0.2, 0.1), half_v=(0.1, -0.4, 0.2)),
    "thin": replace(DISK, half_u=(1.5, 0.0, 0.0), half_v=(0.0, -0.15, 0.0)),
}
EACH = pytest.mark.parametrize("kind", LIGHTS)
AT_REST = LightMotion(np.zeros(3), np.zeros(3))
COUNT = 2_000


def seen(kind, seed, least=1.0):
    """A light, vectors (3, n) from points before it to its centre, and normals towards it."""
    rng, light = np.random.default_rng(seed), make_ellipse_emitter(LIGHTS[kind], AT_REST)
    away = rng.normal(size=(3, COUNT)) * 10.0 ** rng.uniform(-0.5, 0.7, COUNT)
    away *= np.sign((away * light.span.normal).sum(axis=0))
    normal = -away / np.sqrt((away * away).sum(axis=0)) + 0.7 * rng.normal(size=(3, COUNT))
    normal /= np.sqrt((normal * normal).sum(axis=0))
    near = light._from_nearest(-away)
    area = np.cross(*np.array([light.span.half_u[:, 0], light.span.half_v[:, 0]]))
    shortest = np.linalg.norm(area) / light.radius
    some = np.sqrt((near * near).sum(axis=0)) > least * shortest
    height = (away * light.span.normal).sum(axis=0) / np.sqrt((away * away).sum(axis=0))
    rows = (some & (height > 0.05)).nonzero()[0]
    return rng, light, -away[:, rows], normal[:, rows]


def corners(light, to, sides):
    """Corners (3, n) of polygons of the light's area, metres from the points."""
    size = np.sqrt(2.0 * np.pi / (sides * np.sin(2.0 * np.pi / sides)))
    turn = 2.0 * np.pi * (np.arange(sides) + 0.5) / sides
    rows = zip(size * np.cos(turn), size * np.sin(turn), strict=True)
    return [to + a * light.span.half_u + b * light.span.half_v for a, b in rows]


def test_a_disk_against_50_digits():
    """Stokes' theorem along the rim, by quadrature."""
    light = make_ellipse_emitter(DISK, AT_REST)
    assert light.circular
    rng = np.random.default_rng(1)
    for _ in range(5):
        to = rng.normal(size=3) + np.array([0.0, 0.0, 2.5])
        normal = rng.normal(size=3) * 0.2 + np.array([0.0, 0.0, 1.0])
        normal /= np.linalg.norm(normal)
        with mpmath.workdps(50):

            def rim(t, to=to, normal=normal):
                c, s = mpmath.cos(t), mpmath.sin(t)
                p = [to[0] + c / 2, to[1] - s / 2, mpmath.mpf(to[2])]
                d = [-s / 2, -c / 2, mpmath.mpf(0)]
                cross = [p[1] * d[2] - p[2] * d[1], p[2] * d[0] - p[0] * d[2]]
                cross.append(p[0] * d[1] - p[1] * d[0])
                return sum(a * mpmath.mpf(n) for a, n in zip(cross, normal, strict=True)) / sum(
                    a * a for a in p
                )

            want = -mpmath.quad(rim, mpmath.linspace(0, 2 * mpmath.pi, 9)) / 2
        point = np.array(DISK.center)[:, None] - to[:, None]
        got = light.irradiance_factor(to[:, None], point, normal[:, None])[0]
        assert got == pytest.approx(float(want), rel=1e-13)


@EACH
def test_the_whole_light_against_polygons_of_many_sides(kind):
    _, light, to, normal = seen(kind, 2)
    got = light.irradiance_factor(to, -to, normal)
    fine, rough = (polygon_factor(corners(light, to, sides), normal) for sides in (1024, 512))
    whole = (normal * to).sum(axis=0) > light.extent(normal)
    want = np.where(whole, fine + (fine - rough) / 15.0, fine)
    assert np.abs(got - want)[whole].max() < 1e-8
    assert np.abs(got - want)[~whole].max() < 1e-5
    assert 100 < whole.sum() < whole.size - 20


@EACH
@pytest.mark.parametrize("what", ["card", "ball"])
def test_what_is_seen_in_part_is_exact(kind, what):
    """Against polygons of 512 sides; with a limited spread, by 64 sides with a stated error."""
    rng, light, to, normal = seen(kind, 3, 0.2)
    n = to.shape[1]
    turn, along = rng.uniform(0.0, 2.0 * np.pi, n), rng.uniform(-1.0, 1.0, n)
    d = np.cos(turn) * light.span.half_u + np.sin(turn) * light.span.half_v
    e = np.cos(turn) * light.span.half_v - np.sin(turn) * light.span.half_u
    balls, cards = (np.zeros((0, 3, n)), np.zeros((0, n))), np.zeros((0, 4, 3, n))
    if what == "card":
        ends = [along * d - 9.0 * e, along * d + 9.0 * e]
        card = [*ends, ends[1] + 9.0 * d, ends[0] + 9.0 * d]
        cards = np.array([0.5 * (to + corner) for corner in card])[None]
    else:
        middle = 0.5 * (to + along * d)
        most = 0.9 * np.sqrt((middle * middle).sum(axis=0))
        balls = middle[None], np.minimum(0.3 * light.radius * rng.random(n), most)[None]
    rough, want = (
        visible_factor(np.array(corners(light, to, sides)), normal, balls, cards)
        for sides in (64, 512)
    )
    spread = make_spread_ellipse_emitter(replace(LIGHTS[kind], spread=2.0), AT_REST)
    error = spread.outline_error(to, normal)
    assert np.all(np.abs(rough - want) <= error + 1e-12)
    assert np.array_equal(spread.silhouette(to, normal), np.array(corners(light, to, 64)))
    assert light.outline_error(to, normal) is None
    got = visible_factor(light.silhouette(to, normal), normal, balls, cards)
    # errors of these polygons fall with the third power of the number of sides
    assert np.all(np.abs(got - want) <= error * (64 / 512) ** 3 * 2.0 + 1e-12)


@EACH
def test_samples_have_the_irradiance_as_their_mean(kind):
    rng, light, to, normal = seen(kind, 4)
    to, normal = to[:, :40], normal[:, :40]
    a, b = rng.random((2, 40, 20_000))
    way, weight = light.sample(to[..., None], -to[..., None], normal[..., None], a, b)
    want = light.irradiance_factor(to, -to, normal)
    assert weight.mean(axis=1) == pytest.approx(want, rel=0.05, abs=1e-4)
    # on the light
    off = way - to[..., None]
    assert np.abs((off * light.span.normal[..., None]).sum(axis=0)).max() < 1e-12


@EACH
def test_bounds_of_the_light_hold(kind):
    rng, light, to, normal = seen(kind, 5)
    a, b = rng.random((2, to.shape[1], 200))
    way, _ = light.sample(to[..., None], -to[..., None], normal[..., None], a, b)
    off = way - to[..., None]
    most = np.abs((off * normal[..., None]).sum(axis=0)).max(axis=1)
    extent = light.extent(normal)
    assert np.all(most <= extent + 1e-12) and np.all(most > 0.8 * extent)
    assert np.sqrt((off * off).sum(axis=0)).max() <= light.radius + 1e-12
    dark, cut = light.horizon(to, -to, normal)
    below = (way * normal[..., None]).sum(axis=0) < 0.0
    assert not np.any(dark & ~below.all(axis=1)) and not np.any(below.any(axis=1) & ~(dark | cut))
    nearest = light._from_nearest(to)
    assert np.all(
        np.sqrt((nearest * nearest).sum(axis=0))
        <= np.sqrt((way * way).sum(axis=0)).min(axis=1) * (1.0 if light.circular else 1.02) + 1e-9
    )


def test_it_shines_to_one_side():
    light = make_ellipse_emitter(DISK, AT_REST)
    assert isinstance(light, EllipseEmitter)
    behind = np.array(DISK.center)[:, None] + np.array([[0.1], [0.0], [1.0]])
    down = np.array([[0.0], [0.0], [-1.0]])
    to = light.to_center(behind)
    assert light.irradiance_factor(to, behind, down)[0] == 0.0
    assert light.horizon(to, behind, down)[0][0]


@pytest.mark.parametrize(
    "kind", ["disk", *(pytest.param(k, marks=pytest.mark.slow) for k in ("ellipse", "thin"))]
)
def test_pictures_agree_with_brute_force(kind):
    scene = Scene(CAMERA, (FLOOR, BALL, CARD), (LIGHTS[kind],))
    assert_both_methods_agree(scene)


@pytest.mark.slow
def test_motion():
    ball = replace(BALL, motion=Motion((0.7, 0.3, 0.2)))
    light = replace(LIGHTS["ellipse"], motion=Motion((0.4, 0.0, 0.2)))
    scene = Scene(CAMERA, (FLOOR, CARD, ball), (light,))
    assert_agrees(scene, EXACT, 1024, 2e-3)


def with_ellipses(seed):
    """A random scene whose lights are ellipses of any place and size."""
    scene, rng = random_scene(seed), np.random.default_rng(seed)
    lights = []
    for light in scene.lights:
        down = -np.array(light.center) + rng.normal(size=3)
        u = np.cross(down, rng.normal(size=3))
        v = np.cross(down, u)
        u, v = (x / np.linalg.norm(x) * rng.uniform(0.2, 0.8) for x in (u, v))
        axes = (tuple(u), tuple(v))
        lights.append(EllipseLight(light.center, *axes, (9.0,) * 3, light.motion))
    return replace(scene, lights=tuple(lights))


@pytest.mark.parametrize(
    "seed", [0, 2, 3, 4, *(pytest.param(k, marks=pytest.mark.slow) for k in (1, 5))]
)
def test_random_scenes_agree_with_brute_force(seed):
    scene = with_ellipses(seed)
    assert_agrees(scene, replace(EXACT, tolerance=3e-3), 256, 6e-3, 1e-9)


@pytest.mark.parametrize(
    "seed", [1, 2, 3, 5, *(pytest.param(k, marks=pytest.mark.slow) for k in (0, 4))]
)
def test_no_pixel_that_depends_is_left_out(seed):
    scene = with_ellipses(seed)
    assert_no_pixel_is_left_out(scene, seed)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
@EACH
def test_the_tolerance_is_kept(kind, tolerance):
    scene = Scene(CAMERA, (FLOOR, BALL, CARD), (LIGHTS[kind],))
    assert_tolerance_is_kept(scene, tolerance)
