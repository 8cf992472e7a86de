# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of known surfaces, for tests."""

from dataclasses import replace

import numpy as np

from adaptive_drt.scene.description import Material
from adaptive_drt.scene.triangle_mesh import TriangleMesh

__all__ = [
    "ball_mesh",
    "bumpy_mesh",
    "grid_mesh",
    "mesh_of",
    "placed",
    "scattered",
    "smooth_normals",
    "triangle_soup",
    "turned_steps",
]


def mesh_of(vertices, faces, smooth=False, color=(0.7, 0.6, 0.5), **fields):
    """Mesh of vertices (3, v) and faces (3, f), with the mean normals of its vertices if smooth."""
    vertices, faces = np.ascontiguousarray(vertices, dtype=float), np.ascontiguousarray(faces)
    normals = smooth_normals(vertices, faces) if smooth else None
    slot = np.zeros(faces.shape[1], dtype=np.int64)
    return TriangleMesh(vertices, faces, slot, (Material(color),), normals, **fields)


def smooth_normals(vertices, faces):
    """Corner normals (3, 3, f): means of the faces around each vertex, by their area."""
    a, b, c = (vertices[:, each] for each in faces)
    plain = np.cross(b - a, c - a, axis=0)
    mean = np.zeros_like(vertices)
    for corner in faces:
        for axis in range(3):
            np.add.at(mean[axis], corner, plain[axis])
    return np.ascontiguousarray(mean[:, faces].transpose(1, 0, 2))


def bumpy_mesh(columns, rows, bumps=0.15, radius=1.0, center=(0.0, 0.0, 1.2), **fields):
    """Ball with bumps, closed at its poles."""
    u = np.arange(columns) / columns * 2.0 * np.pi
    v = np.arange(1, rows) / rows * np.pi
    u, v = np.meshgrid(u, v, indexing="ij")
    size = radius * (1.0 + bumps * np.sin(5.0 * u) * np.sin(4.0 * v))
    ring = size * np.array([np.sin(v) * np.cos(u), np.sin(v) * np.sin(u), np.cos(v)])
    poles = radius * np.array([[0.0, 0.0], [0.0, 0.0], [1.0, -1.0]])
    points = np.concatenate([ring.reshape(3, -1), poles], axis=1) + np.array(center)[:, None]
    number = np.arange(columns * (rows - 1)).reshape(columns, rows - 1)
    after = np.roll(number, -1, axis=0)
    top, bottom = number.size, number.size + 1
    a, b, c, d = (x.ravel() for x in (number[:, :-1], number[:, 1:], after[:, 1:], after[:, :-1]))
    first, last = number[:, 0], number[:, -1]
    faces = [(a, b, c), (a, c, d), (np.full(columns, top), first, after[:, 0])]
    faces.append((last, np.full(columns, bottom), after[:, -1]))
    return mesh_of(points, np.concatenate([np.array(each) for each in faces], axis=1), **fields)


def ball_mesh(columns, rows, **fields):
    """Ball of triangles."""
    return bumpy_mesh(columns, rows, bumps=0.0, **fields)


def grid_mesh(count, height, size=4.0, **fields):
    """Open square of count x count cells in the plane z = height(x, y)."""
    x, y = np.meshgrid(*(np.linspace(-size / 2, size / 2, count + 1),) * 2, indexing="ij")
    points = np.array([x, y, height(x, y)]).reshape(3, -1)
    number = np.arange((count + 1) ** 2).reshape(count + 1, count + 1)
    low, high = number[:-1], number[1:]
    a, b, c, d = (each.ravel() for each in (low[:, :-1], high[:, :-1], high[:, 1:], low[:, 1:]))
    return mesh_of(points, np.concatenate([(a, b, c), (a, c, d)], axis=1), **fields)


def triangle_soup(rng, count, size=1.0):
    """Random triangles that meet and cross each other."""
    points = size * rng.normal(size=(3, 3 * count))
    return mesh_of(points, np.arange(3 * count).reshape(3, -1))


def placed(mesh, matrix):
    """A mesh with its vertices and normals where a matrix (3, 4) takes them."""
    linear, offset = matrix[:, :3], matrix[:, 3:]
    faces, normals = mesh.faces, mesh.normals
    if normals is not None:
        normals = np.einsum("ij,kjf->kif", np.linalg.inv(linear).T, normals)
    if np.linalg.det(linear) < 0.0:
        faces = np.ascontiguousarray(faces[::-1])
        normals = None if normals is None else normals[::-1]
    return replace(mesh, vertices=linear @ mesh.vertices + offset, faces=faces, normals=normals)


def scattered(rng, count, size=0.3):
    """Matrices (1, 3, 4, count) of turned, stretched and mirrored copies above the floor."""
    turn = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    linear = turn * (size * rng.uniform(0.5, 1.5, size=(count, 1, 3)))
    offset = rng.uniform((-2.0, -2.0, 0.4), (2.0, 2.0, 2.0), size=(count, 3))
    whole = np.concatenate([linear, offset[:, :, None]], axis=2)
    return np.ascontiguousarray(whole.transpose(1, 2, 0)[None])


def turned_steps(angles, sizes, offsets):
    """Matrices (k, 3, 4, 1) that turn about z, scale and move."""
    steps = []
    for angle, size, offset in zip(angles, sizes, offsets, strict=True):
        c, s = np.cos(angle) * size, np.sin(angle) * size
        steps.append([[c, -s, 0.0, offset[0]], [s, c, 0.0, offset[1]], [0.0, 0.0, size, offset[2]]])
    return np.array(steps)[..., None]
