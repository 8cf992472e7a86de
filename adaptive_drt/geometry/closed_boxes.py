# SPDX-License-Identifier: GPL-3.0-or-later
"""Closed boxes among quads: a point before some of their faces needs none of those it is behind.

What a box hides from a point outside lies beyond a face that the point is before: the segment to
it enters there.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array, Ints
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import cross, dot
from .parallelogram import QuadSet

__all__ = ["NO_SOLID", "find_boxes", "outward"]


NO_SOLID = -1
FACES, CORNERS, SHARED = 6, 8, 2
"""Of a box; and how many of its faces share an edge."""
ROUNDS = 3
"""Faces that share edges are told of each other so often: any two of a box are two edges apart."""
MERGED = 2.0**-20
"""Of the shortest edge: corners nearer to each other are one. Blender's are rounded to 2^-24. What
shines through between two faces is no more of what the box hides."""
THIN = 2.0**-10
"""Of a face's longer edge: how far it lies from its box's middle, at least, so that it is clear
which side is out."""


def find_boxes(quads: QuadSet, names: Sequence[str]) -> Ints:
    """The box (n,) that each of n quads is a face of: the number of its first face, or `NO_SOLID`.

    names : quads of one name make boxes first, for boxes may touch; then those that are left.
    """
    solid = np.full(len(names), NO_SOLID)
    name = np.unique(np.array(names, dtype=np.str_), return_inverse=True)[1]
    for group in (name, np.zeros_like(name)):
        rest = (solid == NO_SOLID).nonzero()[0]
        if rest.size < FACES:
            break
        found = _closed(quads.take(rest), group[rest])
        faces = (found != NO_SOLID).nonzero()[0]
        solid[rest[faces]] = rest[found[faces]]
    return solid


def _closed(quads: QuadSet, group: Ints) -> Ints:
    """As `find_boxes`, of quads of one group (n,) that move alike."""
    q, u, v = quads.corner, quads.edge_u, quads.edge_v
    count = group.size
    corner = np.stack([q, q + u, q + u + v, q + v], axis=2)
    length = np.sqrt(np.minimum(dot(u, u), dot(v, v)))
    vertex = _vertices(corner, MERGED * float(length.min()), _kinds(quads, group))
    ends = np.sort([vertex, np.roll(vertex, -1, axis=1)], axis=0)
    edge = np.unique(ends[0] * (4 * count) + ends[1], return_inverse=True)[1].reshape(count, 4)
    label = np.arange(count)
    for _ in range(ROUNDS):
        least = np.full(edge.max() + 1, count)
        np.minimum.at(least, edge.ravel(), np.repeat(label, 4))
        label = np.minimum(label, least[edge].min(axis=1))
    closed = _all_of(label, FACES, np.arange(count))
    key, uses = np.unique(label[:, None] * (4 * count) + edge, return_counts=True)
    open_ = key[uses != SHARED] // (4 * count)
    closed[np.isin(label, open_)] = False
    closed &= _all_of(label, CORNERS, vertex)
    solid = np.where(closed, label, NO_SOLID)
    thick = np.abs(_heights(quads, solid))
    longest = np.sqrt(np.maximum(dot(u, u), dot(v, v)))
    flat = closed & ~(thick > THIN * longest)
    solid[np.isin(label, label[flat])] = NO_SOLID
    return solid


def outward(quads: QuadSet, solid: Ints) -> Array:
    """1 or -1 (n,): times edge_u x edge_v, what points out of the boxes; 1 for other quads."""
    return np.where(_heights(quads, solid) < 0.0, -1.0, 1.0)


def _heights(quads: QuadSet, solid: Ints) -> Array:
    """How far (n,) faces lie from the middles of their boxes, along edge_u x edge_v."""
    height = np.zeros(solid.size)
    faces = (solid != NO_SOLID).nonzero()[0]
    if not faces.size:
        return height
    own, some = solid[faces], quads.take(faces)
    middle, across = some.bounds[0], cross(some.edge_u, some.edge_v)
    inside = np.array([np.bincount(own, row, solid.size) / FACES for row in middle])
    away = middle - columns(inside, own)
    height[faces] = dot(across, away) / np.maximum(np.sqrt(dot(across, across)), TINY)
    return height


def _kinds(quads: QuadSet, group: Ints) -> Ints:
    """Numbers (n,), alike for quads of one group that move alike."""
    moved = np.zeros_like(quads.corner) if quads.displacement is None else quads.displacement
    kinds: Ints = np.unique(np.stack([group, *moved]), axis=1, return_inverse=True)[1].ravel()
    return kinds


def _vertices(corner: Array, near: float, kind: Ints) -> Ints:
    """Numbers (n, 4) of corners (3, n, 4), alike for those nearer than that to each other."""
    place = []
    for values in corner.reshape(3, -1):
        order = np.argsort(values, kind="stable")
        number = np.zeros(values.size, dtype=np.int64)
        number[order[1:]] = np.cumsum(np.diff(values[order]) > near)
        place.append(number)
    key = np.stack([*place, np.repeat(kind, 4)])
    vertex: Ints = np.unique(key, axis=1, return_inverse=True)[1].reshape(corner.shape[1:])
    return vertex


def _all_of(label: Ints, count: int, what: Ints) -> NDArray[np.bool_]:
    """Whether quads (n,) are of a label with so many different things (n,) or (n, k)."""
    number = np.broadcast_to(label if what.ndim == 1 else label[:, None], what.shape)
    each = np.unique(np.stack([number.ravel(), what.ravel()]), axis=1)[0]
    found: NDArray[np.bool_] = np.bincount(each, minlength=label.size)[label] == count
    return found
