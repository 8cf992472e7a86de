# SPDX-License-Identifier: GPL-3.0-or-later
"""Random scenes of a floor, one or two meshes and quad lights, for tests."""

from dataclasses import replace

import numpy as np

from adaptive_drt.scene.description import Material, Quad, QuadLight, Scene
from mesh_shapes import ball_mesh, bumpy_mesh, grid_mesh, smooth_normals, triangle_soup
from random_scenes import look_at

__all__ = ["random_mesh", "random_mesh_scene"]


SOUP_FACES, DOUBLED_FACES = 16, 4
"""Number of loose triangles of a mesh, and how many of them stand for both sides of one."""


def random_mesh(rng, kind):
    """One of several kinds of meshes, above the floor z = 0; coarse ones are flat."""
    center = (*rng.uniform(-0.8, 0.8, 2), rng.uniform(0.9, 1.6))
    smooth = bool(rng.random() < 0.5)
    if kind == 0:
        size = (24, 16) if smooth else (12, 8)
        return ball_mesh(*size, radius=0.7, center=center, smooth=smooth)
    if kind == 1:
        return bumpy_mesh(16, 10, bumps=0.2, radius=0.7, center=center)
    if kind == 2:
        a, b = rng.uniform(0.5, 2.0, 2)
        height = rng.uniform(0.6, 1.4)
        bent = lambda x, y: height + 0.25 * np.sin(a * x) * np.cos(b * y)  # noqa: E731
        return grid_mesh(5, bent, size=1.8)
    soup = triangle_soup(rng, SOUP_FACES - DOUBLED_FACES, 0.35)
    vertices = soup.vertices + np.array(center)[:, None]
    faces = np.concatenate([soup.faces, soup.faces[::-1, :DOUBLED_FACES]], axis=1)
    return type(soup)(vertices, faces, np.zeros(SOUP_FACES, dtype=np.int64), soup.materials)


def _rounded(mesh):
    """The mesh with smooth normals, but for loose triangles, which have few neighbours."""
    if mesh.normals is not None or mesh.faces.shape[1] <= SOUP_FACES:
        return mesh
    return replace(mesh, normals=smooth_normals(mesh.vertices, mesh.faces))


def random_mesh_scene(seed, resolution=(36, 24), rounded=False):
    """A scene of its own for each seed; the kinds of meshes take turns.

    rounded : whether coarse meshes are smooth, too.
    """
    rng = np.random.default_rng(seed)
    floor = Quad((-6.0, -6.0, 0.0), (12.0, 0.0, 0.0), (0.0, 12.0, 0.0), Material((0.8, 0.8, 0.8)))
    meshes = [random_mesh(rng, seed % 4)]
    if seed % 3 == 0:
        meshes.append(random_mesh(rng, int(rng.integers(4))))
    if rounded:
        meshes = [_rounded(mesh) for mesh in meshes]
    turn = rng.uniform(0.0, 2.0 * np.pi)
    size = rng.uniform(0.2, 0.9)
    u = size * np.array([np.cos(turn), np.sin(turn), 0.2])
    v = size * np.array([np.sin(turn), -np.cos(turn), 0.0])
    place = (*rng.uniform(-2.0, 2.0, 2), rng.uniform(3.5, 5.0))
    light = QuadLight(place, tuple(u), tuple(v), (14.0, 12.0, 10.0))
    eye = (rng.uniform(-2.0, 2.0), -5.0, rng.uniform(2.0, 4.0))
    camera = look_at(eye, (0.0, 0.0, 0.7), resolution=resolution)
    return Scene(camera, (floor, *meshes), (light,), (0.1, 0.15, 0.2))
