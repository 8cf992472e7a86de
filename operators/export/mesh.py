# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes as spheres and cylinders, or as the parallelograms and triangles that they are made of, in
the world."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...adaptive_drt.scene.cylinder_recognition import MeshCylinder, recognise_cylinder
from ...adaptive_drt.scene.description import (
    Cylinder,
    Ellipsoid,
    Issue,
    Material,
    Quads,
    ShapeRecord,
    Sphere,
    Triangles,
    vector_of,
)
from ...adaptive_drt.scene.planar_facets import MAX_TRIANGLES
from ...adaptive_drt.scene.primitive_recognition import (
    Facets,
    MeshSphere,
    MeshTriangles,
    Parallelograms,
    recognise_primitive,
)
from .shutter import Matrix, Path, Track, path_of

Indices = NDArray[np.int32]

UNIFORM = 1e-5
"""Of the scale: less difference between the axes is float32's rounding."""

COLLAPSED = 1e-6
"""Of the largest scale: a smaller one along another direction is float32's zero."""

NOT_FINITE = "its matrix is not finite: check its location and scale"
NO_SCALE = "its scale is zero"
COLLAPSES = "its scale is zero along one axis, which makes no sphere: scale all axes alike"

FLAT = 2.0**-40
"""Sine of the angle between two edges of a placed triangle up to which it has no area."""

Form = MeshSphere | MeshCylinder | Facets | str
"""What a mesh stands for, in its own space, or why it is left out."""


@dataclass(frozen=True)
class Layout:
    """A copy of what tells a mesh's form.

    Attributes
    ----------
    points : (n, 3) float32, vertices.
    faces : digest of which vertices each face joins.
    """

    points: NDArray[np.float32]
    faces: bytes


def layout_of(mesh: Any) -> Layout:
    """Return the layout of a Blender mesh."""
    return Layout(points_of(mesh), digest_of(*faces_of(mesh)))


# Attributes are read some 100 times as fast as the properties of vertices, loops and faces.


def points_of(mesh: Any) -> NDArray[np.float32]:
    """Return the vertices (n, 3) of a Blender mesh."""
    points = np.empty((len(mesh.vertices), 3), dtype=np.float32)
    if len(points):
        mesh.attributes["position"].data.foreach_get("vector", points.ravel())
    return points


def faces_of(mesh: Any) -> tuple[Indices, Indices]:
    """Return the vertex of each corner (c,) and the first corner of each face (f,)."""
    corners = np.empty(len(mesh.loops), dtype=np.int32)
    starts = np.empty(len(mesh.polygons), dtype=np.int32)
    if len(corners):
        mesh.attributes[".corner_vert"].data.foreach_get("value", corners)
    mesh.polygons.foreach_get("loop_start", starts)
    return corners, starts


def mesh_form(
    mesh: Any, layout: Layout, known: dict[bytes, Form], most_triangles: int = MAX_TRIANGLES
) -> Form:
    """Return what a Blender mesh stands for.

    Parameters
    ----------
    layout : the mesh's own.
    known : forms by the mesh's content; a copy is looked up here, which is faster than to tell
        its form anew.
    most_triangles : number of triangles above which a mesh has no facets.
    """
    slots = material_indices(mesh)
    key = digest_of(layout.points, slots) + layout.faces + b"%d" % most_triangles
    if key not in known:
        corners, starts = faces_of(mesh)
        known[key] = recognise_primitive(
            np.ascontiguousarray(layout.points.T, dtype=np.float64),
            corners.astype(np.int64),
            starts.astype(np.int64),
            slots.astype(np.int64),
            triangles_of(mesh),
            most_triangles,
        )
    return known[key]


def cylinder_of(mesh: Any, layout: Layout) -> MeshCylinder | None:
    """Return the cylinder or cone whose form a Blender mesh has, or None."""
    return recognise_cylinder(
        np.ascontiguousarray(layout.points.T, dtype=np.float64),
        *(each.astype(np.int64) for each in (*faces_of(mesh), material_indices(mesh))),
    )


