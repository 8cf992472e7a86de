# SPDX-License-Identifier: GPL-3.0-or-later
"""Occluders that others hide from all points of a block: dropped only for sure."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.tracing import shadowed_occluders as shadowed_module
from adaptive_drt.tracing.shadowed_occluders import hidden_by_spheres


def blocks_of(rng, blocks, objects):
    middle, span = rng.normal(size=(3, blocks)), rng.uniform(0.0, 0.4, blocks)
    center = rng.normal(size=(3, objects)) * 6.0
    radius = rng.uniform(0.2, 1.5, objects)
    block = np.repeat(np.arange(blocks), objects)
    return middle, span, block, np.tile(np.arange(objects), blocks), (center, radius)


@pytest.mark.parametrize("seed", range(6))
def test_each_ray_to_what_is_dropped_meets_a_sphere_that_is_kept(seed):
    rng = np.random.default_rng(seed)
    middle, span, block, item, balls = blocks_of(rng, 20, 150)
    solid = np.where(rng.uniform(size=150) < 0.7, balls[1], 0.0)
    dropped = hidden_by_spheres(middle, span, block, item, balls, solid)
    assert dropped.any()
    for b, i in zip(block[dropped], item[dropped], strict=True):
        kept = item[(block == b) & ~dropped]
        kept = kept[solid[kept] > 0.0]
        way = rng.normal(size=(3, 60))
        point = middle[:, b, None] + way / np.linalg.norm(way, axis=0) * span[b]
        way = rng.normal(size=(3, 60))
        there = balls[0][:, i, None] + way / np.linalg.norm(way, axis=0) * balls[1][i]
        away = there - point
        away /= np.linalg.norm(away, axis=0)
        v = balls[0][:, kept, None] - point[:, None]
        along = (v * away[:, None]).sum(axis=0)
        gap = (v * v).sum(axis=0) - along**2
        inside = (v * v).sum(axis=0) <= solid[kept, None] ** 2
        hit = inside | ((along > 0.0) & (gap <= solid[kept, None] ** 2))
        assert hit.any(axis=0).all()


def test_small_numbers_are_left_alone():
    rng = np.random.default_rng(3)
    middle, span, block, item, balls = blocks_of(rng, 5, shadowed_module.MANY_OCCLUDERS - 1)
    assert not hidden_by_spheres(middle, span, block, item, balls, balls[1]).any()


def test_it_does_not_depend_on_batches(monkeypatch):
    rng = np.random.default_rng(4)
    middle, span, block, item, balls = blocks_of(rng, 40, 100)
    kept = rng.uniform(size=item.size) < rng.uniform(0.5, 1.0, 40)[block]
    given = middle, span, block[kept], item[kept], balls, balls[1]
    whole = hidden_by_spheres(*given)
    monkeypatch.setattr(shadowed_module, "BATCH_PAIRS", 1)
    assert np.array_equal(hidden_by_spheres(*given), whole)
    assert whole.any()
