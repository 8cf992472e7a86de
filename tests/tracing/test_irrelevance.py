# SPDX-License-Identifier: GPL-3.0-or-later
"""What cannot matter is left out, and the picture stays the same to the last bit."""

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.render import render_image
from adaptive_drt.scene.description import Motion, Quad, QuadLight, Scene, Sphere
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.irrelevance import SeenBounds
from random_scenes import look_at

CAMERA = replace(look_at((0.0, -8.0, 5.0), (0.0, 0.0, 0.5)), focal_length=45.0, resolution=(96, 72))
FLOOR = Quad((-15.0, -10.0, 0.0), (30.0, 0.0, 0.0), (0.0, 25.0, 0.0))
WALL = Quad((-15.0, 5.5, -0.5), (30.0, 0.0, 0.0), (0.0, 1.5, 9.0))
BALL = Sphere((0.0, 0.0, 1.0), 0.9)
DOWN = QuadLight((-1.0, -1.0, 5.5), (0.9, 0.0, 0.0), (0.0, -0.9, 0.0), (20.0, 20.0, 20.0))
UP = QuadLight((0.0, 0.0, 6.0), (0.9, 0.0, 0.0), (0.0, 0.9, 0.0), (9.0, 9.0, 9.0), name="Up")
BASE = Scene(CAMERA, (BALL, FLOOR, WALL), (DOWN,))


def plan_of(*more, lights=(DOWN,)):
    return make_plan(Scene(CAMERA, (BALL, FLOOR, WALL, *more), lights), Settings(threads=1), True)


@pytest.mark.parametrize("center", [(0.0, 1.0, -1.0), (1.0, -14.0, 6.0), (-40.0, 0.0, 1.0)])
def test_objects_that_are_neither_seen_nor_before_a_light_are_left_out(center):
    plan = plan_of(Sphere(center, 0.3))
    assert plan.object_count == 3
    assert any(each["what"] == "1 objects" for each in plan.skipped)


@pytest.mark.parametrize(
    "more",
    [
        Sphere((-0.8, -0.8, 3.5), 0.2),  # between the light and the floor
        Sphere((0.0, 0.0, -0.1), 0.3),  # reaches through the floor
        Sphere((0.0, 1.0, -1.0), 0.3, motion=Motion((0.0, 0.0, 3.0))),
    ],
)
def test_objects_that_may_matter_stay(more):
    assert plan_of(more).object_count == 4


def test_lights_that_face_away_from_all_that_is_seen_are_left_out():
    plan = plan_of(lights=(DOWN, UP))
    assert [light.name for light in plan.lights] == [DOWN.name]
    assert any(each["what"] == "Up" for each in plan.skipped)
    low = replace(UP, center=(3.0, 0.0, 0.5))  # the wall rises above it
    assert len(plan_of(lights=(DOWN, low)).lights) == 2


@pytest.mark.parametrize("method", ["EXACT", "RAYS"])
def test_pictures_are_the_same_without_what_cannot_matter(method):
    settings = Settings(threads=1, method=method)
    rng = np.random.default_rng(1)
    below = [
        Sphere(tuple(c), 0.2) for c in rng.uniform((-4, -4, -3), (4, 4, -0.3), (20, 3)).tolist()
    ]
    want = render_image(BASE, settings)
    found = render_image(Scene(CAMERA, (BALL, FLOOR, *below, WALL), (DOWN, UP)), settings)
    for name in ("color", "alpha", "mask", "samples"):
        np.testing.assert_array_equal(getattr(found, name), getattr(want, name))


def test_what_one_polygon_hides_is_not_seen():
    plan = make_plan(
        Scene(CAMERA, (BALL, Sphere((0.0, 1.0, -1.0), 0.3), FLOOR), (DOWN,)), Settings()
    )
    bounds = SeenBounds.make(plan.shapes, plan.lens, plan.resolution, None)
    assert bounds.seen.tolist() == [True, False, True]
