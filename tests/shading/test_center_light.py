# SPDX-License-Identifier: GPL-3.0-or-later
"""Light at single points by rays or lines, and what is said of its error."""

import numpy as np

from adaptive_drt.cubature.sampled_centers import CenterTask, sample_centers
from adaptive_drt.scene.description import Material, PointLight, Quad, QuadLight, Scene, SphereLight
from adaptive_drt.scene.settings import Settings
from adaptive_drt.shading import center_light
from adaptive_drt.shading.center_light import MIXED, visibility_numbers
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.occluder_culling import Occluders
from mesh_shapes import ball_mesh
from random_scenes import look_at

FLOOR = Quad((-6.0, -6.0, 0.0), (12.0, 0.0, 0.0), (0.0, 12.0, 0.0), Material((0.8, 0.7, 0.6)))
LAMP = QuadLight((1.0, -1.0, 5.0), (0.9, 0.0, 0.0), (0.0, -0.6, 0.0), (12.0, 11.0, 9.0))
BULB = SphereLight((-2.0, -1.5, 4.0), 0.5, (20.0, 15.0, 10.0))
SIZE = (24, 16)
CAMERA = look_at((0.5, -6.0, 3.5), (0.0, 0.0, 0.5), resolution=SIZE)


def floor_light(lights, limit):
    """Light at the centres of pixels as if all of them showed the floor."""
    plan = make_plan(Scene(CAMERA, (FLOOR, ball_mesh(20, 14)), lights), Settings())
    x, y = (each.ravel() for each in np.meshgrid(np.arange(SIZE[0]), np.arange(10)))
    n = x.size
    task = CenterTask(
        x + 0.5, y + 0.5, y * SIZE[0] + x, np.zeros(n, dtype=np.int64), np.full(n, limit)
    )
    return sample_centers(plan, Occluders(plan), task).light


def test_errors_end_below_the_limit_and_are_right(monkeypatch):
    exact = floor_light((LAMP, BULB), 1e-4)
    rough = floor_light((LAMP, BULB), 4e-3)
    assert (np.maximum(rough.spread, rough.unseen) < 5.7e-3).all()
    off = np.sqrt(((rough.color - exact.color) ** 2).mean())
    assert off < 4e-3
    np.testing.assert_array_equal(rough.unhidden, exact.unhidden)
    # rays alone say the same as lines and rays
    monkeypatch.setattr(center_light, "LINE_COUNTS", ())
    monkeypatch.setattr(
        center_light, "points_for_lines", lambda *args: np.zeros(args[2].item.size, dtype=bool)
    )
    rays = floor_light((LAMP, BULB), 4e-3)
    assert np.sqrt(((rays.color - exact.color) ** 2).mean()) < 4e-3


def test_point_lights_are_visible_or_not_without_error():
    light = floor_light((PointLight((1.0, -1.0, 5.0), (40.0, 40.0, 40.0)),), 1e-3)
    share = light.color[0] / light.unhidden[0]
    assert set(np.unique(share)) == {0.0, 1.0}
    assert light.spread.max() == light.unseen.max() == 0.0
    assert (light.visibility != MIXED).all()


def test_numbers_tell_which_lights_are_visible():
    whole = np.array([[1.0, 1.0, 1.0, 0.0, 1.0], [1.0, 1.0, 1.0, 1.0, 1.0]])
    seen = np.array([[1.0, 0.0, 1.0, 0.0, 0.5], [1.0, 1.0, 0.0, 1.0, 1.0]])
    numbers = visibility_numbers(whole, seen)
    assert np.unique(numbers[:4]).size == 4 and numbers[4] == MIXED
