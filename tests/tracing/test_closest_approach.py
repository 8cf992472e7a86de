# SPDX-License-Identifier: GPL-3.0-or-later
"""Ray parameters of hits, and of the closest points where rays miss, by plain formulas."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.scene.description import Sphere
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.closest_approach import hits_or_closest_points
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import intersect_pairs
from random_scenes import random_scene

RAYS = 300


@pytest.mark.parametrize("seed", range(12))
def test_hits_are_hits_and_misses_are_where_rays_are_nearest(seed):
    scene = random_scene(seed)
    plan = make_plan(scene, Settings())
    shapes = sorted(scene.shapes, key=lambda shape: not isinstance(shape, Sphere))
    drift = np.array(scene.camera.motion.displacement) if scene.camera.motion else np.zeros(3)
    rng = np.random.default_rng(seed)
    x, y = rng.uniform((0.0, 0.0), plan.resolution, (RAYS, 2)).T
    w, item = plan.lens.directions(x, y), rng.integers(0, len(shapes), RAYS)
    time = rng.uniform(-0.5, 0.5, RAYS) if plan.motion else np.zeros(RAYS)
    found = hits_or_closest_points(plan, w, item, time)
    hit = intersect_pairs(plan, w[:, :, None], item, time[:, None])[:, 0]
    assert np.isfinite(found).all() and (found > 0.0).all()
    met = np.isfinite(hit)
    np.testing.assert_array_equal(found[met], hit[met])
    for k in np.flatnonzero(~met):
        shape = shapes[item[k]]
        way = np.array(shape.motion.displacement) if shape.motion else np.zeros(3)
        shift = time[k] * (way - drift) - plan.lens.origin
        if isinstance(shape, Sphere):
            center = np.array(shape.center) + shift
            along = max(w[:, k] @ center / (w[:, k] @ w[:, k]), 0.0)
            assert found[k] == pytest.approx(along, rel=1e-9, abs=1e-300), (seed, k)
            continue
        corner, u, v = (
            np.array(shape.corner) + shift,
            np.array(shape.edge_u),
            np.array(shape.edge_v),
        )
        normal = np.cross(u, v)
        corners = np.array([corner, corner + u, corner + v, corner + u + v])
        far = 2.0 * np.linalg.norm(corners, axis=1).max() / np.linalg.norm(w[:, k])
        with np.errstate(divide="ignore"):
            plane = (normal @ corner) / (normal @ w[:, k])
        if abs(plane / far - 1.0) < 1e-9 or abs(plane) < 1e-12:
            continue
        # on the plane, if that is ahead and not far beyond the corners; else beside a corner
        beside = (corners @ w[:, k]).max() / (w[:, k] @ w[:, k])
        want = plane if 0.0 < plane < far else max(beside, 0.0)
        assert found[k] == pytest.approx(want, rel=1e-9, abs=1e-300), (seed, k)
