# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays that embree takes to instances meet what rays in the own spaces of the instances meet."""

import pickle

import numpy as np
import pytest

from adaptive_drt.geometry.embree_library import native_library, native_version
from adaptive_drt.geometry.mesh import instance_tracer
from adaptive_drt.geometry.mesh.faces import MeshFaces
from adaptive_drt.geometry.mesh.instanced_faces import InstancedFaces
from adaptive_drt.geometry.mesh.shape import MeshSet
from adaptive_drt.scene.mesh_instances import MeshInstances
from mesh_shapes import ball_mesh, bumpy_mesh, scattered

native = pytest.mark.skipif(native_library() is None, reason="embree's library is not found")
ORIGIN = np.zeros((3, 1))
BALL = ball_mesh(24, 12, center=(0.0, 0.0, 0.0))
BUMPY = bumpy_mesh(12, 8, center=(0.1, 0.0, 0.0))


def faces_of(mesh):
    return MeshFaces.make(mesh.vertices, mesh.faces, mesh.normals)


def both(mesh, matrices, monkeypatch):
    """Instances that embree traces, and the same from box to box."""
    ours = InstancedFaces.make(faces_of(mesh), matrices, ORIGIN, None)
    assert ours.tracer.engine.startswith("embree")
    with monkeypatch.context() as patch:
        patch.setattr(instance_tracer, "native_library", lambda: None)
        other = InstancedFaces.make(faces_of(mesh), matrices, ORIGIN, None)
        assert other.tracer.engine == "boxes"
    return ours, other


def spread(count, extent, size=0.3, seed=0):
    """Instances over a square of some extent."""
    matrices = scattered(np.random.default_rng(seed), count, size)
    matrices[:, :2, 3] *= extent / 2.0
    return matrices


def apart(distance):
    """Balls that do not meet, one above the other."""
    matrices = spread(100, 4.0)
    matrices[0, :2, 3], matrices[0, 2, 3] = 0.0, distance * np.arange(100)
    return InstancedFaces.make(faces_of(BALL), matrices, ORIGIN, None)


def on_surfaces(instances, count, seed=1):
    """Points as shading takes them, and normals, of what rays towards instances meet."""
    rng = np.random.default_rng(seed)
    center = instances.balls[0][:, rng.integers(0, instances.placements.count, count)]
    away = rng.normal(size=(3, count))
    start = center + 0.9 * away / np.linalg.norm(away, axis=0)
    way = center + 0.2 * rng.normal(size=(3, count)) - start
    t = instances.intersect(start, way)
    some = np.isfinite(t)
    start, way = start[:, some], way[:, some]
    return instances.surface(start, way, start + t[some] * way)[:2]


@native
@pytest.mark.parametrize("extent", [4.0, 2_000.0])
def test_hits_are_those_from_box_to_box(extent, monkeypatch):
    ours, other = both(BUMPY, spread(300, extent), monkeypatch)
    rng = np.random.default_rng(3)
    start = np.array([[0.0], [0.0], [3.0]]) + 0.1 * rng.normal(size=(3, 4_000))
    at = rng.integers(0, 300, 4_000)
    way = ours.balls[0][:, at] + 0.2 * rng.normal(size=(3, 4_000)) - start
    a, b = (each.tracer.nearest(start, way, 0.0) for each in (ours, other))
    assert (a.item >= 0).mean() > 0.5
    same = (a.item == b.item) & (a.face == b.face)
    assert same.mean() > 0.999
    np.testing.assert_array_equal(a.t[same], b.t[same])
    hit = same & (a.item >= 0)
    start, way, t = start[:, hit], way[:, hit], a.t[hit]
    a, b = (each.surface(start, way, start + t * way) for each in (ours, other))
    assert (a[0] == b[0]).all(axis=0).mean() > 0.999 and (a[1] == b[1]).all(axis=0).mean() > 0.999
    to = t * rng.uniform(0.5, 1.5, t.size) * way
    blocked = [each.blocked(start, to) for each in (ours, other)]
    assert (blocked[0] == blocked[1]).mean() > 0.998


@native
@pytest.mark.parametrize("distance", [1.5, 40.0])
def test_no_ray_meets_the_convex_instance_that_it_leaves(distance):
    ours = apart(distance)
    point, normal = on_surfaces(ours, 4_000)
    assert point.shape[1] > 2_000
    rng = np.random.default_rng(2)
    across = np.cross(normal, rng.normal(size=normal.shape), axis=0)
    across /= np.linalg.norm(across, axis=0)
    for sine in (1.0, 0.1, 1.0 / instance_tracer.REACH):
        assert not ours.blocked(point, 0.3 * (across + sine * normal)).any()


@native
@pytest.mark.parametrize("distance", [1.5, 40.0])
def test_nothing_leaks_out_of_closed_instances(distance):
    ours = apart(distance)
    point, normal = on_surfaces(ours, 4_000)
    assert point.shape[1] > 2_000
    rng = np.random.default_rng(2)
    inside = point - 1e-5 * normal
    to = rng.normal(size=(3, point.shape[1], 8))
    to *= 5.0 * np.sign((to * normal[:, :, None]).sum(axis=0))
    flat = np.repeat(inside, 8, axis=1), to.reshape(3, -1)
    assert ours.blocked(*flat, group=8).all()
    assert (ours.intersect(*flat) < 1.0).all()


@native
def test_instances_too_small_or_too_thin_for_embree_are_met_from_box_to_box(monkeypatch):
    matrices = spread(100, 20.0)
    matrices[0, :, :3, :5] *= 1e-6
    matrices[0, :, 0, 5:10] *= 1e-3
    ours, other = both(BUMPY, matrices, monkeypatch)
    assert ours.tracer._walked.size == 10
    center = ours.balls[0]
    start = center + np.array([[0.0], [0.0], [4.0]])
    way = np.concatenate([np.zeros((2, 100)), np.full((1, 100), -1.0)])
    a, b = (each.tracer.nearest(start, way, 0.0) for each in (ours, other))
    np.testing.assert_array_equal(a.item, b.item)
    np.testing.assert_array_equal(a.t, b.t)
    shadow = [each.blocked(start, 6.0 * way) for each in (ours, other)]
    np.testing.assert_array_equal(*shadow)
    assert shadow[0].sum() > 90


@native
def test_pickled_instances_are_traced_alike():
    ours = InstancedFaces.make(faces_of(BALL), spread(30, 4.0), ORIGIN, None)
    rng = np.random.default_rng(0)
    rays = 3.0 * rng.normal(size=(3, 500)), 3.0 * rng.normal(size=(3, 500))
    before = ours.intersect(*rays), ours.blocked(*rays)
    again = pickle.loads(pickle.dumps(ours))
    for found, expected in zip((again.intersect(*rays), again.blocked(*rays)), before, strict=True):
        np.testing.assert_array_equal(found, expected)


def test_statistics_name_the_engine(monkeypatch):
    record = MeshInstances(BALL, spread(150, 9.0), BALL.materials)
    found = MeshSet.from_records([record], ORIGIN, None)
    assert found.has_instances and not MeshSet.from_records([BALL], ORIGIN, None).has_instances
    expected = "boxes" if native_library() is None else native_version()
    assert found.figures()["instance_rays"] == expected
    monkeypatch.setattr(instance_tracer, "native_library", lambda: None)
    found = MeshSet.from_records([record], ORIGIN, None)
    assert found.figures()["instance_rays"] == "boxes"
