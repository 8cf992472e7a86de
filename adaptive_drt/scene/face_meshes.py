# SPDX-License-Identifier: GPL-3.0-or-later
"""Flat faces as meshes: many small parallelograms and triangles that light is not summed for in
closed form, but whose rays are traced.

Closed forms of polygons cost more the more of them a point sees, under a sky all above its horizon.
From some number on rays cost less: `detection.face_costs` says from which.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from ..numerics.floats import TINY
from .description import (
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
from .triangle_mesh import TriangleMesh

__all__ = ["faces_as_meshes", "flat_faces"]

Corners = NDArray[np.float64]
Group = tuple[Motion | None, Visibility]

LARGE_FACE = 64.0
"""Area, in medians of all faces, from which a face is large."""
MOST_LARGE = 24
"""Number of large faces up to which they stay what they are: floors and walls before which the
others stand. They then keep their closed forms, and pixels that only they fill and light cost
little."""
MOST_GROUPS = 16
"""Largest number of meshes that are made: one of all faces that move alike and are seen alike."""
ROUNDING = 2.0**-44
"""Distance, as a fraction of the largest coordinate, up to which corners are one: those of two
faces at a common edge differ by some rounding of 2^-53."""
NAME = "Flat faces"


def flat_faces(shapes: Iterable[ShapeRecord]) -> int:
    """Return the number of parallelograms and triangles that `faces_as_meshes` would replace."""
    found = _Faces(list(shapes))
    return int(found.replaced.sum())


def faces_as_meshes(shapes: Sequence[ShapeRecord]) -> tuple[ShapeRecord, ...]:
    """Return shapes with the flat faces among them as meshes.

    Those that shine, which are lights, and few large ones (`LARGE_FACE`) stay what they are, and
    all do where they move in too many ways (`MOST_GROUPS`).
    """
    found = _Faces(list(shapes))
    return (*found.others(), *found.meshes())


class _Faces:
    """The flat faces of records.

    Attributes
    ----------
    replaced : (n,) bool, of all faces in the order of their records, whether a mesh replaces them.
    """

    def __init__(self, records: list[ShapeRecord]) -> None:
        self._records = records
        self._flat = [
            each for each in records if isinstance(each, Quads | Triangles | Quad | Triangle)
        ]
        self._corners = [_corners(each) for each in self._flat]
        counts = [each.shape[2] for each in self._corners]
        self._starts = np.cumsum([0, *counts])
        dark = [_is_dark(each) for each in self._flat]
        self.replaced = np.concatenate([np.zeros(0, dtype=np.bool_), *dark])
        size = np.concatenate([np.zeros(0), *map(_areas, self._corners)])
        if self.replaced.any():
            large = self.replaced & (size > LARGE_FACE * float(np.median(size[self.replaced])))
            if large.sum() <= MOST_LARGE:
                self.replaced &= ~large
        if len(self._groups()) > MOST_GROUPS:
            self.replaced[:] = False

    def _groups(self) -> dict[Group, list[int]]:
        """Numbers of the records with faces that are replaced, by how they move and are seen."""
        groups: dict[Group, list[int]] = {}
        for number, each in enumerate(self._flat):
            if self._own(number).any():
                groups.setdefault((each.motion, each.visibility), []).append(number)
        return groups

    def _own(self, number: int) -> NDArray[np.bool_]:
        """Which faces of a record are replaced."""
        own: NDArray[np.bool_] = self.replaced[self._starts[number] : self._starts[number + 1]]
        return own

    def others(self) -> list[ShapeRecord]:
        """The records without the faces that are replaced."""
        numbers = {id(each): number for number, each in enumerate(self._flat)}
        kept: list[ShapeRecord] = []
        for record in self._records:
            number = numbers.get(id(record))
            own = np.zeros(1, dtype=np.bool_) if number is None else self._own(number)
            if not own.any():
                kept.append(record)
            elif not own.all():
                assert isinstance(record, ShapeBatch)
                kept.append(record.take(~own))
        return kept

    def meshes(self) -> list[TriangleMesh]:
        """The meshes that stand for the faces."""
        return [self._mesh(group, numbers) for group, numbers in self._groups().items()]

    def _mesh(self, group: Group, numbers: list[int]) -> TriangleMesh:
        materials: dict[Material, int] = {}
        corners, slots = [], []
        for number in numbers:
            own, record = self._own(number), self._flat[number]
            corners.append(self._corners[number][..., own])
            worn = _materials(record)
            slot = np.array([materials.setdefault(each, len(materials)) for each in worn])
            slots.append(slot[_slots(record)[own]])
        vertices, faces, owner = _triangles(corners)
        motion, visibility = group
        names = {self._flat[number].name for number in numbers}
        return TriangleMesh(
            vertices,
            faces,
            np.concatenate(slots)[owner],
            tuple(materials),
            motion=motion,
            name=names.pop() if len(names) == 1 else NAME,
            visibility=visibility,
        )


def _triangles(
    parts: list[Corners],
) -> tuple[Corners, NDArray[np.int64], NDArray[np.int64]]:
    """Vertices (3, v), triangles (3, t) and the face (t,) of each, of faces (3, 3 or 4, n)."""
    points, faces, owners, first, before = [], [], [], 0, 0
    for each in parts:
        count, number = each.shape[1:]
        base = first + np.arange(number)
        points.append(each.reshape(3, -1))
        for k in range(1, count - 1):
            faces.append(np.stack([base, base + k * number, base + (k + 1) * number]))
            owners.append(before + np.arange(number))
        first, before = first + count * number, before + number
    vertices, corners = np.concatenate(points, axis=1), np.concatenate(faces, axis=1)
    # corners that rounding alone sets apart are one, so that faces meet at their common edges
    cell = max(float(np.abs(vertices).max()), TINY) * ROUNDING
    _, one, place = np.unique(
        np.rint(vertices / cell), axis=1, return_index=True, return_inverse=True
    )
    return vertices[:, one], place.reshape(-1)[corners], np.concatenate(owners)


def _corners(record: Quads | Triangles | Quad | Triangle) -> Corners:
    """Corners (3, k, n) of the faces of a record, metres."""
    if isinstance(record, Quad | Quads):
        fields = (record.corner, record.edge_u, record.edge_v)
        a, u, v = (np.asarray(each, dtype=np.float64).reshape(3, -1) for each in fields)
        return np.stack([a, a + u, a + u + v, a + v], axis=1)
    vertices = np.asarray(record.vertices, dtype=np.float64).reshape(3, 3, -1)
    return np.ascontiguousarray(np.moveaxis(vertices, 0, 1))


def _areas(corners: Corners) -> Corners:
    """Areas (n,) of faces (3, k, n), of a triangle as of the parallelogram that it is half of."""
    u, v = corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0]
    area: Corners = np.linalg.norm(np.cross(u, v, axis=0), axis=0)
    return area


def _materials(record: Quads | Triangles | Quad | Triangle) -> tuple[Material, ...]:
    return record.materials if isinstance(record, ShapeBatch) else (record.material,)


def _slots(record: Quads | Triangles | Quad | Triangle) -> NDArray[np.int64]:
    """The number (n,) of the material of each face of a record."""
    return record.slot if isinstance(record, ShapeBatch) else np.zeros(1, dtype=np.int64)


def _is_dark(record: Quads | Triangles | Quad | Triangle) -> NDArray[np.bool_]:
    """Whether each face (n,) of a record does not shine."""
    dark = np.array([not any(each.emission) for each in _materials(record)], dtype=np.bool_)
    return dark[_slots(record)]
