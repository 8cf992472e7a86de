# SPDX-License-Identifier: GPL-3.0-or-later
"""Edges of the polygons that come near each other, against those of all pairs of polygons."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry import crossing_polygons
from adaptive_drt.geometry.silhouettes import CircularSilhouette, Hemisphere
from adaptive_drt.lights import occluded_form_factor
from adaptive_drt.lights.occluded_form_factor import visible_factor

POINTS = 24
KINDS = ("scattered", "large", "mesh", "equal", "around", "edge-on")


def unit(rng, *shape):
    vector = rng.normal(size=(3, *shape))
    return vector / np.sqrt((vector * vector).sum(axis=0))


def icosahedron():
    """Faces (20, 3, 3) that share all their edges."""
    g = 0.5 * (1.0 + 5.0**0.5)
    flat = [(a, b) for a in (-1.0, 1.0) for b in (-g, g)]
    points = np.array([p for a, b in flat for p in ((0.0, a, b), (a, b, 0.0), (b, 0.0, a))])
    near = np.abs(np.linalg.norm(points[:, None] - points, axis=2) - 2.0) < 1e-9
    faces = [
        (i, j, k)
        for i in range(12) for j in range(i) for k in range(j)
        if near[i, j] and near[j, k] and near[i, k]
    ]  # fmt: skip
    return points[np.array(faces)]


def outlines(rng, kind, m):
    """Corners (m, 3, 3, POINTS) of triangles."""
    if kind == "mesh":
        place = 4.0 * unit(rng, POINTS)
        faces = np.repeat(icosahedron(), 1 + m // 20, axis=0)[:m]
        return place[None, None] + 0.5 * faces[..., None]
    if kind == "around":  # faces of a mesh around the point, which leave no gap
        faces = np.repeat(icosahedron(), 1 + m // 20, axis=0)[:m]
        return faces[..., None] + 0.2 * unit(rng, POINTS)[None, None]
    size = 2.0 if kind == "large" else 0.4
    middle = 3.0 * unit(rng, m, POINTS).swapaxes(0, 1)
    corners = middle[:, None] + size * rng.normal(size=(m, 3, 3, POINTS))
    if kind == "equal":
        corners[m // 2 :] = corners[: m - m // 2]
    if kind == "edge-on":
        corners[::3, 2] = 0.5 * (corners[::3, 0] + corners[::3, 1]) * 1.3
    return corners


@pytest.mark.parametrize("balls", [0, 2])
@pytest.mark.parametrize("light", ["sky", "round", "quad"])
@pytest.mark.parametrize("m", [1, 2, 13, 40])
@pytest.mark.parametrize("kind", KINDS)
def test_it_is_the_integral_over_all_pairs(monkeypatch, kind, m, light, balls):
    rng = np.random.default_rng([m, balls, KINDS.index(kind)])
    normal, corners = unit(rng, POINTS), outlines(rng, kind, m)
    half = np.full(POINTS, 1.0)
    silhouette = Hemisphere()
    if light == "round":
        silhouette = CircularSilhouette(unit(rng, POINTS), np.cos(half), np.sin(half))
    if light == "quad":
        center, u, v = 5.0 * unit(rng, POINTS), 2.0 * unit(rng, POINTS), 2.0 * unit(rng, POINTS)
        silhouette = np.array([center + u + v, center - u + v, center - u - v, center + u - v])
    center = 3.0 * unit(rng, balls, POINTS).swapaxes(0, 1)
    spheres = center, np.full((balls, POINTS), 0.8)
    found = []
    for least in (1, 1_000):
        monkeypatch.setattr(occluded_form_factor, "CROSSING_POLYGONS", least)
        found.append(visible_factor(silhouette, normal, spheres, corners))
    assert found[0] == pytest.approx(found[1], abs=1e-12)


def test_points_do_not_depend_on_each_other(monkeypatch):
    rng = np.random.default_rng(5)
    normal, corners = unit(rng, POINTS), outlines(rng, "scattered", 40)
    none = np.zeros((0, 3, POINTS)), np.zeros((0, POINTS))
    whole = visible_factor(Hemisphere(), normal, none, corners)
    monkeypatch.setattr(occluded_form_factor, "BLOCK_PAIRS", 1)
    assert np.array_equal(visible_factor(Hemisphere(), normal, none, corners), whole)


def test_few_pairs_are_near_each_other(monkeypatch):
    rng = np.random.default_rng(6)
    found = []
    kept = crossing_polygons._near_pairs
    monkeypatch.setattr(
        crossing_polygons, "_near_pairs", lambda *a: found.append(kept(*a)) or found[-1]
    )
    none = np.zeros((0, 3, POINTS)), np.zeros((0, POINTS))
    corners = outlines(rng, "scattered", 200)
    visible_factor(Hemisphere(), unit(rng, POINTS), none, corners)
    pairs = sum(edge.size for edge, _, _ in found)
    assert 0 < pairs < 0.2 * 200 * 600 * POINTS
