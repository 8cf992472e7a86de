# SPDX-License-Identifier: GPL-3.0-or-later
"""Instances answer as copies of the mesh do."""

import pickle

import numpy as np
import pytest

from adaptive_drt.geometry.embree import has_embree
from adaptive_drt.geometry.embree_library import native_library
from adaptive_drt.geometry.line_crossings import LightLines
from adaptive_drt.geometry.mesh import instance_boxes, instance_tracer, tracer
from adaptive_drt.geometry.mesh.faces import MeshFaces
from adaptive_drt.geometry.mesh.instanced_faces import InstancedFaces
from mesh_shapes import bumpy_mesh, placed, scattered, turned_steps

ORIGIN = np.array([[0.0], [-6.0], [2.0]])
MESH = bumpy_mesh(12, 8, center=(0.1, 0.0, 0.0), smooth=True)
SHARED = MeshFaces.make(MESH.vertices, MESH.faces, MESH.normals)
MATRICES = scattered(np.random.default_rng(5), 20)


def instances(matrices=MATRICES, displacement=None):
    return InstancedFaces.make(SHARED, matrices, ORIGIN, displacement)


def copied(matrices=MATRICES):
    """All copies as one mesh."""
    meshes = [placed(MESH, matrices[0, ..., k]) for k in range(matrices.shape[3])]
    first = np.cumsum([0, *(each.vertices.shape[1] for each in meshes)])[:-1]
    return MeshFaces.make(
        np.concatenate([each.vertices for each in meshes], axis=1) - ORIGIN,
        np.concatenate([m.faces + at for m, at in zip(meshes, first, strict=True)], axis=1),
        np.concatenate([each.normals for each in meshes], axis=2),
    )


def rays(count, seed=0):
    rng = np.random.default_rng(seed)
    start = rng.normal(size=(3, count))
    return start, np.array([[0.0], [6.0], [-1.0]]) + 2.0 * rng.normal(size=(3, count)) - start


@pytest.mark.parametrize("engine", ["numpy", "boxes", "embree"])
def test_rays_find_what_they_find_on_copies(engine, monkeypatch):
    embree = engine != "numpy"
    if (embree and not has_embree()) or (engine == "embree" and native_library() is None):
        pytest.skip("needs embree")
    for module in (instance_boxes, tracer):
        monkeypatch.setattr(module, "has_embree", lambda: embree)
    if engine != "embree":
        monkeypatch.setattr(instance_tracer, "native_library", lambda: None)
    start, way = rays(3_000)
    own, other = instances(), copied()
    t, expected = own.intersect(start, way), other.intersect(start, way)
    both = np.isfinite(t) & np.isfinite(expected)
    assert both.sum() > 400 and (np.isfinite(t) == np.isfinite(expected)).mean() > 0.999
    near = np.abs(t[both] - expected[both]) < 1e-6
    assert near.mean() > 0.998  # rays that graze an edge may pass beside it
    assert (own.blocked(start, way) == other.blocked(start, way)).mean() > 0.999
    some = np.flatnonzero(both)[near]
    start, way = start[:, some], way[:, some]
    a, b = (each.surface(start, way, start + t[some] * way) for each in (own, other))
    same = np.abs(a[1] - b[1]).max(axis=0) < 1e-4
    assert same.mean() > 0.995
    np.testing.assert_allclose(a[0][:, same], b[0][:, same], atol=1e-5)
    np.testing.assert_allclose(a[2].rise[:, same], b[2].rise[:, same], atol=1e-5)
    np.testing.assert_allclose(a[2].facet[:, same], b[2].facet[:, same], atol=1e-6)


def test_pickled_instances_answer_the_same():
    start, way = rays(500)
    own = instances()
    before = own.intersect(start, way)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(own)).intersect(start, way), before)


def test_outlines_are_those_of_copies():
    few = MATRICES[..., :6]
    own, other = instances(few), copied(few)
    point = np.array([[0.0], [6.0], [-1.9]]) + 0.05 * np.random.default_rng(0).normal(size=(3, 9))
    sides = np.array([[8.0], [0.0], [0.0]]), np.array([[0.0], [8.0], [0.0]])
    lines = LightLines(np.array([[-4.0], [2.0], [3.0]]), *sides, 27, point)
    a, b = own.outline_crossings(point, lines), other.outline_crossings(point, lines)

    def sums(found):
        weight = found.change * found.place
        return np.array(
            [np.bincount(found.line, weights=w, minlength=27 * 9) for w in (found.change, weight)]
        )

    assert a.line.size > 100
    np.testing.assert_allclose(sums(a), sums(b), atol=1e-9)
    many = instances(scattered(np.random.default_rng(1), 400))
    assert many.outline_crossings(point, lines) is None


def test_copies_are_what_is_baked():
    own = instances()
    baked, other = own.baked(np.arange(20)), copied()
    corners, expected = (each.vertices[:, each.faces] for each in (baked, other))
    order, expected_order = (np.lexsort(c.reshape(9, -1).round(9)) for c in (corners, expected))
    np.testing.assert_allclose(corners[..., order], expected[..., expected_order], atol=1e-12)
    np.testing.assert_allclose(
        baked.normals[..., order], other.normals[..., expected_order], atol=1e-9
    )


def test_balls_and_boxes_hold_the_instances():
    own, vertices = instances(), copied().vertices
    center, radius = own.balls
    away = np.linalg.norm(vertices[:, :, None] - center[:, None], axis=0)
    assert (away <= radius).any(axis=1).all()
    middle, size = own.ball
    assert np.linalg.norm(vertices - middle[:, None], axis=0).max() <= size
    center, radius = own.clusters
    assert radius.size == 20 * SHARED.clusters[1].size
    away = np.linalg.norm(vertices[:, :, None] - center[:, None], axis=0)
    assert (away <= radius * (1.0 + 1e-9)).any(axis=1).all()


def test_rays_meet_what_turns_and_grows_at_their_own_times():
    matrices = turned_steps((0.0, 0.7, 2.0), (0.5, 0.8, 1.5), [(0, 0, 1), (1, 0, 2), (1, 1, 2)])
    own = instances(matrices)
    assert own.moves and own.outline_crossings(np.zeros((3, 1)), None) is None
    start, way = rays(2_000, seed=3)
    for time in (-0.5, -0.2, 0.0, 0.4):
        linear, offset = own.placements.at(np.zeros(1, dtype=np.int64), np.full(1, time))
        still = np.concatenate([linear, (offset + ORIGIN)[:, None]], axis=1)[None]
        t = own.intersect(start, way, np.full(2_000, time))
        np.testing.assert_allclose(t, instances(still).intersect(start, way), atol=1e-9)
        blocked = instances(still).blocked(start, way)
        np.testing.assert_array_equal(own.blocked(start, way, np.full(2_000, time)), blocked)
        assert 0 < np.isfinite(t).sum() < 2_000
