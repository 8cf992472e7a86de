# SPDX-License-Identifier: GPL-3.0-or-later
"""Sides of cylinders as a kind of shape: what the tracer asks of it, against plain rays."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.cylinder.shape import CylinderSet
from adaptive_drt.geometry.occluder_outline import NOTHING, POLYGON, RAYS
from adaptive_drt.geometry.shape import UNKNOWN_CURVATURE
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
from solid_cylinders import EYE, random_set, sizes_of

UPRIGHT = Cylinder((0.0, 0.0, -1.0), (0.0, 0.0, 1.0), 0.5)
LIGHT = QuadLight((0.0, 0.0, 4.0), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (1.0, 1.0, 1.0))
HERE = LightMotion(np.zeros(3), np.zeros(3))


def upright():
    return CylinderSet.from_records([UPRIGHT], EYE, None)


@pytest.mark.parametrize("tapers", [False, True])
def test_surface_points_are_on_the_side_and_normals_point_to_the_viewer(tapers):
    rng = np.random.default_rng(0)
    shapes, _ = random_set(rng, 40, 0.3, tapers)
    index = rng.integers(40, size=3_000)
    w = rng.normal(size=(3, 3_000))
    t = shapes.intersect(index, w, 0.0)
    own = np.isfinite(t).nonzero()[0]
    index, w = index[own], w[:, own]
    point, normal, inside = shapes.surface(index, w, t[own] * w, 0.0)
    rest = point - shapes.center[:, index]
    axis, _, radius, slope = sizes_of(shapes, index)
    height = dot(rest, axis)
    rest = rest - height * axis
    np.testing.assert_allclose(norm(rest), radius + slope * height, rtol=1e-9, atol=1e-11)
    ideal = rest / norm(rest) - slope * axis
    np.testing.assert_allclose(np.abs(dot(normal, ideal / norm(ideal))), 1.0, rtol=1e-9)
    assert (dot(normal, w) <= 1e-12).all()
    np.testing.assert_allclose(norm(normal), 1.0, rtol=1e-12)
    np.testing.assert_array_equal(inside, dot(normal, ideal) < 0.0)
    assert 20 < inside.sum() < inside.size - 20


@pytest.mark.parametrize("tapers", [False, True])
def test_balls_and_extents_hold_points_of_the_solid(tapers):
    rng = np.random.default_rng(1)
    shapes, _ = random_set(rng, 500, tapers=tapers)
    index, side = np.arange(500), rng.normal(size=(3, 500))
    side -= dot(side, shapes.axis) * shapes.axis
    height = rng.choice([-1.0, 1.0], 500) * shapes.half
    rim = shapes.center + height * shapes.axis
    rim += (shapes.radius + shapes.slope * height) * side / norm(side)
    center, radius = shapes.bounding_spheres
    assert (norm(rim - center) <= radius * (1.0 + 1e-12)).all()
    lower = height < 0.0
    np.testing.assert_allclose(norm(rim - center)[lower], radius[lower], rtol=1e-12)
    direction = rng.normal(size=(3, 500))
    low, high = shapes.extent(index, direction, 0.0)
    along = dot(rim, direction)
    assert ((low - 1e-12 <= along) & (along <= high + 1e-12)).all()
    # no point of the surface is nearer to the centre than the inner radius
    height = rng.uniform(-1.0, 1.0, 500) * shapes.half
    at = shapes.center + height * shapes.axis
    at += (shapes.radius + shapes.slope * height) * side / norm(side)
    assert (norm(at - center) >= shapes.inner_radii * (1.0 - 1e-12)).all()
    if not tapers:
        np.testing.assert_array_equal(shapes.inner_radii, np.minimum(shapes.half, shapes.radius))


@pytest.mark.parametrize("tapers", [False, True])
def test_cosines_of_pixels_are_no_less_than_their_bound(tapers):
    rng = np.random.default_rng(2)
    shapes, _ = random_set(rng, 200, tapers=tapers)
    index = np.arange(200)
    toward = shapes.center + 0.3 * shapes.radius * rng.normal(size=(3, 200))
    w = toward / norm(toward)
    turn = 10.0 ** rng.uniform(-5.0, -1.0, 200)
    other = w + turn * 0.99 * np.cross(w, rng.normal(size=(3, 200)), axis=0) / 3.0
    other /= norm(other)
    turn = norm(np.cross(w, other, axis=0))
    cosine, points = [], []
    for ray in (w, other):
        t = shapes.intersect(index, ray, 0.0)
        _, normal, _ = shapes.surface(index, ray, np.where(np.isfinite(t), t, 1.0) * ray, 0.0)
        points.append(np.where(np.isfinite(t), t, 1.0) * ray)
        cosine.append(np.where(np.isfinite(t), -dot(normal, ray), np.nan))
    least = shapes.least_cosine(index, cosine[0], turn, points[0])
    both = np.isfinite(cosine[0]) & np.isfinite(cosine[1])
    assert (least <= cosine[1] + 1e-12)[both].all() and (least[both] > 0.0).sum() > 20


def test_normals_of_cones_turn_by_no_more_than_their_curvature():
    rng = np.random.default_rng(5)
    records = [Cylinder((0.0, 0.0, 0.0), (0.0, 0.0, float(x)), 1.0, end_radius=0.0)
               for x in 10.0 ** rng.uniform(-1.0, 1.0, 50)]  # fmt: skip
    shapes = CylinderSet.from_records(records, EYE, None)
    assert (shapes.curvature == UNKNOWN_CURVATURE).all()
    index = rng.integers(50, size=20_000)
    share = 10.0 ** rng.uniform(-4.0, 0.0, 20_000)
    height = np.minimum(share * 10.0 ** rng.normal(size=(2, 20_000)) * 0.3, 1.0)
    turn = rng.uniform(0.0, 2.0 * np.pi, (2, 20_000))
    turn[1] = turn[0] + rng.normal(size=20_000)
    half, slope = shapes.half[index], shapes.slope[index]
    out = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    normal = (out - slope * np.array([0.0, 0.0, 1.0])[:, None, None]) / np.sqrt(1.0 + slope**2)
    place = height * out
    place[2] = 2.0 * half * (1.0 - height)
    bound = shapes.curvature_at(index, place[:, 0], certain=True)
    apart = np.linalg.norm(place[:, 1] - place[:, 0], axis=0)
    turned = np.linalg.norm(normal[:, 1] - normal[:, 0], axis=0)
    assert (turned <= bound * apart * (1.0 + 1e-9) + 1e-12).all()
    assert (turned > 0.05 * bound * apart).sum() > 100


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
        Cylinder((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 1.0, end_radius=-1.0),
    ]
    cone = Cylinder((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 1.0, end_radius=0.0)
    found = validate(Scene(Camera(), (*bad, UPRIGHT, cone)))
    assert found.shapes == (UPRIGHT, cone) and len(found.issues) == 4
