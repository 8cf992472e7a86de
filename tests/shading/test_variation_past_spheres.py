# SPDX-License-Identifier: GPL-3.0-or-later
"""Deviations that are foreseen of shadows of spheres, against many points of the patches."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.scene.description import DiskLight, Motion, QuadLight, Sphere, SphereLight
from adaptive_drt.shading.silhouette_rates import ShadowEdges
from adaptive_drt.shading.variation_past_spheres import sphere_shadow_edges
from adaptive_drt.tracing.intersect import Pairs
from deviations import foreseen_and_found
from shaded import patches_at, plan_of

COLOR = (1.0, 1.0, 1.0)
LIGHTS = {
    "quad": QuadLight((0.3, 0.2, 6.0), (0.7, 0.0, 0.1), (0.0, -0.5, 0.0), COLOR),
    "sphere": SphereLight((0.3, 0.2, 6.0), 0.5, COLOR),
    "disk": DiskLight((0.3, 0.2, 6.0), 0.5, COLOR),
}
WAY = Motion((0.5, 0.2, 0.1))


@pytest.mark.parametrize("kind", LIGHTS)
@pytest.mark.parametrize("half", [(0.5, 0.5, 0.0), (3.0, 3.0, 0.0), (0.5, 0.5, 0.5)], ids=str)
def test_deviations_are_foreseen_and_not_much_too_large(kind, half):
    way = WAY if half[2] else None
    balls = (Sphere((0.2, 0.1, 2.5), 0.5, motion=way), Sphere((-0.9, 0.4, 1.0), 0.3))
    plan = plan_of(*balls, light=LIGHTS[kind])
    x, y = np.random.default_rng(4).uniform((60, 30), (140, 100), (250, 2)).T
    deviation, off = foreseen_and_found(plan, x, y, 2, half)
    said = deviation.sum(axis=(0, 1))
    rms = np.sqrt((off**2).mean()), np.sqrt((said**2).mean())
    assert rms[0] < rms[1] < 100.0 * rms[0]
    assert (off > 3.0 * said + 1e-7).mean() < 0.04


@pytest.mark.parametrize("seed", range(6))
def test_covers_depths_and_shifts(seed):
    rng = np.random.default_rng(seed)
    ball = Sphere((0.0, 0.0, 3.0), float(rng.uniform(0.1, 1.0)))
    plan = plan_of(ball, light=LIGHTS["sphere"])
    x, y = rng.uniform((60, 30), (140, 100), (300, 2)).T
    hits, patch = patches_at(plan, x, y, 1, (0.3, 0.3, 0.0))
    pairs = Pairs(np.arange(300), np.zeros(300, dtype=np.int64))
    found = sphere_shadow_edges(plan, hits, patch, plan.lights[0], pairs, 0.0)
    assert isinstance(found, ShadowEdges)
    point = hits.point + plan.lens.origin[:, None]
    to, v = (np.array(c)[:, None] - point for c in (LIGHTS["sphere"].center, ball.center))
    far, near = np.linalg.norm(to, axis=0), np.linalg.norm(v, axis=0)
    apart = np.arccos((to * v).sum(axis=0) / far / near)
    light, own = np.arcsin(0.5 / far), np.arcsin(ball.radius / near)
    # radii may change by this much over a patch, at least
    move = 2.0 * patch.reach / near
    assert found.covers[apart + light + move < own].all()
    assert not found.covers[apart + light > own].any()
    assert not found.depth[(apart - light - own > 4.0 * move)].any()
    crossing = (apart < light + own) & (apart > np.abs(light - own))
    assert (found.depth[crossing] > 0.0).all() and (found.depth <= 1.0).all()
    most = np.minimum(own / light, 1.0) ** 2
    np.testing.assert_allclose(found.depth[crossing], most[crossing], rtol=0.3)
