# SPDX-License-Identifier: GPL-3.0-or-later
"""Deviations by shadows: none where none can be, and what is left of them after the shutter."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.scene.description import PointLight, Sphere, SphereLight
from adaptive_drt.shading.variation import (
    KINK_KIND,
    ROOT_KIND,
    SMOOTH_KIND,
    STEP_KIND,
    shadow_variation,
    steps_after_shutter,
    zero_variation,
)
from adaptive_drt.tracing.occluder_culling import Occluders
from shaded import patches_at, plan_of

COLOR = (1.0, 1.0, 1.0)


def varied(plan, x, y, half):
    hits, patch = patches_at(plan, x, y, plan.object_count - 1, half)
    light = plan.as_shadow_caster(plan.lights[0])
    pairs = Occluders(plan).find_candidates(light, hits, patch.radius)
    return hits, shadow_variation(plan, hits, patch, light, pairs, 0.0)


def test_kinds_are_apart():
    assert sorted((SMOOTH_KIND, ROOT_KIND, KINK_KIND, STEP_KIND)) == [0, 1, 2, 3]
    assert zero_variation(5).shape == (4, 3, 5) and not zero_variation(5).any()


@pytest.mark.parametrize("across", [0.0, 0.1, 1.0])
@pytest.mark.parametrize("along", [0.0, 0.05, 0.5, 5.0])
def test_steps_that_move_are_spread_out(across, along):
    steps = np.array([[across], [across], [along]])
    found = steps_after_shutter(steps)[0]
    if along <= 2.0 * across:
        assert found == pytest.approx(2.0 * across)
    else:
        assert found == pytest.approx((2.0 * across) ** 2 / along)


def test_umbrae_and_open_floors_do_not_vary_and_edges_do():
    light = SphereLight((0.0, 0.0, 6.0), 0.3, COLOR)
    plan = plan_of(Sphere((0.0, 0.0, 3.0), 0.8), light=light)
    x, y = np.random.default_rng(1).uniform((40, 20), (160, 110), (800, 2)).T
    hits, (found, hidden) = varied(plan, x, y, (0.3, 0.3, 0.0))
    point = hits.point + plan.lens.origin[:, None]
    away = np.hypot(point[0], point[1])
    # from the middle: the umbra ends at 1.3 m and the penumbra at 1.95 m, about
    assert hidden[away < 1.15].all() and not hidden[away > 1.45].any()
    assert not found[..., hidden].any()
    assert not found[..., away > 2.3].any()
    edge = (away > 1.45) & (away < 1.8)
    assert (found[:, :2, edge].sum(axis=(0, 1)) > 0.0).all()
    assert not found[:, 2].any()


@pytest.mark.parametrize("half", [0.02, 0.5])
def test_shadows_of_points_are_steps_where_their_edge_may_be(half):
    plan = plan_of(Sphere((0.0, 0.0, 3.0), 0.8), light=PointLight((0.0, 0.0, 6.0), COLOR))
    x, y = np.random.default_rng(2).uniform((40, 20), (160, 110), (3_000, 2)).T
    hits, (found, _) = varied(plan, x, y, (half, half, 0.0))
    point = hits.point + plan.lens.origin[:, None]
    away = np.hypot(point[0], point[1])
    edge = 6.0 * np.tan(np.arcsin(0.8 / 3.0))
    step = found[STEP_KIND].sum(axis=0) > 0.0
    size = half * 0.1  # metres, about, that half a patch is wide
    assert step[np.abs(away - edge) < 0.2 * size].all()
    assert not step[np.abs(away - edge) > 10.0 * size].any()
    assert not found[[SMOOTH_KIND, ROOT_KIND]].any()
