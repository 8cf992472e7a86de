# SPDX-License-Identifier: GPL-3.0-or-later
"""Patches: their steps are how far hits move from the middle of a box to its sides."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.patch import Patch
from adaptive_drt.geometry.shape import MIN_PLANE_COSINE
from adaptive_drt.scene.description import Motion, PointLight, Sphere
from adaptive_drt.shading.footprint import make_patch
from shaded import hits_at, patches_at, plan_of
from shape_sets import spheres_of

LIGHT = PointLight((1.0, 0.0, 5.0), (1.0, 1.0, 1.0))
BALL = Sphere((0.0, 0.0, 1.0), 1.0)


def pixels(rng, count, low=(60, 30), high=(140, 90)):
    return rng.uniform(low, high, (count, 2)).T


@pytest.mark.parametrize("half", [1e-4, 0.5])
@pytest.mark.parametrize("axis", [0, 1])
def test_steps_on_planes_are_those_of_hits(half, axis):
    x, y = pixels(np.random.default_rng(1), 50)
    plan = plan_of(light=LIGHT)
    hits, patch = patches_at(plan, x, y, 0, np.eye(3)[axis] * half)
    _, _, moved = hits_at(plan, x + half * (axis == 0), y + half * (axis == 1), 0)
    np.testing.assert_allclose(
        patch.steps[axis], moved.point - hits.point, rtol=0.02, atol=1e-3 * half
    )
    assert patch.axes == (axis,) and not patch.steps[1 - axis].any()
    size = np.linalg.norm(patch.steps[axis], axis=0)
    np.testing.assert_allclose(patch.radius, size, rtol=1e-12)
    np.testing.assert_allclose(patch.surface_steps[axis], size, rtol=1e-12)
    assert not patch.curvature.any()


def test_steps_on_spheres_are_those_of_hits_away_from_the_limb():
    rng = np.random.default_rng(2)
    plan = plan_of(BALL, light=LIGHT)
    center = spheres_of(plan).center[:, 0]
    middle = np.linalg.solve(np.stack([plan.lens.right, plan.lens.up, -center], 1), -plan.lens.base)
    x, y = middle[0] + rng.uniform(-8, 8, 40), middle[1] + rng.uniform(-8, 8, 40)
    hits, patch = patches_at(plan, x, y, 0, (1e-3, 1e-3, 0.0))
    for axis in (0, 1):
        _, _, moved = hits_at(plan, x + 1e-3 * (axis == 0), y + 1e-3 * (axis == 1), 0)
        np.testing.assert_allclose(
            patch.steps[axis], moved.point - hits.point, rtol=0.02, atol=1e-7
        )
    assert (patch.curvature == 1.0).all()
    w = plan.lens.directions(x, y)
    slant = np.abs((hits.normal * w).sum(axis=0)) / np.linalg.norm(w, axis=0)
    np.testing.assert_allclose(patch.cosine, slant, rtol=1e-12)


def test_steps_at_the_limb_are_no_longer_than_a_chord():
    plan = plan_of(BALL, light=LIGHT)
    center = spheres_of(plan).center[:, 0]
    middle = np.linalg.solve(np.stack([plan.lens.right, plan.lens.up, -center], 1), -plan.lens.base)
    # the outermost place at which rays hit
    low, high = 0.0, 100.0
    for _ in range(60):
        at = 0.5 * (low + high)
        try:
            hits_at(plan, middle[:1] + at, middle[1:2], 0)
            low = at
        except AssertionError:
            high = at
    _, patch = patches_at(plan, middle[:1] + low, middle[1:2], 0, (0.5, 0.5, 0.0))
    assert isinstance(patch, Patch) and (patch.cosine >= MIN_PLANE_COSINE).all()
    assert (patch.surface_steps <= 2.0).all() and np.isfinite(patch.steps).all()


@pytest.mark.parametrize("way", [(0.6, 0.0, 0.0), (0.0, 0.0, 0.5), (0.3, -0.4, 0.1)])
def test_hits_move_along_fixed_rays(way):
    moving = Sphere(BALL.center, BALL.radius, motion=Motion(way))
    plan = plan_of(moving, light=LIGHT)
    center = spheres_of(plan).center[:, 0]
    middle = np.linalg.solve(np.stack([plan.lens.right, plan.lens.up, -center], 1), -plan.lens.base)
    x, y = middle[0] + np.linspace(-5, 5, 11), np.full(11, middle[1])
    half = 1e-3
    hits, patch = patches_at(plan, x, y, 0, (0.0, 0.0, half))
    _, _, moved = hits_at(plan, x, y, 0, half)
    np.testing.assert_allclose(patch.steps[2], moved.point - hits.point, rtol=0.05, atol=1e-6)
    assert patch.axes == (2,) and (patch.half_time == half).all()


def test_points_are_patches_without_extent():
    plan = plan_of(BALL, light=LIGHT)
    x, y = pixels(np.random.default_rng(3), 20)
    w, t, hits = hits_at(plan, x, y, 1)
    patch = make_patch(plan, w, t, hits, np.zeros((3, 20)))
    assert patch.axes == () and not patch.radius.any() and not patch.steps.any()
