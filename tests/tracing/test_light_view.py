# SPDX-License-Identifier: GPL-3.0-or-later
"""A light as points see it: its cone holds the light on its whole path, for all or some points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from adaptive_drt.scene.description import Motion
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Surface
from adaptive_drt.tracing.light_view import LightView
from sphere_heaps import sphere_heap


def test_the_cone_holds_a_moving_light():
    heap = sphere_heap(1, 8, "square")
    light = replace(heap.lights[0], motion=Motion((1.0, 0.5, 0.0)))
    plan = make_plan(replace(heap, lights=(light,)), Settings())
    rng = np.random.default_rng(7)
    point, count = rng.uniform(-3.0, 3.0, (3, 50)), 50
    flags = np.zeros(count, dtype=bool)
    surface = Surface(point, np.ones((3, count)) / np.sqrt(3.0), np.arange(count) % 8, flags)
    emitter = plan.lights[0]
    sight = LightView.make(emitter, surface, rng.uniform(0.0, 1.0, count), np.zeros(count))
    assert sight.any_reach
    a, b = rng.random((2, count, 1))
    for time in (-0.5, 0.0, 0.5):
        to = emitter.to_center(point, time)[:, :, None]
        way = emitter.sample(to, point[:, :, None], surface.normal[:, :, None], a, b)[0][:, :, 0]
        length = np.sqrt((way**2).sum(axis=0))
        along = (way * sight.cone.axis).sum(axis=0) / length
        assert (along >= sight.cone.cosine - 1e-12).all()
        assert (length <= sight.cone.far + 1e-12).all()
    rows = np.array([3, 17])
    some = sight.take(rows)
    np.testing.assert_array_equal(some.cone.axis, sight.cone.axis[:, rows])
    np.testing.assert_array_equal(some.surface.item, surface.item[rows])
    np.testing.assert_array_equal(some.reach, sight.reach[rows])
