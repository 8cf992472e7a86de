# SPDX-License-Identifier: GPL-3.0-or-later
"""All shapes of a scene: sets of one kind each, whose objects are numbered set after set."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from .planar_faces import NO_SOLID
from .shape import UNKNOWN_CURVATURE, ShapeSet

__all__ = ["ShapeTable"]


LONG_RUN_LENGTH = 1_024
"""Mean number of consecutive rows with the same object from which each run is a group of its
own."""


@dataclass(frozen=True)
class ShapeTable:
    """Sets of shapes; object numbers run through the first set, then the second, and so on.

    Attributes
    ----------
    sets : the sets, in the order of the registry; a set may be empty.
    """

    sets: tuple[ShapeSet, ...]

    @cached_property
    def firsts(self) -> tuple[int, ...]:
        """Number of each set's first object, and behind the last set the number of all objects."""
        return tuple(np.cumsum([0, *(each.count for each in self.sets)]).tolist())

    @property
    def count(self) -> int:
        """Number of objects."""
        return self.firsts[-1]

    def groups(self, item: Ints) -> Iterator[tuple[ShapeSet, Ints, Ints]]:
        """Split objects (m,), given by number, by kind; sets without any are left out.

        Yields
        ------
        The set, the rows (r,) of `item` that are of its kind, ascending, and their indices (r,)
        within the set. Numbers below 0, which stand for no object, are in no group.
        """
        left = item.size
        for shapes, first, end in zip(self.sets, self.firsts[:-1], self.firsts[1:], strict=True):
            if not left:
                return
            if first == end:
                continue
            own = item < end
            own &= item >= first
            rows = own.nonzero()[0]
            left -= rows.size
            if rows.size == item.size:
                yield shapes, rows, item - first if first else item
            elif rows.size:
                index = item[rows]
                yield shapes, rows, index - first if first else index

    def runs(self, item: Ints) -> Iterator[tuple[ShapeSet, slice | Ints, Ints]]:
        """Split objects (m,) like `groups`; where runs of one object are long, by run.

        The rows of a run are a slice, which copies nothing, and its index has one element, which
        broadcasts.
        """
        if not item.size:
            return
        starts = [0, *((item[1:] != item[:-1]).nonzero()[0] + 1).tolist()]
        if item.size < LONG_RUN_LENGTH * len(starts):
            yield from self.groups(item)
            return
        for a, b in zip(starts, [*starts[1:], item.size], strict=True):
            shapes, index = self.locate(int(item[a]))
            yield shapes, slice(a, b), np.array([index])

    def locate(self, item: int) -> tuple[ShapeSet, int]:
        """The set of an object given by number, and its index within the set."""
        number = int(np.searchsorted(self.firsts, item, side="right")) - 1
        return self.sets[number], item - self.firsts[number]

    def plane(self, item: Ints) -> tuple[Array, Array]:
        """Normals and points (3, m) of the planes of planar objects: see `ShapeSet.plane`."""
        normal, point = np.empty((2, 3, item.size))
        for shapes, rows, index in self.groups(item):
            if rows.size == item.size:
                return shapes.plane(index)
            normal[:, rows], point[:, rows] = shapes.plane(index)
        return normal, point

    def moved(self, point: Array, item: Ints, times: Sequence[Array]) -> list[Array]:
        """Points (3, m) that belong to objects, at each of some shutter times (m,)."""
        if self.displacement is None:
            return [point] * len(times)
        change = columns(self.displacement, item)
        return [point + time * change for time in times]

    def extent(self, item: Ints, direction: Array, time: Array) -> tuple[Array, Array]:
        """Least and greatest dot product (m,) of the points of objects with vectors (3, m).

        time : (m,) shutter times.
        """
        low, high = np.empty(item.size), np.empty(item.size)
        for shapes, rows, index in self.groups(item):
            if rows.size == item.size:
                return shapes.extent(index, direction, time)
            low[rows], high[rows] = shapes.extent(index, columns(direction, rows), time[rows])
        return low, high

    @cached_property
    def curvature(self) -> Array:
        """Curvatures (n,) of all objects' surfaces, 1 / m; 0 for planes."""
        return np.concatenate([each.curvature for each in self.sets])

    @cached_property
    def _curvature_or_none(self) -> Array:
        """Curvatures (n + 1,) of all objects' surfaces, and 0 for none."""
        return np.append(self.curvature, 0.0)

    def curvature_at(self, item: Ints, point: Array, certain: bool) -> Array:
        """Curvatures (m,) at points (3, m) of objects, 1 / m; 0 where no object is given (-1).

        certain : see `ShapeSet.curvature_at`.
        """
        found: Array = self._curvature_or_none[item]
        rows = (found == UNKNOWN_CURVATURE).nonzero()[0]
        for shapes, own, index in self.groups(item[rows]):
            found[rows[own]] = shapes.curvature_at(index, columns(point, rows[own]), certain)
        return found

    @cached_property
    def min_cosine(self) -> Array:
        """Least cosines (n,) between rays and normals: see `ShapeSet.min_cosine`."""
        return np.concatenate([each.min_cosine for each in self.sets])

    @cached_property
    def moves(self) -> Mask:
        """Whether each object (n,) moves relative to the camera during the shutter."""
        return np.concatenate([each.moves for each in self.sets])

    @cached_property
    def moves_under_fixed_ray(self) -> Mask:
        """Whether the point (n,) of each object that a fixed ray hits may move."""
        return np.concatenate([each.moves_under_fixed_ray for each in self.sets])

    @cached_property
    def displacement(self) -> Array | None:
        """Displacements (3, n) over the shutter, metres; None if no object moves."""
        if all(each.displacement is None for each in self.sets):
            return None
        parts = [
            np.zeros((3, each.count)) if each.displacement is None else each.displacement
            for each in self.sets
        ]
        return np.concatenate(parts, axis=1)

    @cached_property
    def bounding_spheres(self) -> tuple[Array, Array]:
        """Centres (3, n) and radii (n,), metres, of spheres around the objects at mid-shutter."""
        parts = [each.bounding_spheres for each in self.sets]
        center = np.concatenate([each[0] for each in parts], axis=1)
        return center, np.concatenate([each[1] for each in parts])

    @cached_property
    def inner_radii(self) -> Array:
        """Radii (n,), metres, of balls inside the objects: see `ShapeSet.inner_radii`."""
        return np.concatenate([each.inner_radii for each in self.sets])

    @cached_property
    def solid(self) -> Ints:
        """Number (n,) of the closed solid that each object is a face of, or `NO_SOLID`.

        It is the number of the solid's first face.
        """
        parts = []
        for shapes, first in zip(self.sets, self.firsts[:-1], strict=True):
            faces = shapes.faces
            own = np.full(shapes.count, NO_SOLID) if faces is None else faces.solid
            parts.append(np.where(own == NO_SOLID, NO_SOLID, own + first))
        return np.concatenate(parts)

    @cached_property
    def proxied(self) -> int:
        """Number of the first objects that fill their bounding spheres."""
        full = [each.fills_bounding_sphere for each in self.sets]
        number = full.index(False) if False in full else len(full)
        return self.firsts[number]

    @cached_property
    def planar(self) -> Mask:
        """Whether each object (n,) lies in a plane."""
        return np.repeat([each.planar for each in self.sets], np.diff(self.firsts))

    @cached_property
    def sampled(self) -> Mask:
        """Whether what each object (n,) covers and hides is known by rays only."""
        return np.repeat([each.sampled for each in self.sets], np.diff(self.firsts))
