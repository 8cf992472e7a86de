# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights seen as a whole, in part or not at all, against rays to many points of them."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.detection.occlusion import classify_light_visibility
from adaptive_drt.scene.description import Sphere
from adaptive_drt.tracing.occluder_culling import Occluders
from detected import traced
from plain_hits import oracle_depth
from random_scenes import random_scene

RAYS = 100


def blocked_by(plan, scene, surface, to, time):
    """Which shapes (s, n, k) block vectors (3, n, k) from points; not the points' own."""
    shapes = sorted(scene.shapes, key=lambda shape: not isinstance(shape, Sphere))
    n, k = to.shape[1:]
    start = np.repeat(surface.point + plan.lens.origin[:, None], k, axis=1)
    way = to.reshape(3, -1)
    length = np.linalg.norm(way, axis=0)
    far = np.array([oracle_depth(s, way / length, np.full(n * k, time), start) for s in shapes])
    cut = ((far > 1e-9 * length) & (far < length * (1 - 1e-9))).reshape(len(shapes), n, k)
    own = (surface.item == np.arange(len(shapes))[:, None]) & ~surface.inside
    return cut & ~own[:, :, None]


@pytest.mark.parametrize("seed", range(30))
@pytest.mark.parametrize("order", [1, 2])
def test_lights_are_open_hidden_or_in_part(seed, order):
    scene = random_scene(seed)
    if scene.camera.motion is not None:
        return
    plan, _, center = traced(scene, order=order)
    rng = np.random.default_rng(seed)
    if not center.rows.size:
        return
    some = rng.choice(center.rows.size, min(200, center.rows.size), replace=False)
    points = center.hits.take(np.sort(some))
    for light in plan.lights:
        pairs = Occluders(plan).find_candidates(light, points)
        found = classify_light_visibility(plan, points, light, pairs)
        middle = light.to_center(points.point, 0.0)[:, :, None]
        if light.extended:
            spot = rng.random((2, some.size, RAYS))
            to, weight = light.sample(
                middle, points.point[:, :, None], points.normal[:, :, None], *spot
            )
        else:
            to = middle
            weight = np.maximum((points.normal[:, :, None] * to).sum(axis=0), 0.0)
        assert not weight[found.dark].any(), f"seed {seed}"
        hidden = blocked_by(plan, scene, points, to, 0.0)
        if not light.casts_shadow:
            assert not found.hidden.any() and not found.partial.any()
            continue
        open_ = (weight > 0.0) & ~hidden.any(axis=0)
        assert not (open_ & found.hidden[:, None]).any(), f"seed {seed}"
        sure = ~(found.dark | found.hidden | found.partial)
        lost = (weight > 0.0) & hidden.any(axis=0) & sure[:, None]
        # a ray along an outline may fall on either side
        assert lost.mean() < 1e-4, f"seed {seed}"
        cut = found.partial & (weight > 0.0).all(axis=1) & hidden.any(axis=(0, 2))
        assert np.isin(np.flatnonzero(cut), found.pairs.pixel).all(), f"seed {seed}"
