# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables of shapes: objects are numbered set after set, split by kind and joined again."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.shape_table import ShapeTable
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from random_scenes import random_scene


def table(seed) -> ShapeTable:
    return make_plan(random_scene(seed), Settings()).shapes


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("name", ["groups", "runs"])
def test_every_object_is_in_one_group(seed, name):
    shapes, rng = table(seed), np.random.default_rng(seed)
    item = rng.integers(-1 if name == "groups" else 0, shapes.count, 50)
    if seed % 2:  # long runs
        item = np.repeat(item, 2_000)
    seen = np.zeros(item.size, dtype=int)
    for own, rows, index in getattr(shapes, name)(item):
        first = shapes.firsts[shapes.sets.index(own)]
        seen[rows] += 1
        np.testing.assert_array_equal(item[rows], np.broadcast_to(first + index, item[rows].shape))
    np.testing.assert_array_equal(seen, item >= 0)
    assert list(getattr(shapes, name)(item[:0])) == []


@pytest.mark.parametrize("seed", range(10))
def test_what_is_joined_is_that_of_each_set(seed):
    shapes = table(seed)
    center, radius = shapes.bounding_spheres
    for item in range(shapes.count):
        own, index = shapes.locate(item)
        assert shapes.firsts[shapes.sets.index(own)] + index == item
        np.testing.assert_array_equal(center[:, item], own.bounding_spheres[0][:, index])
        assert radius[item] == own.bounding_spheres[1][index]
        assert shapes.planar[item] == own.planar
        assert shapes.curvature[item] == own.curvature[index]
        if shapes.displacement is not None:
            way = np.zeros(3) if own.displacement is None else own.displacement[:, index]
            np.testing.assert_array_equal(shapes.displacement[:, item], way)
    direction = np.random.default_rng(seed).normal(size=(3, shapes.count))
    items, time = np.arange(shapes.count), np.zeros(shapes.count)
    low, high = shapes.extent(items, direction, time)
    middle, reach = (center * direction).sum(axis=0), radius * np.linalg.norm(direction, axis=0)
    assert (low >= middle - reach * (1 + 1e-9)).all() and (
        high <= middle + reach * (1 + 1e-9)
    ).all()
