# SPDX-License-Identifier: GPL-3.0-or-later
"""Decomposition of meshes into parallelograms: coplanar groups of faces, or else single faces.

A coplanar group consists of faces of one material that are connected through edges shared by no
third face: a side of a cube, however it is subdivided. Where a group is not a parallelogram,
each of its faces has to be one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from .description import Vector, vector_of

__all__ = ["Mesh", "Parallelogram", "mesh_edges", "parallelograms"]


ANGLE_TOLERANCE = 1e-4
"""Angle, radians, below which a turn of an outline, or between two faces, counts as rounding."""

MAX_PARALLELOGRAMS = 10_000
"""Largest number of parallelograms made of one mesh. Seen: 18,000 sides of cubes take a minute and
a gigabyte at 1 %."""

UNRECOGNISED = "its mesh is neither a UV sphere, an icosphere nor made of flat parallelograms"
"""Reasons, shown to the user, why a mesh is not made of parallelograms."""
NOT_A_PARALLELOGRAM = "its outline is not a parallelogram"
OVERLAPPING_FACES = "its faces overlap"


@dataclass(frozen=True)
class Parallelogram:
    """`corner` + u * `edge_u` + v * `edge_v`, u and v in 0..1, in the mesh's own space.

    slot : its material slot.
    """

    corner: Vector
    edge_u: Vector
    edge_v: Vector
    slot: int = 0


@dataclass(frozen=True)
class Mesh:
    """Faces of a mesh.

    Attributes
    ----------
    points : (3, n) vertex positions.
    corners : (c,) vertex of each face corner, face after face.
    starts, sizes, slots : (f,) first corner, number of corners and material slot of each face.
    slack : largest position error from float32 rounding, absolute.
    fit : largest further position error, as a fraction of a group's size.
    """

    points: Array
    corners: Ints
    starts: Ints
    sizes: Ints
    slots: Ints
    slack: float
    fit: float

    def take(self, faces: Ints) -> Mesh:
        """Return the selected faces, with all the points."""
        sizes = self.sizes[faces]
        starts = np.cumsum(sizes) - sizes
        within = np.arange(int(sizes.sum())) - np.repeat(starts, sizes)
        corners = self.corners[np.repeat(self.starts[faces], sizes) + within]
        return Mesh(self.points, corners, starts, sizes, self.slots[faces], self.slack, self.fit)


def parallelograms(mesh: Mesh) -> tuple[Parallelogram, ...] | str:
    """Return the parallelograms that a mesh consists of, or the reason, for the user, why not."""
    area = _area_vectors(mesh)
    size = np.linalg.norm(area, axis=0)
    shown = (size > 0.0).nonzero()[0]
    if not shown.size:
        return "it has no area"
    mesh, normal = mesh.take(shown), area[:, shown] / size[shown]
    parts, simple = _coplanar_groups(mesh, normal), _are_parallelograms(mesh)
    found: list[Parallelogram] = []
    for faces in parts:
        whole = _tiled_parallelogram(mesh, faces, simple)
        if isinstance(whole, Parallelogram):
            found.append(whole)
        elif faces.size == 1 or not _append_faces(mesh, faces, simple, found):
            return whole if len(parts) == 1 else UNRECOGNISED
        if len(found) > MAX_PARALLELOGRAMS:
            most = f"{MAX_PARALLELOGRAMS:,}"
            return f"it has more flat parts than the {most} of a mesh that are rendered at most"
    return tuple(found)


def _append_faces(mesh: Mesh, faces: Ints, simple: Mask, found: list[Parallelogram]) -> bool:
    """Append each face as its own parallelogram to `found`; return whether all of them are one."""
    for face in faces[: MAX_PARALLELOGRAMS + 1]:
        one = _tiled_parallelogram(mesh, face[None], simple)
        if isinstance(one, str):
            return False
        found.append(one)
    return True


def _tiled_parallelogram(mesh: Mesh, faces: Ints, simple: Mask) -> Parallelogram | str:
    """The parallelogram that some faces together tile, or the reason why there is none."""
    if faces.size > 1 or not simple[faces[0]]:
        return _outline_parallelogram(mesh.take(faces))
    start = int(mesh.starts[faces[0]])
    a, b, _, d = (mesh.points[:, vertex] for vertex in mesh.corners[start : start + 4])
    return Parallelogram(
        vector_of(a), vector_of(b - a), vector_of(d - a), int(mesh.slots[faces[0]])
    )


def _are_parallelograms(mesh: Mesh) -> Mask:
    """Which faces (f,) of four corners are parallelograms: a vectorised test for the usual mesh."""
    found: Mask = np.equal(mesh.sizes, 4)
    four = found.nonzero()[0]
    a, b, c, d = (mesh.points[:, mesh.corners[mesh.starts[four] + k]] for k in range(4))
    u, v = b - a, d - a
    turn = np.linalg.norm(np.cross(u, v, axis=0), axis=0)
    gap, size = np.linalg.norm(a + c - b - d, axis=0), np.linalg.norm(c - a, axis=0)
    found[four] = (gap <= mesh.fit * size + mesh.slack) & (
        turn > ANGLE_TOLERANCE * np.linalg.norm(u, axis=0) * np.linalg.norm(v, axis=0)
    )
    return found


def mesh_edges(mesh: Mesh) -> tuple[Ints, Ints]:
    """Return the vertices (2, e) of all edges, and the edge (c,) that leaves each face corner."""
    after = _next_vertices(mesh)
    low, high = np.minimum(mesh.corners, after), np.maximum(mesh.corners, after)
    keys, edge = np.unique(low * mesh.points.shape[1] + high, return_inverse=True)
    return np.stack(np.divmod(keys, mesh.points.shape[1])), edge


def _next_vertices(mesh: Mesh) -> Ints:
    """The next vertex (c,) of the face after each face corner."""
    after = np.roll(mesh.corners, -1)
    after[mesh.starts + mesh.sizes - 1] = mesh.corners[mesh.starts]
    return after


def _area_vectors(mesh: Mesh) -> Array:
    """Area vectors (3, f) of the faces."""
    # relative to a corner of each face: far from the mesh's origin nothing cancels
    first = np.repeat(mesh.corners[mesh.starts], mesh.sizes)
    place = mesh.points[:, mesh.corners] - mesh.points[:, first]
    after = mesh.points[:, _next_vertices(mesh)] - mesh.points[:, first]
    area: Array = 0.5 * np.add.reduceat(np.cross(place, after, axis=0), mesh.starts, axis=1)
    return area


def _coplanar_groups(mesh: Mesh, normal: Array) -> list[Ints]:
    """Face indices of each coplanar group, given the faces' unit normals (3, f)."""
    edge = mesh_edges(mesh)[1]
    order = np.argsort(edge, kind="stable")
    face = np.repeat(np.arange(mesh.sizes.size), mesh.sizes)[order]
    count = np.bincount(edge)
    first = (np.cumsum(count) - count)[count == 2]
    one, other = face[first], face[first + 1]
    turn = np.linalg.norm(np.cross(normal[:, one], normal[:, other], axis=0), axis=0)
    joined = (turn < ANGLE_TOLERANCE) & (mesh.slots[one] == mesh.slots[other])
    label = _connected_components(mesh.sizes.size, one[joined], other[joined])
    order = np.argsort(label, kind="stable")
    return np.split(order, np.diff(label[order]).nonzero()[0] + 1)


