# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's cost model: b is measured alike, so it is at least 1, or said not to be measured."""

from dataclasses import replace

import pytest

from adaptive_drt import render as render_module
from adaptive_drt.cost_model import (
    MIN_SAMPLE_PIXELS,
    affordable_pixels,
    measure_pixel_costs,
    predicted_ratio,
)
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import validate
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.occluder_culling import Occluders
from random_scenes import random_scene

SIZE = (240, 180)
QUICK = (0, 9, 19)
RAYS = Settings(method="RAYS", light_rays=4, time_rays=4, pixel_rays=4, threads=1)


def plan_of(seed, size=SIZE, **changes):
    scene = random_scene(seed)
    scene = replace(scene, camera=replace(scene.camera, resolution=size))
    return make_plan(validate(scene), replace(RAYS, **changes))


@pytest.mark.parametrize(
    "seed", [s if s in QUICK else pytest.param(s, marks=pytest.mark.slow) for s in range(20)]
)
def test_derivatives_cost_no_less_than_nothing(seed):
    plan = plan_of(seed)
    costs = measure_pixel_costs(plan, Occluders(plan))
    print(f"scene {seed}: b {costs.b:.2f}, spread {costs.spread:.2f}, {costs.pixels} pixels")
    assert costs.pixels >= MIN_SAMPLE_PIXELS
    assert costs.b + costs.spread >= 1.0
    assert 0.0 < costs.summary()["plain"] < 1e-3


def test_a_scene_without_effects_has_nothing_to_detect():
    """Both passes are then the same, so that b is 1 but for the spread of the measurement."""
    plan = plan_of(0, use_penumbra=False, use_motion=False, use_edges=False)
    costs = measure_pixel_costs(plan, Occluders(plan), repetitions=9)
    assert abs(costs.b - 1.0) <= max(costs.spread, 0.1)


def test_a_sample_fits_the_time_of_the_render_or_is_not_taken():
    plan = plan_of(0, (1280, 720))
    assert affordable_pixels(plan, 1.0, 1e-5) == 0
    several = affordable_pixels(plan, 50.0, 1e-5)
    assert MIN_SAMPLE_PIXELS <= several <= 0.02 * 50.0 / 1e-5
    assert affordable_pixels(plan, 1e6, 1e-5) > several
    # a picture of few pixels has no sound sample, however long its render takes
    assert affordable_pixels(plan_of(0, (60, 40)), 1e6, 1e-5) == 0


def test_statistics_say_what_is_not_measured(monkeypatch):
    scene = random_scene(0)
    short = render_image(scene, RAYS).stats
    assert short["b"] is short["b_spread"] is short["predicted_ratio"] is None
    assert short["pixel_seconds"] is None and 0.0 < short["a"] <= 1.0
    monkeypatch.setattr(render_module, "affordable_pixels", lambda *_: 1_000)
    long = render_image(scene, RAYS).stats
    assert long["predicted_ratio"] == predicted_ratio(long["a"], long["b"], long["c"])
    assert long["b_spread"] >= 0.0
    assert long["pixel_seconds"]["repetitions"] == 5
    everywhere = render_image(scene, replace(RAYS, distribution="EVERYWHERE")).stats
    assert (everywhere["b"], everywhere["b_spread"]) == (1.0, 0.0)
    assert "b" not in render_image(scene, Settings(tolerance=0.01, threads=1)).stats
