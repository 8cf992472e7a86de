# SPDX-License-Identifier: GPL-3.0-or-later
"""Texture coordinates are linear over each face, and meet the corners' own."""

from dataclasses import replace

import numpy as np

from adaptive_drt.geometry.mesh.surface_coordinates import surface_coordinates
from mesh_shapes import bumpy_mesh, grid_mesh


def points_on(mesh, rng, count=200):
    """Random faces (n,), points on them (3, n) and their shares (3, n) of the corners."""
    face = rng.integers(0, mesh.faces.shape[1], count)
    share = rng.dirichlet(np.ones(3), count).T
    return face, (mesh.vertices[:, mesh.faces[:, face]] * share).sum(axis=1), share


def test_maps_are_interpolated_between_corners():
    rng = np.random.default_rng(0)
    mesh = bumpy_mesh(10, 6)
    mesh = replace(mesh, uv=rng.random((2, 3, mesh.faces.shape[1])))
    face, point, share = points_on(mesh, rng)
    found = surface_coordinates(mesh, face, point)
    np.testing.assert_allclose(found.uv, (mesh.uv[:, :, face] * share).sum(axis=1), atol=1e-9)
    np.testing.assert_array_equal(found.own, point)
    assert surface_coordinates(replace(mesh, uv=None), face, point).uv is None


def test_generated_coordinates_fill_the_box():
    mesh = grid_mesh(4, lambda x, y: 0.0 * x, size=3.0)
    face, point, _ = points_on(mesh, np.random.default_rng(1))
    found = surface_coordinates(mesh, face, point).generated
    np.testing.assert_allclose(found[:2], point[:2] / 3.0 + 0.5, atol=1e-12)
    np.testing.assert_array_equal(found[2], 0.5)
