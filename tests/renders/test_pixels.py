# SPDX-License-Identifier: GPL-3.0-or-later
"""Method EXACT: single pixels whose error was far beyond their goal, each for its own cause."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.render import render_image
from adaptive_drt.scene.description import Quad, QuadLight, Scene, Sphere
from adaptive_drt.scene.settings import Settings
from adaptive_drt.shading.footprint import make_patch
from adaptive_drt.shading.variation import pair_receivers
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Pairs, intersect_pairs, surface
from oracle.kept import converged_color
from random_scenes import look_at, random_scene

pytestmark = pytest.mark.filterwarnings("error")

TRUTH = 0.1
"""Of the tolerance: the goal of the truth's pixels."""

PIXELS = (
    # seed, x, y, tolerance, tolerances that the pixel may be off by, cause
    (245, 13, 26, 1e-3, 20.0, "an arm of a star below the floor that a ball rests on"),
    (210, 16, 8, 1e-3, 2.0, "arms of a star hidden where two objects meet"),
    (238, 28, 25, 1e-2, 2.0, "stars reached out too far along the shutter, to a ball's rim"),
    (1012, 16, 10, 1e-3, 3.0, "the pixel reaches through the plane of a quad that casts a shadow"),
    (1035, 16, 11, 1e-3, 3.0, "a quad's corner stands in the floor that the pixel sees"),
    (235, 31, 14, 1e-4, 5.0, "a corner of a quad that no line meets"),
    (239, 22, 29, 1e-4, 10.0, "balls that cut each other, and an outline faster than lines across"),
    (206, 14, 26, 1e-4, 20.0, "more cells than 512 are needed"),
    (202, 4, 9, 1e-4, 3.0, "the plane of a quad light runs through the pixel"),
)


@pytest.mark.parametrize(("seed", "x", "y", "tolerance", "most", "cause"), PIXELS)
def test_a_pixel_that_was_wrong(seed, x, y, tolerance, most, cause):
    scene = random_scene(seed)
    part = replace(scene, camera=replace(scene.camera, border=(x, y, x + 1, y + 1)))
    film = render_image(part, Settings(tolerance=tolerance))
    width, height = scene.camera.resolution
    rng = np.random.default_rng(seed)
    some = np.stack([rng.integers(0, width, 100), rng.integers(0, height, 100)], axis=1)
    scale = converged_color(scene, some, 0.1).mean()
    truth = converged_color(scene, np.array([[x, y]]), TRUTH * tolerance, scale)
    error = np.sqrt(((film.color[:, 0, 0] - truth[0]) ** 2).mean()) / (tolerance * scale)
    assert error < most, f"seed {seed}, pixel {x}, {y}: {error:.2f}, {cause}"


@pytest.mark.parametrize(("beside", "foreseen"), [(0.0, True), (0.06, False), (-0.06, False)])
def test_small_balls_that_touch_a_side_of_a_quad_light(beside, foreseen):
    """Seen beside a side, but nearer than the light reaches that way: its outline is not within."""
    floor = Quad((-9.0, -9.0, 0.0), (18.0, 0.0, 0.0), (0.0, 18.0, 0.0))
    light = QuadLight((0.0, 0.0, 5.0), (0.9, 0.0, 0.0), (0.0, -0.9, 0.0), (9.0, 9.0, 9.0))
    camera = look_at((0.0, -4.0, 1.9), (0.0, 0.0, 0.0), resolution=(200, 200))
    # from the origin, at a fifth of the way to a point of the side or beside it
    ball = Sphere((0.2 * 0.9 + beside, 0.2 * 0.3, 1.0), 0.02)
    plan = make_plan(Scene(camera, (ball, floor), (light,)), Settings())
    w = plan.lens.directions(*np.full((2, 1), 100.0))
    t = intersect_pairs(plan, w, np.ones(1, dtype=np.int64))
    hits = surface(plan, w, t, np.ones(1, dtype=np.int64))
    patch = make_patch(plan, w, t, hits, np.array([[0.05], [0.05], [0.0]]))
    nothing = np.zeros(1, dtype=np.int64)
    shape = plan.as_shadow_caster(plan.lights[0])
    receivers = pair_receivers(hits, patch, Pairs(nothing, nothing), 0.0)
    found = plan.shapes.sets[0].shadow_edges(nothing, receivers, shape)
    assert (found.depth[0] > 0.0) == foreseen


def test_what_late_rounds_find_is_refined_as_well():
    """Samples met another object after 24 rounds: the estimate was 8.5 tolerances."""
    film = render_image(random_scene(7023), Settings(tolerance=1e-4))
    assert film.stats["error_estimate"] < 1.5e-4
