# SPDX-License-Identifier: GPL-3.0-or-later
"""Detection of closed boxes among quads, so that faces turned away from a point can be skipped.

For a point outside a closed box, every segment that the box blocks enters it through a face whose
outer side the point sees. Faces seen from behind therefore add no occlusion and need no test.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...numerics.arrays import Array, Ints
from ...numerics.floats import TINY
from ...numerics.gather import columns
from ...numerics.vector import cross, dot
from ..planar_faces import NO_SOLID

__all__ = ["find_boxes", "outward_sign"]


BOX_FACES, BOX_CORNERS, FACES_PER_EDGE = 6, 8, 2
"""Numbers of faces and of corners of a box, and of faces that share an edge."""
LABEL_PASSES = 3
"""Number of label propagation passes over shared edges: any two faces of a box are at most two
edges apart."""
MERGE_TOLERANCE = 2.0**-20
"""Largest distance between corners that are merged into one, as a fraction of the shortest edge.
Blender's coordinates are rounded to 2^-24. A gap between two faces of at most this size lets
through no more of what the box hides."""
MIN_THICKNESS = 2.0**-10
"""Smallest distance of a face from its box's centroid, as a fraction of the face's longer edge, at
which the outward direction is certain."""


def find_boxes(
    q: Array,
    u: Array,
    v: Array,
    displacement: Array | None,
    names: Sequence[str] | NDArray[np.str_],
    met: Ints | None = None,
) -> Ints:
    """Find closed boxes among n quads.

    Parameters
    ----------
    q, u, v : (3, n) corners and edges, metres.
    displacement : (3, n) metres over the shutter, or None if no quad moves.
    names : object name of each quad. Quads of one name are joined first, since boxes may touch
        each other; then the quads that are left, whatever their names.
    met : (n,) numbers that are equal where the same rays meet quads; None if that is so for all.
        Where they do not, a face seen from behind may hide what the one before it lets through.

    Returns
    -------
    (n,) int64, the box of each quad: the index of its first face, or `NO_SOLID`.
    """
    solid = np.full(len(names), NO_SOLID)
    name = np.unique(np.array(names, dtype=np.str_), return_inverse=True)[1]
    same = np.zeros_like(name) if met is None else met
    for group in (name + name.size * same, same):
        rest = (solid == NO_SOLID).nonzero()[0]
        if rest.size < BOX_FACES:
            break
        own = columns(q, rest), columns(u, rest), columns(v, rest)
        moved = np.zeros_like(own[0]) if displacement is None else columns(displacement, rest)
        found = _boxes_in_group(*own, moved, group[rest])
        faces = (found != NO_SOLID).nonzero()[0]
        solid[rest[faces]] = rest[found[faces]]
    return solid


def _boxes_in_group(q: Array, u: Array, v: Array, moved: Array, group: Ints) -> Ints:
    """Find boxes as `find_boxes`, of quads with equal group number (n,) and equal motion.

    moved : (3, n) displacements over the shutter, metres.
    """
    count = group.size
    corner = np.stack([q, q + u, q + u + v, q + v], axis=2)
    length = np.sqrt(np.minimum(dot(u, u), dot(v, v)))
    kind: Ints = np.unique(np.stack([group, *moved]), axis=1, return_inverse=True)[1].ravel()
    vertex = _vertex_labels(corner, MERGE_TOLERANCE * float(length.min()), kind)
    ends = np.sort([vertex, np.roll(vertex, -1, axis=1)], axis=0)
    edge = np.unique(ends[0] * (4 * count) + ends[1], return_inverse=True)[1].reshape(count, 4)
    label = np.arange(count)
    for _ in range(LABEL_PASSES):
        least = np.full(edge.max() + 1, count)
        np.minimum.at(least, edge.ravel(), np.repeat(label, 4))
        label = np.minimum(label, least[edge].min(axis=1))
    closed = _has_distinct_count(label, BOX_FACES, np.arange(count))
    key, uses = np.unique(label[:, None] * (4 * count) + edge, return_counts=True)
    open_ = key[uses != FACES_PER_EDGE] // (4 * count)
    closed[np.isin(label, open_)] = False
    closed &= _has_distinct_count(label, BOX_CORNERS, vertex)
    solid = np.where(closed, label, NO_SOLID)
    thick = np.abs(_centroid_distances(q, u, v, solid))
    longest = np.sqrt(np.maximum(dot(u, u), dot(v, v)))
    flat = closed & ~(thick > MIN_THICKNESS * longest)
    solid[np.isin(label, label[flat])] = NO_SOLID
    return solid


def outward_sign(q: Array, u: Array, v: Array, solid: Ints) -> Array:
    """Sign (n,) that turns u x v out of the quad's box; 1 for quads of no box.

    q, u, v : (3, n) corners and edges, metres.  solid : (n,) as `find_boxes` returns it.
    """
    return np.where(_centroid_distances(q, u, v, solid) < 0.0, -1.0, 1.0)


def _centroid_distances(q: Array, u: Array, v: Array, solid: Ints) -> Array:
    """Signed distances (n,) of faces from the centroids of their boxes, along u x v."""
    height = np.zeros(solid.size)
    faces = (solid != NO_SOLID).nonzero()[0]
    if not faces.size:
        return height
    own = solid[faces]
    q, u, v = (columns(part, faces) for part in (q, u, v))
    middle, across = q + 0.5 * (u + v), cross(u, v)
    inside = np.array([np.bincount(own, row, solid.size) / BOX_FACES for row in middle])
    away = middle - columns(inside, own)
    height[faces] = dot(across, away) / np.maximum(np.sqrt(dot(across, across)), TINY)
    return height


def _vertex_labels(corner: Array, near: float, kind: Ints) -> Ints:
    """Labels (n, 4) of corners (3, n, 4), equal for corners of one kind at the same position.

    Sorted values of a coordinate count as equal if consecutive ones differ by at most `near`,
    metres.
    """
    place = []
    for values in corner.reshape(3, -1):
        order = np.argsort(values, kind="stable")
        number = np.zeros(values.size, dtype=np.int64)
        number[order[1:]] = np.cumsum(np.diff(values[order]) > near)
        place.append(number)
    key = np.stack([*place, np.repeat(kind, 4)])
    vertex: Ints = np.unique(key, axis=1, return_inverse=True)[1].reshape(corner.shape[1:])
    return vertex


def _has_distinct_count(label: Ints, count: int, what: Ints) -> NDArray[np.bool_]:
    """Whether the label of each quad (n,) occurs with exactly `count` distinct values of `what`.

    what : (n,) or (n, k) numbers of each quad.
    """
    number = np.broadcast_to(label if what.ndim == 1 else label[:, None], what.shape)
    each = np.unique(np.stack([number.ravel(), what.ravel()]), axis=1)[0]
    found: NDArray[np.bool_] = np.bincount(each, minlength=label.size)[label] == count
    return found
