# SPDX-License-Identifier: GPL-3.0-or-later
"""Which edges of a mesh are edges of the picture."""

import numpy as np
import pytest

from adaptive_drt.geometry.mesh.edges import MeshEdges
from mesh_shapes import ball_mesh, grid_mesh


def test_a_smooth_closed_mesh_has_outlines_only():
    mesh = ball_mesh(32, 16, center=(5.0, 0.0, 0.0), smooth=True)
    edges = MeshEdges.make(mesh.vertices, mesh.faces, mesh.normals)
    assert edges.ends.shape[1] == mesh.faces.shape[1] * 3 // 2
    assert not edges.sharp.any()
    seen = edges.seen_from_origin(mesh.vertices)
    assert 20 < seen.size < 0.2 * edges.sharp.size
    middle = mesh.vertices[:, edges.ends[:, seen]].mean(axis=1) - np.array([[5.0], [0.0], [0.0]])
    assert (middle[0] < 0.2).all() and (np.abs(middle[0]) < 0.6).all()


def test_flat_shading_makes_each_edge_a_crease_unless_both_faces_lie_in_a_plane():
    mesh = ball_mesh(32, 16, center=(5.0, 0.0, 0.0))
    sharp = MeshEdges.make(mesh.vertices, mesh.faces, None).sharp
    assert (~sharp).sum() == 32 * 14  # the diagonals of flat trapezoids
    plane = grid_mesh(6, lambda x, y: 0.1 * x + 2.0)
    edges = MeshEdges.make(plane.vertices, plane.faces, None)
    assert edges.sharp.sum() == 4 * 6  # the border


def test_vertices_in_the_same_place_are_one():
    mesh = ball_mesh(8, 4, smooth=True)
    loose = mesh.vertices[:, mesh.faces.ravel()]
    faces = np.arange(mesh.faces.size).reshape(3, -1)
    edges = MeshEdges.make(loose, faces, mesh.normals)
    assert not edges.sharp.any()


@pytest.mark.parametrize("turned", [False, True])
def test_the_orientation_of_faces_does_not_matter(turned):
    mesh = ball_mesh(16, 8, center=(0.0, 6.0, 0.0), smooth=True)
    faces, normals = mesh.faces.copy(), mesh.normals
    if turned:
        faces[:, ::3], normals = faces[::-1, ::3], normals.copy()
        normals[:, :, ::3] = normals[::-1, :, ::3]
    edges = MeshEdges.make(mesh.vertices, faces, normals)
    assert not edges.sharp.any()
    ends = edges.ends[:, edges.seen_from_origin(mesh.vertices)]
    # the outline is a closed loop
    assert 16 <= ends.shape[1] <= 32
    assert (np.bincount(ends.ravel()) % 2 == 0).all()
