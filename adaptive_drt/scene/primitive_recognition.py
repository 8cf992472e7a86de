# SPDX-License-Identifier: GPL-3.0-or-later
"""Recognition of polygon meshes that represent a sphere, or else their planar facets.

All vertices of a cube, a cylinder and a tetrahedron lie on one sphere too, so positions alone
prove nothing. A mesh is taken for a sphere if it is, vertex for vertex and face for face, a
UV sphere (segments * rings, any count from 3 up) or an icosphere (any subdivision, the plain
icosahedron included, since that is what Blender's icosphere of subdivision 1 is); or if its faces,
however they are cut, cover the sphere of their vertices once and nowhere lie deep below it.
Meshes that were opened, capped, dented or stretched have another structure or leave the sphere. The
tetrahedron, the octahedron, the cube and their triangulations are not spheres.
All other meshes are decomposed by `planar_facets` into parallelograms, such as the sides of a cube,
and triangles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .description import Vector, vector_of
from .planar_facets import (
    MAX_TRIANGLES,
    NO_AREA,
    Facets,
    Mesh,
    MeshTriangles,
    Parallelograms,
    mesh_edges,
    planar_facets,
)

__all__ = [
    "UNUSABLE",
    "Facets",
    "MeshSphere",
    "MeshTriangles",
    "Parallelograms",
    "recognise_primitive",
]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

RELATIVE_TOLERANCE = 2e-5
"""Largest distance of a vertex from the ideal shape, as a fraction of its size. Seen: Blender's UV
spheres 2e-6 (float32), its icosahedron 7e-6 (its constants have six digits)."""

FLOAT32_ROUNDING = 8.0 * float(np.finfo(np.float32).eps)
"""Largest rounding error of a position stored as float32, as a fraction of the mesh's largest
coordinate: it matters for a mesh far from its own origin."""

ICOSAHEDRON_EDGE = 1.0 / math.sin(2.0 * math.pi / 5.0)
"""Length of a regular icosahedron's edge, in circumradii."""

LONGEST_EDGE = 0.6
"""Largest length, in radii, of an edge of a triangle of a sphere that is cut in any way. No point
of such a face is closer to the centre than sqrt(1 - LONGEST_EDGE**2 / 3) = 0.94 radii; the solids
whose vertices lie on a sphere and that are not meant as one have longer edges or diagonals."""

FEWEST_TRIANGLES = 64
"""Least number of triangles of a sphere that is cut in any way: with edges of `LONGEST_EDGE` no
fewer than about 80 cover it."""

LARGEST_ROUNDING = 2e-4
"""Largest uncertainty of positions, in radii, with which faces of any cut prove a sphere: with a
larger one vertices that are apart could not be told from those in one place."""

WELDING_DIRECTION = (0.5377, 0.6921, 0.4823)
"""Direction, about a unit vector, along which vertices are sorted: those in one place are near each
other in that order, and few others are, since it is none of the axes of a mesh."""

GOLDEN_RATIO = (math.sqrt(5.0) - 1.0) / 2.0
"""The golden ratio, less 1: its multiples, less whole numbers, are spread evenly over 0 to 1."""

SAMPLED_VERTICES = 64
"""Number of vertices that are tried first: most meshes are no spheres, which so many show."""

LARGEST_UNEVENNESS = 2.0
"""Largest length of an edge of such a triangle, as a multiple of what it were if all were alike: a
larger face than the others is meant to be seen. Seen: 1.8 for a cube's sides cut into squares, 1.6
for a UV sphere; 2.2 where the pole of one is cut off and capped."""

COVER_TOLERANCE = 1e-3
"""Largest difference between the sum of the faces' solid angles and that of the full sphere, as a
fraction of the latter. Rounding leaves less; a sphere that is covered twice differs by 1."""

ICOSPHERE_STRETCH = 1.4
"""Largest length of an icosphere's edge, as a multiple of ICOSAHEDRON_EDGE / 2**subdivision; seen:
1.26."""


