# SPDX-License-Identifier: GPL-3.0-or-later
"""Hits of rays with meshes: float64 depths, normals on the viewer's side, starts of shadow rays."""

import numpy as np
import pytest

from adaptive_drt.geometry.mesh.faces import MeshFaces
from adaptive_drt.geometry.mesh.shape import MeshSet
from adaptive_drt.scene.description import Material
from adaptive_drt.scene.triangle_mesh import TriangleMesh
from mesh_shapes import ball_mesh, bumpy_mesh, grid_mesh


def rays_at(center, count, rng):
    w = np.array(center)[:, None] + rng.normal(size=(3, count)) * 0.5
    return np.zeros_like(w), w


def faces_of(mesh):
    return MeshFaces.make(mesh.vertices, mesh.faces, mesh.normals)


@pytest.mark.parametrize("far", [3.0, 1e3])
def test_depths_are_those_of_float64(far):
    plane = grid_mesh(7, lambda x, y: 0.1 * x + far, size=0.6 * far)
    rng = np.random.default_rng(0)
    w = np.array([0.2, 0.2, 0.02])[:, None] * rng.normal(size=(3, 500)) + [[0.0], [0.0], [1.0]]
    t = faces_of(plane).intersect(np.zeros_like(w), w)
    exact = far / (w[2] - 0.1 * w[0])
    hit = np.isfinite(t)
    assert hit.sum() > 200
    np.testing.assert_allclose(t[hit], exact[hit], rtol=1e-14)


def test_normals_face_the_viewer_and_points_lie_on_their_side():
    mesh = bumpy_mesh(60, 40, center=(0.0, 0.0, 5.0), smooth=True)
    rng = np.random.default_rng(1)
    start, w = rays_at((0.0, 0.0, 5.0), 2_000, rng)
    inside = start + np.array([[0.0], [0.0], [5.0]])
    for origin in (start, inside):  # from the outside, and from the inside
        own = faces_of(mesh)
        t = own.intersect(origin, w)
        met = np.isfinite(t)
        hits = origin[:, met] + t[met] * w[:, met]
        point, normal, _ = own.surface(origin[:, met], w[:, met], hits)
        np.testing.assert_allclose((normal**2).sum(0), 1.0, rtol=1e-12)
        assert ((normal * w[:, met]).sum(0) < 0.2).all()
        off = ((point - hits) ** 2).sum(0) ** 0.5
        assert off.max() < 1e-5
        # no ray that leaves the surface meets it again at once
        assert own.blocked(point, normal * 1e-3).mean() < 2e-3


def test_smooth_normals_of_a_ball_are_nearly_radial():
    mesh = ball_mesh(60, 40, center=(0.0, 0.0, 5.0), smooth=True)
    start, w = rays_at((0.0, 0.0, 5.0), 500, np.random.default_rng(2))
    own = faces_of(mesh)
    t = own.intersect(start, w)
    met = np.isfinite(t)
    point, normal, smooth = own.surface(start[:, met], w[:, met], t[met] * w[:, met])
    away = point - [[0.0], [0.0], [5.0]]
    cosine = (normal * away).sum(0) / np.linalg.norm(away, axis=0)
    assert cosine.min() > 0.995
    # the smooth surface lies above the faces, nearly on the ball
    height = np.linalg.norm(away, axis=0)
    risen = np.linalg.norm(away + smooth.rise, axis=0)
    assert (risen >= height).all() and (np.abs(risen - 1.0) < np.abs(height - 1.0) + 1e-9).all()
    assert ((smooth.facet * normal).sum(0) > 0.99).all()


