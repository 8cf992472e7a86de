# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of meshes and instances that are spoilt at random, by seed."""

from dataclasses import replace

import numpy as np

from adaptive_drt.scene.description import Motion
from adaptive_drt.scene.mesh_instances import MeshInstances
from adaptive_drt.scene.triangle_mesh import TriangleMesh
from mesh_shapes import scattered
from random_meshes import random_mesh, random_mesh_scene

__all__ = ["hostile_mesh_scene", "many_doubled_faces"]

EXTREME = (0.0, -0.0, 5e-324, 1e-310, 1e-160, 1e-30, 1e-9, 1e9, 1e29, 1e30, 1e31, np.nan, np.inf)
DOUBLED = 1_000_000
"""Number of faces of a mesh all of which lie in a few places."""


def hostile_mesh_scene(seed):
    """A random scene of meshes in which a few things went wrong."""
    rng = np.random.default_rng((seed, 7))
    scene = random_mesh_scene(seed, resolution=(6, 5))
    shapes = [
        _spoilt(shape, rng) if isinstance(shape, TriangleMesh) else shape for shape in scene.shapes
    ]
    if rng.random() < 0.6:
        shapes.append(_spoilt_instances(rng))
    return replace(scene, shapes=tuple(shapes))


def many_doubled_faces(count=DOUBLED):
    """A mesh of so many faces in six places, and turned over."""
    rng = np.random.default_rng(0)
    vertices = rng.normal(size=(3, 8)) * 0.6 + np.array([[0.0], [0.0], [1.2]])
    faces = np.tile(rng.integers(0, 8, size=(3, 6)), count // 6)
    faces[:, ::2] = faces[::-1, ::2]
    slot = np.zeros(faces.shape[1], dtype=np.int64)
    scene = random_mesh_scene(1, resolution=(6, 5))
    mesh = TriangleMesh(vertices, faces, slot, scene.shapes[1].materials)
    return replace(scene, shapes=(scene.shapes[0], mesh))


def _spoilt(mesh, rng):
    for _ in range(rng.integers(1, 3)):
        mesh = TRICKS[rng.integers(len(TRICKS))](mesh, rng)
    return mesh


def _extreme(rng):
    return float(rng.choice(EXTREME) * rng.choice([-1.0, 1.0]))


def _coordinate(mesh, rng):
    vertices = mesh.vertices.copy()
    vertices[rng.integers(3), rng.integers(vertices.shape[1])] = _extreme(rng)
    return replace(mesh, vertices=vertices)


def _flattened(mesh, rng):
    vertices = mesh.vertices.copy()
    row, size = rng.integers(3), float(10.0 ** rng.uniform(-40, 0)) * float(rng.integers(2))
    vertices[row] = np.where(np.isfinite(vertices[row]), vertices[row] * size, vertices[row])
    return replace(mesh, vertices=vertices)


def _needles(mesh, rng):
    """Corners of faces are moved next to others."""
    vertices = mesh.vertices.copy()
    first, last = rng.integers(0, vertices.shape[1], size=(2, vertices.shape[1] // 2))
    vertices[:, first] = vertices[:, last] * (1.0 + 10.0 ** rng.uniform(-18, -6))
    return replace(mesh, vertices=vertices)


def _doubled(mesh, rng):
    times = int(rng.choice([2, 3, 100]))
    faces = np.tile(mesh.faces, times)
    if rng.random() < 0.5:
        faces[:, : mesh.faces.shape[1]] = mesh.faces[::-1]
    slot = np.zeros(faces.shape[1], dtype=np.int64)
    normals = None if mesh.normals is None else np.tile(mesh.normals, times)
    return replace(mesh, faces=faces, face_slot=slot, normals=normals)


def _without_faces(mesh, rng):
    kept = np.flatnonzero(rng.random(mesh.faces.shape[1]) < rng.choice([0.0, 0.05]))
    normals = None if mesh.normals is None else mesh.normals[..., kept]
    return replace(mesh, faces=mesh.faces[:, kept], face_slot=mesh.face_slot[kept], normals=normals)


def _normals(mesh, rng):
    """Normals that are zero, reversed or of any length."""
    normals = rng.normal(size=(3, 3, mesh.faces.shape[1])) * rng.choice([0.0, 1e-200, 1.0, 1e30])
    return replace(mesh, normals=normals)


def _moved(mesh, rng):
    way = rng.normal(size=3) * 10.0 ** rng.uniform(-30, 25)
    return replace(mesh, motion=Motion(tuple(way.tolist())))


def _resized(mesh, rng):
    return replace(mesh, vertices=mesh.vertices * 10.0 ** rng.uniform(-35, 25))


TRICKS = (
    _coordinate,
    _coordinate,
    _flattened,
    _needles,
    _doubled,
    _without_faces,
    _normals,
    _moved,
    _resized,
)


def _spoilt_instances(rng):
    mesh = random_mesh(rng, int(rng.integers(4)))
    mesh = replace(mesh, vertices=mesh.vertices - np.array([[0.0], [0.0], [1.2]]))
    if rng.random() < 0.3:
        mesh = _spoilt(replace(mesh, motion=None), rng)
    count = int(rng.choice([1, 3, 40]))
    steps = int(rng.choice([1, 1, 2, 3, 5]))
    matrices = np.concatenate([scattered(rng, count, size=0.4) for _ in range(steps)])
    trick = rng.integers(6)
    if trick == 0:  # an entry of any size
        where = tuple(rng.integers(size) for size in matrices.shape)
        matrices[where] = _extreme(rng)
    elif trick == 1:  # all in one place
        matrices[:] = matrices[..., :1]
    elif trick == 2:  # nearly flat
        matrices[:, :, rng.integers(3)] *= 10.0 ** rng.uniform(-20, -5)
    elif trick == 3:  # grown from nothing
        matrices[0, :, :3] *= 0.0 if steps > 2 else 1e-30
    elif trick == 4:  # of very different sizes
        matrices[:, :, :3] *= 10.0 ** rng.uniform(-12, 0.5, size=count)
    return MeshInstances(mesh, matrices, mesh.materials)
