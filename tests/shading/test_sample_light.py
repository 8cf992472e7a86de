# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays from points of pixels to a light: which are needed, and what they see."""

import numpy as np

from adaptive_drt.scene.description import Material, Quad, QuadLight, Scene, Sphere
from adaptive_drt.scene.settings import Settings
from adaptive_drt.shading.direct_light import shade_with_candidates
from adaptive_drt.shading.sample_light import LightSampler
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Surface
from adaptive_drt.tracing.occluder_culling import Occluders, find_group_candidates
from random_scenes import look_at

FLOOR = Quad((-9.0, -9.0, 0.0), (18.0, 0.0, 0.0), (0.0, 18.0, 0.0), Material((0.8, 0.8, 0.8)))
BALL = Sphere((0.0, 0.0, 1.0), 0.5)
LAMP = QuadLight((0.0, 0.0, 4.0), (0.9, 0.0, 0.0), (0.0, -0.9, 0.0), (5.0, 4.0, 3.0))
SCENE = Scene(look_at((0.0, -6.0, 2.0), (0.0, 0.0, 0.6)), (FLOOR, BALL), (LAMP,))


def test_rays_see_the_share_of_the_light_that_is_visible():
    plan = make_plan(SCENE, Settings())
    occluders = Occluders(plan)
    count = 512
    x = np.repeat(np.linspace(0.0, 4.0, 41), count)
    place = np.array([x, 0.0 * x, 0.0 * x]) - plan.lens.origin[:, None]
    normal = np.zeros_like(place)
    normal[2] = 1.0
    item = np.ones(x.size, dtype=np.int64)
    hits = Surface(place, normal, item, np.zeros(x.size, dtype=bool))
    sampler = LightSampler(plan, occluders, 0, True)
    row = np.repeat(np.arange(41), count)
    light = sampler.sample(hits, row, np.zeros(x.size), (row, np.tile(np.arange(count), 41)))
    closed, total, visible = light.colors
    mean = lambda values: values.reshape(3, 41, count).mean(axis=2)  # noqa: E731
    pairs = find_group_candidates(occluders, plan.lights[0], hits, row)
    exact, _ = shade_with_candidates(plan, hits, 0.0, [pairs])
    share = mean(closed) * mean(visible) / mean(total)
    np.testing.assert_allclose(share, mean(exact), atol=6e-3 * closed.max())
    # no rays in the full light, nor in the full shadow of one object
    assert not light.sampled[x > 3.0].any()
    open_ = ~light.sampled & (x > 1.0)
    np.testing.assert_array_equal(total[:, open_], visible[:, open_])
    inside = light.sampled & (x > 0.5)
    assert inside.any() and (visible[:, inside] < total[:, inside]).mean() > 0.3


def test_points_of_a_group_have_the_candidates_of_the_group():
    plan = make_plan(SCENE, Settings())
    place = np.array([[0.0, 0.1, 8.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    hits = Surface(
        place - plan.lens.origin[:, None],
        np.zeros((3, 3)),
        np.array([1, 0, 1]),
        np.zeros(3, dtype=bool),
    )
    # the point on the ball itself is no candidate, the one below it is
    found = find_group_candidates(Occluders(plan), plan.lights[0], hits, np.array([2, 2, 5]))
    assert list(zip(found.pixel.tolist(), found.item.tolist(), strict=True)) == [(0, 0), (1, 1)]
