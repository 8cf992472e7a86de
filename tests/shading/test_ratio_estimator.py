# SPDX-License-Identifier: GPL-3.0-or-later
"""The ratio estimator: exact where nothing or everything is hidden, and right in the mean."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.scene.description import (
    PointLight,
    QuadLight,
    Scene,
    SkyLight,
    Sphere,
    SphereLight,
)
from adaptive_drt.scene.settings import Settings
from adaptive_drt.shading.ratio_estimator import (
    LightSums,
    gather_light,
    light_points,
    ratio_estimate,
)
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Pairs, intersect_pairs, surface
from adaptive_drt.tracing.occluder_culling import Occluders
from mesh_shapes import ball_mesh
from random_scenes import look_at
from shaded import patches_at, plan_of

COLOR = (1.0, 1.0, 1.0)
LIGHTS = {
    "quad": QuadLight((0.3, 0.2, 5.0), (0.7, 0.0, 0.1), (0.0, -0.5, 0.0), COLOR),
    "sphere": SphereLight((0.3, 0.2, 5.0), 0.6, COLOR),
}
COUNT = 50


def gathered(shapes, light, rays, x, y):
    plan = plan_of(*shapes, light=light)
    hits, _ = patches_at(plan, x, y, plan.object_count - 1, (0.5, 0.5, 0.0))
    emitter = plan.lights[0]
    pairs = Occluders(plan).find_candidates(emitter, hits)
    spots = light_points(plan, np.arange(x.size), 0, 1, rays) if rays else None
    sums = gather_light(plan, hits, emitter, pairs, spots, 0.0)
    exact = emitter.irradiance_factor(emitter.to_center(hits.point, 0.0), hits.point, hits.normal)
    return sums, exact


def places(seed=1):
    return np.random.default_rng(seed).uniform((60, 30), (140, 100), (COUNT, 2)).T


@pytest.mark.parametrize("kind", LIGHTS)
@pytest.mark.parametrize("rays", [1, 4, 49])
def test_open_light_is_exact_and_hidden_light_is_none(kind, rays):
    x, y = places()
    sums, exact = gathered((), LIGHTS[kind], rays, x, y)
    np.testing.assert_allclose(sums.estimate(), exact, rtol=1e-12)
    # a wide ball around the light, between it and the floor
    sums, _ = gathered((Sphere((0.3, 0.2, 5.0), 1.5),), LIGHTS[kind], rays, x, y)
    assert not sums.estimate().any()


@pytest.mark.parametrize("kind", LIGHTS)
def test_few_rays_tend_to_many(kind):
    x, y = places(2)
    shapes = (Sphere((0.2, 0.1, 2.0), 0.5), Sphere((-0.5, 0.6, 1.2), 0.4))
    many, exact = gathered(shapes, LIGHTS[kind], 4_096, x, y)
    best = many.estimate()
    assert ((0.0 <= best) & (best <= exact * (1 + 1e-12))).all()
    off = [np.sqrt(((gathered(shapes, LIGHTS[kind], n, x, y)[0].estimate() - best) ** 2).mean())
           for n in (16, 256)]  # fmt: skip
    assert off[1] < 0.4 * off[0] < 0.1 * exact.max()


def test_points_of_light_are_seen_or_not():
    x, y = places()
    light = PointLight((0.3, 0.2, 5.0), COLOR)
    sums, exact = gathered((Sphere((0.3, 0.2, 2.5), 0.5),), light, 0, x, y)
    found = sums.estimate()
    assert np.isclose(found, 0.0).any() and np.isclose(found, exact).any()
    assert (np.isclose(found, 0.0) | np.isclose(found, exact)).all()


def test_ratios_without_a_point_above_the_horizon_are_the_closed_form():
    zero = np.zeros(2)
    np.testing.assert_array_equal(ratio_estimate(np.array([0.3, 0.0]), zero, zero), [0.3, 0.0])
    one = ratio_estimate(np.array([2.0]), np.array([4.0]), np.array([1.0]))
    assert one[0] == 0.5


def test_batches_of_more_rays_are_joined_two_and_two():
    one, other = (LightSums(*np.full((3, 2, 4), k) + np.arange(4.0)) for k in (0.0, 10.0))
    joined = one.joined(other)
    for each in (joined.closed, joined.total, joined.visible):
        assert each.tolist() == [[0.5, 2.5, 10.5, 12.5]] * 2
    single = LightSums(*np.ones((3, 2, 1)))
    assert single.joined(single).visible.tolist() == [[1.0], [1.0]]
    assert joined.take(np.array([1])).total.shape == (1, 4)


@pytest.mark.parametrize("light", [SkyLight(COLOR), SphereLight((6.0, 0.0, 1.2), 0.5, COLOR)])
def test_rays_to_a_uniform_sky_leave_the_facets_of_smooth_meshes(light):
    """Cycles samples no uniform world as a light, and lifts shadow rays to lights only."""
    camera = look_at((0.0, -4.0, 1.2), (0.0, 0.0, 1.2), resolution=(40, 40))
    ball = ball_mesh(10, 6, smooth=True)
    plan = make_plan(Scene(camera, (ball,), (light,)), Settings())
    x, y = np.random.default_rng(4).uniform(12.0, 28.0, (2, 200))
    w, item = plan.lens.directions(x, y), np.zeros(200, dtype=np.int64)
    hits = surface(plan, w, intersect_pairs(plan, w, item), item)
    pairs = Pairs(np.arange(200), item)
    spots = light_points(plan, np.arange(200), 0, 1, 64)
    lifted, flat = (
        gather_light(plan, each, plan.lights[0], pairs, spots, 0.0).visible
        for each in (hits, hits.without_smooth())
    )
    assert flat.sum() < hits.item.size * np.pi
    if isinstance(light, SkyLight):
        np.testing.assert_array_equal(lifted, flat)
    else:
        assert lifted.sum() > 1.01 * flat.sum()


def test_factors_without_hiding_are_left_out_where_they_are_known(monkeypatch):
    """What rays find is the same to the last bit."""
    plan = plan_of(Sphere((0.2, 0.1, 1.0), 0.6), light=LIGHTS["quad"])
    hits, _ = patches_at(plan, *places(), plan.object_count - 1, (0.5, 0.5, 0.0))
    emitter, rows = plan.lights[0], np.arange(COUNT)
    pairs = Occluders(plan).find_candidates(emitter, hits)
    spots = light_points(plan, rows, 0, 1, 16)
    whole = gather_light(plan, hits, emitter, pairs, spots, 0.0)
    monkeypatch.setattr(type(emitter), "irradiance_factor", None)
    some = gather_light(plan, hits, emitter, pairs, spots, 0.0, wants_closed=False)
    assert (whole.closed > 0.0).any() and not some.closed.any()
    assert some.total.tobytes() == whole.total.tobytes()
    assert some.visible.tobytes() == whole.visible.tobytes()