def _connected_components(count: int, one: Ints, other: Ints) -> Ints:
    """Component labels (count,) of a graph with edges one[k] - other[k], equal if connected."""
    label: Ints = np.arange(count)
    while True:
        least = np.minimum(label[one], label[other])
        before = label.copy()
        np.minimum.at(label, label[one], least)
        np.minimum.at(label, label[other], least)
        label = np.take(label, label)
        if np.array_equal(label, before):
            return label


def _outline_parallelogram(part: Mesh) -> Parallelogram | str:
    """The parallelogram that all faces together tile, or the reason why there is none."""
    place = part.points[:, part.corners]
    area = _area_vectors(part)
    size = np.linalg.norm(area, axis=0)
    largest = int(size.argmax())
    normal = area[:, largest] / size[largest]
    extent = float(np.linalg.norm(np.ptp(place, axis=1)))
    allowed = part.fit * extent + part.slack
    if float(np.abs(normal @ (place - place[:, :1])).max()) > allowed:
        return UNRECOGNISED
    edges, edge = mesh_edges(part)
    uses = np.bincount(edge)
    outline = _closed_loop(edges[:, uses == 1]) if (uses <= 2).all() else None
    bends = _turning_vertices(part.points, outline) if outline is not None else None
    if bends is None or len(bends) != 4:
        return NOT_A_PARALLELOGRAM
    a, b, c, d = (part.points[:, i] for i in bends)
    if float(np.linalg.norm(a + c - b - d)) > allowed:
        return NOT_A_PARALLELOGRAM
    whole = float(np.linalg.norm(np.cross(b - a, d - a)))
    if abs(float(size.sum()) - whole) > allowed * extent:
        return OVERLAPPING_FACES
    return Parallelogram(vector_of(a), vector_of(b - a), vector_of(d - a), int(part.slots[0]))


def _closed_loop(edges: Ints) -> list[int] | None:
    """Return the vertices, in order, of the single closed loop that edges (2, e) form, or None."""
    neighbours: dict[int, list[int]] = {}
    for i, j in edges.T.tolist():
        neighbours.setdefault(i, []).append(j)
        neighbours.setdefault(j, []).append(i)
    if not neighbours or any(len(n) != 2 for n in neighbours.values()):
        return None
    first = min(neighbours)
    loop, before = [first], neighbours[first][1]
    while True:
        a, b = neighbours[loop[-1]]
        after = b if a == before else a
        if after == first:
            break
        before = loop[-1]
        loop.append(after)
    return loop if len(loop) == len(neighbours) else None


def _turning_vertices(points: Array, loop: list[int]) -> list[int]:
    """Return the vertices at which a loop turns."""
    place = points[:, loop]
    entering = place - np.roll(place, 1, axis=1)
    leaving = np.roll(entering, -1, axis=1)
    turn = np.linalg.norm(np.cross(entering, leaving, axis=0), axis=0)
    straight = ANGLE_TOLERANCE * np.linalg.norm(entering, axis=0) * np.linalg.norm(leaving, axis=0)
    return [vertex for vertex, bent in zip(loop, turn > straight, strict=True) if bent]
