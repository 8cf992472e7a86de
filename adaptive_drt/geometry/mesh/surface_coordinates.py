# SPDX-License-Identifier: GPL-3.0-or-later
"""Texture coordinates of points on meshes: UV, generated and object coordinates, as in Blender.

They are computed for the hits that ask for them only; nothing is kept for those that do not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...numerics.arrays import Array, Ints
from ...numerics.gather import columns
from ...scene.triangle_mesh import TriangleMesh
from .faces import barycentric

__all__ = ["SurfaceCoordinates", "surface_coordinates"]


@dataclass(frozen=True)
class SurfaceCoordinates:
    """Coordinates of n points on a mesh.

    Attributes
    ----------
    own : (3, n) in the mesh's own space: Blender's object coordinates.
    generated : (3, n) from 0 to 1 along each side of the box around the mesh; 0.5 where it is flat.
    uv : (2, n) by its UV map; None if it has none.
    """

    own: Array
    generated: Array
    uv: Array | None


def surface_coordinates(mesh: TriangleMesh, face: Ints, point: Array) -> SurfaceCoordinates:
    """Coordinates of points (3, n) of a mesh's own space, that lie on its faces (n,)."""
    corners = [columns(mesh.vertices, each[face]) for each in mesh.faces]
    used = columns(mesh.vertices, np.unique(mesh.faces))
    low, high = used.min(axis=1)[:, None], used.max(axis=1)[:, None]
    flat = high <= low
    generated = np.where(flat, 0.5, (point - low) / np.where(flat, 1.0, high - low))
    uv = None
    if mesh.uv is not None:
        uv = np.zeros((2, face.size))
        for share, each in zip(barycentric(point, corners), range(3), strict=True):
            uv += share * mesh.uv[:, each, face]
    return SurfaceCoordinates(point, generated, uv)
