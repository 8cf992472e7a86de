# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes as they are: all their triangles, with the normals that Blender shades them with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...adaptive_drt.scene.description import Issue, Material, vector_of
from ...adaptive_drt.scene.mesh_instances import MeshInstances, is_regular
from ...adaptive_drt.scene.triangle_mesh import TriangleMesh
from .mesh import NO_SCALE, material_indices, points_of, triangles_of
from .shutter import Matrix, Track, matrices_of, path_of

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
    uv : (2, 3, t) float64, component and corner, of the UV map that is rendered; None for none.
    """

    points: NDArray[np.float64]
    corners: NDArray[np.int64]
    slot: NDArray[np.int64]
    normals: NDArray[np.float64] | None
    uv: NDArray[np.float64] | None = None


def triangle_form(mesh: Any) -> MeshForm:
    """Return the triangles of a Blender mesh."""
    points = np.ascontiguousarray(points_of(mesh).T, dtype=np.float64)
    corners, owner = triangles_of(mesh)
    loops = np.empty((corners.shape[1], 3), dtype=np.int32)
    mesh.loop_triangles.foreach_get("loops", loops.ravel())
    normals = None
    if mesh.normals_domain != "FACE":  # else each triangle has a normal of its own, as in Cycles
        every = np.empty((len(mesh.loops), 3), dtype=np.float32)
        mesh.corner_normals.foreach_get("vector", every.ravel())
        normals = np.ascontiguousarray(every[loops].transpose(1, 2, 0), dtype=np.float64)
    slot = material_indices(mesh)[owner].astype(np.int64)
    return MeshForm(points, corners, slot, normals, _rendered_uv(mesh, loops))


def _rendered_uv(mesh: Any, loops: NDArray[np.int32]) -> NDArray[np.float64] | None:
    """Return the coordinates (2, 3, t) of the UV map that Blender renders with, or None.

    loops : (t, 3) the mesh's corners that are the corners of the triangles.
    """
    layer = next((each for each in mesh.uv_layers if each.active_render), None)
    if layer is None or not len(mesh.loops):
        return None
    every = np.empty((len(mesh.loops), 2), dtype=np.float32)
    mesh.attributes[layer.name].data.foreach_get("vector", every.ravel())
    return np.ascontiguousarray(every[loops].transpose(2, 1, 0), dtype=np.float64)


def placed_mesh(
    form: MeshForm,
    track: Track,
    materials: Mapping[int, Material],
    name: str,
    issues: list[Issue],
) -> list[TriangleMesh | MeshInstances]:
    """Return a mesh where a track places it; none, and an issue, where that cannot be.

    A mesh that does more than move straight is an instance of itself, with matrices of its own.

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
    if path.reason and is_regular(linear[:, :, None])[0]:
        mesh, worn = own_mesh(form, materials)
        return [MeshInstances(mesh, matrices_of([track]), worn, name=name)]
    if path.reason:
        issues.append(Issue(name, path.reason))
    points = np.array(path.position)[:, None] + linear @ (form.points - middle[:, None])
    a, b, c = (points[:, each] for each in form.corners)
    if not np.cross(b - a, c - a, axis=0).any():
        issues.append(Issue(name, NO_SCALE, missing=True))
        return []
    corners, normals = form.corners, _turned_normals(form.normals, linear)
    if mirrored := bool(np.linalg.det(linear) < 0.0):
        # a mirrored mesh keeps its outer side
        corners = corners[::-1]
        normals = None if normals is None else normals[::-1]
    slots, slot = np.unique(form.slot, return_inverse=True)
    worn = tuple(materials[each] for each in slots.tolist())
    faces = np.ascontiguousarray(corners)
    uv = form.uv
    if uv is not None and mirrored:
        uv = np.ascontiguousarray(uv[:, ::-1])
    return [TriangleMesh(points, faces, slot, worn, normals, uv, path.motion, name)]


def vanishes(form: MeshForm, track: Track) -> bool:
    """Whether no face of a mesh has an area at the middle of the shutter."""
    linear = track.middle[:3, :3]
    if is_regular(linear[:, :, None])[0] and form.corners.size:
        return False
    a, b, c = (linear @ form.points[:, each] for each in form.corners)
    return not np.cross(b - a, c - a, axis=0).any()


def own_mesh(
    form: MeshForm, materials: Mapping[int, Material]
) -> tuple[TriangleMesh, tuple[Material, ...]]:
    """Return a mesh in its own space, and the materials of its slots, by their numbers."""
    slots, slot = np.unique(form.slot, return_inverse=True)
    worn = tuple(materials[each] for each in slots.tolist())
    return TriangleMesh(form.points, form.corners, slot, worn, form.normals, form.uv), worn


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
