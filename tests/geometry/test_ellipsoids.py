# SPDX-License-Identifier: GPL-3.0-or-later
"""Ellipsoids: hits against plain formulas, round ones against spheres, and what they hide."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from adaptive_drt.geometry.ellipsoid.light_occlusion import ellipsoid_occlusion
from adaptive_drt.geometry.ellipsoid.shape import EllipsoidSet
from adaptive_drt.geometry.ellipsoid.unit_space import UnitSpace
from adaptive_drt.geometry.occluder_outline import CUT, ELLIPSE, NOTHING
from adaptive_drt.geometry.receivers import Receivers
from adaptive_drt.geometry.sphere.shape import SphereSet
from adaptive_drt.lights.emitter import LightMotion
from adaptive_drt.lights.quad_light import make_quad_emitter
from adaptive_drt.lights.sphere_light import make_sphere_emitter
from adaptive_drt.scene.description import Ellipsoid, QuadLight, SphereLight

COUNT = 2_000
AT_REST = LightMotion(np.zeros(3), np.zeros(3))
LIGHTS = {
    "quad": make_quad_emitter(QuadLight((0, 0, 4), (1, 0, 0), (0, -1, 0.2), (1, 1, 1)), AT_REST),
    "ball": make_sphere_emitter(SphereLight((0, 0, 4), 0.8, (1, 1, 1)), AT_REST),
}


def turned(rng, count):
    """Random rotations (3, 3, count)."""
    return np.moveaxis(np.linalg.qr(rng.normal(size=(count, 3, 3)))[0], 0, -1)


def random_set(rng, count, place):
    """Ellipsoids with conjugate half axes about places (3, count)."""
    size = 10.0 ** rng.uniform(-1.5, 0.0, (3, count))
    axes = np.einsum("ijn,jn,jkn->ikn", turned(rng, count), size, turned(rng, count))
    return EllipsoidSet(place, np.ascontiguousarray(axes), None)


def round_sets(rng, count, place):
    """The same balls as ellipsoids and as spheres."""
    radius = 10.0 ** rng.uniform(-1.5, 0.0, count)
    axes = np.ascontiguousarray(radius * turned(rng, count))
    return EllipsoidSet(place, axes, None), SphereSet(place, radius, None)


def quadratic(shapes, start, w):
    """Coefficients a, b, c (n,) of |G (start + t w - centre)|^2 - 1 = a t^2 + 2 b t + c."""
    matrices = np.linalg.inv(np.moveaxis(shapes.half_axes, -1, 0))
    p, q = (np.einsum("nij,jn->in", matrices, x) for x in (start - shapes.center, w))
    return (q * q).sum(axis=0), (p * q).sum(axis=0), (p * p).sum(axis=0) - 1.0


def test_maps_are_inverse_to_each_other():
    rng = np.random.default_rng(1)
    space = random_set(rng, COUNT, np.zeros((3, COUNT))).spaces
    v, n = rng.normal(size=(2, 3, COUNT))
    np.testing.assert_allclose(space.vectors(space.coordinates(v)), v, rtol=1e-9, atol=1e-9)
    along = (space.covectors(n) * space.coordinates(v)).sum(axis=0)
    np.testing.assert_allclose(along, (n * v).sum(axis=0), rtol=1e-9, atol=1e-9)
    sphere = UnitSpace.make(2.0 * turned(rng, 4))
    np.testing.assert_allclose([sphere.longest, sphere.shortest], 2.0, rtol=1e-14)


def test_hits_are_the_roots_of_a_quadratic():
    rng = np.random.default_rng(2)
    w = rng.normal(size=(3, COUNT))
    shapes = random_set(
        rng, COUNT, w * rng.uniform(0.3, 3.0, COUNT) + 0.2 * rng.normal(size=w.shape)
    )
    index = np.arange(COUNT)
    a, b, c = quadratic(shapes, np.zeros_like(w), w)
    square = b * b - a * c
    root = np.sqrt(np.maximum(square, 0.0))
    first, last = (-b - root) / a, (-b + root) / a
    want = np.where(square < 0.0, np.inf, np.where(first > 0.0, first, last))
    want = np.where(want > 0.0, want, np.inf)
    clear = np.abs(square) > 1e-9 * b * b
    t = shapes.intersect(index, w, 0.0)
    np.testing.assert_allclose(t[clear], want[clear], rtol=1e-6)
    hit = np.isfinite(t).nonzero()[0]
    assert 0.1 * COUNT < hit.size < 0.9 * COUNT
    point, normal, inside = shapes.surface(hit, w[:, hit], t[hit] * w[:, hit], 0.0)
    some = shapes.spaces.take(hit)
    place = some.coordinates(point - shapes.center[:, hit])
    np.testing.assert_allclose((place * place).sum(axis=0), 1.0, atol=1e-8)
    assert ((normal * w[:, hit]).sum(axis=0) < 1e-9).all()
    assert np.array_equal(inside, c[hit] < 0.0)
    # a segment is cut where the surface lies between its ends
    end = 1.3 * w
    cut = shapes.blocks(index[:, None], np.zeros((3, COUNT, 1)), end[..., None], 0.0)[:, 0]
    np.testing.assert_array_equal(cut[clear], (want < 1.3)[clear])


def seen_from(rng, shapes):
    """Points below balls, half of which hide something of the lights above them."""
    count = shapes.center.shape[1]
    aim = np.array([0.0, 0.0, 4.0])[:, None] + 1.2 * rng.normal(size=(3, count))
    share = rng.uniform(1.2, 3.0, count)
    return aim + share * (shapes.center - aim)


def receivers_at(point):
    count = point.shape[1]
    none = np.zeros(count)
    return Receivers(point, none > 0.0, none, None, np.zeros(count, dtype=np.int64))


@pytest.mark.parametrize("light", LIGHTS)
def test_what_is_hidden_of_a_light_is_so_from_points_of_it(light):
    rng, lamp = np.random.default_rng(3), LIGHTS[light]
    shapes = random_set(rng, COUNT, rng.normal(size=(3, COUNT)))
    point = seen_from(rng, shapes)
    none, full = ellipsoid_occlusion(
        lamp, receivers_at(point), shapes.center, shapes.spaces, 0.0, 2
    )
    to = lamp.to_center(point)
    up = to / np.linalg.norm(to, axis=0)
    a, b = rng.random((2, COUNT, 200))
    way = lamp.sample(to[..., None], point[..., None], up[..., None], a, b)[0]
    index = np.arange(COUNT)[:, None]
    cut = shapes.blocks(index, point[..., None], way * (1.0 - 1e-9), 0.0)
    # only what is in front of the light counts
    lit = (lamp.plane(to).height_of(np.zeros_like(to)) > 0.0) & (
        lamp.radius < 0.9 * np.linalg.norm(to, axis=0)
    )
    assert none[lit].mean() > 0.1 and full[lit].mean() > 0.003
    assert not (cut.any(axis=1) & none & lit).any()
    assert not (~cut.all(axis=1) & full & lit).any()
    kinds = shapes.outline_kind(index[:, 0], point, np.zeros(COUNT, dtype=bool), lamp, 0.0)
    assert {NOTHING, ELLIPSE} <= set(kinds.tolist())
    assert not (cut.any(axis=1) & (kinds == NOTHING) & lit).any()
    assert light == "quad" or CUT not in kinds


def test_round_ones_cover_and_hide_as_spheres_do():
    rng, lamp = np.random.default_rng(4), LIGHTS["quad"]
    ellipsoids, spheres = round_sets(rng, COUNT, rng.normal(size=(3, COUNT)))
    point, index = seen_from(rng, spheres), np.arange(COUNT)
    outside = np.linalg.norm(spheres.center - point, axis=0) > 1.01 * spheres.radius
    none, full = (
        shapes.occlusion(index, lamp, receivers_at(point), 0.0, 2)
        for shapes in (ellipsoids, spheres)
    )
    for one, other in zip(none, full, strict=True):
        np.testing.assert_array_equal(one[outside], other[outside])
    w = spheres.center + 0.3 * rng.normal(size=(3, COUNT))
    hits = [shapes.intersect(index, w, 0.0) for shapes in (ellipsoids, spheres)]
    np.testing.assert_allclose(*hits, rtol=1e-5)


def test_records_are_read():
    record = Ellipsoid((1.0, 2.0, 3.0), (1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.5, 0.0, 3.0))
    shapes = EllipsoidSet.from_records([record], np.ones((3, 1)), None)
    np.testing.assert_allclose(shapes.center[:, 0], (0.0, 1.0, 2.0))
    low, high = shapes.extent(np.array([0]), np.eye(3)[:, 2:], 0.0)
    np.testing.assert_allclose((low[0], high[0]), (-1.0, 5.0))
    assert record.defect() is None
    assert "thinner" in Ellipsoid(record.center, *3 * ((1.0, 0.0, 0.0),)).defect()
    assert shapes.count == 1 and SimpleNamespace(**record.__dict__).name == "Ellipsoid"
