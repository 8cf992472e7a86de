# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow rays between points of random scenes and anywhere, against plain formulas."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.scene.description import Sphere
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Pairs, Surface
from adaptive_drt.tracing.shadow_rays import batches_by_rank, blocked_segments
from plain_hits import oracle_depth
from random_scenes import random_scene

POINTS, RAYS = 40, 12


@pytest.mark.parametrize("seed", range(16))
def test_segments_are_blocked_by_what_they_cross(seed):
    scene = random_scene(seed)
    plan = make_plan(scene, Settings())
    shapes = sorted(scene.shapes, key=lambda shape: not isinstance(shape, Sphere))
    rng = np.random.default_rng(seed)
    size = max(
        np.abs([getattr(shape, "center", None) or shape.corner for shape in shapes]).max(), 1e-3
    )
    start = rng.uniform(-size, size, (3, POINTS))
    to = rng.uniform(-size, size, (3, POINTS, RAYS)) - start[:, :, None]
    time = rng.uniform(-0.5, 0.5, (POINTS, RAYS)) if plan.motion else np.zeros((POINTS, RAYS))
    chosen = rng.random((POINTS, len(shapes))) < 0.7
    pairs = Pairs(*np.nonzero(chosen))
    eye = plan.lens.origin[:, None]
    drift = np.array(scene.camera.motion.displacement) if scene.camera.motion else np.zeros(3)
    normal, item = np.zeros_like(start), np.full(POINTS, -1)
    points = Surface(start - eye, normal, item, np.zeros(POINTS, dtype=bool))
    found = blocked_segments(plan, points, to, pairs, time)
    for k in range(RAYS):
        way, t = to[:, :, k], time[:, k]
        length = np.linalg.norm(way, axis=0)
        # the plan's points rest with the camera
        begin = start + t * drift[:, None]
        far = np.array([oracle_depth(shape, way / length, t, begin) for shape in shapes]) / length
        want = ((far < 1.0) & chosen.T).any(axis=0)
        unsure = (np.abs(far - 1.0) < 1e-9).any(axis=0) | (far < 1e-9).any(axis=0)
        np.testing.assert_array_equal(found[~unsure, k], want[~unsure], f"seed {seed}")
    assert 0.0 < found.mean() < 0.98


def test_a_point_is_once_in_each_batch():
    rng = np.random.default_rng(1)
    pixel = np.sort(rng.integers(0, 50, 200))
    pairs = Pairs(pixel, rng.integers(0, 9, 200))
    batches = batches_by_rank(50, pairs)
    assert all(np.unique(rows).size == rows.size for rows, _ in batches)
    found = [(p, i) for rows, item in batches for p, i in zip(rows, item, strict=True)]
    assert sorted(found) == sorted(zip(pairs.pixel, pairs.item, strict=True))
    for pixel in range(50):  # in order
        assert [i for p, i in found if p == pixel] == pairs.item[pairs.pixel == pixel].tolist()