NO_FACES, NOT_FINITE = "it has no faces", "its vertices are not finite numbers"
UNUSABLE = (NO_FACES, NOT_FINITE, NO_AREA)
"""Reasons for which a mesh cannot be rendered in any form; for others its triangles can."""


@dataclass(frozen=True)
class MeshSphere:
    """Sphere in the mesh's own space: centre and radius in its units.

    slot : the material slot of most of its faces.
    """

    center: Vector
    radius: float
    slot: int = 0


def recognise_primitive(
    points: FloatArray,
    corners: IntArray,
    starts: IntArray,
    slots: IntArray,
    triangles: tuple[IntArray, IntArray] | None = None,
    most_triangles: int = MAX_TRIANGLES,
) -> MeshSphere | Facets | str:
    """Return the sphere or the facets that a mesh represents, or why it is not rendered.

    Parameters
    ----------
    points : (3, n) float64, vertex positions.
    corners : (c,) int64, vertex of each face corner, face after face.
    starts : (f,) int64, first corner of each face, ascending from 0.
    slots : (f,) int64, material slot of each face.
    triangles : vertices (3, t) of triangles into which faces are cut that are no parallelograms,
        and the face (t,) of each. None: all triangles from the first corner of a face.
    most_triangles : number of triangles above which a mesh has no facets.

    Returns
    -------
    A sphere, facets, or a reason for the user, which begins with "its" or "it".
    """
    if len(starts) == 0:
        return NO_FACES
    sizes = np.diff(starts, append=len(corners))
    cut, owner = _fans(corners, starts, sizes) if triangles is None else triangles
    # loose vertices are never rendered, so they are removed and the others renumbered
    used = np.bincount(corners, minlength=points.shape[1]) > 0
    number = np.cumsum(used) - 1
    corners, points = number[corners], points[:, used]
    if not np.isfinite(points).all():
        return NOT_FINITE
    slack = FLOAT32_ROUNDING * float(np.abs(points).max())
    mesh = Mesh(points, corners, starts, sizes, slots, slack, RELATIVE_TOLERANCE)
    cut = number[cut]
    ball = _as_uv_sphere(mesh) or _as_icosphere(mesh) or _as_covered_sphere(mesh, cut)
    if ball:
        return replace(ball, slot=int(np.bincount(slots).argmax()))
    return planar_facets(mesh, cut, owner, most_triangles)


def _fans(corners: IntArray, starts: IntArray, sizes: IntArray) -> tuple[IntArray, IntArray]:
    """All triangles (3, t) from the first corner of each face, and the face (t,) of each."""
    count = np.maximum(sizes - 2, 0)
    owner = np.repeat(np.arange(sizes.size), count)
    first = starts[owner]
    second = first + 1 + np.arange(owner.size) - np.repeat(np.cumsum(count) - count, count)
    return corners[np.stack([first, second, second + 1])], owner


def _fit_sphere(points: FloatArray, slack: float) -> MeshSphere | None:
    """Return the sphere on which all points (3, n), n >= 4, lie, or None.

    |p|^2 = 2 c.p + (r^2 - |c|^2) is linear in its unknowns; solved by least squares relative to the
    points' centroid and in units of their extent.
    """
    middle = points.mean(axis=1)
    local = points - middle[:, None]
    extent = float(np.abs(local).max())
    if extent == 0.0:
        return None
    local = local / extent
    rows = np.concatenate([2.0 * local, np.ones((1, local.shape[1]))])
    squares = (local * local).sum(axis=0)
    solution, _, rank, _ = np.linalg.lstsq(rows.T, squares, rcond=None)
    if rank < 4:
        return None
    distance = np.linalg.norm(local - solution[:3, None], axis=0)
    radius = float(distance.mean())
    allowed = RELATIVE_TOLERANCE * radius + slack / extent
    if float(np.abs(distance - radius).max()) > allowed:
        return None
    center = middle + extent * solution[:3]
    # rounding must not move a primitive off its origin, or it would wobble when it rotates
    if float(np.linalg.norm(center)) <= RELATIVE_TOLERANCE * radius * extent:
        center = np.zeros(3)
    return MeshSphere(vector_of(center), radius * extent)


