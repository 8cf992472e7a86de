# SPDX-License-Identifier: GPL-3.0-or-later
"""Embree's scene of instances by itself: what lies before and behind where rays begin and end."""

import numpy as np
import pytest

from adaptive_drt.geometry.embree_library import native_library
from adaptive_drt.geometry.mesh.instance_scene import InstanceScene
from adaptive_drt.geometry.mesh.placements import Placements
from mesh_shapes import ball_mesh

BALL = ball_mesh(48, 24, center=(0.0, 0.0, 0.0))


def row_of_balls(count):
    """Placements of balls of radius 0.5 m along x, 2 m apart, that are stretched along z."""
    linear = np.repeat(np.diag([0.5, 0.5, 1.0])[..., None], count, axis=2)
    offset = np.array([2.0 * np.arange(count), np.zeros(count), np.zeros(count)])
    return Placements(linear, offset)


@pytest.mark.skipif(native_library() is None, reason="embree's library is not found")
def test_rays_meet_the_balls_of_a_row():
    places = row_of_balls(5)
    box = np.array([-0.5, -0.5, -1.0]), np.array([8.5, 0.5, 1.0])
    scene = InstanceScene(BALL.vertices, BALL.faces, places, box)
    assert 1e-7 < scene.rounding < 1e-3
    start = np.array([[-3.0], [0.01], [0.02]]) + np.zeros((3, 6))
    way = np.array([[1.0], [0.0], [0.0]]) + np.zeros((3, 6))
    item, face = scene.nearest(start, way, np.array([0.0, 3.0, 5.0, 7.0, 9.0, 20.0]))
    np.testing.assert_array_equal(item, [0, 0, 1, 2, 3, -1])
    assert (face[:5] >= 0).all() and face[5] == -1
    length = np.array([2.4, 2.6, 4.4, 12.0, 12.0, 1e38])
    blocked = [scene.blocked(start, length * way, near) for near in (0.0, 3.6)]
    np.testing.assert_array_equal(blocked[0], [False, True, True, True, True, True])
    np.testing.assert_array_equal(blocked[1], [False, False, False, True, True, True])


def test_small_flat_and_thin_instances_are_not_suited():
    linear = np.array([np.diag(each) for each in ((1, 1, 1), (1e-6,) * 3, (1, 1, 0), (1, 1, 0.01))])
    places = Placements(np.moveaxis(linear, 0, 2), np.zeros((3, 4)))
    np.testing.assert_array_equal(InstanceScene.suited(places, 2.0, 100.0), [1, 0, 0, 0])
    assert not InstanceScene.suited(places, 2.0, 1e6).any()
