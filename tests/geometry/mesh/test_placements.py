# SPDX-License-Identifier: GPL-3.0-or-later
"""Places of instances: motion between times, inverses, and balls that enclose what moves."""

import numpy as np
import pytest

from adaptive_drt.geometry.mesh.placements import Placements, applied, stretch
from mesh_shapes import scattered, turned_steps

ORIGIN = np.array([[0.5], [-1.0], [2.0]])


def moving(rng, count=7, steps=3):
    """Placements whose matrices have nothing in common from time to time."""
    matrices = np.concatenate([scattered(rng, count) for _ in range(steps)])
    return matrices, Placements.make(matrices, ORIGIN, np.array([0.3, 0.1, -0.2]))


def test_matrices_are_met_at_their_times():
    matrices, places = moving(np.random.default_rng(0))
    for step, time in enumerate((-0.5, 0.0, 0.5)):
        linear, offset = places.at(np.arange(7), np.full(7, time))
        np.testing.assert_allclose(linear, matrices[step, :, :3], atol=1e-12)
        drift = time * np.array([[0.3], [0.1], [-0.2]])
        np.testing.assert_allclose(offset, matrices[step, :, 3] - ORIGIN + drift, atol=1e-12)
    np.testing.assert_array_equal(places.at(np.arange(7), 0.0)[0], places.linear)


def test_rotation_is_steady_and_scale_is_linear():
    matrices = turned_steps((0.0, 2.0), (1.0, 3.0), np.zeros((2, 3)))
    places = Placements.make(matrices, np.zeros((3, 1)), None)
    time = np.linspace(-0.5, 0.5, 11)
    linear, _ = places.at(np.zeros(11, dtype=np.int64), time)
    size, angle = 2.0 + 2.0 * time, 2.0 * (time + 0.5)
    np.testing.assert_allclose(linear[0, 0], size * np.cos(angle), atol=1e-12)
    np.testing.assert_allclose(linear[1, 0], size * np.sin(angle), atol=1e-12)
    np.testing.assert_allclose(linear[2, 2], size, atol=1e-12)


def test_rotation_takes_the_shorter_way_and_mirrors_stay_mirrors():
    turns = turned_steps((-3.0, 3.0), (1.0, 1.0), np.zeros((2, 3)))
    turns[:, :, 2] *= -1.0
    places = Placements.make(turns, np.zeros((3, 1)), None)
    linear, _ = places.at(np.zeros(1, dtype=np.int64), np.zeros(1))
    np.testing.assert_allclose(linear[..., 0], np.diag([-1.0, -1.0, -1.0]), atol=1e-12)


@pytest.mark.parametrize("time", [0.0, 0.31])
def test_rays_in_own_spaces(time):
    rng = np.random.default_rng(1)
    _, places = moving(rng)
    item, (start, way) = rng.integers(0, 7, 50), rng.normal(size=(2, 3, 50))
    when = np.full(50, time) if time else 0.0
    own = places.to_own(item, start, way, when)
    linear, offset = places.at(item, when)
    np.testing.assert_allclose(applied(linear, own[0]) + offset, start, atol=1e-10)
    np.testing.assert_allclose(applied(linear, own[1]), way, atol=1e-10)


def test_what_is_flat_has_no_way():
    matrices = turned_steps((0.0, 0.0), (0.0, 1.0), np.zeros((2, 3)))
    places = Placements.make(matrices, np.zeros((3, 1)), None)
    one = np.zeros(1, dtype=np.int64)
    _, way = places.to_own(one, np.ones((3, 1)), np.ones((3, 1)), np.full(1, -0.5))
    np.testing.assert_array_equal(way, 0.0)


@pytest.mark.parametrize("seed", range(4))
def test_balls_enclose_points_at_all_times(seed):
    rng = np.random.default_rng(seed)
    _, places = moving(rng)
    middle, radius = rng.normal(size=3), 0.7
    center, displacement, reach = places.swept_balls(middle, radius)
    unit = rng.normal(size=(3, 200))
    point = middle[:, None] + radius * unit / np.linalg.norm(unit, axis=0)
    for item in range(7):
        for time in np.linspace(-0.5, 0.5, 41):
            linear, offset = places.at(np.full(200, item), np.full(200, time))
            gap = applied(linear, point) + offset - (center + time * displacement)[:, item, None]
            assert np.linalg.norm(gap, axis=0).max() <= reach[item]


def test_bounds_on_lengths_are_exact_where_axes_are_orthogonal():
    linear = scattered(np.random.default_rng(2), 9)[0, :, :3]
    size = np.linalg.norm(linear, 2, axis=(0, 1))
    np.testing.assert_allclose(stretch(linear), size, rtol=1e-6)
    sheared = np.random.default_rng(3).normal(size=(3, 3, 50))
    assert (stretch(sheared) >= np.linalg.norm(sheared, 2, axis=(0, 1))).all()
