# SPDX-License-Identifier: GPL-3.0-or-later
"""Spot lights: their cone, their irradiance, and pictures against brute force."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.lights.emitter import LightMotion
from adaptive_drt.lights.spot_light import SpotPointEmitter, SpotSphereEmitter, make_spot_emitter
from adaptive_drt.scene.description import Motion, Quad, Scene, SpotLight
from light_checks import (
    BALL,
    CAMERA,
    EXACT,
    FLOOR,
    assert_agrees,
    assert_both_methods_agree,
    assert_tolerance_is_kept,
)
from oracle.lights import emitted
from random_scenes import random_scene

CARD = Quad((0.7, -0.9, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.3))
SPOT = SpotLight((1.0, -1.0, 4.0), (-0.2, 0.3, -1.0), (40.0, 30.0, 20.0), 0.8, 0.4, 0.3)
KINDS = {
    "disk": SPOT,
    "ball": replace(SPOT, faces=False),
    "point": replace(SPOT, radius=0.0),
    "hard": replace(SPOT, blend=0.02),
    "soft": replace(SPOT, blend=1.0),
}
EACH = pytest.mark.parametrize(
    "kind",
    [pytest.param(k, marks=pytest.mark.slow if k in ("ball", "soft") else ()) for k in KINDS],
)
SQUEEZED = np.linalg.inv(
    np.array([[1.5, 0.1, 0.2], [0.0, 0.5, -0.3], [0.3, 0.15, 1.0]])  # its Z axis is last
)
UNEVEN = {
    f"uneven {kind}": replace(KINDS[kind], frame=tuple(map(tuple, SQUEEZED)))
    for kind in ("disk", "ball", "point", "soft")
}
KINDS |= UNEVEN
SLOW = UNEVEN.keys() - {"uneven point"} | {"soft"}
ALL = pytest.mark.parametrize(
    "kind", [pytest.param(k, marks=pytest.mark.slow if k in SLOW else ()) for k in KINDS]
)
AT_REST = LightMotion(np.zeros(3), np.zeros(3))


@ALL
def test_irradiance_is_the_mean_over_the_light(kind):
    rng = np.random.default_rng(4)
    record = KINDS[kind]
    light, n, count = make_spot_emitter(record, AT_REST), 60, 400
    point = np.array(record.center)[:, None] + np.array([[0.8], [0.8], [0.5]]) * rng.normal(
        size=(3, n)
    )
    point[2] -= 2.0
    normal = np.array(record.center)[:, None] - point + 0.8 * rng.normal(size=(3, n))
    normal /= np.sqrt((normal * normal).sum(axis=0))
    got = light.irradiance_factor(light.to_center(point), point, normal)
    square = np.stack(np.meshgrid(*2 * [(np.arange(count) + 0.5) / count]), axis=-1).reshape(-1, 2)
    for k in range(n):
        p, m = (np.broadcast_to(x[:, k], (len(square), 3)) for x in (point, normal))
        want = emitted(record, p, m, np.zeros(len(p)), square)[1].mean()
        # uneven cones are integrated by nodes, to a fraction of the whole light
        assert got[k] == pytest.approx(want, rel=2e-3, abs=1e-4 if kind in UNEVEN else 1e-5)


@ALL
def test_samples_have_the_irradiance_as_their_mean(kind):
    rng = np.random.default_rng(5)
    light = make_spot_emitter(KINDS[kind], AT_REST)
    point = rng.normal(size=(3, 40)) + np.array([[1.0], [-1.0], [0.0]])
    point[2] = 0.0
    normal = np.broadcast_to(np.array([[0.0], [0.0], [1.0]]), point.shape)
    a, b = rng.random((2, 40, 20_000))
    to = light.to_center(point)
    _, weight = light.sample(to[..., None], point[..., None], normal[..., None], a, b)
    want = light.irradiance_factor(to, point, normal)
    assert weight.mean(axis=1) == pytest.approx(want, rel=0.03, abs=1e-4)


def test_points_within_a_ball_get_all_of_its_light():
    light = make_spot_emitter(KINDS["ball"], AT_REST)
    assert isinstance(light, SpotSphereEmitter)
    point = np.array(SPOT.center)[:, None] + np.array([[0.1], [0.0], [0.1]])
    up = np.array([[0.0], [0.0], [1.0]])
    to = light.to_center(point)
    assert light.irradiance_factor(to, point, up)[0] == np.pi
    assert not any(light.horizon(to, point, up)[0])


@ALL
def test_it_is_dark_only_where_nothing_arrives(kind):
    """Also of patches and moving lights: no point within reach gets any light."""
    rng = np.random.default_rng(6)
    motion = Motion((0.3, 0.2, 0.1))
    light = make_spot_emitter(replace(KINDS[kind], motion=motion), AT_REST)
    point = rng.normal(scale=3.0, size=(3, 500))
    point[2] = 0.0
    normal = np.broadcast_to(np.array([[0.0], [0.0], [1.0]]), point.shape)
    reach = rng.uniform(0.0, 0.5, 500)
    dark, _ = light.horizon(light.to_center(point, 0.0), point, normal, reach, np.zeros(500))
    assert 50 < dark.sum() < 490
    for _ in range(30):
        turn = rng.uniform(0.0, 2.0 * np.pi, 500)
        near = point + reach * np.array([np.cos(turn), np.sin(turn), 0.0 * turn])
        time = rng.uniform(-0.5, 0.5, 500)
        got = light.irradiance_factor(light.to_center(near, time), near, normal)
        assert np.all(got[dark] == 0.0)


def test_the_edge_of_the_cone():
    light = make_spot_emitter(KINDS["point"], AT_REST)
    assert isinstance(light, SpotPointEmitter)
    axis = light.beam.axis[:, 0]
    aside = np.cross(axis, (1.0, 0.0, 0.0))
    aside /= np.linalg.norm(aside)
    angle = np.array([0.0, 0.2, 0.35, 0.4, 0.5, 1.0])
    to = 3.0 * (np.cos(angle) * axis[:, None] + np.sin(angle) * aside[:, None])
    edge = light.profile_edge(to)
    outer, inner = math.acos(light.beam.outer), math.acos(light.beam.inner)
    assert outer == pytest.approx(0.4)
    assert edge.gap == pytest.approx(np.maximum(angle - outer, inner - angle), abs=1e-12)
    onset = np.minimum(np.abs(angle - outer), np.abs(angle - inner))
    assert edge.onset == pytest.approx(onset, abs=1e-12)
    assert edge.width == pytest.approx(np.full(6, outer - inner))


@EACH
def test_pictures_agree_with_brute_force(kind):
    scene = Scene(CAMERA, (FLOOR, BALL, CARD), (KINDS[kind],))
    assert_both_methods_agree(scene)


@pytest.mark.slow
@pytest.mark.parametrize("kind", UNEVEN)
def test_pictures_of_uneven_spots_agree_with_brute_force(kind):
    assert_both_methods_agree(Scene(CAMERA, (FLOOR, BALL, CARD), (KINDS[kind],)))


@pytest.mark.slow
def test_motion():
    ball = replace(BALL, motion=Motion((0.7, 0.3, 0.2)))
    spot = replace(SPOT, motion=Motion((0.4, 0.0, 0.2)))
    scene = Scene(CAMERA, (FLOOR, CARD, ball), (spot,))
    assert_agrees(scene, EXACT, 1024, 2e-3)


@pytest.mark.parametrize(
    "seed", [3, 4, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (0, 1, 2, 5))]
)
def test_random_scenes_agree_with_brute_force(seed):
    """The lights of random scenes, each in a cone towards the middle."""
    scene, rng = random_scene(seed), np.random.default_rng(seed)
    spots = tuple(
        SpotLight(
            light.center, tuple(-np.array(light.center) + rng.normal(size=3)), (50.0,) * 3,
            rng.uniform(0.3, 2.0), rng.uniform(0.0, 1.0), rng.choice([0.0, 0.4]), seed % 2 == 0,
            light.motion,
        )
        for light in scene.lights
    )  # fmt: skip
    scene = replace(scene, lights=spots)
    assert_agrees(scene, replace(EXACT, tolerance=3e-3), 256, 6e-3, 1e-9)


@pytest.mark.parametrize("tolerance", [1e-2, pytest.param(1e-3, marks=pytest.mark.slow)])
@EACH
def test_the_tolerance_is_kept(kind, tolerance):
    scene = Scene(CAMERA, (FLOOR, BALL, CARD), (KINDS[kind],))
    assert_tolerance_is_kept(scene, tolerance)
