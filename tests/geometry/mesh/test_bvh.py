# SPDX-License-Identifier: GPL-3.0-or-later
"""Clusters of faces enclose them, and the tree finds what a loop over all faces finds."""

import numpy as np
import pytest

from adaptive_drt.geometry.mesh.bvh import CLUSTER_SIZE, FaceTree, face_clusters
from adaptive_drt.numerics.morton import morton_order
from mesh_shapes import bumpy_mesh, triangle_soup


def all_hits(mesh, start, way):
    """Ray parameters (rays, faces) by Cramer's rule."""
    a, b, c = (mesh.vertices[:, each].T for each in mesh.faces)
    found = np.full((start.shape[1], len(a)), np.inf)
    for k, (o, d) in enumerate(zip(start.T, way.T, strict=True)):
        system = np.stack([b - a, c - a, np.broadcast_to(-d, a.shape)], axis=2)
        y, z, t = np.linalg.solve(system, (o - a)[:, :, None])[:, :, 0].T
        inside = (y >= 0) & (z >= 0) & (y + z <= 1) & (t > 0)
        found[k] = np.where(inside, t, np.inf)
    return found


def test_morton_order_is_a_permutation_that_keeps_neighbours():
    point = np.random.default_rng(0).random((3, 500))
    order = morton_order(point)
    assert sorted(order.tolist()) == list(range(500))
    step = np.linalg.norm(np.diff(point[:, order], axis=1), axis=0).mean()
    assert step < 0.5 * np.linalg.norm(np.diff(point, axis=1), axis=0).mean()


@pytest.mark.parametrize("seed", range(3))
def test_clusters_enclose_their_faces(seed):
    mesh = triangle_soup(np.random.default_rng(seed), 100)
    order, center, radius = face_clusters(mesh.vertices, mesh.faces)
    assert radius.size == -(-100 // CLUSTER_SIZE)
    for rank, face in enumerate(order):
        own = rank // CLUSTER_SIZE
        corners = mesh.vertices[:, mesh.faces[:, face]]
        assert (np.linalg.norm(corners - center[:, own, None], axis=0) <= radius[own]).all()


@pytest.mark.parametrize("seed", range(4))
def test_the_tree_finds_the_nearest_face(seed):
    rng = np.random.default_rng(seed)
    mesh = triangle_soup(rng, 90) if seed % 2 else bumpy_mesh(12, 8, center=(0.0, 0.0, 0.0))
    start, way = 2.0 * rng.normal(size=(3, 200)), rng.normal(size=(3, 200))
    hits = all_hits(mesh, start, way)
    tree = FaceTree(mesh.vertices, mesh.faces)
    found = tree.nearest(start, way)
    best = hits.min(axis=1)
    np.testing.assert_array_equal(found >= 0, np.isfinite(best))
    met = found >= 0
    np.testing.assert_allclose(hits[met, found[met]], best[met], rtol=1e-12)
    length = rng.random(200) * 4.0
    near = np.isfinite(best) & (np.abs(best - length) < 1e-9)
    blocked = tree.blocked(start, way, length)
    np.testing.assert_array_equal(blocked[~near], (best < length)[~near])
