# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertices in the same place."""

import numpy as np

from adaptive_drt.geometry.mesh.welding import welded_vertices


def test_numbers_are_those_of_sorted_places():
    rng = np.random.default_rng(0)
    for _ in range(20):
        vertices = rng.integers(-2, 3, (3, 60)) * 1.0
        _, expected = np.unique(vertices.T, axis=0, return_inverse=True)
        assert (welded_vertices(vertices) == expected.ravel()).all()


def test_signs_of_zero_do_not_matter_and_nothing_is_no_place():
    assert (welded_vertices(np.array([[0.0, -0.0], [1.0, 1.0], [0.0, 0.0]])) == 0).all()
    assert welded_vertices(np.zeros((3, 0))).size == 0