def _as_uv_sphere(mesh: Mesh) -> MeshSphere | None:
    """Return the sphere if the mesh is a UV sphere of m segments and n rings, or None.

    Two poles, m * (n - 1) vertices between them at the angles k pi / n and j 2 pi / m, a
    triangle for each of the 2 m cells at the poles and a quad for each other cell.
    """
    points, corners, starts = mesh.points, mesh.corners, mesh.starts
    sizes, slack = mesh.sizes, mesh.absolute_tolerance
    triangles, quads = int((sizes == 3).sum()), int((sizes == 4).sum())
    segments = triangles // 2
    if triangles % 2 or segments < 3 or triangles + quads != len(sizes) or quads % segments:
        return None
    rings = quads // segments + 2
    count = points.shape[1]
    if rings < 3 or count != segments * (rings - 1) + 2:
        return None
    quad_corners = corners[(starts[sizes == 4][:, None] + np.arange(4))]
    triangle_corners = corners[(starts[sizes == 3][:, None] + np.arange(3))]
    in_quad = np.zeros(count, dtype=np.bool_)
    in_quad[quad_corners] = True
    poles = (~in_quad).nonzero()[0]
    ball = _fit_sphere(points, slack) if len(poles) == 2 else None
    if ball is None:
        return None
    cell = _rings_and_segments(points, poles, ball, segments, rings, slack)
    if cell is None:
        return None
    latitude, longitude = cell
    if not _covers_cells(latitude[quad_corners], longitude[quad_corners], segments, (1, rings - 2)):
        return None
    return ball if _covers_fans(latitude, longitude, triangle_corners, segments, rings) else None


def _rings_and_segments(
    points: FloatArray, poles: IntArray, ball: MeshSphere, segments: int, rings: int, slack: float
) -> tuple[IntArray, IntArray] | None:
    """Return each vertex's ring k (0 and n at the poles) and segment j, or None if one is off."""
    local = (points - np.array(ball.center)[:, None]) / ball.radius
    axis = (local[:, poles[0]] - local[:, poles[1]]) / 2.0
    between = np.setdiff1d(np.arange(points.shape[1]), poles)
    axis_length = float(np.linalg.norm(axis))
    if axis_length < 0.5:  # the poles of a sphere are opposite, so this is 1
        return None
    axis = axis / axis_length
    across = local[:, between[0]] - axis * (axis @ local[:, between[0]])
    across_length = float(np.linalg.norm(across))
    if across_length < RELATIVE_TOLERANCE:
        return None
    across = across / across_length
    along, aside, third = (v @ local for v in (axis, across, np.cross(axis, across)))
    k = np.rint(np.arctan2(np.hypot(aside, third), along) * rings / math.pi).astype(np.int64)
    j = np.rint(np.arctan2(third, aside) * segments / math.tau).astype(np.int64) % segments
    theta, phi = k * math.pi / rings, j * math.tau / segments
    frame = np.stack([axis, across, np.cross(axis, across)], axis=1)
    sine = np.sin(theta)
    ideal = frame @ np.stack([np.cos(theta), sine * np.cos(phi), sine * np.sin(phi)])
    # one vertex fixes the frame's rotation, so its rounding error adds to that of all others
    allowed = 4.0 * (RELATIVE_TOLERANCE + slack / ball.radius)
    if float(np.linalg.norm(local - ideal, axis=0).max()) > allowed:
        return None
    keys = k[between] * segments + j[between]
    if not np.array_equal(np.sort(keys), np.arange(segments, segments * rings)):
        return None
    return k, j


def _first_segment(j: IntArray, segments: int) -> IntArray:
    """Return the first of the two adjacent segments in each row, modulo the number of segments."""
    low, high = j.min(axis=1), j.max(axis=1)
    return np.where(high - low == segments - 1, high, low)


