# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that are spheres or made of parallelograms, placed in the world."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...adaptive_drt.recognise import Ball, Parallelogram, recognise
from ...adaptive_drt.scene import Issue, Material, Quad, Shape, Sphere, vector_of
from .shutter import Matrix, Track, path_of

Indices = NDArray[np.int32]

UNIFORM = 1e-5
"""Of the scale: less difference between the axes is float32's rounding."""

BENT = 1e-3
"""Radians, about: a normal that is less off its face's own is rounding."""

Flats = tuple[Parallelogram, ...]
Form = Ball | Flats | str
"""What a mesh stands for, in its own space, or why it is left out."""


def mesh_form(mesh: Any, known: dict[bytes, Form]) -> Form:
    """Return what a Blender mesh stands for.

    Parameters
    ----------
    known : forms by the mesh's content; a copy is looked up here, which is faster than to tell
        its form anew.
    """
    points = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
    corners = np.empty(len(mesh.loops), dtype=np.int32)
    starts = np.empty(len(mesh.polygons), dtype=np.int32)
    mesh.vertices.foreach_get("co", points)
    mesh.loops.foreach_get("vertex_index", corners)
    mesh.polygons.foreach_get("loop_start", starts)
    slots = _material_indices(mesh)
    digest = hashlib.blake2b(points, digest_size=16)
    digest.update(corners)
    digest.update(starts)
    digest.update(slots)
    key = digest.digest()
    if key not in known:
        known[key] = recognise(
            np.ascontiguousarray(points.reshape(-1, 3).T, dtype=np.float64),
            corners.astype(np.int64),
            starts.astype(np.int64),
            slots.astype(np.int64),
        )
    return known[key]


def wears_several(mesh: Any) -> bool:
    """Whether the faces of a Blender mesh wear different materials."""
    return bool(np.ptp(_material_indices(mesh)))


def _material_indices(mesh: Any) -> Indices:
    """Return the material slot (faces,) that each face wears."""
    indices = np.zeros(len(mesh.polygons), dtype=np.int32)
    mesh.polygons.foreach_get("material_index", indices)
    return np.clip(indices, 0, max(len(mesh.materials) - 1, 0))


def is_smooth(mesh: Any) -> bool:
    """Whether a Blender mesh shades its faces as if they were curved."""
    corner = np.empty((len(mesh.loops), 3), dtype=np.float32)
    face = np.empty((len(mesh.polygons), 3), dtype=np.float32)
    sizes = np.empty(len(mesh.polygons), dtype=np.int32)
    mesh.corner_normals.foreach_get("vector", corner.ravel())
    mesh.polygon_normals.foreach_get("vector", face.ravel())
    mesh.polygons.foreach_get("loop_total", sizes)
    return bool(np.abs(corner - np.repeat(face, sizes, axis=0)).max(initial=0.0) > BENT)


def shapes_of(
    form: Ball | Flats,
    track: Track,
    materials: Mapping[int, Material],
    name: str,
    issues: list[Issue],
) -> list[Shape]:
    """Return the shapes of a mesh placed by a track; none, and an issue, where that cannot be.

    Parameters
    ----------
    materials : by the numbers of their slots.
    """
    linear = track.middle[:3, :3]
    if not np.isfinite(track.middle).all():
        issues.append(Issue(name, "its matrix is not finite: check its location and scale"))
        return []
    if isinstance(form, Ball):
        if linear.any(axis=0).all():
            sphere = _sphere(form, track, materials[form.slot], name, issues)
            return [] if sphere is None else [sphere]
    else:
        quads = _quads(form, track, materials, name, issues)
        if quads:
            return quads
    issues.append(Issue(name, "its scale is zero"))
    return []


def uniform_scale(linear: Matrix) -> float | None:
    """Return the one scale of a 3 x 3 matrix that turns, mirrors and scales, or None."""
    metric = linear.T @ linear
    square = float(np.trace(metric)) / 3.0
    if float(np.abs(metric - square * np.eye(3)).max()) > 2.0 * UNIFORM * square:
        return None
    return float(np.sqrt(square))


def _sphere(
    form: Ball, track: Track, material: Material, name: str, issues: list[Issue]
) -> Sphere | None:
    scale = uniform_scale(track.middle[:3, :3])
    if scale is None:
        x, y, z = np.linalg.norm(track.middle[:3, :3], axis=0)
        if uniform_scale(np.diag([x, y, z])) is None:
            said = f"it is scaled by {x:.4g}, {y:.4g}, {z:.4g}, which makes no sphere"
        else:
            said = "its parents shear it, which makes no sphere"
        issues.append(Issue(name, f"{said}; scale all axes alike"))
        return None
    # a sphere may turn freely, so only its size could show: one direction's length stands for it
    path = path_of(track, form.center)
    reason = path.reason
    if track.opens is not None and track.closes is not None:
        sized = Track(_sized(track.middle), _sized(track.opens), _sized(track.closes))
        reason = path_of(sized, shape=np.eye(3)).reason or reason
    if reason:
        issues.append(Issue(name, reason))
    return Sphere(path.position, form.radius * scale, material, path.motion, name)


def _sized(matrix: Matrix) -> Matrix:
    """Return the matrix that only scales, as another does along its own axes."""
    sized = np.eye(4)
    sized[:3, :3] = np.diag(np.linalg.norm(matrix[:3, :3], axis=0))
    return sized


def _quads(
    form: Flats, track: Track, materials: Mapping[int, Material], name: str, issues: list[Issue]
) -> list[Shape]:
    """Return those that have an area where the track places them."""
    corner, u, v = np.array([(p.corner, p.edge_u, p.edge_v) for p in form]).transpose(1, 2, 0)
    center = corner + (u + v) / 2.0
    # their middle stays put when they turn about it, so that is the point to follow for all
    middle = center.mean(axis=1)
    path = path_of(track, vector_of(middle), np.hstack([u, v]))
    linear = track.middle[:3, :3]
    u, v = linear @ u, linear @ v
    place = np.array(path.position)[:, None] + linear @ (center - middle[:, None]) - (u + v) / 2.0
    shown = np.cross(u, v, axis=0).any(axis=0).nonzero()[0].tolist()
    if shown and path.reason:
        issues.append(Issue(name, path.reason))
    return [
        Quad(
            vector_of(place[:, i]),
            vector_of(u[:, i]),
            vector_of(v[:, i]),
            materials[form[i].slot],
            path.motion,
            name,
        )
        for i in shown
    ]
