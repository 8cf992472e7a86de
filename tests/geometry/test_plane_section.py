# SPDX-License-Identifier: GPL-3.0-or-later
"""Spheres that a light's plane cuts: what the polygons that stand for them are off by is stated."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.scene.description import Camera, DiskLight, Quad, QuadLight, Scene, Sphere
from adaptive_drt.scene.settings import Settings
from adaptive_drt.shading import partial_occlusion
from adaptive_drt.shading.partial_occlusion import apply_occluders
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Pairs, Surface
from shape_sets import spheres_of

POINTS = 60
FINE = 192
"""Corners of the polygon that counts as the truth, four times those of the renderer's."""
FINE_SHARE = 1.0 - 1.0 / 16.0
"""Difference between the two polygons' results, as a fraction of the coarser one's error: errors
fall with the square of the number of corners (Richardson, 1911)."""
WHITE = (1.0, 1.0, 1.0)
LIGHTS = {
    "disk": DiskLight((0.0, 0.0, 2.0), 0.8, WHITE),
    "quad": QuadLight((0.0, 0.0, 2.0), (0.9, 0.0, 0.2), (0.0, -0.7, 0.1), WHITE),
}


def case(name, seed, others):
    """A plan whose light some spheres reach into, with quads before it if wanted, and points."""
    rng = np.random.default_rng(seed)
    shapes = []
    for _ in range(1 + 2 * others):
        place = rng.normal(size=3) * (0.5, 0.5, 0.1) + (0.0, 0.0, 2.0)
        shapes.append(Sphere(tuple(place), float(rng.uniform(0.15, 0.5))))
    for _ in range(2 * others):
        place = rng.normal(size=3) * (0.5, 0.5, 0.1) + (0.0, 0.0, 1.3)
        shapes.append(Quad(tuple(place), *(tuple(x) for x in rng.normal(size=(2, 3)) * 0.4)))
    scene = Scene(Camera(resolution=(4, 4)), tuple(shapes), (LIGHTS[name],))
    plan = make_plan(scene, Settings(method="EXACT"))
    point = rng.uniform((-3.0, -3.0, -1.5), (3.0, 3.0, 0.0), (POINTS, 3)).T
    normal = np.zeros((3, POINTS))
    normal[2] = 1.0
    surface = Surface(point, normal, np.full(POINTS, -1), np.zeros(POINTS, dtype=bool))
    number = plan.object_count
    pairs = Pairs(np.repeat(np.arange(POINTS), number), np.tile(np.arange(number), POINTS))
    return plan, surface, pairs


def factors(plan, surface, pairs):
    """Factors and errors (n,), and which points see a sphere cut."""
    light = plan.lights[0]
    factor = light.irradiance_factor(light.to_center(surface.point), surface.point, surface.normal)
    whole, error = factor.copy(), np.zeros(POINTS)
    apply_occluders(plan, surface, light, pairs, 0.0, factor, error, np.full(POINTS, np.inf))
    return factor, error, whole


@pytest.mark.parametrize("others", [False, pytest.param(True, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", LIGHTS)
def test_the_polygons_error_is_no_more_than_estimated(name, others, monkeypatch):
    off, stated = [], []
    for seed in range(6):
        of = case(name, seed, others)
        got, error, whole = factors(*of)
        with monkeypatch.context() as finer:
            finer.setattr(partial_occlusion, "SECTION_CORNERS", FINE)
            want, _, _ = factors(*of)
        some = (want > 1e-6 * whole) & (want < 0.999 * whole)
        off.append(((got - want) / FINE_SHARE / whole)[some])
        stated.append((error / whole)[some])
    off, stated = np.abs(np.concatenate(off)), np.concatenate(stated)
    assert off.size > POINTS, "hardly any light was hidden in part"
    assert np.sqrt((off**2).mean()) <= np.sqrt((stated**2).mean())
    assert (off <= 2.0 * stated + 1e-9).mean() >= 0.95
    assert np.sqrt((off**2).mean()) < 1e-3


def test_closed_forms_state_no_error():
    plan, surface, _ = case("quad", 0, True)
    quads = np.arange(spheres_of(plan).count, plan.object_count)
    pairs = Pairs(np.repeat(np.arange(POINTS), quads.size), np.tile(quads, POINTS))
    factor, error, whole = factors(plan, surface, pairs)
    assert (factor < whole).any() and not error.any()
