# SPDX-License-Identifier: GPL-3.0-or-later
"""Embree's scenes of triangles."""

import numpy as np
import pytest

from adaptive_drt.geometry.embree import has_embree, make_embree_scene


@pytest.mark.skipif(not has_embree(), reason="needs embree")
def test_a_ray_meets_the_nearer_of_two_triangles():
    corners = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]])
    vertices = np.concatenate([corners, corners + np.array([[0.0], [0.0], [1.0]])], axis=1)
    scene = make_embree_scene(vertices, np.arange(6).reshape(2, 3).T)
    start = np.array([[0.2, 0.2, 5.0], [0.2, 0.2, 0.0], [2.0, 2.0, 5.0]], dtype=np.float32)
    way = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]], dtype=np.float32)
    assert scene.run(start, way, query="INTERSECT").tolist() == [1, 0, -1]


@pytest.mark.skipif(not has_embree(), reason="needs embree")
def test_thousands_of_scenes_are_made():
    """With a device for each, embree crashes."""
    corners = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]])
    start, way = np.array([[0.2, 0.2, 5.0], [0.0, 0.0, -1.0]], dtype=np.float32)[:, None]
    scenes = [make_embree_scene(corners, np.array([[0], [1], [2]])) for _ in range(3_000)]
    assert all(scene.run(start, way).tolist() == [0] for scene in scenes)
