# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays by embree agree with those by NumPy, wherever the mesh is and whatever its size."""

import pickle

import numpy as np
import pytest

from adaptive_drt.geometry.embree import has_embree
from adaptive_drt.geometry.mesh import tracer as module
from adaptive_drt.geometry.mesh.tracer import START_OFFSET, FaceTracer
from mesh_shapes import ball_mesh, bumpy_mesh

pytestmark = pytest.mark.skipif(not has_embree(), reason="needs embree")


def plain(vertices, faces, monkeypatch):
    """A tracer that does without embree."""
    found = FaceTracer(vertices, faces)
    with monkeypatch.context() as patch:
        patch.setattr(module, "has_embree", lambda: False)
        found._traced()
    return found


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("far", [0.0, 1e4])
def test_embree_and_numpy_agree(scale, far, monkeypatch):
    rng = np.random.default_rng(3)
    mesh = bumpy_mesh(24, 16, center=(0.0, 0.0, 0.0))
    offset = scale * far * np.array([[1.0], [2.0], [-1.0]])
    vertices = scale * mesh.vertices + offset
    start = scale * (3.0 * rng.normal(size=(3, 2_000))) + offset
    way = scale * rng.normal(size=(3, 2_000)) + offset - start
    ours, other = FaceTracer(vertices, mesh.faces), plain(vertices, mesh.faces, monkeypatch)
    a, b = ours.nearest(start, way), other.nearest(start, way)
    assert (a == b).mean() > 0.995  # some rays pass between two faces
    assert ((a >= 0) == (b >= 0)).mean() > 0.998
    assert (ours.blocked(start, way) == other.blocked(start, way)).mean() > 0.998


def test_no_ray_leaves_a_closed_mesh():
    mesh = ball_mesh(64, 32, center=(0.0, 0.0, 0.0))
    way = np.random.default_rng(0).normal(size=(3, 100_000))
    # also exactly through vertices and the middles of edges
    corners = mesh.vertices[:, mesh.faces].reshape(3, -1)
    edges = 0.5 * (mesh.vertices[:, mesh.faces[0]] + mesh.vertices[:, mesh.faces[1]])
    for some in (way, corners, edges):
        start = np.zeros_like(some)
        assert (FaceTracer(mesh.vertices, mesh.faces).nearest(start, some) >= 0).all()


def test_segments_end_before_the_light():
    mesh = ball_mesh(8, 4, center=(0.0, 0.0, 0.0))
    found = FaceTracer(mesh.vertices, mesh.faces)
    start, way = np.array([[3.0], [0.1], [0.2]]), np.array([[-1.0], [0.0], [0.0]])
    t = np.linspace(1.0, 4.0, 301)
    blocked = [bool(found.blocked(start, way * each)[0]) for each in t]
    first = t[np.argmax(blocked)]
    assert not blocked[0] and blocked[-1] and 1.9 < first < 2.4
    assert not found.blocked(start, np.zeros((3, 1)))[0]
    assert START_OFFSET < 1e-5


def test_a_pickled_tracer_builds_embree_again():
    mesh = ball_mesh(8, 4)
    found = FaceTracer(mesh.vertices, mesh.faces)
    start, way = np.zeros((3, 1)), np.array([[0.0], [0.1], [1.0]])
    face = found.nearest(start, way)
    assert pickle.loads(pickle.dumps(found)).nearest(start, way) == face >= 0
