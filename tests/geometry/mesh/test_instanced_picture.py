# SPDX-License-Identifier: GPL-3.0-or-later
"""Coverage of pixels by instances is that of copies, or says less."""

import numpy as np
import pytest

from adaptive_drt.geometry.camera import make_pinhole_camera
from adaptive_drt.geometry.mesh import instanced_picture as module
from adaptive_drt.geometry.mesh.faces import MeshFaces
from adaptive_drt.geometry.mesh.instanced_faces import InstancedFaces
from adaptive_drt.geometry.mesh.pixel_coverage import mesh_coverage
from mesh_shapes import bumpy_mesh, scattered
from random_scenes import look_at

WIDTH, HEIGHT = 60, 40
CAMERA = make_pinhole_camera(look_at((0.5, -6.0, 3.5), (0.0, 0.0, 0.9), resolution=(WIDTH, HEIGHT)))
MESH = bumpy_mesh(12, 8, center=(0.0, 0.0, 0.0), smooth=True)
SHARED = MeshFaces.make(MESH.vertices, MESH.faces, MESH.normals)


def pixels():
    y, x = (each.ravel() for each in np.mgrid[:HEIGHT, :WIDTH])
    return x, y, CAMERA.directions(x + 0.5, y + 0.5)


def instances():
    matrices = scattered(np.random.default_rng(4), 12, size=0.5)
    return InstancedFaces.make(SHARED, matrices, CAMERA.origin[:, None], None)


@pytest.mark.parametrize("drawn", [0, 300, 1 << 18])
def test_coverage_is_conservative(drawn, monkeypatch):
    monkeypatch.setattr(module, "MOST_DRAWN_FACES", drawn)
    _, _, w = pixels()
    own = instances()
    found, exact = own.coverage(w, CAMERA), mesh_coverage(own.baked(np.arange(12)), w, CAMERA)
    assert not (exact.may_hit & ~found.may_hit).any()
    assert not (found.covers & ~exact.covers).any()
    t = own.intersect(np.zeros_like(w), w)
    hit = np.isfinite(t)
    assert (found.near[hit] <= t[hit]).all() and (t[found.covers] <= found.far[found.covers]).all()
    met, near = own.may_meet(w, CAMERA)
    assert not (exact.may_hit & ~met).any() and (near[hit] <= t[hit]).all()
    if drawn > 300:
        np.testing.assert_array_equal(found.covers, exact.covers)
        assert found.covers.sum() > 50
    else:
        assert found.covers.sum() < exact.covers.sum()


def test_batches_agree():
    """What is known of a pixel does not depend on the others that are asked with it."""
    _, _, w = pixels()
    whole = instances().coverage(w, CAMERA)
    rows = np.arange(1, w.shape[1], 7)
    part = instances().coverage(np.ascontiguousarray(w[:, rows]), CAMERA)
    for name in ("may_hit", "covers", "near"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[rows])
