# SPDX-License-Identifier: GPL-3.0-or-later
"""Many thin flat faces are rendered as meshes of triangles, where rays cost less than closed forms.

Many long narrow faces, as of fences, blinds and grids, cross each pixel and lie before a light side
by side: closed forms then take a time that grows with the square of their number and more. Traced
as one mesh the time hardly depends on it, but grows faster with the inverse of the tolerance. The
figures are those of `benchmarks/thin_faces.py`; only ratios of times matter.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...numerics.arrays import Array, Ints
from ...scene.description import (
    Material,
    Motion,
    Quad,
    Quads,
    ShapeBatch,
    ShapeRecord,
    Triangle,
    Triangles,
    Visibility,
)
from ...scene.settings import Settings
from ...scene.triangle_mesh import TriangleMesh

__all__ = ["meshes_of_thin_faces", "rays_cost_less_from"]


MIN_ASPECT = 16.0
"""Ratio of the longest edge of a face to its height above it from which the face is thin."""
LEAST_FACES, FACES_POWER = 24.0, 0.4
"""Number of thin faces from which they are traced as a mesh at a tolerance of 1 %, and the power of
the inverse of the tolerance that it grows with.

Fitted to times of fences of 21 to 180 faces: closed forms take n^2.1 at 1 %, and 2.5 to 3 times as
long at 0.1 %; rays n^0.3, and 9 to 20 times as long. The times are equal at 11 faces and 1 %, where
bars are about a pixel wide, and at 20 where they are four pixels wide."""
REFERENCE_TOLERANCE = 0.01
"""Tolerance of these numbers."""

Flat = Quad | Quads | Triangle | Triangles


def rays_cost_less_from(tolerance: float) -> float:
    """The number of thin faces from which rays cost less than closed forms."""
    return float(LEAST_FACES * (REFERENCE_TOLERANCE / tolerance) ** FACES_POWER)


def meshes_of_thin_faces(
    records: Sequence[ShapeRecord], settings: Settings
) -> tuple[list[ShapeRecord], int]:
    """The shapes, with meshes instead of those that are made of many thin faces.

    Those that move alike and are met by the same rays become one mesh. What shines stays: its faces
    lie in the planes of lights.

    Returns
    -------
    records : the shapes; meshes come last, and have the names of their first shapes.
    count : number of faces that are now in meshes.
    """
    if settings.method != "EXACT" or settings.accelerator == "ARRAYS":
        return list(records), 0
    groups: dict[tuple[Motion | None, Visibility], list[Flat]] = {}
    for each in records:
        if isinstance(each, Flat) and _is_thin(each):
            groups.setdefault((each.motion, each.visibility), []).append(each)
    least = rays_cost_less_from(settings.tolerance)
    many = [own for own in groups.values() if sum(map(_count, own)) >= least]
    gone = {id(each) for own in many for each in own}
    kept = [each for each in records if id(each) not in gone]
    return [*kept, *map(_mesh, many)], sum(_count(each) for own in many for each in own)


def _count(record: Flat) -> int:
    """Number of faces."""
    return record.count if isinstance(record, ShapeBatch) else 1


def _materials(record: Flat) -> tuple[tuple[Material, ...], Ints]:
    """The materials, and the index of that of each face."""
    if isinstance(record, ShapeBatch):
        return record.materials, record.slot
    return (record.material,), np.zeros(1, dtype=np.int64)


def _is_thin(record: Flat) -> bool:
    """Whether at least half of the faces are thin, and none of them shines."""
    if any(any(each.emission) for each in _materials(record)[0]):
        return False
    corners = _corners(record)
    u, v = corners[1] - corners[0], corners[-1] - corners[0]
    edges = corners - np.roll(corners, 1, axis=0)
    longest = (edges**2).sum(axis=1).max(axis=0)
    area = np.linalg.norm(np.cross(u, v, axis=0), axis=0)
    return bool((MIN_ASPECT * area <= longest).mean() >= 0.5)


def _corners(record: Flat) -> Array:
    """Corners (3 or 4, 3, n) of the faces in order, metres."""
    if isinstance(record, Triangle | Triangles):
        return np.asarray(record.vertices, dtype=np.float64).reshape(3, 3, -1)
    corner, u, v = (
        np.asarray(each, dtype=np.float64).reshape(3, -1)
        for each in (record.corner, record.edge_u, record.edge_v)
    )
    return np.array([corner, corner + u, corner + u + v, corner + v])


def _mesh(records: Sequence[Flat]) -> TriangleMesh:
    """One mesh of shapes that move alike and are met by the same rays."""
    vertices, faces, slots = [], [], []
    materials: list[Material] = []
    first = 0
    for record in records:
        corners, (own, slot) = _corners(record), _materials(record)
        sides, _, count = corners.shape
        vertices.append(corners.transpose(1, 0, 2).reshape(3, -1))
        # corner k of face i is vertex k * count + i
        number = first + np.arange(sides * count).reshape(sides, count)
        for k in range(1, sides - 1):
            faces.append(number[[0, k, k + 1]])
            slots.append(slot + len(materials))
        materials += own
        first += sides * count
    distinct = list(dict.fromkeys(materials))
    place = np.array([distinct.index(each) for each in materials])
    some = records[0]
    return TriangleMesh(
        np.concatenate(vertices, axis=1),
        np.concatenate(faces, axis=1),
        place[np.concatenate(slots)],
        tuple(distinct),
        motion=some.motion,
        name=some.name,
        visibility=some.visibility,
    )
