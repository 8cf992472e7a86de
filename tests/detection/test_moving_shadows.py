# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that changes during the shutter: wherever rays to it are blocked at some times only."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.detection.moving_shadows import light_changes
from adaptive_drt.scene.description import (
    Motion,
    PointLight,
    Quad,
    QuadLight,
    Scene,
    Sphere,
    SphereLight,
    vector_of,
)
from adaptive_drt.tracing.occluder_culling import Occluders
from detected import in_order, traced
from plain_hits import blocked
from random_scenes import look_at

FLOOR = Quad((-9.0, -9.0, 0.0), (18.0, 0.0, 0.0), (0.0, 18.0, 0.0))
EYE = look_at((0.0, -9.0, 6.0), (0.0, 0.0, 0.0), resolution=(32, 24))
LIGHTS = (
    PointLight((1.0, 0.5, 6.0), (1.0, 1.0, 1.0)),
    SphereLight((1.0, 0.5, 6.0), 0.4, (1.0, 1.0, 1.0)),
    QuadLight((1.0, 0.5, 6.0), (0.5, 0.0, 0.0), (0.0, -0.4, 0.0), (1.0, 1.0, 1.0)),
)
TIMES = np.linspace(-0.5, 0.5, 15)


def things(rng):
    """Spheres and a quad over the floor; some move."""
    shapes = [FLOOR]
    for k in range(4):
        way = Motion(vector_of(rng.normal(size=3) * 0.6)) if k < 3 else None
        place = vector_of(rng.uniform((-3, -3, 1), (3, 3, 4)))
        shapes.append(Sphere(place, float(rng.uniform(0.1, 0.8)), motion=way))
    corner, u, v = rng.uniform((-3, -3, 1), (3, 3, 4)), *rng.normal(size=(2, 3))
    way = Motion(vector_of(rng.normal(size=3) * 0.5))
    return tuple([*shapes, Quad(vector_of(corner), vector_of(u), vector_of(v), motion=way)])


@pytest.mark.parametrize("light", LIGHTS, ids=lambda light: type(light).__name__)
@pytest.mark.parametrize("carried", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_no_point_whose_light_changes_is_left_out(light, carried, seed):
    rng = np.random.default_rng(seed)
    way = np.array([0.7, -0.3, 0.1]) if carried else np.zeros(3)
    lamp = replace(light, motion=Motion(vector_of(way))) if carried else light
    scene = Scene(EYE, things(rng), (lamp,))
    plan, _, center = traced(scene)
    shapes = in_order(scene)
    floor = next(k for k, shape in enumerate(shapes) if shape is FLOOR)
    rows = np.flatnonzero(center.hits.item == floor)
    points = center.hits.take(rows)
    shape = plan.as_shadow_caster(plan.lights[0])
    pairs = Occluders(plan).find_candidates(shape, points)
    found = light_changes(plan, points, shape, pairs, np.zeros(rows.size))
    start = points.point + plan.lens.origin[:, None]
    # some points of the light, its middle among them
    spots = [np.zeros(3)]
    if hasattr(light, "half_u"):
        u, v = np.array(light.half_u), np.array(light.half_v)
        spots += [a * u + b * v for a in (-0.9, 0.9) for b in (-0.9, 0.9)]
    changes = np.zeros(rows.size, dtype=bool)
    for spot in spots:
        states = []
        for time in TIMES:
            end = np.array(light.center) + spot + time * way
            ends = np.broadcast_to(end[:, None], start.shape)
            states.append(blocked(shapes, start, ends, np.full(rows.size, time), (floor,)))
        changes |= np.ptp(np.array(states).astype(int), axis=0) > 0
    assert not (changes & ~found).any(), f"seed {seed}"
    assert changes.any()
    # where the light rests, some points prove to be lit or dark all the time
    assert carried or not found.all(), f"seed {seed}"
