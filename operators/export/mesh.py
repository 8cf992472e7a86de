# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that are spheres or parallelograms, placed in the world."""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np

from ...adaptive_drt.recognise import Ball, Parallelogram, recognise
from ...adaptive_drt.scene import Issue, Material, Quad, Shape, Sphere, Vector
from .shutter import Matrix, Track, path_of

UNIFORM = 1e-5
"""Of the scale: less difference between the axes is float32's rounding."""


Form = Ball | Parallelogram | str
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
    digest = hashlib.blake2b(points, digest_size=16)
    digest.update(corners)
    digest.update(starts)
    key = digest.digest()
    if key not in known:
        known[key] = recognise(
            np.ascontiguousarray(points.reshape(-1, 3).T, dtype=np.float64),
            corners.astype(np.int64),
            starts.astype(np.int64),
        )
    return known[key]


def shape_of(
    form: Ball | Parallelogram, track: Track, material: Material, name: str, issues: list[Issue]
) -> Shape | None:
    """Return the shape of a mesh placed by a track, or None with an issue that says why not."""
    linear = track.middle[:3, :3]
    if not np.isfinite(track.middle).all():
        issues.append(Issue(name, "its matrix is not finite: check its location and scale"))
        return None
    if not linear.any() or _flat(linear, form):
        issues.append(Issue(name, "its scale is zero"))
        return None
    if isinstance(form, Ball):
        return _sphere(form, track, material, name, issues)
    return _quad(form, track, material, name, issues)


def _flat(linear: Matrix, form: Ball | Parallelogram) -> bool:
    if isinstance(form, Ball):
        return bool((np.linalg.norm(linear, axis=0) == 0.0).any())
    return not np.cross(linear @ form.edge_u, linear @ form.edge_v).any()


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


def _quad(
    form: Parallelogram, track: Track, material: Material, name: str, issues: list[Issue]
) -> Quad:
    edges = np.array([form.edge_u, form.edge_v]).T
    # its centre stays put when it turns, so that is the point to follow
    middle = np.array(form.corner) + edges.sum(axis=1) / 2.0
    path = path_of(track, _vector(middle), edges)
    if path.reason:
        issues.append(Issue(name, path.reason))
    edge_u, edge_v = (track.middle[:3, :3] @ edges).T
    corner = np.array(path.position) - (edge_u + edge_v) / 2.0
    return Quad(_vector(corner), _vector(edge_u), _vector(edge_v), material, path.motion, name)


def _vector(array: Matrix) -> Vector:
    x, y, z = array.tolist()
    return (x, y, z)
