# SPDX-License-Identifier: GPL-3.0-or-later
"""Footprints: linear functions over them, and balls clear of them, against many of their points."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.footprint import Footprint

SIDE = np.linspace(-1.0, 1.0, 21)


def points_of(a, b, thickness, rng):
    """Points of a parallelogram and as far off it as it is thick: (n, 3)."""
    x, y = (part.ravel() for part in np.meshgrid(SIDE, SIDE))
    off = rng.normal(size=(x.size, 3))
    off *= thickness / np.linalg.norm(off, axis=1, keepdims=True)
    return x[:, None] * a + y[:, None] * b + off


@pytest.mark.parametrize("seed", range(30))
@pytest.mark.parametrize("thickness", [0.0, 0.3])
def test_bounds_hold_at_all_points(seed, thickness):
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=(2, 3))
    footprint = Footprint((a[:, None], b[:, None]), np.array([thickness]))
    points, at = points_of(a, b, thickness, rng), np.zeros(20, dtype=np.int64)
    slope = rng.normal(size=(3, 20))
    most = footprint.linear_variation(slope, at)
    change = np.abs(points @ slope).max(axis=0)
    assert (change <= most * (1 + 1e-12)).all()
    assert (change >= most * (0.99 if thickness == 0.0 else 0.6)).all()
    v, r = rng.normal(size=(3, 20)) * 3.0, rng.random(20)
    clear = footprint.is_clear_of(v, r, at)
    away = np.linalg.norm(points[:, :, None] - v, axis=1).min(axis=0)
    assert (away[clear] > r[clear]).all()
    assert clear.any()


def test_unbounded_footprints_hold_nothing_back():
    zero = np.zeros((3, 1))
    footprint, at = Footprint((zero, zero), np.array([np.inf])), np.zeros(1, dtype=np.int64)
    assert footprint.linear_variation(np.ones((3, 1)), at)[0] == np.inf
    assert footprint.linear_variation(zero, at)[0] == np.inf
    assert not footprint.is_clear_of(np.full((3, 1), 1e9), np.ones(1), at)[0]
