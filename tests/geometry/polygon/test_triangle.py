# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles: their geometry against plain formulas, and meshes of them without gaps."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from adaptive_drt.geometry.polygon.triangle import EDGE_MARGIN, TriangleSet
from adaptive_drt.numerics.vector import cross, dot, norm
from adaptive_drt.scene.description import (
    Issue,
    Material,
    Motion,
    Scene,
    Triangle,
    Triangles,
    single_shapes,
    validate,
)
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from plain_hits import oracle_triangle
from random_scenes import look_at

COUNT, RAYS = 400, 50


def random_triangles(rng, count=COUNT, thin=0.3):
    """Vertices (3, 3, count) before the origin; a share of the triangles is thin."""
    a = rng.normal(size=(3, count)) + np.array([[0.0], [0.0], [-4.0]])
    u, v = 10.0 ** rng.uniform(-2.0, 0.5, (2, 1, count)) * rng.normal(size=(2, 3, count))
    v = np.where(rng.random(count) < thin, rng.normal(size=count) * u + 1e-3 * v, v)
    return np.stack([a, a + u, a + v])


def triangle_set(vertices, displacement=None, origin=None):
    count = vertices.shape[2]
    record = Triangles(vertices, np.zeros(count, dtype=np.int64), (Material(),))
    origin = np.zeros((3, 1)) if origin is None else origin
    return TriangleSet.from_records([record], origin, displacement)


def test_records_of_one_and_of_many_make_the_same_set():
    vertices = random_triangles(np.random.default_rng(0), 5)
    many = Triangles(vertices, np.zeros(5, dtype=np.int64), (Material(),))
    origin, moved = np.array([[1.0], [2.0], [3.0]]), np.ones((3, 6))
    last = Triangle(((0.0, 0.0, -1.0), (1.0, 0.0, -1.0), (0.0, 1.0, -1.0)))
    mixed = TriangleSet.from_records([many, last], origin, moved)
    single = TriangleSet.from_records([*many.records(), last], origin, moved)
    for name in ("corner", "edge_u", "edge_v", "displacement"):
        np.testing.assert_array_equal(getattr(mixed, name), getattr(single, name))
    assert mixed.count == 6 and TriangleSet.from_records([], origin, None).count == 0


def test_what_cannot_be_rendered_is_said_of_each():
    vertices = random_triangles(np.random.default_rng(1), 6)
    vertices[1, 1, 4] = np.nan
    vertices[2, :, 2] = vertices[1, :, 2]
    many = Triangles(vertices, np.arange(6) % 2, (Material(), Material()), name="Mesh")
    camera = look_at((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    found, alone = (validate(Scene(camera, shapes)) for shapes in ((many,), single_shapes([many])))
    assert found.issues == alone.issues and len(found.issues) == 2
    assert found.issues[0] == Issue("Mesh", "it has no area", missing=True)
    assert single_shapes(found.shapes) == alone.shapes and found.shapes[0].count == 4
    plan = make_plan(validate(Scene(camera, (*found.shapes, *found.shapes))), Settings())
    assert plan.shapes.count == 4 and plan.summary()["triangles"] == 4


@pytest.mark.parametrize("moving", [False, True])
def test_hits_are_those_of_plain_rays(moving):
    rng = np.random.default_rng(2)
    vertices = random_triangles(rng)
    d = rng.normal(size=(3, COUNT)) if moving else None
    shapes, index = triangle_set(vertices, d), np.arange(COUNT)[:, None]
    time = rng.uniform(-0.5, 0.5, (COUNT, RAYS)) if moving else 0.0
    weight = rng.dirichlet(np.ones(3), (COUNT, RAYS)) * 1.5 - 0.5 / 3.0
    place = np.einsum("vcn,nkv->cnk", vertices, weight)
    if moving:
        place = place + time * d[:, :, None]
    w = place * rng.uniform(0.5, 2.0, (COUNT, RAYS))
    t = shapes.intersect(index, w, time)
    moved = np.zeros((3, COUNT, 1)) if d is None else time * d[:, :, None]
    want = oracle_triangle(
        [np.reshape(vertex[:, :, None] + moved + 0.0 * w, (3, -1)) for vertex in vertices],
        w.reshape(3, -1),
    ).reshape(COUNT, RAYS)
    clear = np.abs(weight).min(axis=2) > 1e-9
    np.testing.assert_array_equal(np.isfinite(t)[clear], np.isfinite(want)[clear])
    both = np.isfinite(t) & np.isfinite(want)
    np.testing.assert_allclose(t[both], want[both], rtol=1e-6)
    blocked = shapes.blocks(index, np.zeros((3, COUNT, 1)), w * 1e3, time)
    np.testing.assert_array_equal(blocked[clear], np.isfinite(want)[clear])
    assert 0.2 < np.isfinite(t).mean() < 0.8


def test_planes_hold_the_edges_and_face_inwards():
    rng = np.random.default_rng(3)
    a, b, c = random_triangles(rng, thin=0.0)
    q, u, v = a, b - a, c - a
    planes, normal, height = TriangleSet.planes(q, u, v)
    starts, edges = TriangleSet.edges(q, u, v)
    middle = q + (u + v) / 3.0
    for plane, start, edge in zip(planes, starts, edges, strict=True):
        size = norm(plane)
        np.testing.assert_allclose(dot(plane, start) / size, 0.0, atol=1e-12)
        np.testing.assert_allclose(dot(plane, edge) / size, 0.0, atol=1e-12)
        assert (dot(plane, middle) > 0.0).all()
    assert (height >= 0.0).all()
    np.testing.assert_allclose(dot(normal, middle), height, atol=1e-12)
    assert {tuple(np.round(s[:, 0], 9)) for s in starts} <= {
        tuple(np.round(v[:, 0], 9)) for v in TriangleSet.vertices(q, u, v)
    }


def test_balls_hold_triangles_and_none_is_much_smaller():
    rng = np.random.default_rng(4)
    a, b, c = random_triangles(rng)
    center, radius = TriangleSet.bounding_ball(a, b - a, c - a)
    away = np.array([norm(vertex - center) for vertex in (a, b, c)])
    assert (away.max(axis=0) <= radius * (1.0 + 1e-12)).all()
    sides = np.array([norm(b - a), norm(c - b), norm(a - c)])
    area = norm(cross(b - a, c - a))
    circumradius = sides.prod(axis=0) / (2.0 * area)
    longest, squares = sides.max(axis=0), (sides**2).sum(axis=0)
    acute = squares > 2.0 * longest**2
    np.testing.assert_allclose(radius, np.where(acute, circumradius, longest / 2.0), rtol=1e-6)
    assert 0.03 < acute.mean() < 0.9


def test_edges_are_moved_outwards_by_the_margin():
    rng = np.random.default_rng(5)
    vertices = random_triangles(rng, thin=0.0)
    shapes = triangle_set(vertices)
    far = np.sqrt((vertices**2).sum(axis=1)).max(axis=0)
    grown = TriangleSet.vertices(shapes.corner, shapes.edge_u, shapes.edge_v)
    a, b, c = vertices
    normal = cross(b - a, c - a)
    for k in range(3):
        start, end = vertices[k], vertices[(k + 1) % 3]
        outwards = cross(end - start, normal)
        outwards /= norm(outwards)
        moved = dot(grown[k] - start, outwards) / far
        np.testing.assert_allclose(moved, EDGE_MARGIN, rtol=0.05)


def test_slivers_grow_by_a_thousandth_at_most():
    line = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, -1.0], [0.5, 1e-15, -1.0]])[:, :, None]
    shapes = triangle_set(line)
    assert norm(shapes.edge_u)[0] <= 1.001


