# SPDX-License-Identifier: GPL-3.0-or-later
"""Planes of objects take memory for each object that may have one, not for each sphere."""

from __future__ import annotations

import numpy as np

from adaptive_drt.scene.description import Quad, Scene
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.face_planes import FacePlanes
from sphere_heaps import sphere_heap


def test_spheres_share_a_row():
    heap = sphere_heap(1, 40, "square")
    wall = Quad((-9.0, 4.0, -0.5), (18.0, 0.0, 0.0), (0.0, 0.0, 9.0))
    for shapes in ((*heap.shapes, wall), heap.shapes[1:], (heap.shapes[0], wall)):
        table = make_plan(Scene(heap.camera, shapes, heap.lights), Settings()).shapes
        planes = FacePlanes.make(table)
        item = np.arange(-1, table.count)
        wanted = np.concatenate([[False], table.planar])
        np.testing.assert_array_equal(planes.are_planar(item), wanted)
        assert planes.normal.shape == (3, 1 + table.planar.sum())
