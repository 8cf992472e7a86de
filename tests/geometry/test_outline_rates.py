# SPDX-License-Identifier: GPL-3.0-or-later
"""Angles of lights and of outlines that move over them, against the angles themselves."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.shadow_edges import largest_shift, outline_rates, outline_shifts
from adaptive_drt.scene.description import (
    DiskLight,
    Motion,
    PointLight,
    QuadLight,
    Sphere,
    SphereLight,
)
from adaptive_drt.shading.variation import pair_receivers
from adaptive_drt.tracing.intersect import Pairs
from shaded import patches_at, plan_of

COLOR = (1.0, 1.0, 1.0)
CENTER = (0.0, 0.0, 5.0)


def test_half_angles_of_lights():
    far = np.array([1.0, 2.0, 10.0])
    for light, want in (
        (PointLight(CENTER, COLOR), 0.0 * far),
        (SphereLight(CENTER, 0.7, COLOR), np.arcsin(0.7 / far)),
        (DiskLight(CENTER, 0.7, COLOR), np.arctan(0.7 / far)),
    ):
        emitter = plan_of(light=light).lights[0]
        np.testing.assert_allclose(emitter.half_angle(far), want, rtol=1e-12)
    # inside a ball it is all around
    ball = plan_of(light=SphereLight(CENTER, 0.7, COLOR)).lights[0]
    assert ball.half_angle(np.array([0.1]))[0] == pytest.approx(np.pi / 2)


@pytest.mark.parametrize("seed", range(10))
def test_quads_are_as_wide_as_their_corners_along_a_direction(seed):
    rng = np.random.default_rng(seed)
    u, v = rng.normal(size=(2, 3))
    light = plan_of(light=QuadLight(CENTER, tuple(u), tuple(v), COLOR)).lights[0]
    toward = rng.normal(size=(3, 1))
    toward /= np.linalg.norm(toward)
    corners = np.array([a * u + b * v for a in (-1, 1) for b in (-1, 1)])
    want = np.arctan2((corners @ toward).max(), 4.0)
    found = light.half_angle_along(toward, np.array([4.0]))[0]
    assert found == pytest.approx(want, rel=1e-12)


def test_outlines_that_come_nearer_move_faster():
    angle = np.linspace(0.0, 0.7, 20)
    # the angle of 1 at a distance of 1 / angle, and one step nearer
    np.testing.assert_allclose(largest_shift(angle), angle / (1.0 - angle), rtol=1e-12)
    assert np.isfinite(largest_shift(np.array([5.0])))


@pytest.mark.parametrize("seed", range(8))
def test_rates_are_those_of_angles_between_outline_and_light(seed):
    """A small ball before a point light: its angle from the light, seen from a step aside."""
    rng = np.random.default_rng(seed)
    at, light = (np.array([100.0]), np.array([70.0])), PointLight(CENTER, COLOR)
    ground = plan_of(light=light)
    point = patches_at(ground, *at, 0, (0.5, 0.5, 0.0))[0].point[:, 0] + ground.lens.origin
    # near the light's own direction, where the angle is small
    place = point + rng.uniform(0.3, 0.7) * (np.array(CENTER) - point) + 0.05 * rng.normal(size=3)
    way = rng.normal(size=3) * 0.3
    ball = Sphere(tuple(place.tolist()), 1e-3, motion=Motion(tuple(way.tolist())))
    plan = plan_of(ball, light=light)
    half = 1e-4
    hits, patch = patches_at(plan, *at, 1, (half, half, half))
    to, v = np.array(CENTER) - point, place - point
    far, near = np.linalg.norm(to), np.linalg.norm(v)
    axis, unit = to / far, v / near
    aside = unit - (unit @ axis) * axis
    toward = (aside / np.linalg.norm(aside))[:, None]
    angle = np.arccos(unit @ axis)
    pairs = Pairs(np.zeros(1, dtype=np.int64), np.zeros(1, dtype=np.int64))
    receivers = pair_receivers(hits, patch, pairs, 0.0)
    displacement = way[:, None]
    rate, steps = outline_rates(
        receivers, plan.lights[0], displacement, np.array([near]), np.array([far])
    )
    assert rate[0] == pytest.approx(abs(1.0 / near - 1.0 / far), rel=1e-9)
    found = outline_shifts(steps, toward, axis[:, None], rate, np.array([angle]))[:, 0]
    for number in range(3):
        moved = patch.steps[number][:, 0]
        shift = half * way if number == 2 else 0.0
        new_to, new_v = to - moved, v - moved + shift
        new = np.arccos(new_to @ new_v / np.linalg.norm(new_to) / np.linalg.norm(new_v))
        # what moves along the light's direction is not counted: it turns by the angle's share
        slack = 1e-6 + 2.0 * angle * np.linalg.norm(shift - moved) / near
        assert found[number] == pytest.approx(abs(new - angle), rel=0.1, abs=slack), (seed, number)
