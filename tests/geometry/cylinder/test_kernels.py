# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays, segments and tangent trapezoids of solid cylinders and cones, against plain formulas."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from adaptive_drt.geometry.cylinder.kernels import (
    axial_view,
    cylinder_blocks_segment,
    intersect_side,
    segment_distance,
    tangent_trapezoid,
)
from adaptive_drt.numerics.vector import dot
from plain_hits import oracle_depth
from solid_cylinders import random_set, sizes_of

COUNT = 4_000


def seen_from_points(rng, tapers=False):
    """A few solids, each from many points and along as many vectors."""
    shapes, records = random_set(rng, 8, tapers=tapers)
    index = np.arange(COUNT) % 8
    point, w = rng.normal(size=(2, 3, COUNT)) * 1.5
    v = shapes.center[:, index] - point
    return records, index, point, w, v, sizes_of(shapes, index)


def plain_hits(records, index, point, w):
    """Ray parameters of the first hits of the solids, by plain formulas."""
    length = np.sqrt((w * w).sum(axis=0))
    t = np.empty(COUNT)
    for k, record in enumerate(records):
        own = index == k
        t[own] = oracle_depth(record, w[:, own] / length[own], np.zeros(own.sum()), point[:, own])
    return t / length


@pytest.mark.parametrize("tapers", [False, True])
def test_hits_of_the_side_are_those_of_the_solid_but_for_its_ends(tapers):
    records, index, point, w, v, sizes = seen_from_points(np.random.default_rng(0), tapers)
    t = intersect_side(w, v, *sizes)
    far = plain_hits(records, index, point, w)
    hit = np.isfinite(t)
    np.testing.assert_allclose(t[hit], far[hit], rtol=1e-9)
    axis, half, *_ = sizes
    height = np.abs(dot(w, axis) * np.where(np.isfinite(far), far, 0.0) - dot(v, axis))
    missed = np.isfinite(far) & ~hit
    np.testing.assert_allclose(height[missed], half[missed], rtol=1e-9)
    assert hit.sum() > 60 and missed.sum() > 5


@pytest.mark.parametrize("tapers", [False, True])
def test_segments_are_blocked_where_they_cross_the_surface(tapers):
    records, index, point, w, v, sizes = seen_from_points(np.random.default_rng(1), tapers)
    far = plain_hits(records, index, point, w)
    clear = np.abs(far - 1.0) > 1e-9
    blocked = cylinder_blocks_segment(w, v, *sizes)
    assert (blocked == (far < 1.0))[clear].all()
    assert 100 < blocked.sum() < COUNT - 100


@pytest.mark.parametrize("tapers", [False, True])
def test_segments_from_the_surface_outwards_are_not_blocked(tapers):
    rng = np.random.default_rng(2)
    _, _, _, w, v, sizes = seen_from_points(rng, tapers)
    axis, half, radius, slope = sizes
    view = axial_view(-v, axis, radius, slope)
    out = view.across / np.sqrt(dot(view.across, view.across))
    height = rng.uniform(-1.0, 1.0, COUNT) * half
    at = (radius + slope * height) * out + height * axis
    away = np.where(dot(w, out - slope * axis) < 0.0, -w, w)
    assert not cylinder_blocks_segment(away, -at, *sizes, 1e-12).any()


def test_lines_along_the_axis_and_across_it():
    sizes = np.array([[0.0], [0.0], [1.0]]), np.array([1.0]), np.array([0.5]), np.zeros(1)
    v = np.array([[0.2], [0.0], [3.0]])
    along, across = np.array([[0.0], [0.0], [9.0]]), np.array([[9.0], [0.0], [0.0]])
    assert cylinder_blocks_segment(along, v, *sizes)[0]
    assert not cylinder_blocks_segment(along, v + 0.4 * across / 9.0, *sizes)[0]
    assert not np.isfinite(intersect_side(along, v, *sizes))[0]
    assert not cylinder_blocks_segment(across, v, *sizes)[0]
    near = np.array([[3.0], [0.2], [0.5]])
    assert cylinder_blocks_segment(across, near, *sizes)[0]


