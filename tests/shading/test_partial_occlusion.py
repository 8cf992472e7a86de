# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights that occluders reach into or enclose: what no closed form covers, against many rays."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.lights.emitter import sample_emitter
from adaptive_drt.scene.description import Quad, QuadLight, Sphere, SphereLight
from adaptive_drt.shading.partial_occlusion import apply_occluders
from adaptive_drt.tracing.occluder_culling import Occluders
from plain_hits import blocked
from shaded import FLOOR, patches_at, plan_of

COLOR = (1.0, 1.0, 1.0)
QUAD = QuadLight((0.0, 0.0, 4.0), (1.0, 0.0, 0.0), (0.0, -0.8, 0.0), COLOR)
BULB = SphereLight((0.0, 0.0, 4.0), 0.8, COLOR)
CASES = {
    "a ball through the light's plane": (QUAD, (Sphere((0.4, 0.2, 4.0), 0.5),)),
    "a quad through the light's plane": (
        QUAD,
        (Quad((-0.3, -0.5, 3.2), (0.6, 0.2, 0.0), (0.0, 0.0, 1.5)),),
    ),
    "a ball in a bulb": (BULB, (Sphere((0.5, 0.2, 3.6), 0.4),)),
    "many balls": (
        QUAD,
        tuple(Sphere((0.5 * k - 1, 0.3 * k - 0.5, 2.0 + 0.2 * k), 0.3) for k in range(5)),
    ),
    "balls and quads": (
        BULB,
        (Sphere((0.2, 0.0, 2.0), 0.4), Quad((-1.0, -1.0, 1.5), (0.9, 0.0, 0.1), (0.0, 1.2, 0.0))),
    ),
}
COUNT, SIDE = 30, 48


@pytest.mark.parametrize("case", CASES)
def test_factors_are_the_mean_over_rays(case):
    record, shapes = CASES[case]
    rng = np.random.default_rng(5)
    plan = plan_of(*shapes, light=record)
    light, floor = plan.lights[0], plan.object_count - 1
    x, y = rng.uniform((60, 30), (140, 100), (COUNT, 2)).T
    hits, _ = patches_at(plan, x, y, floor, (0.5, 0.5, 0.0))
    center = light.moved(0.0)
    a, b = (part.ravel() for part in np.meshgrid(*[(np.arange(SIDE) + 0.5) / SIDE] * 2))
    a, b = (np.broadcast_to(part, (COUNT, SIDE**2)) for part in (a, b))
    to, weight = sample_emitter(
        light, center[:, :, None], hits.point[:, :, None], hits.normal[:, :, None], a, b
    )
    start = np.repeat(hits.point + plan.lens.origin[:, None], SIDE**2, axis=1)
    cut = blocked((*shapes, FLOOR), start, start + to.reshape(3, -1), np.zeros(start.shape[1]),
                  (len(shapes),)).reshape(weight.shape)  # fmt: skip
    factor = weight.mean(axis=1)
    pairs = Occluders(plan).find(light, hits)
    apply_occluders(plan, hits, light, pairs, 0.0, factor)
    want = (weight * ~cut).mean(axis=1)
    size = weight.mean(axis=1).max()
    np.testing.assert_allclose(factor, want, atol=0.02 * size)
    assert (want < 0.9 * weight.mean(axis=1)).any()
    # points without occluders keep their factor
    alone = np.setdiff1d(np.arange(COUNT), pairs.pixel)
    np.testing.assert_array_equal(factor[alone], weight.mean(axis=1)[alone])