def triangles_of(mesh: Any) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the vertices (3, t) of the triangles that Blender draws, and the face (t,) of each."""
    mesh.calc_loop_triangles()
    vertices = np.empty((len(mesh.loop_triangles), 3), dtype=np.int32)
    faces = np.empty(len(vertices), dtype=np.int32)
    mesh.loop_triangles.foreach_get("vertices", vertices.ravel())
    mesh.loop_triangles.foreach_get("polygon_index", faces)
    return np.ascontiguousarray(vertices.T, dtype=np.int64), faces.astype(np.int64)


def digest_of(*arrays: NDArray[Any]) -> bytes:
    """Return a digest of the content of arrays."""
    digest = hashlib.blake2b(digest_size=16)
    for array in arrays:
        digest.update(array)
    return digest.digest()


def wears_several(mesh: Any) -> bool:
    """Whether the faces of a Blender mesh wear different materials."""
    return bool(np.ptp(material_indices(mesh)))


def material_indices(mesh: Any) -> Indices:
    """Return the material slot (faces,) that each face wears."""
    indices = np.zeros(len(mesh.polygons), dtype=np.int32)
    attribute = mesh.attributes.get("material_index")  # not there while all are 0
    if attribute is not None and (attribute.domain, attribute.data_type) == ("FACE", "INT"):
        attribute.data.foreach_get("value", indices)
    return np.clip(indices, 0, max(len(mesh.materials) - 1, 0))


def shapes_of(
    form: MeshSphere | MeshCylinder | Facets,
    track: Track,
    materials: Mapping[int, Material],
    name: str,
    issues: list[Issue],
) -> list[ShapeRecord]:
    """Return the shapes of a mesh placed by a track; none, and an issue, where that cannot be.

    Parameters
    ----------
    materials : by the numbers of their slots.
    """
    linear = track.middle[:3, :3]
    if isinstance(form, MeshCylinder):
        return [_cylinder(form, track, materials[form.slot], name, issues)]
    if not isinstance(form, MeshSphere):
        facets = _facets(form, track, materials, name, issues)
        if not facets:
            issues.append(Issue(name, NO_SCALE, missing=True))
        return facets
    scale = uniform_scale(linear)
    if is_stretched(track.middle):
        return [_ellipsoid(form, track, materials[form.slot], name, issues)]
    if not scale:
        issues.append(Issue(name, _no_sphere(linear), missing=True))
        return []
    return [_sphere(form, scale, track, materials[form.slot], name, issues)]


def turns(form: MeshSphere | MeshCylinder | Facets, track: Track) -> bool:
    """Whether a mesh that stands for other shapes turns or grows so that it shows."""
    if track.opens is None or track.closes is None:
        return False
    if isinstance(form, MeshCylinder):
        # it may spin about its axis: the axis and the length of a radius show
        axis, radius, _ = _axes(form)
        times = track.middle, track.opens, track.closes
        still, sized = Track(*map(_linear, times)), [_length_along(each, radius) for each in times]
        return (
            path_of(still, shape=axis[:, None]).reason is not None
            or path_of(Track(*sized), shape=np.eye(3)).reason is not None
        )
    if isinstance(form, MeshSphere):
        seen = track if is_stretched(track.middle) else _sized_track(track)
        still = Track(*(_linear(each) for each in (seen.middle, seen.opens, seen.closes)))
        return path_of(still, shape=np.eye(3)).reason is not None
    flat, cut = form.parallelograms, form.triangles
    a, b, c = (cut.points[:, each] for each in cut.corners)
    still = Track(*(_linear(each) for each in (track.middle, track.opens, track.closes)))
    edges = np.hstack([flat.edge_u, flat.edge_v, b - a, c - a])
    return path_of(still, shape=edges).reason is not None


def _linear(matrix: Matrix) -> Matrix:
    """Return a matrix without its location."""
    placed = np.eye(4)
    placed[:3, :3] = matrix[:3, :3]
    return placed


def uniform_scale(linear: Matrix) -> float | None:
    """Return the one scale of a 3 x 3 matrix that turns, mirrors and scales, or None."""
    metric = linear.T @ linear
    square = float(np.trace(metric)) / 3.0
    if float(np.abs(metric - square * np.eye(3)).max()) > 2.0 * UNIFORM * square:
        return None
    return float(np.sqrt(square))


def stays_cylinder(form: MeshCylinder, matrix: Matrix) -> bool:
    """Whether a 4 x 4 matrix makes a right circular cylinder of one."""
    if not np.isfinite(matrix).all():
        return False
    axis, one, other = (matrix[:3, :3] @ each for each in _axes(form))
    size = float(np.linalg.norm(one))
    length = float(np.linalg.norm(axis))
    if not min(size, length) > COLLAPSED * max(size, length):
        return False
    slants = abs(one @ other), size * abs(axis @ one) / length, size * abs(axis @ other) / length
    uneven = abs(float(other @ other) - size * size)
    return max(uneven, *map(float, slants)) <= 2.0 * UNIFORM * size * size


def _axes(form: MeshCylinder) -> tuple[Matrix, Matrix, Matrix]:
    """The axis (3,) from end to end of a cylinder, and two radii across it and each other."""
    axis = np.subtract(form.end, form.start)
    away = np.zeros(3)
    away[np.argmin(np.abs(axis))] = 1.0
    one = np.cross(axis, away)
    one *= form.radius / np.linalg.norm(one)
    return axis, one, np.cross(axis / np.linalg.norm(axis), one)


def _length_along(matrix: Matrix, vector: Matrix) -> Matrix:
    """Return the matrix that scales all alike, as much as another one does a vector (3,)."""
    sized = np.eye(4)
    sized[:3, :3] *= np.linalg.norm(matrix[:3, :3] @ vector) / np.linalg.norm(vector)
    return sized


def _cylinder(
    form: MeshCylinder, track: Track, material: Material, name: str, issues: list[Issue]
) -> Cylinder:
    """Return the cylinder or cone; its middle is the point that is followed."""
    axis, radius, _ = (track.middle[:3, :3] @ each for each in _axes(form))
    path = path_of(track, vector_of(np.add(form.start, form.end) / 2.0))
    if path.reason:
        issues.append(Issue(name, path.reason))
    middle = np.array(path.position)
    start, end = vector_of(middle - axis / 2.0), vector_of(middle + axis / 2.0)
    size, last = float(np.linalg.norm(radius)), form.end_radius
    narrow = None if last is None else size * last / form.radius
    return Cylinder(start, end, size, material, path.motion, name, end_radius=narrow)


def is_stretched(matrix: Matrix) -> bool:
    """Whether a 4 x 4 matrix makes an ellipsoid of a sphere."""
    linear = matrix[:3, :3]
    if not np.isfinite(matrix).all() or uniform_scale(linear) is not None:
        return False
    largest, _, least = np.linalg.svd(linear, compute_uv=False)
    return bool(least > COLLAPSED * largest)


def _no_sphere(linear: Matrix) -> str:
    """Return why a finite 3 x 3 matrix that flattens a sphere makes none of it."""
    largest, middle, _ = np.linalg.svd(linear, compute_uv=False)
    return NO_SCALE if middle <= COLLAPSED * largest else COLLAPSES


def _sphere(
    form: MeshSphere, scale: float, track: Track, material: Material, name: str, issues: list[Issue]
) -> Sphere:
    # a sphere may turn freely, so only its size could show: one direction's length stands for it
    path = path_of(track, form.center)
    reason = path.reason
    if track.opens is not None and track.closes is not None:
        reason = path_of(_sized_track(track), shape=np.eye(3)).reason or reason
    if reason:
        issues.append(Issue(name, reason))
    return Sphere(path.position, form.radius * scale, material, path.motion, name)


def _ellipsoid(
    form: MeshSphere, track: Track, material: Material, name: str, issues: list[Issue]
) -> Ellipsoid:
    """Return a sphere that a matrix stretches or shears."""
    path = path_of(track, form.center, np.eye(3))
    if path.reason:
        issues.append(Issue(name, path.reason))
    axes = (vector_of(form.radius * axis) for axis in track.middle[:3, :3].T)
    return Ellipsoid(path.position, *axes, material, path.motion, name)


def _sized_track(track: Track) -> Track:
    """Return a track of the scale alone, which is sampled at the ends of the shutter, too."""
    assert track.opens is not None and track.closes is not None
    return Track(_sized(track.middle), _sized(track.opens), _sized(track.closes))


def _sized(matrix: Matrix) -> Matrix:
    """Return the matrix that only scales, as another does along its own axes."""
    sized = np.eye(4)
    sized[:3, :3] = np.diag(np.linalg.norm(matrix[:3, :3], axis=0))
    return sized


def _facets(
    form: Facets,
    track: Track,
    materials: Mapping[int, Material],
    name: str,
    issues: list[Issue],
) -> list[ShapeRecord]:
    """Return those that have an area where the track places them."""
    flat, cut = form.parallelograms, form.triangles
    a, b, c = (cut.points[:, each] for each in cut.corners)
    center = flat.corner + (flat.edge_u + flat.edge_v) / 2.0
    # their middle stays put when they turn about it, so that is the point to follow for all
    middle = np.hstack([center, (a + b + c) / 3.0]).mean(axis=1)
    path = path_of(track, vector_of(middle), np.hstack([flat.edge_u, flat.edge_v, b - a, c - a]))
    batches = [
        _quads(flat, middle, track, path, materials, name),
        _triangles(cut, middle, track, path, materials, name),
    ]
    found: list[ShapeRecord] = [each for each in batches if each.count]
    if found and path.reason:
        issues.append(Issue(name, path.reason))
    return found


def _quads(
    form: Parallelograms,
    middle: Matrix,
    track: Track,
    path: Path,
    materials: Mapping[int, Material],
    name: str,
) -> Quads:
    """Return the parallelograms that have an area.

    Parameters
    ----------
    middle : the point (3,) of the mesh's space that is followed.
    """
    u, v = form.edge_u, form.edge_v
    center = form.corner + (u + v) / 2.0
    linear = track.middle[:3, :3]
    u, v = linear @ u, linear @ v
    place = np.array(path.position)[:, None] + linear @ (center - middle[:, None]) - (u + v) / 2.0
    shown = np.cross(u, v, axis=0).any(axis=0).nonzero()[0]
    slot, worn = _worn(form.slot, materials)
    return Quads(place, u, v, slot, worn, path.motion, name).take(shown)


def _triangles(
    form: MeshTriangles,
    middle: Matrix,
    track: Track,
    path: Path,
    materials: Mapping[int, Material],
    name: str,
) -> Triangles:
    """Return the triangles that have an area; those that share a point have the very same one."""
    local = track.middle[:3, :3] @ (form.points - middle[:, None])
    points = np.array(path.position)[:, None] + local
    slot, worn = _worn(form.slot, materials)
    vertices = np.ascontiguousarray(points[:, form.corners].transpose(1, 0, 2))
    found = Triangles(vertices, slot, worn, path.motion, name)
    u, v = found.edges()
    area = np.linalg.norm(np.cross(u, v, axis=0), axis=0)
    wide = area > FLAT * np.linalg.norm(u, axis=0) * np.linalg.norm(v, axis=0)
    return found.take(wide.nonzero()[0])


def _worn(
    slot: NDArray[np.int64], materials: Mapping[int, Material]
) -> tuple[NDArray[np.int64], tuple[Material, ...]]:
    """Return the materials that are worn, and the index (n,) among them of each facet's."""
    slots, index = np.unique(slot, return_inverse=True)
    return index, tuple(materials[each] for each in slots.tolist())
