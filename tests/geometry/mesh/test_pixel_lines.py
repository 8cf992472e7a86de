# SPDX-License-Identifier: GPL-3.0-or-later
"""Crossings of lines within pixels by the edges of a mesh's picture."""

import numpy as np
import pytest

from adaptive_drt.geometry.camera import make_pinhole_camera
from adaptive_drt.geometry.mesh.faces import MeshFaces
from adaptive_drt.geometry.mesh.pixel_lines import edges_on_lines
from mesh_shapes import ball_mesh, grid_mesh
from random_scenes import look_at

SIZE, LINES = (20, 14), 7
CAMERA = make_pinhole_camera(look_at((0.5, -6.0, 3.5), (0.0, 0.0, 1.0), resolution=SIZE))
MESHES = {
    "ball": ball_mesh(14, 9),
    "smooth": ball_mesh(30, 20, smooth=True),
    "open": grid_mesh(3, lambda x, y: 1.0 + 0.2 * x * y, size=2.0),
    "behind": grid_mesh(2, lambda x, y: 1.0 + 0.3 * x, size=14.0),
}


@pytest.mark.parametrize("name", MESHES)
def test_what_is_seen_changes_only_at_crossings(name):
    """Between crossings neighbouring rays of a line hit the mesh, or miss it, alike."""
    mesh = MESHES[name]
    faces = MeshFaces.make(mesh.vertices - CAMERA.origin[:, None], mesh.faces, mesh.normals)
    x, y = (each.ravel() for each in np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1])))
    line, place = edges_on_lines(faces, CAMERA, x, y, LINES)
    assert line.size and (place > 0.0).all() and (place < 1.0).all()
    spots = (np.arange(40) + 0.5) / 40
    pixel, j = np.divmod(np.arange(x.size * LINES), LINES)
    across = x[pixel, None] + spots
    up = np.broadcast_to((y[pixel] + (j + 0.5) / LINES)[:, None], across.shape)
    w = CAMERA.directions(across, up).reshape(3, -1)
    t = faces.intersect(np.zeros_like(w), w).reshape(across.shape)
    changes = np.isfinite(t[:, 1:]) != np.isfinite(t[:, :-1])
    counted = np.zeros(changes.shape)
    at = np.ceil(place * 40 - 0.5).astype(int) - 1
    inside = (at >= 0) & (at < 39)
    np.add.at(counted, (line[inside], at[inside]), 1)
    assert changes.any()
    assert (counted[changes] >= 1).all()
