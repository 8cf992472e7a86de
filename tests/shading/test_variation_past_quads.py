# SPDX-License-Identifier: GPL-3.0-or-later
"""Deviations that are foreseen of shadows of quads, against many points of the patches."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.scene.description import Motion, Quad, QuadLight, SphereLight
from adaptive_drt.shading.variation_past_quads import quad_shadow_edges
from adaptive_drt.tracing.intersect import Pairs
from deviations import foreseen_and_found
from shaded import patches_at, plan_of

COLOR = (1.0, 1.0, 1.0)
LIGHTS = {
    "quad": QuadLight((0.3, 0.2, 6.0), (0.7, 0.0, 0.1), (0.0, -0.5, 0.0), COLOR),
    "sphere": SphereLight((0.3, 0.2, 6.0), 0.5, COLOR),
}
WAY = Motion((0.5, 0.2, 0.1))


def plates(way):
    return (
        Quad((-0.5, -0.5, 2.5), (1.2, 0.1, 0.0), (0.2, 1.0, 0.3), motion=way),
        Quad((-1.5, -0.2, 0.0), (0.7, 0.0, 0.0), (0.0, 0.1, 1.0)),  # stands on the floor
    )


@pytest.mark.parametrize("kind", LIGHTS)
@pytest.mark.parametrize("half", [(0.5, 0.5, 0.0), (3.0, 3.0, 0.0), (0.5, 0.5, 0.5)], ids=str)
def test_deviations_are_foreseen_and_not_much_too_large(kind, half):
    plan = plan_of(*plates(WAY if half[2] else None), light=LIGHTS[kind])
    x, y = np.random.default_rng(4).uniform((60, 30), (140, 100), (250, 2)).T
    deviation, off = foreseen_and_found(plan, x, y, 2, half)
    said = deviation.sum(axis=(0, 1))
    rms = np.sqrt((off**2).mean()), np.sqrt((said**2).mean())
    assert rms[0] < rms[1] < 100.0 * rms[0]
    # the floor behind the standing quad is not what its pixels see
    assert (off > 3.0 * said + 1e-7).mean() < 0.03


def test_wide_plates_cover_and_plates_behind_the_light_hide_nothing():
    light = LIGHTS["sphere"]
    x, y = np.random.default_rng(1).uniform((80, 50), (120, 90), (100, 2)).T
    pairs = Pairs(np.arange(100), np.zeros(100, dtype=np.int64))
    for height, covers in ((3.0, True), (7.0, False)):
        wide = Quad((-8.0, -8.0, height), (16.0, 0.0, 0.0), (0.0, 16.0, 0.0))
        plan = plan_of(wide, light=light)
        hits, patch = patches_at(plan, x, y, 1, (0.3, 0.3, 0.0))
        found = quad_shadow_edges(plan, hits, patch, plan.lights[0], pairs, 0.0)
        assert (found.covers == covers).all()
        assert covers or not found.depth.any()
