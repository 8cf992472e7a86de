# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights prepared for tracing: their samples lie on them, and weigh what their closed form is."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.lights.emitter import make_emitter, sample_emitter, view_cone
from adaptive_drt.lights.form_factor import irradiance_factor
from adaptive_drt.scene.description import DiskLight, Motion, PointLight, QuadLight, SphereLight

COLOR = (3.0, 2.0, 1.0)
LIGHTS = {
    "quad": QuadLight((0.3, 0.2, 3.0), (0.8, 0.0, 0.3), (0.1, -0.6, 0.0), COLOR),
    "sphere": SphereLight((0.3, 0.2, 3.0), 0.7, COLOR),
    "disk": DiskLight((0.3, 0.2, 3.0), 0.7, COLOR),
}
EYE, STILL = np.array([5.0, -2.0, 1.0]), np.zeros(3)


def points(rng, count):
    """Points about the origin, relative to the tracer's, and normals on the light's side."""
    point = rng.uniform((-2, -2, -1), (2, 2, 1), (count, 3)).T
    normal = np.array([[0.0], [0.0], [1.0]]) + 0.5 * rng.normal(size=(3, count))
    return point - EYE[:, None], normal / np.linalg.norm(normal, axis=0)


@pytest.mark.parametrize("kind", LIGHTS)
@pytest.mark.parametrize("seed", range(4))
def test_samples_lie_on_the_light_and_weigh_its_closed_form(kind, seed):
    rng = np.random.default_rng(seed)
    light = make_emitter(LIGHTS[kind], EYE, STILL)
    point, normal = points(rng, 20)
    side = 64
    a, b = (part.ravel() for part in np.meshgrid(*[(np.arange(side) + 0.5) / side] * 2))
    a, b = (np.broadcast_to(part, (20, side * side)) for part in (a, b))
    to, weight = sample_emitter(
        light, light.moved(0.0)[:, :, None], point[:, :, None], normal[:, :, None], a, b
    )
    spot = point[:, :, None] + to + EYE[:, None, None]
    away = spot - np.array(LIGHTS[kind].center)[:, None, None]
    if kind == "quad":
        u, v = np.array(LIGHTS[kind].half_u), np.array(LIGHTS[kind].half_v)
        place = np.linalg.lstsq(np.stack([u, v], axis=1), away.reshape(3, -1), rcond=None)[0]
        np.testing.assert_allclose(
            np.stack([u, v], axis=1) @ place, away.reshape(3, -1), atol=1e-12
        )
        assert np.abs(place).max() <= 1.0
    elif kind == "sphere":
        np.testing.assert_allclose(np.linalg.norm(away, axis=0), 0.7, rtol=1e-9)
        assert ((away * to).sum(axis=0) <= 1e-9).all()  # on the near side
    else:
        assert (np.linalg.norm(away, axis=0) <= 0.7 * (1 + 1e-12)).all()
        middle = light.moved(0.0) - point
        leaning = (away * middle[:, :, None]).sum(axis=0)
        np.testing.assert_allclose(leaning, 0.0, atol=1e-10)  # it faces the point
    assert (weight >= 0.0).all()
    exact = irradiance_factor(light, light.moved(0.0), point, normal)
    np.testing.assert_allclose(weight.mean(axis=1), exact, rtol=5e-3, atol=1e-3)


@pytest.mark.parametrize("kind", [*LIGHTS, "point"])
@pytest.mark.parametrize("seed", range(6))
def test_cones_hold_the_light(kind, seed):
    rng = np.random.default_rng(seed)
    record = LIGHTS.get(kind) or PointLight((0.3, 0.2, 3.0), COLOR)
    light = make_emitter(record, EYE, STILL)
    point, normal = points(rng, 30)
    cone = view_cone(light, light.moved(0.0), point)
    if kind == "point":
        to = np.repeat((light.moved(0.0) - point)[:, :, None], 5, axis=2)
    else:
        spot = rng.random((2, 30, 300))
        to, _ = sample_emitter(
            light, light.moved(0.0)[:, :, None], point[:, :, None], normal[:, :, None], *spot
        )
    length = np.linalg.norm(to, axis=0)
    cosine = (to * cone.axis[:, :, None]).sum(axis=0) / length
    assert (cosine >= cone.cosine[:, None] - 1e-12).all(), f"seed {seed}"
    assert (length <= cone.far[:, None] * (1 + 1e-12)).all()
    assert (length >= cone.near[:, None] * (1 - 1e-12)).all()
    np.testing.assert_allclose(cone.cosine**2 + cone.sine**2, 1.0, atol=1e-12)


def test_lights_move_against_the_camera():
    way, drift = np.array([1.0, 2.0, 3.0]), np.array([0.5, 0.0, -1.0])
    record = SphereLight((1.0, 1.0, 1.0), 0.5, COLOR, motion=Motion(tuple(way.tolist())))
    light = make_emitter(record, EYE, drift)
    times = np.array([-0.5, 0.0, 0.25])
    want = np.ones((3, 1)) - EYE[:, None] + times * (way - drift)[:, None]
    np.testing.assert_allclose(light.moved(times), want)
    assert light.ball == pytest.approx(0.5 + 0.5 * np.linalg.norm(way - drift))
    assert make_emitter(record, EYE, STILL, moving=False).displacement is None
    point = light.pinpoint()
    assert point.radius == 0.0 and not point.extended and light.extended


def test_quads_emit_on_the_side_of_their_normal():
    light = make_emitter(LIGHTS["quad"], EYE, STILL)
    u, v = np.array(LIGHTS["quad"].half_u), np.array(LIGHTS["quad"].half_v)
    normal = np.cross(u, v) / np.linalg.norm(np.cross(u, v))
    np.testing.assert_allclose(light.normal[:, 0], normal)
    center, facing = np.array(LIGHTS["quad"].center), np.zeros((3, 2))
    facing[:] = np.stack([-normal, normal], axis=1)
    before_and_behind = np.stack([center + normal, center - normal], axis=1) - EYE[:, None]
    factor = irradiance_factor(light, light.moved(0.0), before_and_behind, facing)
    assert factor[0] > 0.5 and factor[1] == 0.0
