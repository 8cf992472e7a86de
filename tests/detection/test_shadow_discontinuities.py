# SPDX-License-Identifier: GPL-3.0-or-later
"""Sharp edges of shadows: wherever a point light is seen from one part of a pixel only."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.detection.shadow_discontinuities import detect_shadow_edges, patch_reach
from adaptive_drt.scene.description import PointLight, Quad, Scene, Sphere, SphereLight
from adaptive_drt.tracing.occluder_culling import Occluders
from detected import grid, in_order, seen, traced
from plain_hits import blocked
from random_scenes import look_at, random_scene


def lit_by_a_point(seed):
    """A random scene at rest, whose lights are points."""
    scene = random_scene(seed)
    lights = tuple(PointLight(light.center, (1.0, 1.0, 1.0)) for light in scene.lights)
    shapes = tuple(replace(shape, motion=None) for shape in scene.shapes)
    return replace(scene, camera=replace(scene.camera, motion=None), shapes=shapes, lights=lights)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("seed", range(16))
def test_pixels_with_light_and_shadow_are_flagged(seed, order):
    scene = lit_by_a_point(seed)
    plan, tile, center = traced(scene, order=order)
    hits, rows, shapes = center.hits, center.rows, in_order(scene)
    if not rows.size:
        return
    reach = patch_reach(plan, hits, center.w[:, rows])
    for number, light in enumerate(plan.lights):
        pairs = Occluders(plan).find_candidates(light, hits, reach)
        found = detect_shadow_edges(plan, hits, light, pairs, reach)
        end = np.array(scene.lights[number].center)[:, None]
        lit, dark = np.zeros((2, rows.size), dtype=bool)
        for a, b, _ in grid(4):
            item, point = seen(scene, tile.x[rows] + a, tile.y[rows] + b, np.zeros(rows.size))
            for own in np.unique(hits.item):
                some = np.flatnonzero((item == own) & (hits.item == own))
                # not what the horizon of the surface itself decides
                ends = np.broadcast_to(end, (3, some.size))
                side = (hits.normal[:, some] * (ends - point[:, some])).sum(axis=0) > 0.0
                away = blocked(shapes, point[:, some], ends, np.zeros(some.size), (own,))
                dark[some] |= away & side
                lit[some] |= ~away & side
        assert not (lit & dark & ~found).any(), f"seed {seed}"
        assert (found & ~(lit & dark)).mean() < (0.35 if order == 2 else 0.7), f"seed {seed}"


def test_wide_penumbrae_are_no_edges_and_narrow_ones_are():
    floor = Quad((-9.0, -9.0, 0.0), (18.0, 0.0, 0.0), (0.0, 18.0, 0.0))
    eye = look_at((0.0, -9.0, 6.0), (0.0, 0.0, 0.0), resolution=(64, 48))
    found = []
    for radius in (1e-3, 1.0):
        light = SphereLight((0.0, 0.0, 6.0), radius, (1.0, 1.0, 1.0))
        plan, _, center = traced(Scene(eye, (Sphere((0.0, 0.0, 3.0), 0.5), floor), (light,)))
        hits = center.hits.take(center.hits.item == 1)
        reach = np.full(hits.item.size, 0.05)
        pairs = Occluders(plan).find_candidates(plan.lights[0], hits, reach)
        found.append(detect_shadow_edges(plan, hits, plan.lights[0], pairs, reach).sum())
    assert found[0] > 10 and found[1] == 0