def fan(rng, count):
    """Vertices (3, 3, count) of triangles around a common one, each sharing two edges."""
    angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, count))
    rim = np.stack([np.cos(angle), np.sin(angle), 0.3 * rng.normal(size=count)])
    rim += np.array([[0.2], [0.1], [-3.0]])
    middle = np.tile([[0.21], [0.13], [-3.1]], count)
    return np.stack([middle, rim, np.roll(rim, -1, axis=1)])


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
def test_rays_through_shared_edges_hit(scale):
    """No ray through an edge passes both triangles, nor does a segment between other points."""
    rng = np.random.default_rng(6)
    for _ in range(20):
        count = int(rng.integers(4, 30))
        vertices, share = scale * fan(rng, count), rng.random((count, RAYS))
        origin = scale * rng.normal(size=(3, 1))
        shapes = triangle_set(vertices + origin, origin=origin)
        edge = vertices[0][:, :, None] + share * (vertices[1] - vertices[0])[:, :, None]
        place = edge.reshape(3, -1)
        index = np.arange(count)[:, None]
        w = np.broadcast_to(place[:, None], (3, count, place.shape[1]))
        facing = np.abs(dot(shapes.unit_normal, place[:, :1])) > 0.0
        assert facing.any()
        assert np.isfinite(shapes.intersect(index, w, 0.0)).any(axis=0).all()
        # segments from the surface of another thing
        start = scale * (rng.normal(size=(3, 1, 1)) + np.array([[[0.0]], [[0.0]], [[4.0]]]))
        to = 2.0 * (w - start)
        assert (
            shapes.blocks(index, np.broadcast_to(start, (3, count, 1)), to, 0.0).any(axis=0).all()
        )


def test_records_are_values():
    vertices = random_triangles(np.random.default_rng(7), 4)
    one, same = (
        Triangles(v, np.zeros(4, dtype=np.int64), (Material(),), Motion((1.0, 0.0, 0.0)))
        for v in (vertices, vertices.copy())
    )
    assert one == same and hash(one) == hash(same) and repr(one).startswith("Triangles(4, ")
    assert one != one.take(np.arange(3)) and one.take(np.arange(4)) == one
    for single, other in itertools.pairwise(one.records()):
        assert single != other and single.motion == one.motion
