# SPDX-License-Identifier: GPL-3.0-or-later
"""How a mesh is shaded, where that is not how its form is rendered."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...adaptive_drt.scene.cylinder_recognition import MeshCylinder
from ...adaptive_drt.scene.primitive_recognition import Facets, MeshSphere
from .mesh import Indices, faces_of, points_of

BENT = 1e-3
"""Radians, about: a normal that is less off its face's own is rounding."""

SLIVER = 1e-4
"""Area over the square of its length: of a narrower face float32 leaves no normal."""

TURNED_ASIDE = 0.05
"""Radians, about: custom normals of a ball that are less off its own are not told."""

FACETED = 0.006
"""Of the radius: how far below the sphere a flat-shaded face may lie and not be told. A UV sphere
of 32 x 16 has 0.010, and its picture is 4 % off Cycles' (root mean square of a ball that fills a
third of it); one of 48 x 24 has 0.004 and is 2 % off."""

COARSE = 0.012
"""The same of a smooth-shaded one, of which only the outline shows its faces: 2 % at 0.010 (UV
sphere of 32 x 16), 6 % at 0.018 (icosphere of subdivision 3)."""

SMOOTH = "its smooth shading is left out: its faces are rendered flat, as they are"
CUSTOM = "its custom normals are left out: its faces are rendered flat, as they are"
CUSTOM_BALL = "its custom normals are left out: it is rendered as a sphere"
FACETS = "its faceted outline is left out: it is rendered as a sphere (Effects > Spheres)"
FLAT_FACETS = "its facets are left out: it is rendered as a smooth sphere (Effects > Spheres)"

CYLINDER_FACETS = (
    "its faceted outline is left out: it is rendered as a cylinder (Effects > Spheres)"
)

Vectors = NDArray[np.floating[Any]]


def shading_left_out(mesh: Any, form: MeshSphere | Facets) -> str:
    """Return what of a Blender mesh's shading its form lacks, or ""."""
    points, (corners, starts) = points_of(mesh), faces_of(mesh)
    sizes = np.diff(starts, append=len(corners))
    places = points[corners].astype(np.float64)
    normals, wide = _face_normals(places, starts, sizes)
    face = np.repeat(normals, sizes, axis=0)
    corner = np.empty((len(corners), 3), dtype=np.float32)
    mesh.corner_normals.foreach_get("vector", corner.ravel())
    bent = (np.abs(corner - face).max(axis=1) > BENT) & np.repeat(wide, sizes)
    if isinstance(form, MeshSphere):
        own = (places - np.array(form.center)) / form.radius
        is_flat = not np.logical_or.reduceat(bent, starts).all()
        custom = corner if mesh.has_custom_normals and bent.any() else None
        return _of_ball(own, face, custom, is_flat)
    if not bent.any():
        return ""
    return CUSTOM if mesh.has_custom_normals else SMOOTH


def is_round(mesh: Any, form: MeshCylinder) -> bool:
    """Whether a Blender mesh in the form of a cylinder or cone is shaded as one.

    Its side has the normals of that, its ends are flat.
    """
    points, (corners, starts) = points_of(mesh), faces_of(mesh)
    sizes = np.diff(starts, append=len(corners))
    start, axis = np.array(form.start), np.subtract(form.end, form.start)
    length = float(np.linalg.norm(axis))
    axis = axis / length
    places = points[corners].astype(np.float64) - start
    height = places @ axis
    out = places - height[:, None] * axis
    if form.end_radius == 0.0:
        # at an apex the direction is that of the middle of the face
        middle = np.add.reduceat(out, starts, axis=0).repeat(sizes, axis=0)
        out = np.where((np.linalg.norm(out, axis=1) > 0.5 * form.radius)[:, None], out, middle)
    size = np.linalg.norm(out, axis=1)
    own = out / np.where(size > 0.0, size, 1.0)[:, None]
    last = form.radius if form.end_radius is None else form.end_radius
    slope = (last - form.radius) / length
    own = (own - slope * axis) / math.sqrt(1.0 + slope * slope)
    spans = np.maximum.reduceat(height, starts) - np.minimum.reduceat(height, starts)
    own[~np.repeat(spans > 0.5 * length, sizes)] = axis
    normal = np.empty((len(corners), 3), dtype=np.float32)
    mesh.corner_normals.foreach_get("vector", normal.ravel())
    signs = np.sign((normal * own).sum(axis=1))[:, None]
    return bool(np.abs(normal - signs * own).max() <= TURNED_ASIDE)


def facets_left_out(form: MeshCylinder) -> tuple[str, ...]:
    """Return what of a mesh's outline its cylinder lacks."""
    return (CYLINDER_FACETS,) if 1.0 - math.cos(math.pi / form.sides) > COARSE else ()


def _face_normals(
    places: Vectors, starts: Indices, sizes: Indices
) -> tuple[Vectors, NDArray[np.bool_]]:
    """Return the faces' own normals (f, 3), and whether each face is wide enough to have one.

    From 4.5 on Blender's may be custom ones.

    Parameters
    ----------
    places : (c, 3), of the faces' corners, face after face.
    """
    edges = places - np.repeat(places[starts], sizes, axis=0)
    following = np.arange(1, len(edges) + 1)
    following[starts + sizes - 1] = starts
    normals = np.add.reduceat(np.cross(edges, edges[following]), starts, axis=0)
    length = np.linalg.norm(normals, axis=1)
    longest = np.maximum.reduceat((edges * edges).sum(axis=1), starts)
    return normals / np.where(length > 0.0, length, 1.0)[:, None], length > SLIVER * longest


def _of_ball(own: Vectors, face: Vectors, custom: Vectors | None, is_flat: bool) -> str:
    """Return the same of a sphere; all vectors are those of its faces' corners, (c, 3).

    Parameters
    ----------
    own : the sphere's normals there.
    face : normals of the faces.
    custom : the normals that the mesh states; None where they are its own.
    is_flat : whether a face is shaded flat.
    """
    # distances of the faces' planes from the centre, below 0 where faces look inwards
    depths = (own * face).sum(axis=1)
    if custom is not None:
        aside = custom - np.sign(depths)[:, None] * own
        if float(np.abs(aside).max()) > TURNED_ASIDE:
            return CUSTOM_BALL
    below = 1.0 - float(np.abs(depths).min())
    if is_flat:
        return FLAT_FACETS if below > FACETED else ""
    return FACETS if below > COARSE else ""
