# SPDX-License-Identifier: GPL-3.0-or-later
"""Flat lights of limited spread, against brute force over the light."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.geometry.spread_profile import spread_gain
from adaptive_drt.lights.emitter import LightMotion
from adaptive_drt.lights.occluded_form_factor import visible_factor
from adaptive_drt.lights.registry import make_emitter
from adaptive_drt.lights.spread_light import (
    make_spread_ellipse_emitter,
    make_spread_quad_emitter,
)
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import EllipseLight, Motion, Quad, QuadLight, Scene, Sphere
from light_checks import BALL, CAMERA, EXACT, FLOOR, RAYS, rms

HERE = LightMotion(np.zeros(3), np.zeros(3))
GRID = 500
SPREADS = (2.8, 1.6, 0.7, 0.2)


def quad(spread):
    return QuadLight((0.1, 0.2, 2.0), (0.8, 0.1, 0.0), (0.1, -0.6, 0.1), (1, 1, 1), spread=spread)


def ellipse(spread):
    fields = quad(spread)
    return EllipseLight(fields.center, fields.half_u, fields.half_v, (1, 1, 1), spread=spread)


def brute(light, point, normal, occluder=None):
    """Irradiance over the radiance by an even grid on the light."""
    g = (np.arange(GRID) + 0.5) / GRID * 2.0 - 1.0
    a, b = np.meshgrid(g, g)
    u, v = np.array(light.half_u), np.array(light.half_v)
    n = np.cross(u, v)
    area = 4.0 * np.linalg.norm(n)
    n /= np.linalg.norm(n)
    way = (np.array(light.center) - point)[:, None]
    way = way + u[:, None] * a.ravel() + v[:, None] * b.ravel()
    square = (way * way).sum(axis=0)
    cosine = -(n @ way) / np.sqrt(square)
    tangent = np.sqrt(np.maximum(1.0 - cosine**2, 0.0)) / np.maximum(cosine, 1e-9)
    f = np.maximum(0.0, 1.0 - tangent / math.tan(light.spread / 2.0)) * (cosine > 0.0)
    share = f * np.maximum(normal @ way, 0.0) / np.sqrt(square) * np.maximum(cosine, 0.0) / square
    if isinstance(light, EllipseLight):
        share = share * ((a * a + b * b).ravel() <= 1.0)
    if occluder is not None:
        center, radius = occluder
        along = (center - point) @ way / np.sqrt(square)
        miss = ((center - point) ** 2).sum() - along * along
        share = share * (miss > radius * radius)
    return share.sum() * area / GRID**2


@pytest.mark.parametrize("kind", [quad, ellipse])
@pytest.mark.parametrize("spread", SPREADS)
def test_irradiance_is_that_of_brute_force(kind, spread):
    rng = np.random.default_rng(3)
    light = kind(spread)
    emitter = make_emitter(light, HERE)
    for _ in range(12):
        point = np.array([*rng.uniform(-1.5, 1.5, 2), rng.uniform(0.0, 1.2)])
        normal = np.array([0.0, 0.0, 1.0]) + 0.7 * rng.normal(size=3)
        normal /= np.linalg.norm(normal)
        to = emitter.center - point[:, None]
        got = emitter.irradiance_factor(to, point[:, None], normal[:, None])[0]
        want = brute(light, point, normal)
        whole = make_emitter(kind(math.pi), HERE)
        most = whole.irradiance_factor(to, point[:, None], normal[:, None])[0]
        assert got == pytest.approx(want, abs=2e-4 * max(most, 0.05))


@pytest.mark.parametrize("spread", SPREADS)
def test_what_is_seen_behind_a_ball(spread):
    rng = np.random.default_rng(4)
    light = quad(spread)
    emitter = make_emitter(light, HERE)
    some = 0
    for _ in range(12):
        point, normal = np.array([*rng.uniform(-0.8, 0.8, 2), 0.0]), np.array([0.1, 0.2, 1.0])
        normal /= np.linalg.norm(normal)
        center, radius = np.array([*rng.uniform(-0.5, 0.5, 2), 1.0]), 0.3
        to = emitter.center - point[:, None]
        spheres = (center - point)[None, :, None], np.array([[radius]])
        none = np.zeros((0, 4, 3, 1))
        n = normal[:, None]
        got = visible_factor(emitter.silhouette(to, n), n, spheres, none, emitter.profile)[0]
        want = brute(light, point, normal, (center, radius))
        assert got == pytest.approx(want, abs=2e-4)
        some += 0.0 < want < 0.99 * brute(light, point, normal)
    assert some > 2


@pytest.mark.parametrize("spread", SPREADS)
def test_the_gain_keeps_the_power(spread):
    """As measured in Cycles."""
    half = spread / 2.0
    want = 1.0 / (1.0 - half / math.tan(half))
    assert spread_gain(spread) == pytest.approx(want, rel=1e-3)
    emitter = make_spread_quad_emitter(quad(spread), HERE)
    assert np.allclose(emitter.power, spread_gain(spread))
    assert np.allclose(make_spread_ellipse_emitter(ellipse(spread), HERE).power, emitter.power)


def test_a_full_spread_is_the_plain_light():
    assert type(make_spread_quad_emitter(quad(math.pi), HERE)).__name__ == "QuadEmitter"


def scene(light, motion=None):
    ball = Sphere(BALL.center, BALL.radius, motion=motion)
    box = Quad((-1.6, -0.6, 0.4), (0.9, 0.2, 0.1), (0.1, 0.7, 0.2))
    return Scene(CAMERA, (FLOOR, ball, box), (light,))


@pytest.mark.parametrize("kind", [QuadLight, pytest.param(EllipseLight, marks=pytest.mark.slow)])
def test_both_methods_agree(kind):
    light = kind((-0.6, 0.3, 4.0), (0.5, 0.0, 0.1), (0.0, -0.4, 0.0), (9, 6, 3), spread=0.9)
    exact, rays = (render_image(scene(light), settings).color for settings in (EXACT, RAYS))
    assert rms(exact - rays) < 0.04 * rms(exact)
    assert exact.mean() == pytest.approx(rays.mean(), rel=1e-2)
    assert (exact == 0.0).any()


@pytest.mark.parametrize(
    "spread, moving",
    [(2.0, False), (0.6, False), (2.0, True), pytest.param(0.6, True, marks=pytest.mark.slow)],
)
def test_the_tolerance_is_kept(spread, moving):
    half = (0.5, 0.0, 0.1), (0.0, -0.4, 0.0)
    light = QuadLight((-0.6, 0.3, 4.0), *half, (9, 6, 3), spread=spread)
    one = scene(light, Motion((0.6, 0.0, 0.3)) if moving else None)
    fine, rough = (
        render_image(one, replace(EXACT, tolerance=tolerance)).color for tolerance in (2e-3, 1e-2)
    )
    assert rms(rough - fine) < 1e-2 * fine.mean()