def _covers_cells(k: IntArray, j: IntArray, segments: int, span: tuple[int, int]) -> bool:
    """Whether quads with vertices (k, j), each (q, 4), are the cells of rings `span`, once each."""
    k0, j0 = k.min(axis=1), _first_segment(j, segments)
    place = 2 * (k - k0[:, None]) + (j - j0[:, None]) % segments
    if not np.array_equal(np.sort(place, axis=1), np.tile(np.arange(4), (len(k), 1))):
        return False
    first, last = span
    cells = np.sort(k0 * segments + j0)
    return np.array_equal(cells, np.arange(first * segments, (last + 1) * segments))


def _covers_fans(
    latitude: IntArray, longitude: IntArray, faces: IntArray, segments: int, rings: int
) -> bool:
    """Whether triangles (2 m, 3) are the two fans around the poles, each once."""
    k = latitude[faces]
    order = np.argsort((k == 0) | (k == rings), axis=1, kind="stable")  # the pole goes last
    k, j = np.take_along_axis(k, order, 1), np.take_along_axis(longitude[faces], order, 1)
    north = (k == np.array([1, 1, 0])).all(axis=1)
    south = (k == np.array([rings - 1, rings - 1, rings])).all(axis=1)
    if not (north | south).all():
        return False
    pair = j[:, :2]
    j0 = _first_segment(pair, segments)
    if not np.array_equal(np.sort((pair - j0[:, None]) % segments, axis=1)[:, 1], np.ones(len(j))):
        return False
    return np.array_equal(np.sort(south * segments + j0), np.arange(2 * segments))


def _as_icosphere(mesh: Mesh) -> MeshSphere | None:
    """Return the sphere if the mesh is an icosphere of any subdivision, or None.

    Closed, 20 * 4^s triangles; 12 vertices with five edges, at the corners of a regular
    icosahedron, all others with six; no edge longer than in such a subdivision.
    """
    points, slack = mesh.points, mesh.absolute_tolerance
    faces, count = len(mesh.sizes), points.shape[1]
    level = round(math.log(faces / 20.0, 4.0)) if faces >= 20 else 0
    if faces != 20 * 4**level or count != faces // 2 + 2 or not (mesh.sizes == 3).all():
        return None
    edges, edge = mesh_edges(mesh)
    if not (np.bincount(edge) == 2).all():
        return None
    valence = np.bincount(edges.ravel(), minlength=count)
    roots = (valence == 5).nonzero()[0]
    if len(roots) != 12 or not np.isin(valence, (5, 6)).all():
        return None
    ball = _fit_sphere(points, slack)
    if ball is None:
        return None
    local = (points - np.array(ball.center)[:, None]) / ball.radius
    apart = np.linalg.norm(local[:, roots, None] - local[:, None, roots], axis=0)
    far = math.sqrt(4.0 - ICOSAHEDRON_EDGE**2)
    ideal = np.array([0.0] + [ICOSAHEDRON_EDGE] * 5 + [far] * 5 + [2.0])
    if float(np.abs(np.sort(apart, axis=1) - ideal).max()) > 4.0 * (
        RELATIVE_TOLERANCE + slack / ball.radius
    ):
        return None
    longest = float(np.linalg.norm(local[:, edges[0]] - local[:, edges[1]], axis=0).max())
    return ball if longest <= ICOSPHERE_STRETCH * ICOSAHEDRON_EDGE / 2**level else None


