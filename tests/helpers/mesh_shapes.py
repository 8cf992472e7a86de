# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of known surfaces, for tests."""

import numpy as np

from adaptive_drt.scene.description import Material
from adaptive_drt.scene.triangle_mesh import TriangleMesh

__all__ = ["ball_mesh", "bumpy_mesh", "grid_mesh", "mesh_of", "smooth_normals", "triangle_soup"]


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
