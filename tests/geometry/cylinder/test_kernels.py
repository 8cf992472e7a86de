# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays, segments and tangent parallelograms of solid cylinders, against plain formulas."""

from __future__ import annotations

import numpy as np

from adaptive_drt.geometry.cylinder.kernels import (
    axial_view,
    cylinder_blocks_segment,
    intersect_side,
    segment_distance,
    tangent_parallelogram,
)
from adaptive_drt.numerics.vector import dot
from plain_hits import oracle_depth
from solid_cylinders import random_set

COUNT = 4_000


def seen_from_points(rng):
    """A few cylinders, each from many points and along as many vectors."""
    shapes, records = random_set(rng, 8)
    index = np.arange(COUNT) % 8
    point, w = rng.normal(size=(2, 3, COUNT)) * 1.5
    v = shapes.center[:, index] - point
    sizes = shapes.axis[:, index], shapes.half[index], shapes.radius[index]
    return records, index, point, w, v, sizes


def plain_hits(records, index, point, w):
    """Ray parameters of the first hits of the solids, by plain formulas."""
    length = np.sqrt((w * w).sum(axis=0))
    t = np.empty(COUNT)
    for k, record in enumerate(records):
        own = index == k
        t[own] = oracle_depth(record, w[:, own] / length[own], np.zeros(own.sum()), point[:, own])
    return t / length


def test_hits_of_the_side_are_those_of_the_solid_but_for_its_ends():
    records, index, point, w, v, sizes = seen_from_points(np.random.default_rng(0))
    t = intersect_side(w, v, *sizes)
    far = plain_hits(records, index, point, w)
    hit = np.isfinite(t)
    np.testing.assert_allclose(t[hit], far[hit], rtol=1e-9)
    axis, half, _ = sizes
    height = np.abs(dot(w, axis) * np.where(np.isfinite(far), far, 0.0) - dot(v, axis))
    missed = np.isfinite(far) & ~hit
    np.testing.assert_allclose(height[missed], half[missed], rtol=1e-9)
    assert hit.sum() > 60 and missed.sum() > 20


def test_segments_are_blocked_where_they_cross_the_surface():
    records, index, point, w, v, sizes = seen_from_points(np.random.default_rng(1))
    far = plain_hits(records, index, point, w)
    clear = np.abs(far - 1.0) > 1e-9
    blocked = cylinder_blocks_segment(w, v, *sizes)
    assert (blocked == (far < 1.0))[clear].all()
    assert 100 < blocked.sum() < COUNT - 100


def test_segments_from_the_surface_outwards_are_not_blocked():
    rng = np.random.default_rng(2)
    _, _, _, w, v, (axis, half, radius) = seen_from_points(rng)
    view = axial_view(-v, axis, radius)
    out = view.across / np.sqrt(dot(view.across, view.across))
    at = radius * out + rng.uniform(-1.0, 1.0, COUNT) * half * axis
    away = np.where(dot(w, out) < 0.0, -w, w)
    assert not cylinder_blocks_segment(away, -at, axis, half, radius, 1e-12).any()


def test_lines_along_the_axis_and_across_it():
    axis, half, radius = np.array([[0.0], [0.0], [1.0]]), np.array([1.0]), np.array([0.5])
    v = np.array([[0.2], [0.0], [3.0]])
    along, across = np.array([[0.0], [0.0], [9.0]]), np.array([[9.0], [0.0], [0.0]])
    assert cylinder_blocks_segment(along, v, axis, half, radius)[0]
    assert not cylinder_blocks_segment(along, v + 0.4 * across / 9.0, axis, half, radius)[0]
    assert not np.isfinite(intersect_side(along, v, axis, half, radius))[0]
    assert not cylinder_blocks_segment(across, v, axis, half, radius)[0]
    near = np.array([[3.0], [0.2], [0.5]])
    assert cylinder_blocks_segment(across, near, axis, half, radius)[0]


def test_planes_through_the_edges_of_the_parallelogram_touch_the_cylinder():
    _, _, _, _, v, (axis, half, radius) = seen_from_points(np.random.default_rng(3))
    q, u, c, outside = tangent_parallelogram(v, axis, half, radius)
    np.testing.assert_array_equal(outside, axial_view(v, axis, radius).power > 0.0)
    own = outside.nonzero()[0]
    for corner in (q, q + c):
        rest = corner - v
        rest = rest - dot(rest, axis) * axis
        np.testing.assert_allclose(np.sqrt(dot(rest, rest))[own], radius[own], rtol=1e-9)
        # the view of such a point is tangent: across its radius
        np.testing.assert_allclose(dot(rest, corner)[own], 0.0, atol=1e-9)
    np.testing.assert_allclose(np.sqrt(dot(u, u)), 2.0 * half, rtol=1e-12)


def test_distance_to_the_axis_between_the_ends():
    axis, half = np.array([[0.0], [0.0], [1.0]]), np.array([2.0])
    for v, distance in (([3.0, 0.0, 1.0], 3.0), ([3.0, 0.0, 6.0], 5.0)):
        found = segment_distance(np.array(v)[:, None], axis, half)
        np.testing.assert_allclose(found, distance)
