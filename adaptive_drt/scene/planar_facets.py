# SPDX-License-Identifier: GPL-3.0-or-later
"""Decomposition of meshes into planar facets: parallelograms where there are any, else triangles.

A coplanar group consists of faces of one material that are connected through edges shared by no
third face: a side of a cube, however it is subdivided. A group that tiles a parallelogram is one
facet. The faces of other groups are parallelograms, or else they are triangulated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Ints, Mask

__all__ = [
    "MAX_TRIANGLES",
    "NO_AREA",
    "Facets",
    "Mesh",
    "MeshTriangles",
    "Parallelograms",
    "mesh_edges",
    "planar_facets",
]


ANGLE_TOLERANCE = 1e-4
"""Angle, radians, below which a turn of an outline, or between two faces, counts as rounding."""

MAX_PARALLELOGRAMS = 10_000
"""Largest number of parallelograms made of one mesh. Seen: 18,000 sides of cubes take a minute and
a gigabyte at 1 %."""

MAX_TRIANGLES = 24
"""Largest number of triangles made of one mesh.

Each triangle is rendered as a polygon in closed form, whose cost grows with their number. Measured,
seconds of processor time for 120 x 80 pixels under one area light, in closed form and with traced
rays: a cylinder of 8 sides (12 triangles) 0.6 and 0.3 at 1 %, 1.3 and 4.2 at 0.1 %; one of 32 sides
(60 triangles) 4.6 and 0.4 at 1 %, 10 and 4.9 at 0.1 %, 182 and 26 while it moves."""

MIN_SINE = 2.0**-40
"""Sine of the angle between two edges of a triangle up to which it has no area: it is dropped. What
it covers is narrower than the rounding of coordinates by far."""

NO_AREA = "it has no area"
"""Reasons, shown to the user, why a mesh is not rendered."""
TOO_MANY = "it has more flat parts than are rendered in closed form"


@dataclass(frozen=True)
class MeshTriangles:
    """t triangles between points of a mesh.

    Attributes
    ----------
    points : (3, n) float64, in the mesh's own space.
    corners : (3, t) int64, the three points of each.
    slot : (t,) int64, the material slot of each.
    """

    points: Array
    corners: Ints
    slot: Ints


@dataclass(frozen=True)
class Facets:
    """What a mesh consists of that is not a sphere."""

    parallelograms: Parallelograms
    triangles: MeshTriangles

    @property
    def slot(self) -> Ints:
        """Material slots (n,) of all parallelograms and triangles."""
        return np.concatenate([self.parallelograms.slot, self.triangles.slot])


@dataclass(frozen=True)
class Parallelograms:
    """n parallelograms `corner` + u * `edge_u` + v * `edge_v`, u and v in 0..1, in the mesh's own
    space.

    Attributes
    ----------
    corner, edge_u, edge_v : (3, n) float64.
    slot : (n,) int64, the material slot of each.
    """

    corner: Array
    edge_u: Array
    edge_v: Array
    slot: Ints


@dataclass(frozen=True)
class Mesh:
    """Faces of a mesh.

    Attributes
    ----------
    points : (3, n) vertex positions.
    corners : (c,) vertex of each face corner, face after face.
    starts, sizes : (f,) first corner and number of corners of each face.
    material_slots : (f,) material slot of each face.
    absolute_tolerance : largest position error from float32 rounding, absolute.
    relative_tolerance : largest further position error, as a fraction of a group's size.
    """

    points: Array
    corners: Ints
    starts: Ints
    sizes: Ints
    material_slots: Ints
    absolute_tolerance: float
    relative_tolerance: float

    def take(self, faces: Ints) -> Mesh:
        """Return the selected faces, with all the points."""
        sizes = self.sizes[faces]
        starts = np.cumsum(sizes) - sizes
        within = np.arange(int(sizes.sum())) - np.repeat(starts, sizes)
        corners = self.corners[np.repeat(self.starts[faces], sizes) + within]
        return Mesh(
            self.points,
            corners,
            starts,
            sizes,
            self.material_slots[faces],
            self.absolute_tolerance,
            self.relative_tolerance,
        )


def planar_facets(
    mesh: Mesh, triangles: Ints, owner: Ints, most_triangles: int = MAX_TRIANGLES
) -> Facets | str:
    """Return the facets that a mesh consists of, or the reason, for the user, why there are none.

    Parallelograms are in the order of the groups' first faces, and within a group in the order of
    its faces.

    Parameters
    ----------
    triangles : (3, t) points of triangles that all faces together are cut into.
    owner : (t,) the face of each.
    most_triangles : number of triangles above which there are no facets.
    """
    area = _area_vectors(mesh)
    size = np.linalg.norm(area, axis=0)
    shown = (size > 0.0).nonzero()[0]
    found = _parallelograms(mesh.take(shown), area[:, shown] / size[shown], most_triangles)
    if isinstance(found, str):
        return found
    flat, used = found
    rest = np.ones(mesh.sizes.size, dtype=np.bool_)
    rest[shown[used]] = False
    corners, slot = _with_area(mesh, triangles[:, rest[owner]], owner[rest[owner]])
    if slot.size > most_triangles:
        return TOO_MANY
    if not flat.slot.size and not slot.size:
        return NO_AREA
    return Facets(flat, MeshTriangles(mesh.points, corners, slot))


def _with_area(mesh: Mesh, corners: Ints, owner: Ints) -> tuple[Ints, Ints]:
    """Those of triangles, as of `planar_facets`, that have an area, and their material slots."""
    a, b, c = (mesh.points[:, each] for each in corners)
    u, v = b - a, c - a
    area = np.linalg.norm(np.cross(u, v, axis=0), axis=0)
    wide = area > MIN_SINE * np.linalg.norm(u, axis=0) * np.linalg.norm(v, axis=0)
    return corners[:, wide], mesh.material_slots[owner[wide]]


def _parallelograms(
    mesh: Mesh, normal: Array, most_triangles: int
) -> tuple[Parallelograms, Ints] | str:
    """The parallelograms among the facets of a mesh, and the faces (k,) that they consist of.

    Returns the reason, for the user, where there are too many facets.

    normal : (3, f) unit normals of the faces.
    """
    order, starts = _coplanar_groups(mesh, normal)
    sizes, simple = np.diff(starts, append=order.size), _are_parallelograms(mesh)
    # most groups are a single face of up to four corners, and are told from all of them at once
    alone = (sizes == 1) & (mesh.sizes[order[starts]] <= 4)
    plain = alone & simple[order[starts]]
    used = [order[starts[plain]]]
    found = [_faces_as_parallelograms(mesh, used[0], starts[plain])]
    triangles = int((mesh.sizes[order[starts[alone & ~plain]]] - 2).sum())
    before, others = np.cumsum([0, *plain]), 0
    for group in (~alone).nonzero()[0].tolist():
        if before[group] + others > MAX_PARALLELOGRAMS or triangles > most_triangles:
            break
        first = int(starts[group])
        faces = order[first : first + sizes[group]]
        made, kept = _group_parallelograms(mesh, faces, first, simple)
        found.append(made)
        used.append(faces[kept])
        others += made.place.size
        triangles += int((mesh.sizes[faces[~kept]] - 2).sum())
    if triangles > most_triangles or before[-1] + others > MAX_PARALLELOGRAMS:
        return TOO_MANY
    return _in_order(found), np.concatenate(used)


@dataclass(frozen=True)
class _Placed:
    """Parallelograms and their places (n,) in the order of all."""

    place: Ints
    shape: Parallelograms


def _in_order(found: list[_Placed]) -> Parallelograms:
    """All parallelograms, by their places."""
    order = np.argsort(np.concatenate([each.place for each in found]))
    corner, u, v, slot = (
        np.concatenate([getattr(each.shape, name) for each in found], axis=-1)[..., order]
        for name in ("corner", "edge_u", "edge_v", "slot")
    )
    return Parallelograms(corner, u, v, slot)


def _faces_as_parallelograms(mesh: Mesh, faces: Ints, place: Ints) -> _Placed:
    """Faces of four corners, each known to be a parallelogram."""
    first = mesh.starts[faces]
    a, b, d = (mesh.points[:, mesh.corners[first + k]] for k in (0, 1, 3))
    return _Placed(place, Parallelograms(a, b - a, d - a, mesh.material_slots[faces]))


def _group_parallelograms(
    mesh: Mesh, faces: Ints, first: int, simple: Mask
) -> tuple[_Placed, Mask]:
    """The parallelogram that the faces of a group tile, or else those that some of them are.

    Returns with them the mask of the faces that they consist of.

    first : place of the group's first face.
    """
    whole = _outline_parallelogram(mesh.take(faces))
    if whole is not None:
        return _Placed(np.array([first]), whole), np.ones(faces.size, dtype=np.bool_)
    place, kept = first + np.arange(faces.size), simple[faces].copy()
    found = [_faces_as_parallelograms(mesh, faces[kept], place[kept])]
    # `simple` tells all faces of up to four corners
    for k in (mesh.sizes[faces] > 4).nonzero()[0].tolist() if faces.size > 1 else ():
        one = _outline_parallelogram(mesh.take(faces[k : k + 1]))
        if one is not None:
            found.append(_Placed(place[k : k + 1], one))
            kept[k] = True
    return _Placed(place[kept], _in_order(found)), kept


def _are_parallelograms(mesh: Mesh) -> Mask:
    """Which faces (f,) of four corners are parallelograms: a vectorised test for the usual mesh."""
    found: Mask = np.equal(mesh.sizes, 4)
    four = found.nonzero()[0]
    a, b, c, d = (mesh.points[:, mesh.corners[mesh.starts[four] + k]] for k in range(4))
    u, v = b - a, d - a
    turn = np.linalg.norm(np.cross(u, v, axis=0), axis=0)
    gap, size = np.linalg.norm(a + c - b - d, axis=0), np.linalg.norm(c - a, axis=0)
    found[four] = (gap <= mesh.relative_tolerance * size + mesh.absolute_tolerance) & (
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


def _coplanar_groups(mesh: Mesh, normal: Array) -> tuple[Ints, Ints]:
    """Face indices (f,), coplanar group after group, and where in them each group starts (g,).

    normal : (3, f) unit normals of the faces.
    """
    edge = mesh_edges(mesh)[1]
    order = np.argsort(edge, kind="stable")
    face = np.repeat(np.arange(mesh.sizes.size), mesh.sizes)[order]
    count = np.bincount(edge)
    first = (np.cumsum(count) - count)[count == 2]
    one, other = face[first], face[first + 1]
    turn = np.linalg.norm(np.cross(normal[:, one], normal[:, other], axis=0), axis=0)
    joined = (turn < ANGLE_TOLERANCE) & (mesh.material_slots[one] == mesh.material_slots[other])
    label = _connected_components(mesh.sizes.size, one[joined], other[joined])
    order = np.argsort(label, kind="stable")
    return order, np.diff(label[order], prepend=-1).nonzero()[0]


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


def _outline_parallelogram(part: Mesh) -> Parallelograms | None:
    """The parallelogram that all faces together tile, or None."""
    place = part.points[:, part.corners]
    area = _area_vectors(part)
    size = np.linalg.norm(area, axis=0)
    largest = int(size.argmax())
    normal = area[:, largest] / size[largest]
    extent = float(np.linalg.norm(np.ptp(place, axis=1)))
    allowed = part.relative_tolerance * extent + part.absolute_tolerance
    if float(np.abs(normal @ (place - place[:, :1])).max()) > allowed:
        return None
    edges, edge = mesh_edges(part)
    uses = np.bincount(edge)
    outline = _closed_loop(edges[:, uses == 1]) if (uses <= 2).all() else None
    bends = _turning_vertices(part.points, outline) if outline is not None else None
    if bends is None or len(bends) != 4:
        return None
    a, b, c, d = (part.points[:, i] for i in bends)
    if float(np.linalg.norm(a + c - b - d)) > allowed:
        return None
    whole = float(np.linalg.norm(np.cross(b - a, d - a)))
    if abs(float(size.sum()) - whole) > allowed * extent:
        return None  # faces overlap
    return Parallelograms(a[:, None], (b - a)[:, None], (d - a)[:, None], part.material_slots[:1])


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