def test_the_smooth_surface_is_on_the_viewers_side_whichever_way_normals_point():
    mesh = bumpy_mesh(30, 20, center=(0.0, 0.0, 5.0), smooth=True)
    start, w = rays_at((0.0, 0.0, 5.0), 500, np.random.default_rng(3))
    found = []
    for normals in (mesh.normals, -mesh.normals):
        own = MeshFaces.make(mesh.vertices, mesh.faces, normals)
        t = own.intersect(start, w)
        met = np.isfinite(t)
        found.append(own.surface(start[:, met], w[:, met], t[met] * w[:, met]))
    (_, normal, smooth), (_, reverse, same) = found
    assert (np.abs(smooth.rise) > 1e-4).any()
    np.testing.assert_array_equal(normal, -reverse)
    np.testing.assert_array_equal(smooth.facet, same.facet)
    np.testing.assert_allclose(smooth.rise, same.rise, rtol=0.0, atol=1e-15)


def test_faces_without_an_area_are_left_out():
    vertices = np.array([[0.0, 1.0, 0.0, 2.0, 2.0], [0.0, 0.0, 1.0, 0.0, 0.0], [3.0] * 5])
    faces = np.array([[0, 0, 3], [1, 1, 4], [2, 3, 3]])
    own = MeshFaces.make(vertices, faces, None)
    assert own.faces.shape[1] == 1 and own.vertices.shape[1] == 3
    empty = MeshFaces.make(vertices, faces[:, 1:], None)
    w = np.array([[0.1], [0.1], [1.0]])
    assert np.isinf(empty.intersect(np.zeros((3, 1)), w)).all()
    assert not empty.blocked(np.zeros((3, 1)), 9.0 * w).any()


def set_of(*records, displacement=None):
    return MeshSet.from_records(records, np.zeros((3, 1)), displacement)


def test_a_set_has_an_object_for_each_material():
    mesh = ball_mesh(16, 8, center=(0.0, 0.0, 5.0))
    slot = (mesh.vertices[0, mesh.faces].mean(axis=0) > 0.0).astype(np.int64)
    both = TriangleMesh(mesh.vertices, mesh.faces, slot, (Material(), Material((1.0, 0.0, 0.0))))
    shapes = set_of(both, mesh)
    assert shapes.count == 3
    w = np.array([[0.1, -0.1, 0.1, 9.0], [0.0, 0.0, 0.0, 0.0], [1.0, 1.0, 1.0, 1.0]])
    t = shapes.intersect(np.array([1, 1, 2, 2]), w, 0.0)
    assert np.isfinite(t).tolist() == [True, False, True, False] and t[0] == t[2]
    center, radius = shapes.bounding_spheres
    assert center.shape == (3, 3) and (radius > 0.5).all() and radius[2] < 1.2
    inside = shapes.surface(np.array([2]), w[:, 2:3], t[2] * w[:, 2:3], 0.0)[2]
    assert inside.all()


def test_meshes_move_as_a_whole():
    mesh = ball_mesh(32, 16, center=(0.0, 0.0, 5.0), smooth=True)
    shapes = set_of(mesh, displacement=np.array([[2.0], [0.0], [1.0]]))
    index, w = np.zeros((1, 1), dtype=int), np.array([0.2, 0.0, 1.0])[:, None, None]
    times = np.array([[-0.5, 0.0, 0.5]])
    t = shapes.intersect(index, np.broadcast_to(w, (3, 1, 3)), times)
    place = [ball_mesh(32, 16, center=(2 * s, 0.0, 5.0 + s), smooth=True) for s in times[0]]
    expected = [set_of(each).intersect(index, w[:, :, :1], 0.0)[0, 0] for each in place]
    assert np.isinf(expected[0])
    np.testing.assert_allclose(t[0], expected, rtol=1e-6)
    w, later = w[:, :, 0], float(t[0, 2])
    point, normal, _ = shapes.surface(np.zeros(1, dtype=int), w, later * w, 0.5)
    still = set_of(place[2]).surface(np.zeros(1, dtype=int), w, later * w, 0.0)
    np.testing.assert_allclose(point, still[0], atol=1e-6)
    np.testing.assert_allclose(normal, still[1], atol=1e-5)
    start, to = (np.array([x, 0.0, 3.0])[:, None, None] for x in (0.3, 0.0))
    blocked = shapes.blocks(index, start, np.broadcast_to(to, (3, 1, 3)), times)
    assert blocked.tolist() == [[False, True, True]]
