# SPDX-License-Identifier: GPL-3.0-or-later
"""Proxies that segments enter: none of the spheres that segments meet is left out."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("embreex")

from adaptive_drt.tracing.embree import ProxyScene


def entered(center, radius, start, end):
    """Which segments (n,) come within the spheres (m,) of radius `radius`: (n, m) distances."""
    way = end - start
    along = ((center[:, None] - start[:, :, None]) * way[:, :, None]).sum(axis=0)
    part = np.clip(along / (way**2).sum(axis=0)[:, None], 0.0, 1.0)
    nearest = start[:, :, None] + part * way[:, :, None]
    return np.linalg.norm(center[:, None] - nearest, axis=0) <= radius


@pytest.mark.parametrize("seed", range(8))
def test_spheres_on_the_way_are_found_and_few_others(seed):
    rng = np.random.default_rng(seed)
    scale, away = 10.0 ** rng.uniform(-3, 3), rng.normal(size=(3, 1)) * 10.0 ** rng.uniform(0, 2)
    center = scale * (rng.normal(size=(3, 200)) + away)
    radius = scale * 10.0 ** rng.uniform(-3, -0.7, 200)
    start = scale * (rng.normal(size=(3, 150)) + away)
    end = scale * (rng.normal(size=(3, 1)) + away)
    scene = ProxyScene(center, radius)
    found = np.zeros((150, 200), dtype=bool)
    segment, item = scene.intersected_by(start, end - start)
    assert not found[segment, item].any()
    found[segment, item] = True
    assert found.sum() == segment.size
    around = np.linalg.norm(center[:, None] - start[:, :, None], axis=0) <= scene.circumradius
    missed = entered(center, radius, start, end) & ~found & ~around
    assert not missed.any(), f"seed {seed}"
    # rays go on behind the segment's end, and so may find what is there
    beyond = start + 1e3 * (end - start)
    wide = scene.circumradius * (1 + 1e-4)
    assert not (found & ~entered(center, wide, start, beyond)).any(), f"seed {seed}"
    assert (scene.circumradius > radius).all()


def test_segments_of_no_length_meet_nothing():
    scene = ProxyScene(np.zeros((3, 1)), np.ones(1))
    segment, item = scene.intersected_by(np.array([[5.0], [0.0], [0.0]]), np.zeros((3, 1)))
    assert segment.size == item.size == 0
