# SPDX-License-Identifier: GPL-3.0-or-later
"""Recognition of polygon meshes that represent a cylinder or cone, as Blender builds them.

Two rings of m vertices, evenly spaced on two circles about an axis and at the same angles, joined
by m quads; each ring is closed by a polygon or by a fan of triangles, or both are open. Or one such
ring, and an apex on its axis, joined by m triangles. Whether a mesh with these faces is meant as a
cylinder or as a prism, its shading tells.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .description import Vector, vector_of
from .primitive_recognition import FLOAT32_ROUNDING, RELATIVE_TOLERANCE

__all__ = ["FEWEST_SIDES", "SIDE_CORNERS", "MeshCylinder", "recognise_cylinder"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FEWEST_SIDES = 12
"""Least number of sides of a prism that may stand for a cylinder: those of one of 12 are 3 % of the
radius inside it."""
SIDE_CORNERS = 4
"""Number of corners of a side."""


@dataclass(frozen=True)
class MeshCylinder:
    """Cylinder, truncated cone or cone in the mesh's own space: its ends' centres and radii.

    sides : number of its sides.  slot : the material slot of all its faces.
    end_radius : 0 for a cone; None: the same as at the start.
    is_open : whether it is a tube without ends.
    """

    start: Vector
    end: Vector
    radius: float
    sides: int
    slot: int = 0
    end_radius: float | None = None
    is_open: bool = False


def recognise_cylinder(
    points: FloatArray, corners: IntArray, starts: IntArray, slots: IntArray
) -> MeshCylinder | None:
    """Return the cylinder that a mesh represents, or None; parameters as `recognise_primitive`.

    All faces must have one material slot.
    """
    sizes = np.diff(starts, append=len(corners))
    count = int((sizes == SIDE_CORNERS).sum())
    pointed = count == 0
    if pointed:
        # a fan at the apex, and a polygon or another fan
        count = int((sizes == 3).sum()) // (1 if (sizes > 3).any() else 2)
    rest = (1, count) if pointed else (0, 2, 2 * count)
    if count < FEWEST_SIDES or len(starts) - count not in rest:
        return None
    if np.ptp(slots) or not np.isfinite(points).all():
        return None
    used = np.unique(corners)
    number = np.zeros(points.shape[1], dtype=np.int64)
    number[used] = np.arange(used.size)
    points, corners = points[:, used], number[corners]
    sides = (sizes == SIDE_CORNERS).nonzero()[0]
    if pointed:
        cone = _ring_and_apex(points, corners, starts, sizes, count)
        if cone is None:
            return None
        *rings, sides = cone
    else:
        if len(starts) == count:
            found = _open_rings(corners, points.shape[1], count)
        else:
            found = _rings(corners, starts, sizes, points.shape[1], count)
        if found is None:
            return None
        rings = [*found]
    placed = _placed(points, *rings)
    if placed is None:
        return None
    start, end, radii, angle = placed
    edges = corners[starts[sides][:, None] + np.arange(3 if pointed else SIDE_CORNERS)]
    if not _joins_rings(edges, rings[1], angle, count):
        return None
    last = None if radii[0] == radii[1] else radii[1]
    return MeshCylinder(start, end, radii[0], count, int(slots[0]), last, len(starts) == count)


def _ring_and_apex(
    points: FloatArray, corners: IntArray, starts: IntArray, sizes: IntArray, sides: int
) -> tuple[IntArray, IntArray, IntArray] | None:
    """Return the vertices (m,) of a ring, the apex (1,) and the faces (m,) between, or None."""
    flat = (sizes > 3).nonzero()[0]
    fans = (sizes == 3).nonzero()[0]
    triangles = corners[starts[fans][:, None] + np.arange(3)]
    uses = np.bincount(triangles.ravel(), minlength=points.shape[1])
    middles = (uses == sides).nonzero()[0]
    if len(middles) != 2 - len(flat) or points.shape[1] != sides + len(middles):
        return None
    ring = np.setdiff1d(np.arange(points.shape[1]), middles)
    if len(flat):
        own = np.unique(corners[starts[flat[0]] : starts[flat[0]] + sizes[flat[0]]])
        if sizes[flat[0]] != sides or not np.array_equal(own, ring):
            return None
    center = points[:, ring].mean(axis=1)
    away = np.linalg.norm(points[:, middles] - center[:, None], axis=0)
    apex = middles[away.argmax()]
    faces = fans[(triangles == apex).any(axis=1)]
    return (ring, np.array([apex]), faces) if len(faces) == sides else None


def _rings(
    corners: IntArray, starts: IntArray, sizes: IntArray, count: int, sides: int
) -> tuple[IntArray, IntArray] | None:
    """Return the vertices (m,) of both rings, each closed once by a polygon or a fan, or None."""
    rest = (sizes != SIDE_CORNERS).nonzero()[0]
    if len(rest) == 2 and (sizes[rest] == sides).all() and count == 2 * sides:
        first, last = (np.unique(corners[starts[face] : starts[face] + sides]) for face in rest)
    elif len(rest) == 2 * sides and (sizes[rest] == 3).all() and count == 2 * sides + 2:
        fans = corners[starts[rest][:, None] + np.arange(3)]
        uses = np.bincount(fans.ravel(), minlength=count)
        middles = (uses == sides).nonzero()[0]
        if len(middles) != 2:
            return None
        own = [fans[(fans == middle).any(axis=1)] for middle in middles]
        if any(len(each) != sides for each in own):
            return None
        first, last = (
            np.setdiff1d(each, middle) for each, middle in zip(own, middles, strict=True)
        )
    else:
        return None
    apart = first.size == sides and last.size == sides and not np.isin(first, last).any()
    return (first, last) if apart else None


def _open_rings(corners: IntArray, count: int, sides: int) -> tuple[IntArray, IntArray] | None:
    """Return the vertices (m,) of both rings of a tube of quads without ends, or None."""
    if count != 2 * sides:
        return None
    quads = corners.reshape(-1, SIDE_CORNERS)
    edges = np.sort(np.stack([quads, np.roll(quads, -1, axis=1)]), axis=0).reshape(2, -1)
    pairs, uses = np.unique(edges[0] * count + edges[1], return_counts=True)
    # the edges between two sides join the rings, those of one side are along them
    across = pairs[uses == 2]
    one, other = across // count, across % count
    if one.size != sides or np.unique(np.concatenate([one, other])).size != count:
        return None
    rims = pairs[uses == 1]
    ends = np.concatenate([rims // count, rims % count])
    if not np.array_equal(np.sort(ends), np.repeat(np.arange(count), 2)):
        return None
    # the two neighbours of each vertex along its ring
    beside = np.roll(ends, rims.size)[np.argsort(ends, kind="stable")].reshape(count, 2)
    ring, vertex = [-1, 0], 0
    while len(ring) <= count and (len(ring) == 2 or vertex != 0):
        low, high = beside[vertex].tolist()
        vertex = high if low == ring[-2] else low
        ring.append(vertex)
    first = np.unique(np.array(ring[1:]))
    last = np.setdiff1d(np.arange(count), first)
    crossing = np.isin(one, first) != np.isin(other, first)
    return (first, last) if first.size == sides and crossing.all() else None


def _placed(
    points: FloatArray, first: IntArray, last: IntArray
) -> tuple[Vector, Vector, tuple[float, float], IntArray] | None:
    """Return both centres, both radii and the angle (n,) of each vertex, in sides; or None.

    Vertices that are in no ring, the middles of fans, must be the centres of the ends.
    last : (m,) a ring, or (1,) an apex.
    """
    start, end = points[:, first].mean(axis=1), points[:, last].mean(axis=1)
    length = float(np.linalg.norm(end - start))
    if not length > 0.0:
        return None
    axis = (end - start) / length
    x = points[:, first[0]] - start
    radius = float(np.linalg.norm(x))
    if not radius > 0.0:
        return None
    x = x / radius
    y = np.cross(axis, x)
    local = points - start[:, None]
    local[:, last] -= (length * axis)[:, None]
    step = math.tau / first.size
    angle = np.arctan2(y @ local, x @ local) / step
    k = np.rint(angle).astype(np.int64) % first.size
    extent = float(np.abs(points).max())
    # one vertex fixes the frame's rotation, so its rounding error adds to that of all others
    allowed = 4.0 * (RELATIVE_TOLERANCE * max(radius, length) + FLOAT32_ROUNDING * extent)
    end_radius = 0.0
    if last.size > 1:
        end_radius = float(np.linalg.norm(local[:, last], axis=0).mean())
        end_radius = radius if abs(end_radius - radius) <= allowed else end_radius
    size = np.full(points.shape[1], radius)
    size[last] = end_radius
    ideal = size * (np.cos(k * step) * x[:, None] + np.sin(k * step) * y[:, None])
    ring = np.concatenate([first, last])
    middles = np.setdiff1d(np.arange(points.shape[1]), ring)
    off = [np.linalg.norm(local[:, ring] - ideal[:, ring], axis=0)]
    if middles.size:
        ends = np.stack([start, end], axis=1)
        gaps = np.linalg.norm(points[:, middles, None] - ends[:, None], axis=0)
        off.append(gaps.min(axis=1))
    narrow = min(radius, end_radius or radius)
    if float(np.concatenate(off).max()) > min(allowed, 0.1 * step * narrow):
        return None
    return vector_of(start), vector_of(end), (radius, end_radius), k


def _joins_rings(quads: IntArray, last: IntArray, angle: IntArray, sides: int) -> bool:
    """Whether quads (m, 4) join neighbours of one ring with those at the same angles of the other,
    or triangles (m, 3) with the apex, each pair of neighbours once.
    """
    upper = np.isin(quads, last)
    if last.size == 1:
        quads, upper = _doubled(quads, upper)
    if not (upper.sum(axis=1) == 2).all():
        return False
    order = np.argsort(upper, axis=1, kind="stable")
    k = np.sort(np.take_along_axis(angle[quads], order, 1).reshape(-1, 2, 2), axis=2)
    if not np.array_equal(k[:, 0], k[:, 1]):
        return False
    low, high = k[:, 0, 0], k[:, 0, 1]
    wraps = high - low == sides - 1
    first = np.where(wraps, high, low)
    next_to = wraps | (high - low == 1)
    return bool(next_to.all()) and np.array_equal(np.sort(first), np.arange(sides))


def _doubled(faces: IntArray, upper: NDArray[np.bool_]) -> tuple[IntArray, NDArray[np.bool_]]:
    """Triangles (m, 3) at an apex as quads (m, 4) whose upper edge is above the lower one."""
    order = np.argsort(upper, axis=1, kind="stable")
    low = np.take_along_axis(faces, order, 1)[:, :2]
    above = np.tile(np.array([False, False, True, True]), (len(faces), 1))
    one = upper.sum(axis=1) == 1
    above[~one] = False
    return np.concatenate([low, low], axis=1), above