@pytest.mark.parametrize("tapers", [False, True])
def test_planes_through_the_edges_of_the_trapezoid_touch_the_side(tapers):
    _, _, _, _, v, sizes = seen_from_points(np.random.default_rng(3), tapers)
    axis, half, radius, slope = sizes
    corners, outside = tangent_trapezoid(v, *sizes)
    np.testing.assert_array_equal(outside, axial_view(v, axis, radius, slope).power > 0.0)
    own = outside.nonzero()[0]
    for corner, end in zip(corners, (-half, half, half, -half), strict=True):
        rest = corner - v
        np.testing.assert_allclose(dot(rest, axis), end, atol=1e-9)
        rest = rest - dot(rest, axis) * axis
        size = np.sqrt(dot(rest, rest))
        np.testing.assert_allclose(size[own], (radius + slope * end)[own], rtol=1e-9, atol=1e-11)
        # the view of such a point is across the normal there; at an apex the direction is rounded
        normal, clear = rest / size - slope * axis, own[size[own] > 1e-9]
        np.testing.assert_allclose(dot(normal, corner)[clear], 0.0, atol=1e-6)


def test_cones_seen_along_their_axis_have_no_hole_at_the_apex():
    axis = np.array([[0.0], [0.0], [1.0]])
    sizes = axis, *(np.array([each]) for each in (0.7, 0.3, -0.3 / 0.7))
    for away in (1.0, 3.0, 1e6):
        v, w = np.array([[0.0], [0.0], [-0.7 - away]]), np.array([[0.0], [0.0], [-1.0]])
        np.testing.assert_allclose(intersect_side(w, v, *sizes), away, rtol=1e-9)
        assert cylinder_blocks_segment(w * (away + 1.0), v, *sizes)[0]


def test_hits_agree_with_50_digits():
    """Random lines at cones, thin and far ones among them: the hit as an exact quadratic has it."""
    rng, worst = np.random.default_rng(4), 0.0
    for _ in range(300):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        half, wide = 10.0 ** rng.uniform(-2.0, 1.0, 2)
        slope = -wide / half * float(rng.choice([1.0, rng.uniform(0.0, 1.0)]))
        radius = wide
        first = radius - slope * half
        v = rng.normal(size=3) * (half + wide) * 10.0 ** rng.uniform(0.5, 3.0)
        target = v + axis * rng.uniform(-half, half) + rng.normal(size=3) * radius * 0.2
        w = target / np.linalg.norm(target) * rng.uniform(0.5, 2.0)
        each = (np.array([[x] for x in vector]) for vector in (w, v, axis))
        sizes = (np.array([x]) for x in (half, radius, slope))
        w1, v1, axis1 = each
        t = float(intersect_side(w1, v1, axis1, *sizes)[0])
        if not np.isfinite(t):
            continue
        with mpmath.workdps(50):
            W, V, A = (mpmath.matrix([mpmath.mpf(float(x)) for x in each]) for each in (w, v, axis))
            A = A / mpmath.sqrt(_product(A, A))
            f, along = _product(W, A), _product(V, A)
            w2, v2 = W - f * A, V - along * A
            level, k = mpmath.mpf(radius) - mpmath.mpf(slope) * along, mpmath.mpf(slope)
            p = _product(w2, v2) + k * f * level
            q = _product(w2, w2) - (k * f) ** 2
            g = _product(v2, v2) - level**2
            root = mpmath.sqrt(p * p - q * g)
            exact = min(((p - root) / q, (p + root) / q), key=lambda x: abs(x - t))
            # how far the computed point is off along the ray, in roundings of its distance, and of
            # the angle to the surface
            slant = root / mpmath.sqrt(q if q > 0 else -q) / first
            off = abs(float((exact - t) / exact)) * min(1.0, float(slant))
        worst = max(worst, off)
    assert 0.0 < worst < 1e-11


def _product(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def test_distance_to_the_axis_between_the_ends():
    axis, half = np.array([[0.0], [0.0], [1.0]]), np.array([2.0])
    for v, distance in (([3.0, 0.0, 1.0], 3.0), ([3.0, 0.0, 6.0], 5.0)):
        found = segment_distance(np.array(v)[:, None], axis, half)
        np.testing.assert_allclose(found, distance)
