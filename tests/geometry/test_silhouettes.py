# SPDX-License-Identifier: GPL-3.0-or-later
"""Silhouettes: directions inside them are those that meet the light, or the occluder."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.silhouettes import (
    CircularSilhouette,
    circular_silhouette,
    make_polygon_silhouettes,
    polygon_silhouette,
)

DIRECTIONS = 4_000


def directions_near(rng, center, reach):
    w = center + reach * rng.normal(size=(DIRECTIONS, 3))
    return w / np.linalg.norm(w, axis=1, keepdims=True)


def quad_at(rng, height):
    """Corners (4, 3) of a quad whose middle is at a height over the horizon, in any order."""
    middle = np.array([*rng.normal(size=2), height])
    u, v = rng.normal(size=(2, 3)) * 0.4
    corners = middle + np.array([u + v, u - v, -u - v, v - u])
    return corners[:: rng.choice([-1, 1])]


def meets(corners, w):
    """Whether directions meet a convex quad, and by how much they do, by its edges' planes."""
    planes = np.cross(corners, np.roll(corners, -1, axis=0))
    planes /= np.linalg.norm(planes, axis=1, keepdims=True)
    planes *= np.sign(planes @ corners.mean(axis=0))[:, None]
    height = w @ planes.T
    return (height > 0.0).all(axis=1) & (w @ corners.mean(axis=0) > 0.0), np.abs(height).min(axis=1)


@pytest.mark.parametrize("seed", range(30))
def test_quad_lights_above_the_horizon(seed):
    rng = np.random.default_rng(seed)
    corners, normal = quad_at(rng, 2.0 if seed % 2 else 0.1), np.array([0.0, 0.0, 1.0])
    cut = corners[:, 2].min() < 0.0
    if corners[:, 2].max() < 0.0:
        return
    found = polygon_silhouette(corners[:, :, None], normal[:, None], bool(cut))
    assert found.edges.half_angle.shape[0] == (5 if cut else 4) and found.cone is None
    w = directions_near(rng, found.center[:, 0], found.reach[0])
    inside, margin = meets(corners, w)
    planes = found.edges.planes.normal[:, :, 0]
    ours = (w @ planes > 0.0).all(axis=1)
    if cut:
        inside &= w[:, 2] > 0.0
        margin = np.minimum(margin, np.abs(w[:, 2]))
    clear = margin > 1e-9
    np.testing.assert_array_equal(ours[clear], inside[clear], err_msg=f"seed {seed}")
    # all of it lies within its reach
    away = np.linalg.norm(w[inside] - found.center[:, 0], axis=1)
    assert not away.size or away.max() <= found.reach[0] * (1 + 1e-12)
    # edges below the horizon are none; the others begin and end on it or above
    arcs = found.edges
    for phi in (-arcs.half_angle, arcs.half_angle):
        ends = np.cos(phi) * arcs.middle + np.sin(phi) * arcs.along
        assert not cut or ends[2][arcs.half_angle > 0.0].min() > -1e-12


@pytest.mark.parametrize("seed", range(10))
def test_round_lights_that_the_horizon_cuts(seed):
    rng = np.random.default_rng(seed)
    half = rng.uniform(0.2, 1.3)
    rise = rng.uniform(-0.9, 0.9) * half
    axis = np.array([np.cos(rise), 0.0, np.sin(rise)])
    light = CircularSilhouette(axis[:, None], np.cos([half]), np.sin([half]))
    found = circular_silhouette(light, np.array([[0.0], [0.0], [1.0]]), True)
    arc = found.edges
    ends = [
        np.cos(phi) * arc.middle[:, 0, 0] + np.sin(phi) * arc.along[:, 0, 0]
        for phi in (-arc.half_angle[0, 0], arc.half_angle[0, 0])
    ]
    for end in ends:  # where the circle and the horizon cross
        assert end[2] == pytest.approx(0.0, abs=1e-14)
        assert end @ axis == pytest.approx(np.cos(half), abs=1e-12)
    assert (
        circular_silhouette(light, np.array([[0.0], [0.0], [1.0]]), False).edges.half_angle.size
        == 0
    )


@pytest.mark.parametrize("seed", range(20))
def test_occluders_are_to_the_left_of_their_edges(seed):
    rng = np.random.default_rng(seed)
    quads = np.array([quad_at(rng, 1.5), quad_at(rng, 2.5)])
    center = np.array([0.0, 0.0, 1.0])
    found = make_polygon_silhouettes(quads[..., None], center[:, None])
    assert not found.edge_on.any()
    for k, corners in enumerate(quads):
        w = directions_near(rng, corners.mean(axis=0) / np.linalg.norm(corners.mean(axis=0)), 0.3)
        inside, margin = meets(corners, w)
        planes = found.segments.planes.normal[:, found.edge_rows(k), 0]
        clear = margin > 1e-9
        np.testing.assert_array_equal((w @ planes > 0).all(axis=1)[clear], inside[clear], f"{seed}")


def test_polygons_seen_edge_on_are_flat():
    corners = np.array([(1.0, 0.0, 0.0), (2.0, 0.0, 0.0), (2.0, 1.0, 0.0), (1.0, 1.0, 0.0)])
    quads = np.array([corners, corners + np.array([0.0, 0.0, 0.1])])
    found = make_polygon_silhouettes(quads[..., None], np.array([[0.0], [0.0], [1.0]]))
    assert found.edge_on[:, 0].tolist() == [True, False]
