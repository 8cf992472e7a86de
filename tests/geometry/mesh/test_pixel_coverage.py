# SPDX-License-Identifier: GPL-3.0-or-later
"""Coverage of pixels by meshes, against many rays through each pixel."""

import numpy as np
import pytest

from adaptive_drt.geometry.camera import make_pinhole_camera
from adaptive_drt.geometry.mesh import raster
from adaptive_drt.geometry.mesh.bvh import FaceTree
from adaptive_drt.geometry.mesh.faces import MeshFaces
from adaptive_drt.geometry.mesh.pixel_coverage import mesh_coverage
from mesh_shapes import ball_mesh, bumpy_mesh, grid_mesh, triangle_soup
from random_scenes import look_at

WIDTH, HEIGHT, RAYS = 20, 14, 150


def some_mesh(kind, rng):
    if kind == "soup":
        return triangle_soup(rng, 20)
    if kind == "few":
        return triangle_soup(rng, 3, size=3.0)
    if kind == "flat":
        return ball_mesh(16, 8, center=(0.0, 0.0, 0.0))
    return bumpy_mesh(40, 30, center=(0.0, 0.0, 0.0), smooth=True)


@pytest.mark.parametrize("kind", ["smooth", "flat", "soup", "few"])
@pytest.mark.parametrize("seed", range(6))
def test_bounds_hold_for_all_rays_of_a_pixel(kind, seed):
    rng = np.random.default_rng(seed)
    mesh = some_mesh(kind, rng)
    # from far, from near and from the inside
    eye = rng.normal(size=3) * rng.choice([0.3, 3.0, 8.0])
    camera = make_pinhole_camera(look_at(eye, rng.normal(size=3) * 0.3, resolution=(WIDTH, HEIGHT)))
    faces = MeshFaces.make(mesh.vertices - camera.origin[:, None], mesh.faces, mesh.normals)
    x, y = (each.ravel() for each in np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT)))
    cover = mesh_coverage(faces, camera.directions(x + 0.5, y + 0.5), camera)
    a, b = rng.random((2, x.size, RAYS))
    w = camera.directions(x[:, None] + a, y[:, None] + b).reshape(3, -1)
    face = FaceTree(faces.vertices, faces.faces).nearest(np.zeros_like(w), w)
    normal, corner = faces.planes
    met = (face >= 0).nonzero()[0]
    t = np.full(face.size, np.inf)
    t[met] = (normal * corner).sum(0)[face[met]] / (normal[:, face[met]] * w[:, met]).sum(0)
    t, hit = t.reshape(-1, RAYS), (face >= 0).reshape(-1, RAYS)
    assert not (hit.any(axis=1) & ~cover.may_hit).any()
    assert not (cover.covers & ~hit.all(axis=1)).any()
    assert not (cover.may_hit & (t.min(axis=1) < cover.near)).any()
    assert not (cover.covers & (t.max(axis=1) > cover.far)).any()


def test_smooth_inner_edges_are_no_edges():
    mesh = bumpy_mesh(200, 120, bumps=0.05, center=(0.0, 0.0, 0.0), smooth=True)
    camera = make_pinhole_camera(look_at((0.0, -6.0, 0.0), (0.0, 0.0, 0.0), resolution=(32, 24)))
    faces = MeshFaces.make(mesh.vertices - camera.origin[:, None], mesh.faces, mesh.normals)
    x, y = (each.ravel() for each in np.meshgrid(np.arange(32), np.arange(24)))
    cover = mesh_coverage(faces, camera.directions(x + 0.5, y + 0.5), camera)
    cut = cover.may_hit & ~cover.covers
    assert cover.covers.sum() > 60
    assert cut.sum() < 0.8 * cover.covers.sum()
    assert (cover.far[cover.covers] - cover.near[cover.covers]).max() < 1.5


def test_sheets_that_cross_each_other_are_an_edge():
    upright = grid_mesh(4, lambda x, y: x)
    other = grid_mesh(4, lambda x, y: -x)
    vertices = np.concatenate([upright.vertices, other.vertices], axis=1)
    faces = np.concatenate([upright.faces, other.faces + upright.vertices.shape[1]], axis=1)
    camera = make_pinhole_camera(look_at((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), resolution=(32, 24)))
    mesh = MeshFaces.make(vertices - camera.origin[:, None], faces, None)
    x, y = (each.ravel() for each in np.meshgrid(np.arange(32), np.arange(24)))
    cover = mesh_coverage(mesh, camera.directions(x + 0.5, y + 0.5), camera)
    cut = (cover.may_hit & ~cover.covers).reshape(24, 32)
    # the sheets cross in the plane x = 0: in one of two columns of pixels
    assert cut[2:-2, 15:17].any(axis=1).all()
    assert not cut[2:-2, 8:13].any()


@pytest.mark.parametrize("most", [1, 500])
def test_parts_of_a_window_give_the_same_bounds(monkeypatch, most):
    mesh = bumpy_mesh(40, 30, bumps=0.05, center=(0.0, 0.0, 0.0), smooth=True)
    camera = make_pinhole_camera(look_at((0.0, -6.0, 0.0), (0.0, 0.0, 0.0), resolution=(32, 24)))
    faces = MeshFaces.make(mesh.vertices - camera.origin[:, None], mesh.faces, mesh.normals)
    x, y = (each.ravel() for each in np.meshgrid(np.arange(2, 29), np.arange(1, 18)))
    w = camera.directions(x + 0.5, y + 0.5)
    whole = mesh_coverage(faces, w, camera)
    monkeypatch.setattr(raster, "MOST_PAIRS", most)
    parts = mesh_coverage(faces, w, camera)
    assert whole.covers.any() and (whole.may_hit & ~whole.covers).any()
    for name in whole.__dataclass_fields__:
        np.testing.assert_array_equal(getattr(parts, name), getattr(whole, name))
