# SPDX-License-Identifier: GPL-3.0-or-later
"""Footprints of pixels: the points that many rays through a pixel hit lie within their bounds."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.detection.pixel_footprint import make_footprint
from adaptive_drt.detection.shadow_discontinuities import patch_reach
from detected import grid, seen, traced
from random_scenes import random_scene


@pytest.mark.parametrize("seed", range(20))
def test_hits_on_the_same_object_are_within_reach_and_footprint(seed):
    scene = random_scene(seed)
    plan, tile, center = traced(scene)
    if not center.rows.size:
        return
    hits, rows = center.hits, center.rows
    reach = patch_reach(plan, hits, center.w[:, rows])
    footprint = make_footprint(plan, hits, reach)
    at, rng = np.arange(rows.size), np.random.default_rng(seed)
    slope = rng.normal(size=(3, rows.size))
    most = footprint.linear_variation(slope, at)
    for a, b, _ in grid(4):
        item, point = seen(scene, tile.x[rows] + a, tile.y[rows] + b, np.zeros(rows.size))
        same = item == hits.item
        away = point - plan.lens.origin[:, None] - hits.point
        away, size = away[:, same], np.linalg.norm(hits.point[:, same], axis=0)
        apart = np.linalg.norm(away, axis=0)
        assert (apart <= reach[same] + 1e-9 * size).all(), f"seed {seed}"
        change = np.abs((slope[:, same] * away).sum(axis=0))
        slack = 1e-9 * size * np.linalg.norm(slope[:, same], axis=0)
        assert (change <= most[same] + slack).all(), f"seed {seed}"
        # a ball around a point of the footprint is never clear of it
        clear = footprint.is_clear_of(away, 1e-9 * size, at[same])
        assert not clear.any(), f"seed {seed}"
    wide = np.isfinite(footprint.thickness)
    far = (
        1e3
        * (reach + footprint.thickness)[wide]
        * slope[:, wide]
        / np.linalg.norm(slope[:, wide], axis=0)
    )
    flat = footprint.is_clear_of(far, np.zeros(far.shape[1]), at[wide])
    assert not wide.any() or flat.mean() > 0.9
