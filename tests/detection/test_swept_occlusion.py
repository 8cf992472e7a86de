# SPDX-License-Identifier: GPL-3.0-or-later
"""What is said of a light over patches of surfaces holds for points in them, at any time."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.detection.swept_occlusion import classify_patches
from adaptive_drt.lights.disk_light import DiskEmitter
from adaptive_drt.scene.description import (
    DiskLight,
    Motion,
    PointLight,
    Quad,
    QuadLight,
    Scene,
    Sphere,
    SphereLight,
)
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Pairs, Surface
from adaptive_drt.tracing.occluder_culling import Occluders
from random_scenes import look_at
from shape_sets import spheres_of

POINTS = 40
"""Places, spots of the light and times tried for each pair."""
KINDS = ("quad", "sphere", "disk", "point")


def scene_of(rng, kind):
    """A light, spheres of all sizes before, beside, behind and around it, and a quad; some move."""

    def motion():
        return Motion(tuple(rng.normal(scale=0.2, size=3))) if rng.random() < 0.4 else None

    where, power = tuple(rng.normal((0.0, 0.0, 4.0))), (1.0, 1.0, 1.0)
    size = 10.0 ** rng.uniform(-1.5, 0.3)
    u, v, _ = size * np.linalg.qr(rng.normal(size=(3, 3)))[0]
    light = {
        "quad": QuadLight(where, tuple(u), tuple(rng.uniform(0.3, 1.0) * v), power, motion()),
        "sphere": SphereLight(where, size, power, motion()),
        "disk": DiskLight(where, size, power, motion()),
        "point": PointLight(where, power, motion()),
    }[kind]
    balls = [
        Sphere(
            tuple(rng.uniform((-2, -2, 0), (2, 2, 5))),
            float(10.0 ** rng.uniform(-1.5, 0.4)),
            motion=motion(),
        )
        for _ in range(6)
    ]
    quad = Quad((-1.0, -1.0, 1.0), (2.0, 0.0, 0.0), (0.0, 2.0, 0.5))
    camera = look_at((0, -9, 3), (0, 0, 1), resolution=(8, 6))
    return Scene(shapes=(*balls, quad), lights=(light,), camera=camera)


def spots(rng, light, point, time):
    """Random points of a light as seen from points (3, m), at times (m,)."""
    m = time.size
    center = light.center + (0.0 if light.displacement is None else light.displacement * time)
    if light.span is not None:
        a, b = rng.uniform(-1.0, 1.0, (2, m))
        return center + light.span.half_u * a + light.span.half_v * b
    if not light.extended:
        return np.broadcast_to(center, (3, m))
    offset = rng.normal(size=(3, m))
    if isinstance(light, DiskEmitter):
        axis = (center - point) / np.linalg.norm(center - point, axis=0)
        offset -= axis * (axis * offset).sum(axis=0)
    offset /= np.linalg.norm(offset, axis=0)
    return center + light.radius * np.sqrt(rng.uniform(size=m)) * offset


def hidden(start, end, center, radius):
    """Whether the surface of a ball cuts segments: by the ball's distance from them, plainly."""
    way = end - start
    t = np.clip(((center - start) * way).sum(axis=0) / (way * way).sum(axis=0), 0.0, 1.0)
    nearest = np.linalg.norm(start + t * way - center, axis=0)
    inside = [np.linalg.norm(p - center, axis=0) < radius for p in (start, end)]
    return (nearest < radius) & ~(inside[0] & inside[1])


@pytest.mark.parametrize("kind", KINDS)
def test_patches_are_judged_as_all_their_points_are(kind):
    told = np.zeros(3, dtype=int)
    for seed in range(40):
        rng = np.random.default_rng([seed, KINDS.index(kind)])
        plan = make_plan(scene_of(rng, kind), Settings())
        light = plan.as_shadow_caster(plan.lights[0])
        n, objects = 30, plan.object_count
        point = rng.uniform((-3, -3, -0.5), (3, 3, 1.5), (n, 3)).T - plan.lens.origin[:, None]
        reach = 10.0 ** rng.uniform(-3.0, -0.3, n)
        up = np.tile([[0.0], [0.0], [1.0]], n)
        surface = Surface(point, up, np.full(n, objects - 1), np.zeros(n, dtype=np.bool_))
        pixel, item = np.divmod(np.arange(n * objects), objects)
        pairs = Pairs(pixel, item)
        none, full = classify_patches(plan, Occluders(plan), surface, light, pairs, reach)
        assert not (none & full).any()
        quads = item >= spheres_of(plan).count
        assert not (none | full)[quads].any(), "of quads nothing is sure"
        told += [none.sum(), full.sum(), (~none & ~full & ~quads).sum()]
        for k in np.flatnonzero(none | full):
            time = rng.uniform(-0.5, 0.5, POINTS)
            away = rng.normal(size=(3, POINTS))
            away *= reach[pixel[k]] * rng.uniform(size=POINTS) / np.linalg.norm(away, axis=0)
            start = point[:, pixel[k], None] + away
            center = spheres_of(plan).moved(np.full(POINTS, item[k]), time)
            end = spots(rng, light, start, time)
            cut = hidden(start, end, center, spheres_of(plan).radius[item[k]])
            # a quad light shines to its front only
            lit = ((start - end) * light.span.normal).sum(axis=0) > 0.0 if kind == "quad" else True
            assert np.all((cut == full[k]) | ~np.asarray(lit)), f"seed {seed}, {kind}, pair {k}"
    assert (told > 100).all(), "all three answers are given"
