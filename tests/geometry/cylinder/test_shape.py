# SPDX-License-Identifier: GPL-3.0-or-later
"""Sides of cylinders as a kind of shape: what the tracer asks of it, against plain rays."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.cylinder.shape import CylinderSet
from adaptive_drt.geometry.occluder_outline import NOTHING, POLYGON, RAYS
from adaptive_drt.lights.emitter import LightMotion
from adaptive_drt.lights.registry import make_emitter
from adaptive_drt.numerics.vector import dot, norm
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import (
    Camera,
    Cylinder,
    Material,
    Quad,
    QuadLight,
    Scene,
    SkyLight,
    Sphere,
    validate,
)
from adaptive_drt.scene.settings import Settings
from solid_cylinders import EYE, random_set

UPRIGHT = Cylinder((0.0, 0.0, -1.0), (0.0, 0.0, 1.0), 0.5)
LIGHT = QuadLight((0.0, 0.0, 4.0), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (1.0, 1.0, 1.0))
HERE = LightMotion(np.zeros(3), np.zeros(3))


def upright():
    return CylinderSet.from_records([UPRIGHT], EYE, None)


def test_surface_points_are_on_the_side_and_normals_point_to_the_viewer():
    rng = np.random.default_rng(0)
    shapes, _ = random_set(rng, 40, 0.3)
    index = rng.integers(40, size=3_000)
    w = rng.normal(size=(3, 3_000))
    t = shapes.intersect(index, w, 0.0)
    own = np.isfinite(t).nonzero()[0]
    index, w = index[own], w[:, own]
    point, normal, inside = shapes.surface(index, w, t[own] * w, 0.0)
    rest = point - shapes.center[:, index]
    rest = rest - dot(rest, shapes.axis[:, index]) * shapes.axis[:, index]
    np.testing.assert_allclose(norm(rest), shapes.radius[index], rtol=1e-9)
    assert (dot(normal, w) <= 1e-12).all()
    np.testing.assert_allclose(norm(normal), 1.0, rtol=1e-12)
    np.testing.assert_array_equal(inside, dot(normal, rest) < 0.0)
    assert 20 < inside.sum() < inside.size - 20


def test_balls_and_extents_hold_points_of_the_solid():
    rng = np.random.default_rng(1)
    shapes, _ = random_set(rng, 500)
    index, side = np.arange(500), rng.normal(size=(3, 500))
    side -= dot(side, shapes.axis) * shapes.axis
    rim = shapes.center + rng.choice([-1.0, 1.0], 500) * shapes.half * shapes.axis
    rim += shapes.radius * side / norm(side)
    center, radius = shapes.bounding_spheres
    np.testing.assert_allclose(norm(rim - center), radius, rtol=1e-12)
    direction = rng.normal(size=(3, 500))
    low, high = shapes.extent(index, direction, 0.0)
    along = dot(rim, direction)
    assert ((low <= along) & (along <= high)).all()
    assert (shapes.inner_radii <= np.minimum(shapes.half, shapes.radius)).all()


def test_cosines_of_pixels_are_no_less_than_their_bound():
    rng = np.random.default_rng(2)
    shapes, _ = random_set(rng, 200)
    index = np.arange(200)
    toward = shapes.center + 0.3 * shapes.radius * rng.normal(size=(3, 200))
    w = toward / norm(toward)
    turn = 10.0 ** rng.uniform(-5.0, -1.0, 200)
    other = w + turn * 0.99 * np.cross(w, rng.normal(size=(3, 200)), axis=0) / 3.0
    other /= norm(other)
    turn = norm(np.cross(w, other, axis=0))
    cosine = []
    for ray in (w, other):
        t = shapes.intersect(index, ray, 0.0)
        _, normal, _ = shapes.surface(index, ray, np.where(np.isfinite(t), t, 1.0) * ray, 0.0)
        cosine.append(np.where(np.isfinite(t), -dot(normal, ray), np.nan))
    least = shapes.least_cosine(index, cosine[0], turn)
    both = np.isfinite(cosine[0]) & np.isfinite(cosine[1])
    assert (least <= cosine[1] + 1e-12)[both].all() and (least[both] > 0.0).sum() > 20


@pytest.mark.parametrize(
    ("point", "kind"),
    [
        ((2.0, 0.0, 0.0), POLYGON),
        ((2.0, 0.0, -3.0), POLYGON),
        ((0.2, 0.0, -3.0), NOTHING),
        ((0.2, 0.0, 0.0), RAYS),
    ],
)
def test_kinds_of_outlines(point, kind):
    """A parallelogram from beside, the end alone from below, and nothing known from inside."""
    emitter, own = make_emitter(LIGHT, HERE), np.zeros(1, dtype=np.bool_)
    at, index = np.array(point)[:, None], np.zeros(1, dtype=np.int64)
    assert upright().outline_kind(index, at, own, emitter, 0.0)[0] == kind
    if kind == POLYGON:
        assert len(upright().polygonal_outline(index, at, 0.0)) == 4


def test_a_light_within_reach_of_the_solid_has_no_closed_form():
    low = QuadLight((0.0, 0.0, 0.9), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (1.0, 1.0, 1.0))
    at, index = np.array([[2.0], [0.0], [0.0]]), np.zeros(1, dtype=np.int64)
    own = np.zeros(1, dtype=np.bool_)
    assert upright().outline_kind(index, at, own, make_emitter(low, HERE), 0.0)[0] == RAYS


def test_closest_points_are_those_to_the_axis_between_the_ends():
    beside = CylinderSet.from_records([UPRIGHT], np.array([[3.0], [0.0], [0.0]]), None)
    w = np.array([[-1.0, -1.0], [0.4, 0.0], [0.0, 0.1]])
    t = beside.closest_points(np.zeros(2, dtype=np.int64), w, 0.0)
    np.testing.assert_allclose(t, (3.0 / 1.16, 3.0), rtol=0.02)


def picture(*shapes, light=LIGHT):
    camera = Camera(
        matrix=((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, -1.0, -6.0), (0.0, 1.0, 0.0, 0.5)),
        resolution=(12, 8), focal_length=40.0,
    )  # fmt: skip
    floor = Quad((-5.0, -5.0, -1.2), (10.0, 0.0, 0.0), (0.0, 10.0, 0.0))
    scene = Scene(camera, (floor, *shapes), (light,))
    return render_image(scene, Settings(threads=1, tolerance=0.01)).color


@pytest.mark.parametrize("light", [LIGHT, SkyLight((1.0, 1.0, 1.0))], ids=["quad", "sky"])
def test_halves_of_a_bond_look_like_one(light):
    """Neither the ends between them nor those within atoms are seen, or change a shadow."""
    grey = Material((0.5, 0.5, 0.5))
    atoms = [Sphere((x, 0.0, 0.4), 0.6, grey) for x in (-1.2, 1.2)]
    one = Cylinder((-1.2, 0.0, 0.4), (1.2, 0.0, 0.4), 0.2, grey)
    halves = [Cylinder((x, 0.0, 0.4), (0.0, 0.0, 0.4), 0.2, grey) for x in (-1.2, 1.2)]
    whole, cut = picture(*atoms, one, light=light), picture(*atoms, *halves, light=light)
    assert np.sqrt(((whole - cut) ** 2).mean()) < 0.01 * whole.mean()


def test_defects_are_told():
    bad = [
        Cylinder((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0),
        Cylinder((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.0),
        Cylinder((0.0, 0.0, np.nan), (0.0, 0.0, 1.0), 1.0),
    ]
    found = validate(Scene(Camera(), (*bad, UPRIGHT)))
    assert found.shapes == (UPRIGHT,) and len(found.issues) == 3
