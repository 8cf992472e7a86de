# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow edges that shapes predict over patches, against shadow rays from points of the patches."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.ellipsoid.shape import EllipsoidSet
from adaptive_drt.geometry.patch import Patch
from adaptive_drt.geometry.polygon.kernels import distance_to_polygon, distance_to_quad
from adaptive_drt.geometry.polygon.shape import ParallelogramSet
from adaptive_drt.geometry.polygon.triangle import TriangleSet
from adaptive_drt.geometry.shaded_patches import ShadedPatches
from adaptive_drt.geometry.shape import ShapeSet
from adaptive_drt.geometry.sphere.shape import SphereSet
from adaptive_drt.lights.emitter import LightMotion
from adaptive_drt.lights.registry import make_emitter
from adaptive_drt.scene.description import DiskLight, PointLight, QuadLight, SphereLight

COUNT, PLACES, RAYS = 800, 10, 64
"""Pairs of patches and occluders, points of each patch, and rays from each point to the light."""
CHANGE = 0.12
"""Change of the visible fraction over a patch that rays show without doubt."""
MISSED = 0.005
"""Fraction of patches in which an edge may be missed: patches are linearised. The occluders lie as
near to patches as a patch is large."""
LIGHTS = {
    "quad": QuadLight((1.0, -1.0, 5.0), (0.7, 0.0, 0.0), (0.0, -0.5, 0.0), (1.0,) * 3),
    "sphere": SphereLight((0.5, -0.5, 4.0), 0.4, (1.0,) * 3),
    "disk": DiskLight((-0.5, -1.0, 4.0), 0.4, (1.0,) * 3),
    "point": PointLight((0.2, -0.5, 4.0), (1.0,) * 3),
}


class DefaultSpheres(SphereSet):
    """Spheres of which nothing but the bounding spheres is known."""

    shadow_edges = ShapeSet.shadow_edges
    outline_kind = ShapeSet.outline_kind


class DefaultTriangles(TriangleSet):
    """Triangles of which nothing but the bounding spheres is known."""

    shadow_edges = ShapeSet.shadow_edges
    outline_kind = ShapeSet.outline_kind


def _polygons(kind, rng, middle, size):
    u, v = rng.normal(size=(2, 3, COUNT)) * size
    return kind(middle - 0.4 * (u + v), u, v, None)


def _spheres(kind, rng, middle, size):
    return kind(middle, size * rng.uniform(0.3, 1.5, COUNT), None)


def _ellipsoids(kind, rng, middle, size):
    axes = np.linalg.qr(rng.normal(size=(COUNT, 3, 3)))[0] * rng.uniform(0.3, 1.5, (COUNT, 1, 3))
    return kind(middle, np.ascontiguousarray(np.moveaxis(axes, 0, -1)) * size, None)


KINDS = {
    "spheres": (SphereSet, _spheres),
    "ellipsoids": (EllipsoidSet, _ellipsoids),
    "parallelograms": (ParallelogramSet, _polygons),
    "triangles": (TriangleSet, _polygons),
    "balls around spheres": (DefaultSpheres, _spheres),
    "balls around triangles": (DefaultTriangles, _polygons),
}


EYE = np.array([[0.3], [-6.0], [3.0]])
"""The camera, from which the positions of all things are counted."""


def _occluders(name, rng, point, light):
    """Shapes near the line from each point to the light."""
    kind, make = KINDS[name]
    to = light.center - point
    aside = rng.normal(size=(3, COUNT)) * 10.0 ** rng.uniform(-2.0, 0.3, COUNT)
    middle = point + rng.uniform(0.05, 0.9, COUNT) * to + aside
    return make(kind, rng, middle, 10.0 ** rng.uniform(-1.5, 0.5, COUNT))


