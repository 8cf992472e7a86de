# SPDX-License-Identifier: GPL-3.0-or-later
"""Parallelograms: hits by another formula, distances against many points of them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from adaptive_drt.geometry.polygon.kernels import (
    distance_at_closest_approach,
    distance_to_edge,
    distance_to_quad,
    edge_planes,
    intersect_quad,
    quad_blocks_segment,
    quad_edges,
    snapped_height,
)

COUNT = 400


def random_quads(seed):
    """Corners and edges (3, n) of quads, and directions, most of them towards the quads."""
    rng = np.random.default_rng(seed)
    q, a, b = rng.normal(size=(3, 3, COUNT)) * 10.0 ** rng.uniform(-1, 1, (3, 1, COUNT))
    x, y = rng.uniform(-0.3, 1.3, (2, COUNT))
    w = (
        (q + x * a + y * b)
        * rng.choice([-1.0, 1.0, 1.0], COUNT)
        * 10.0 ** rng.uniform(-1, 1, COUNT)
    )
    return q, a, b, w


def solved(q, a, b, w):
    """Coordinates on the quad and the ray parameter of hits, by three linear equations."""
    return np.linalg.solve(np.stack([w, -a, -b], axis=1), q)


@pytest.mark.parametrize("seed", range(4))
def test_hits_and_blocked_segments(seed):
    q, a, b, w = random_quads(seed)
    planes, normal, height = edge_planes(q, a, b)
    t = intersect_quad(w, planes, normal, height)
    blocked = quad_blocks_segment(w, planes, normal, height)
    assert (height >= 0.0).all() and 0.2 < np.isfinite(t).mean() < 0.9
    for k in range(COUNT):
        want, x, y = solved(q[:, k], a[:, k], b[:, k], w[:, k])
        if min(abs(x), abs(y), abs(x - 1), abs(y - 1), abs(want - 1)) < 1e-9:
            continue
        hit = want > 0 and 0 < x < 1 and 0 < y < 1
        assert np.isfinite(t[k]) == hit, (seed, k)
        assert blocked[k] == (hit and want < 1), (seed, k)
        if hit:
            assert abs(t[k] / want - 1.0) < 1e-9, (seed, k)


def test_points_within_reach_of_the_plane_see_nothing_of_it():
    normal = np.array([[0.0, 0.0], [0.0, 0.0], [2.0, 2.0]])
    np.testing.assert_array_equal(snapped_height(np.array([0.2, 0.4]), normal, 0.15), [0.0, 0.4])


@pytest.mark.parametrize("seed", range(40))
def test_distances_are_the_least_of_all_points(seed):
    rng = np.random.default_rng(seed)
    q, a, b = rng.normal(size=(3, 3, 1)) * (1.0, 1.0, 10.0 ** rng.uniform(-2, 1))[seed % 3]

    def apart(place):
        return float(np.linalg.norm(q[:, 0] + place[0] * a[:, 0] + place[1] * b[:, 0]))

    best = min(
        minimize(lambda p: apart(p) ** 2, start, bounds=[(0, 1), (0, 1)], tol=1e-14).fun ** 0.5
        for start in ((0.5, 0.5), (0.0, 0.0), (1.0, 1.0))
    )
    assert distance_to_quad(q, a, b)[0] == pytest.approx(best, rel=1e-5, abs=1e-6), seed
    along = [apart((0.0, y)) for y in np.linspace(0.0, 1.0, 4_001)]
    assert distance_to_edge(q, b)[0] == pytest.approx(min(along), rel=1e-5, abs=1e-6), seed


@pytest.mark.parametrize("seed", range(20))
def test_the_point_of_an_edge_that_is_nearest_to_a_ray(seed):
    rng = np.random.default_rng(seed)
    start, edge, axis = rng.normal(size=(3, 3))
    axis /= np.linalg.norm(axis)
    places = start + np.linspace(0.0, 1.0, 20_001)[:, None] * edge
    away = np.linalg.norm(np.cross(places, axis), axis=1)
    found = distance_at_closest_approach(*(part[:, None] for part in (start, edge, axis)))[0]
    assert found == pytest.approx(np.linalg.norm(places[away.argmin()]), abs=1e-3), seed


def test_edges_run_around_the_quad():
    q, a, b, _ = random_quads(1)
    starts, edges = quad_edges(q, a, b)
    ends = {
        tuple(np.round(p[:, 0], 9)) for s, e in zip(starts, edges, strict=True) for p in (s, s + e)
    }
    corners = {tuple(np.round(p[:, 0], 9)) for p in (q, q + a, q + b, q + a + b)}
    assert ends == corners
