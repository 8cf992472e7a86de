# SPDX-License-Identifier: GPL-3.0-or-later
"""Deviations that are foreseen of open light, against many points of the patches."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.scene.description import (
    DiskLight,
    Ellipsoid,
    PointLight,
    QuadLight,
    Sphere,
    SphereLight,
)
from adaptive_drt.shading.unoccluded_variation import unoccluded_deviations
from adaptive_drt.shading.variation import KINK_KIND, SMOOTH_KIND
from adaptive_drt.tracing.intersect import intersect_pairs
from deviations import foreseen_and_found
from shaded import patches_at, plan_of
from shape_sets import spheres_of

COLOR = (1.0, 1.0, 1.0)
LIGHTS = {
    "near quad": QuadLight((0.3, 0.2, 0.5), (0.3, 0.0, 0.0), (0.0, -0.2, 0.0), COLOR),
    "leaning quad": QuadLight((0.3, 0.2, 0.8), (0.0, 0.0, 0.4), (0.5, 0.2, 0.0), COLOR),
    "sphere": SphereLight((0.3, 0.2, 0.9), 0.4, COLOR),
    "disk": DiskLight((0.3, 0.2, 0.9), 0.4, COLOR),
    "point": PointLight((0.3, 0.2, 0.4), COLOR),
}


@pytest.mark.parametrize("half", [0.5, 3.0])
@pytest.mark.parametrize("kind", LIGHTS)
def test_deviations_on_a_floor(kind, half):
    plan = plan_of(light=LIGHTS[kind])
    x, y = np.random.default_rng(4).uniform((60, 30), (140, 100), (250, 2)).T
    deviation, off = foreseen_and_found(plan, x, y, 0, (half, half, 0.0))
    said = deviation.sum(axis=(0, 1))
    rms = np.sqrt((off**2).mean()), np.sqrt((said**2).mean())
    assert rms[0] < rms[1] < 60.0 * rms[0]
    assert (off > 3.0 * said + 1e-9).mean() < 0.02


@pytest.mark.parametrize("kind", ["sphere", "point"])
def test_deviations_on_a_ball_with_its_terminator(kind):
    light = {
        "sphere": SphereLight((3.0, 0.0, 1.0), 0.4, COLOR),
        "point": PointLight((3.0, 0.0, 1.0), COLOR),
    }[kind]
    plan = plan_of(Sphere((0.0, 0.0, 1.0), 1.0), light=light)
    x, y = np.random.default_rng(4).uniform((70, 40), (130, 120), (4_000, 2)).T
    w, v = plan.lens.directions(x, y), spheres_of(plan).center[:, [0]]
    hit = np.linalg.norm(np.cross(w, v, axis=0), axis=0) < 0.93 * np.linalg.norm(w, axis=0)
    x, y = x[hit][:250], y[hit][:250]
    deviation, off = foreseen_and_found(plan, x, y, 0, (0.5, 0.5, 0.0))
    said = deviation.sum(axis=(0, 1))
    assert np.sqrt((off**2).mean()) < np.sqrt((said**2).mean())
    assert (off > 3.0 * said + 1e-9).mean() < 0.02


def test_deviations_fall_with_the_square_of_the_extent():
    plan = plan_of(light=LIGHTS["sphere"])
    light = plan.lights[0]
    x, y = np.random.default_rng(4).uniform((60, 30), (140, 100), (50, 2)).T
    sums = []
    for half in (0.2, 0.1):
        hits, patch = patches_at(plan, x, y, 0, (half, half, 0.0))
        to = light.to_center(hits.point, 0.0)
        factor = light.irradiance_factor(to, hits.point, hits.normal)
        found = unoccluded_deviations(light, to, hits, patch, factor)
        sums.append(found.sum(axis=(0, 1)))
        assert not found[:, 2].any()
    np.testing.assert_allclose(sums[0], 4.0 * sums[1], rtol=1e-6)


def test_the_surface_of_a_ball_of_light_that_curves_through_patches_is_foreseen():
    """Below the ball's lowest point the surface is level: its distance changes in second order."""
    plan = plan_of(light=SphereLight((0.3, 0.2, 1.066), 1.0755, COLOR))
    x, y = np.random.default_rng(4).uniform((80, 50), (130, 90), (3_000, 2)).T
    hits, _ = patches_at(plan, x, y, 0, (1.0, 1.0, 0.0))
    to = plan.lights[0].to_center(hits.point, 0.0)
    near = np.hypot(to[0], to[1]) < 0.25
    assert near.sum() > 30
    deviation, off = foreseen_and_found(plan, x[near], y[near], 0, (1.5, 1.5, 0.0))
    said = deviation.sum(axis=(0, 1))
    assert np.sqrt((off**2).mean()) < np.sqrt((said**2).mean())
    assert (off > 3.0 * said + 1e-9).mean() < 0.03


def test_at_sharp_rims_no_more_is_foreseen_than_light_can_differ():
    """The normal of a flake's rim turns by many radians in a pixel, by its largest curvature."""
    flake = Ellipsoid((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1e-3))
    plan = plan_of(flake, light=LIGHTS["sphere"])
    light = plan.lights[0]
    x, y = np.random.default_rng(4).uniform((0, 0), (200, 150), (4_000, 2)).T
    w = plan.lens.directions(x, y)
    seen = np.isfinite(intersect_pairs(plan, w, np.ones(4_000, dtype=int)))
    x, y = x[seen][:200], y[seen][:200]
    hits, patch = patches_at(plan, x, y, 1, (0.5, 0.5, 0.0))
    to = light.to_center(hits.point, 0.0)
    factor = light.irradiance_factor(to, hits.point, hits.normal)
    found = unoccluded_deviations(light, to, hits, patch, factor)
    assert (patch.surface_steps[0] * patch.curvature > 10.0).mean() > 0.5
    # a ball of light that fills the hemisphere gives pi, and there are three causes
    assert found.sum(axis=(0, 1)).max() < 3.0 * np.pi
    # turns of more than a radian leave errors of either sign
    assert not found[SMOOTH_KIND].any() or found[SMOOTH_KIND].max() < found[KINK_KIND].max()