def _patches(rng, point):
    """Patches of the plane z = 0 around points."""
    steps = np.zeros((3, 3, COUNT))
    steps[:2, :2] = rng.normal(size=(2, 2, COUNT)) * 10.0 ** rng.uniform(-4.0, -1.5, COUNT)
    zero, one = np.zeros((3, COUNT)), np.ones(COUNT)
    return Patch(steps, zero, zero, 0.0 * one, 0.0 * one, one, (0, 1), 1.6)


def _hidden_fraction(rng, shapes, light, point, normal):
    """Fractions (n,) of a light that single shapes hide from points (3, n)."""
    a, b = (np.tile(part, (COUNT, 1)) for part in rng.uniform(size=(2, RAYS)))
    start = point[:, :, None]
    to, _ = light.sample(light.to_center(start), start, normal[:, :, None], a, b)
    return shapes.blocks(np.arange(COUNT)[:, None], start, to, 0.0).mean(axis=1)


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("name", KINDS)
def test_without_a_predicted_edge_the_visible_fraction_does_not_change(name, light):
    rng = np.random.default_rng([len(name), len(light)])
    light = make_emitter(LIGHTS[light], LightMotion(EYE[:, 0], np.zeros(3)))
    point = np.zeros((3, COUNT))
    point[:2] = rng.normal(size=(2, COUNT))
    point -= EYE
    normal = np.tile([[0.0], [0.0], [1.0]], COUNT)
    shapes, patch = _occluders(name, rng, point, light), _patches(rng, point)
    none, rows = np.zeros(COUNT, dtype=bool), np.arange(COUNT)
    found = shapes.shadow_edges(
        rows, ShadedPatches(point, normal, none, patch, rows, none, 0.0), light
    )
    low, high = np.ones(COUNT), np.zeros(COUNT)
    for _ in range(PLACES):
        x, y = rng.uniform(-1.0, 1.0, (2, COUNT))
        place = point + x * patch.steps[0] + y * patch.steps[1]
        state = np.random.default_rng(1)  # the same points of the light
        hidden = _hidden_fraction(state, shapes, light, place, normal)
        # what an occluder hides from the camera does not count
        eye = np.zeros((3, COUNT, 1))
        seen = ~shapes.blocks(rows[:, None], eye, (1.0 - 1e-9) * place[:, :, None], 0.0)[:, 0]
        low = np.where(seen, np.minimum(low, hidden), low)
        high = np.where(seen, np.maximum(high, hidden), high)
    missed = (found.depth == 0.0) & (high - low > CHANGE)
    wrong = found.hides_all & (low < 1.0)
    print(
        f"{name}: {(found.depth > 0.0).mean():.3f} edges, {missed.mean():.4f} missed, "
        f"{found.hides_all.mean():.3f} hidden"
    )
    assert missed.mean() <= MISSED
    assert not wrong.any()
    if "balls" in name:
        assert not found.hides_all.any()
    else:
        assert found.hides_all.mean() > 0.02
        assert (found.depth > 0.0).mean() < 0.95


def test_distance_to_a_polygon():
    """Against a fine grid of its points, and against the distance to a parallelogram."""
    rng = np.random.default_rng(7)
    n = 300
    q, u, v = rng.normal(size=(3, 3, n))
    q[:, :20] = 0.5 * (u + v)[:, :20] - 3.0 * u[:, :20]  # the origin lies in the plane
    same = distance_to_polygon((q, q + u, q + u + v, q + v))
    with np.errstate(invalid="ignore"):
        quad = distance_to_quad(q, u, v)
    known = np.isfinite(quad)
    assert np.allclose(same[known], quad[known], rtol=0.0, atol=1e-12)
    g = np.linspace(0.0, 1.0, 200)
    x, y = (part.ravel() for part in np.meshgrid(g, g))
    inside = x + y <= 1.0 + 1e-9
    grid = q[:, :, None] + u[:, :, None] * x[inside] + v[:, :, None] * y[inside]
    brute = np.sqrt((grid * grid).sum(axis=0)).min(axis=1)
    got = distance_to_polygon(TriangleSet.vertices(q, u, v))
    assert np.all(got <= brute + 1e-12) and np.all(got >= brute - 0.03)
