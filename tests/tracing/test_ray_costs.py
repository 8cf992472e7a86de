# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays are chosen for many occluders and coarse tolerances."""

from __future__ import annotations

import numpy as np

from adaptive_drt.scene.description import Camera, Cylinder, Ellipsoid, Scene, Sphere
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.ray_costs import UNKNOWN_FORM_COST, occluder_costs, rays_cost_less
from flat_scenes import AREA, SKY
from light_scenes import light_scene

NUMBER = np.array([0.0, 3.0, 30.0, 300.0, 3e3, 3e4])
CUT, FILLED = np.ones(6, dtype=bool), np.zeros(6, dtype=bool)


def test_rays_cost_less_from_some_number_of_occluders():
    for cut in (CUT, FILLED, None):
        chosen = rays_cost_less(NUMBER, cut, 0.01)
        assert chosen[-1] and (np.diff(chosen.astype(int)) >= 0).all()
    assert not rays_cost_less(NUMBER, FILLED, 0.01)[:2].any()


def test_finer_tolerances_ask_for_more_occluders():
    for cut in (CUT, FILLED, None):
        counts = [rays_cost_less(NUMBER, cut, each).sum() for each in (0.1, 1e-2, 1e-3, 1e-4)]
        assert counts == sorted(counts, reverse=True) and counts[0] > counts[-1]


def test_each_pixel_is_chosen_by_itself():
    both = rays_cost_less(NUMBER, np.arange(6) % 2 == 0, 0.01)
    for row in range(6):
        alone = rays_cost_less(NUMBER[row : row + 1], np.array([row % 2 == 0]), 0.01)
        assert alone[0] == both[row]


def test_outlines_without_a_closed_form_cost_most():
    image = next(
        each
        for seed in range(20)
        for each in light_scene(seed, 4).lights
        if type(each).__name__ == "EnvironmentLight"
    )
    shapes = (
        Sphere((0.0, 0.0, -5.0), 1.0),
        Ellipsoid((3.0, 0.0, -5.0), (1.0, 0.0, 0.0), (0.0, 0.5, 0.0), (0.0, 0.0, 0.5)),
        Cylinder((-3.0, 0.0, -5.0), (-3.0, 1.0, -5.0), 0.3),
    )
    plan = make_plan(Scene(Camera(), shapes, (AREA, SKY, image)), Settings())
    area, sky = (occluder_costs(plan.shapes, each) for each in plan.lights[:2])
    picture = next(each for each in plan.lights if each.environment is not None)
    environment = occluder_costs(plan.shapes, picture)
    ball = [type(each).__name__ for each in plan.shapes.sets].index("SphereSet")
    assert area[ball] == sky[ball] == environment[ball] == 1.0
    assert (area == sky).all() and area.max() < UNKNOWN_FORM_COST
    # the ellipsoid and the side of the cylinder
    assert (environment >= UNKNOWN_FORM_COST).sum() == 2
