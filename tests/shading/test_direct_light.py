# SPDX-License-Identifier: GPL-3.0-or-later
"""Direct light at points of floors and balls, against quadrature over lines across the light."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.scene.description import Material, QuadLight, Sphere, SphereLight
from adaptive_drt.shading.direct_light import shade, shade_with_candidates, smooth_radiance
from adaptive_drt.tracing.occluder_culling import Occluders
from oracle.visible import quad_light, round_light, visible
from shaded import patches_at, plan_of
from shape_sets import spheres_of

COLOR = (2.0, 1.0, 0.5)
LIGHTS = {
    "quad": QuadLight((0.3, 0.2, 5.0), (0.7, 0.0, 0.1), (0.0, -0.5, 0.0), COLOR),
    "sphere": SphereLight((0.3, 0.2, 5.0), 0.6, COLOR),
}
BALLS = (Sphere((0.2, 0.1, 2.0), 0.5), Sphere((-0.5, 0.6, 1.2), 0.4))
COUNT = 40


def quadrature(kind, point, balls):
    """Irradiance factor at a point (3,) of the floor, by another method."""
    light = LIGHTS[kind]
    to = np.array(light.center) - point
    if kind == "quad":
        u, v = np.array(light.half_u), np.array(light.half_v)
        shape = quad_light(to + np.array([u + v, u - v, -u - v, v - u]))
    else:
        distance = np.linalg.norm(to)
        shape = round_light(to / distance, np.arcsin(light.radius / distance))
    spheres = [(np.array(ball.center) - point, ball.radius) for ball in balls]
    return visible(shape, np.array([0.0, 0.0, 1.0]), spheres)


@pytest.mark.parametrize("kind", LIGHTS)
@pytest.mark.parametrize("balls", [(), BALLS[:1], BALLS], ids=len)
def test_floors_are_lit_as_quadrature_says(kind, balls):
    rng = np.random.default_rng(3)
    plan = plan_of(*balls, light=LIGHTS[kind])
    floor = plan.object_count - 1
    x, y = rng.uniform((60, 30), (140, 100), (COUNT, 2)).T
    hits, patch = patches_at(plan, x, y, floor, (0.5, 0.5, 0.0))
    occluders = Occluders(plan)
    found = shade(plan, occluders, hits, 0.0, patch)
    point = hits.point.T + plan.lens.origin
    factor = np.array([quadrature(kind, p, balls) for p in point])
    want = np.outer(np.array(COLOR) * 0.8 / np.pi, factor)
    np.testing.assert_allclose(found.color, want, rtol=1e-6, atol=1e-9)
    assert (found.deviation >= 0.0).all()
    # the same with the occluders that are known
    again, _ = shade_with_candidates(plan, hits, 0.0, found.candidates)
    np.testing.assert_allclose(again, found.color, rtol=1e-12, atol=1e-15)
    whole = smooth_radiance(plan, Occluders(plan), hits, 0.0, (np.zeros(COUNT, dtype=bool),))[0]
    assert (whole >= found.color * (1 - 1e-9)).all()
    assert not smooth_radiance(plan, Occluders(plan), hits, 0.0, (np.ones(COUNT, dtype=bool),))[
        0
    ].any()


def test_light_is_in_proportion_to_albedo_and_power():
    x, y = np.random.default_rng(1).uniform((60, 30), (140, 100), (COUNT, 2)).T
    colors = []
    for power, albedo in (((1.0,) * 3, (0.5,) * 3), ((3.0, 2.0, 0.0), (0.5, 0.25, 1.0))):
        ball = replace(BALLS[0], material=Material(albedo), center=(0.0, 0.0, 0.6), radius=0.6)
        plan = plan_of(ball, light=replace(LIGHTS["quad"], radiance=power))
        w = plan.lens.directions(x, y)
        v = spheres_of(plan).center[:, [0]]
        hit = np.linalg.norm(np.cross(w, v, axis=0), axis=0) < 0.59 * np.linalg.norm(w, axis=0)
        hits, patch = patches_at(plan, x[hit], y[hit], 0, (0.5, 0.5, 0.0))
        colors.append(shade(plan, Occluders(plan), hits, 0.0, patch).color)
    ratio = np.array([3.0, 2.0, 0.0]) * np.array([0.5, 0.25, 1.0]) / 0.5
    np.testing.assert_allclose(colors[1], ratio[:, None] * colors[0], rtol=1e-12, atol=1e-15)
    assert colors[0].any()
