# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights in the plane of a quad: found through any rotation in float32, not a hair beside it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.lights.coplanarity import planes_through_ball
from adaptive_drt.scene.description import (
    Motion,
    PointLight,
    Quad,
    QuadLight,
    Scene,
    Sphere,
    SphereLight,
    vector_of,
)
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from random_scenes import look_at
from shape_sets import quads_of
from transforms import random_rotation

EYE = look_at((0.5, -6.0, 1.0), (0.0, 0.0, 1.0))


def touching(quad, light):
    plan = make_plan(Scene(EYE, (Sphere((9.0, 9.0, 9.0), 0.1), quad), (light,)), Settings())
    found = plan.lights[0].is_coplanar(np.array([0, 1, -1]))
    assert not found[0] and not found[2]
    if not isinstance(light, QuadLight):
        one, origin = plan.lights[0], plan.lens.origin[:, None]
        alone = planes_through_ball(
            one.center, one.radius, one.displacement, quads_of(plan).faces, origin
        )
        assert alone.shape == (1,) and alone[0] == found[1]
    return bool(found[1])


def single(vector):
    """A vector (3,) in float32, as Blender's are."""
    return vector_of(np.float32(vector).astype(float))


def ceiling(seed, gap, scale=1.0):
    """A quad and a quad light in its plane, or beside it by `gap`, turned at random."""
    rng = np.random.default_rng(seed)
    turn, move = random_rotation(rng), rng.normal(size=3)
    corner, u, v = np.array([-2.0, -2.0, 2.0]), np.eye(3)[0] * 4.0, np.eye(3)[1] * 4.0
    middle = np.array([*rng.uniform(-1, 1, 2), 2.0 + gap])
    half = np.array([0.5, 0.0, 0.0]), np.array([0.0, -0.4, 0.0])
    place = [scale * (turn @ part + move) for part in (corner, middle)]
    quad = Quad(single(place[0]), single(scale * turn @ u), single(scale * turn @ v))
    light = QuadLight(single(place[1]), *(single(scale * turn @ h) for h in half), (1.0, 1.0, 1.0))
    return quad, light


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_turned_ceilings(seed, scale):
    assert touching(*ceiling(seed, 0.0, scale)), f"seed {seed}"
    for gap in (1e-4, -1e-4):
        assert not touching(*ceiling(seed, gap, scale)), f"seed {seed}"


def test_a_light_that_leaves_the_plane_during_the_shutter_is_not_in_it():
    quad, light = ceiling(1, 0.0)
    normal = np.cross(quad.edge_u, quad.edge_v)
    normal /= np.linalg.norm(normal)
    along = np.array(quad.edge_u) / 4.0
    assert touching(quad, replace(light, motion=Motion(single(along))))
    assert not touching(quad, replace(light, motion=Motion(vector_of(1e-2 * normal))))
    both = Motion(vector_of(1e-2 * normal))
    assert touching(replace(quad, motion=both), replace(light, motion=both))


def test_points_lie_in_planes_and_balls_do_not():
    quad = Quad((-2.0, -2.0, 2.0), (4.0, 0.0, 0.0), (0.0, 4.0, 0.0))
    assert touching(quad, PointLight((0.3, 0.1, 2.0), (1.0, 1.0, 1.0)))
    assert not touching(quad, PointLight((0.3, 0.1, 2.001), (1.0, 1.0, 1.0)))
    assert not touching(quad, SphereLight((0.3, 0.1, 2.0), 0.1, (1.0, 1.0, 1.0)))
