# SPDX-License-Identifier: GPL-3.0-or-later
"""Shafts from patches to lights, and outlines that reach them, against brute force."""

import numpy as np
import pytest

from adaptive_drt.geometry.light_protocol import LinearSpan
from adaptive_drt.geometry.mesh.faces import MeshFaces
from adaptive_drt.geometry.mesh.outline_shafts import Shafts
from adaptive_drt.lights.bounds import LightBounds
from mesh_shapes import bumpy_mesh

POINTS = 400
"""Number of random points in each test."""


def random_light(rng, flat):
    """A ball, or a parallelogram."""
    center = rng.normal(size=(3, 1)) + np.array([[0.0], [0.0], [4.0]])
    if not flat:
        return LightBounds(center=center, radius=rng.uniform(0.0, 1.0))
    u, v = (s * np.array(x)[:, None] for s, x in ((0.9, (1.0, 0.0, 0.0)), (0.3, (0.0, -1.0, 0.0))))
    span = LinearSpan(u, v, np.array([[0.0], [0.0], [-1.0]]))
    return LightBounds(center=center, radius=float(np.sqrt(0.9)), span=span)


def points_within(rng, light, count):
    """Points (3, count) of a light."""
    if light.span is not None:
        a, b = rng.uniform(-1.0, 1.0, (2, count))
        return light.center + a * light.span.half_u + b * light.span.half_v
    way = rng.normal(size=(3, count))
    return light.center + light.radius * rng.random(count) * way / np.linalg.norm(way, axis=0)


def test_distances_are_those_of_the_nearest_ball():
    rng = np.random.default_rng(0)
    point, place = rng.normal(size=(2, 3, POINTS))
    light = random_light(rng, False)
    shafts = Shafts.make(point, rng.uniform(0.0, 1.0, POINTS), light)
    found = shafts._distances(np.arange(POINTS), 2.0 * place)[0]
    t = np.linspace(0.0, 1.0, 1001)[:, None, None]
    radius = shafts.span + t[:, :, 0] * (light.radius - shafts.span)
    balls = shafts.point + t * shafts.to
    nearest = (np.linalg.norm(2.0 * place - balls, axis=1) - radius).min(axis=0)
    np.testing.assert_allclose(found, nearest, atol=8e-3)


@pytest.mark.parametrize("flat", [False, True])
def test_segments_through_a_shaft_are_never_apart_from_it(flat):
    rng = np.random.default_rng(1)
    light = random_light(rng, flat)
    point, span = rng.normal(size=(3, POINTS)), rng.uniform(0.0, 0.3, POINTS)
    shafts = Shafts.make(point, span, light)
    way = rng.normal(size=(3, POINTS))
    start = point + span * rng.random(POINTS) * way / np.linalg.norm(way, axis=0)
    t = rng.random(POINTS)
    inside = start + t * (points_within(rng, light, POINTS) - start)
    along = rng.normal(size=(3, POINTS)) * 10.0 ** rng.uniform(-3.0, 1.0, POINTS)
    a, b = inside - rng.random(POINTS) * along, inside + rng.random(POINTS) * along
    every = np.arange(POINTS)
    assert shafts.may_meet_segments(every, a, b).all()
    middle, radius = 0.5 * (a + b), 0.5 * np.linalg.norm(b - a, axis=0)
    assert (shafts.distances_of_balls(every, middle, radius) <= 0.0).all()
    # far ones are apart
    assert not shafts.may_meet_segments(every, a + 50.0, b + 50.0).any()


@pytest.mark.parametrize("flat", [False, True])
def test_where_no_outline_reaches_rays_agree(flat):
    rng = np.random.default_rng(2)
    mesh = bumpy_mesh(24, 12, center=(0.0, 0.0, 1.5))
    faces = MeshFaces.make(mesh.vertices, mesh.faces, None)
    light = random_light(rng, flat)
    point = np.array([*rng.uniform(-4.0, 4.0, (2, POINTS)), np.zeros(POINTS)])
    span = np.full(POINTS, 0.05)
    outlines = faces.outline_shafts(light)
    shafts = Shafts.make(point, span, light)
    blocks = outlines.reached_blocks(shafts)
    found = outlines.reached(shafts, blocks, np.ones(POINTS, dtype=np.bool_))
    rays = 64
    start = np.repeat(point, rays, axis=1)
    start[:2] += rng.uniform(-0.035, 0.035, (2, start.shape[1]))
    blocked = faces.blocked(start, points_within(rng, light, start.shape[1]) - start)
    share = blocked.reshape(POINTS, rays).mean(axis=1)
    mixed = (share > 0.0) & (share < 1.0)
    assert mixed.sum() > 0.05 * POINTS
    assert not (mixed & ~found).any()
    # the test is not empty: most patches are not reached
    assert found.mean() < 0.9