def _as_covered_sphere(mesh: Mesh, cut: IntArray) -> MeshSphere | None:
    """Return the sphere that faces of three or four corners cover once, or None.

    All vertices lie on the sphere; each edge joins two triangles, which lie on its two sides; no
    edge is long; and the solid angles of all triangles add up to that of one sphere.

    Parameters
    ----------
    mesh : its vertices in the same place count as one.
    cut : (3, t) vertices of its triangles; those of fewer than three places are passed over.
    """
    points, slack = mesh.points, mesh.absolute_tolerance
    # steps of the golden ratio: equal ones might find the vertices of one ring alone
    places = np.arange(SAMPLED_VERTICES) * GOLDEN_RATIO % 1.0
    some = points[:, np.unique((places * points.shape[1]).astype(np.int64))]
    if mesh.sizes.max() > 4 or cut.shape[1] < FEWEST_TRIANGLES or not _fit_sphere(some, slack):
        return None
    ball = _fit_sphere(points, slack)
    if ball is None:
        return None
    tolerance = RELATIVE_TOLERANCE + slack / ball.radius
    if tolerance > LARGEST_ROUNDING:
        return None
    local = (points - np.array(ball.center)[:, None]) / ball.radius
    a, b, c = _welded(local, tolerance)[cut]
    wide = (a != b) & (b != c) & (c != a)
    a, b, c = a[wide], b[wide], c[wide]
    ends = np.stack([np.concatenate([a, b, c]), np.concatenate([b, c, a])])
    length = np.linalg.norm(local[:, ends[0]] - local[:, ends[1]], axis=0)
    longest = float(length.max(initial=0.0))
    if longest > min(LONGEST_EDGE, LARGEST_UNEVENNESS * _even_edge(a.size)):
        return None
    angle = _solid_angles(local[:, a], local[:, b], local[:, c])
    if abs(float(np.abs(angle).sum()) / (4.0 * math.pi) - 1.0) > COVER_TOLERANCE:
        return None
    # seen from outside all triangles then run anticlockwise, and each edge once in each direction
    ends = np.where(np.tile(angle < 0.0, 3), ends[::-1], ends)
    count = points.shape[1]
    ways, back = np.sort(ends[0] * count + ends[1]), np.sort(ends[1] * count + ends[0])
    once = bool((np.diff(ways) > 0).all())
    return ball if once and np.array_equal(ways, back) else None


def _even_edge(count: int) -> float:
    """Return the edge of equilateral triangles of which so many have the area of a unit sphere."""
    return math.sqrt(16.0 * math.pi / (math.sqrt(3.0) * max(count, 1)))


def _welded(points: FloatArray, tolerance: float) -> IntArray:
    """Return for each point (3, n) the number (n,) of the one that stands for all in its place.

    Points in one place differ by up to `tolerance`, such as those at a pole where a patch ends.
    """
    # 0 is added so that -0 becomes 0: points that are equal then have the same bytes
    rows = np.ascontiguousarray(points.T) + 0.0
    keys = rows.view(np.dtype((np.void, rows.itemsize * 3)))[:, 0]
    _, first, same = np.unique(keys, return_index=True, return_inverse=True)
    apart = points[:, first]
    along = np.array(WELDING_DIRECTION) @ apart
    order = np.argsort(along, kind="stable")
    along, apart = along[order], apart[:, order]
    number = np.arange(along.size)
    for step in range(1, along.size):
        close = np.flatnonzero(along[step:] - along[:-step] <= 2.0 * tolerance)
        if not close.size:
            break
        gap = np.abs(apart[:, close + step] - apart[:, close]).max(axis=0)
        close = close[gap <= tolerance]
        # the least of a place is reached last, by the longest step
        number[close + step] = close
    found: IntArray = first[order[number]][np.argsort(order)[same.reshape(-1)]]
    return found


def _solid_angles(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Return the signed solid angles (t,) of triangles between unit vectors (3, t).

    A. van Oosterom, J. Strackee, The solid angle of a plane triangle, IEEE Trans. Biomed. Eng. 30
    (1983).
    """
    volume = (a * np.cross(b, c, axis=0)).sum(axis=0)
    ab, bc, ca = ((x * y).sum(axis=0) for x, y in ((a, b), (b, c), (c, a)))
    angles: FloatArray = 2.0 * np.arctan2(volume, 1.0 + ab + bc + ca)
    return angles
