# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes as they are: all their triangles, with the normals that Blender shades them with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...adaptive_drt.scene.description import Issue, Material, vector_of
from ...adaptive_drt.scene.triangle_mesh import TriangleMesh
from .mesh import NO_SCALE, material_indices, points_of, triangles_of
from .shutter import Matrix, Track, path_of

LEAST_EXTENT = 1e-30
"""Metres, least length of the axes of a box around a mesh: those of a flat mesh have a direction
that may turn, but no length."""


@dataclass(frozen=True)
class MeshForm:
    """The triangles of a mesh, in its own space.

    Attributes
    ----------
    points : (3, n) float64.  corners : (3, t) int64, vertices of the triangles.
    slot : (t,) int64, material slots.
    normals : (3, 3, t) float64, corner and component; None where all faces are flat.
    """

    points: NDArray[np.float64]
    corners: NDArray[np.int64]
    slot: NDArray[np.int64]
    normals: NDArray[np.float64] | None


def triangle_form(mesh: Any) -> MeshForm:
    """Return the triangles of a Blender mesh."""
    points = np.ascontiguousarray(points_of(mesh).T, dtype=np.float64)
    corners, owner = triangles_of(mesh)
    normals = None
    if mesh.normals_domain != "FACE":  # else each triangle has a normal of its own, as in Cycles
        loops = np.empty((corners.shape[1], 3), dtype=np.int32)
        mesh.loop_triangles.foreach_get("loops", loops.ravel())
        every = np.empty((len(mesh.loops), 3), dtype=np.float32)
        mesh.corner_normals.foreach_get("vector", every.ravel())
        normals = np.ascontiguousarray(every[loops].transpose(1, 2, 0), dtype=np.float64)
    slot = material_indices(mesh)[owner].astype(np.int64)
    return MeshForm(points, corners, slot, normals)


def placed_mesh(
    form: MeshForm,
    track: Track,
    materials: Mapping[int, Material],
    name: str,
    issues: list[Issue],
) -> list[TriangleMesh]:
    """Return a mesh where a track places it; none, and an issue, where that cannot be.

    Parameters
    ----------
    materials : by the numbers of their slots.
    """
    linear = track.middle[:3, :3]
    used = form.points[:, np.unique(form.corners)]
    low, high = used.min(axis=1), used.max(axis=1)
    middle = (low + high) / 2.0
    # a point in the middle is followed; the axes of the box around the mesh tell how it turns
    path = path_of(track, vector_of(middle), np.diag(np.maximum(high - low, LEAST_EXTENT)))
    if path.reason:
        issues.append(Issue(name, path.reason))
    points = np.array(path.position)[:, None] + linear @ (form.points - middle[:, None])
    a, b, c = (points[:, each] for each in form.corners)
    if not np.cross(b - a, c - a, axis=0).any():
        issues.append(Issue(name, NO_SCALE, missing=True))
        return []
    corners, normals = form.corners, _turned_normals(form.normals, linear)
    if np.linalg.det(linear) < 0.0:
        # a mirrored mesh keeps its outer side
        corners = corners[::-1]
        normals = None if normals is None else normals[::-1]
    slots, slot = np.unique(form.slot, return_inverse=True)
    worn = tuple(materials[each] for each in slots.tolist())
    faces = np.ascontiguousarray(corners)
    return [TriangleMesh(points, faces, slot, worn, normals, None, path.motion, name)]


def _turned_normals(normals: Matrix | None, linear: Matrix) -> Matrix | None:
    """Return normals (3, 3, t) as a linear map of the surface turns them."""
    if normals is None:
        return None
    # the cofactors are the inverse transposed, up to a factor, and exist for maps without inverse
    a, b, c = linear.T
    turn = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
    turn *= 1.0 if np.linalg.det(linear) >= 0.0 else -1.0
    found = np.array([turn @ corner for corner in normals])
    length = np.linalg.norm(found, axis=1, keepdims=True)
    placed: Matrix = found / np.where(length > 0.0, length, 1.0)
    return placed
