# SPDX-License-Identifier: GPL-3.0-or-later
"""Depth order of objects, where it is the same for all rays of a box.

Two objects on opposite sides of a plane have the same depth order for every camera off that plane:
the object on the camera's side is in front. Separating planes are the planes of planar objects and,
for two solids whose bounding spheres do not intersect, the radical plane of these spheres, where
the tangents to both have equal length. All else moves linearly in time, so that the ends of a box's
time interval decide.
"""

from __future__ import annotations

import numpy as np

from ..geometry.line_forms import BoxCoverage
from ..geometry.shape_table import ShapeTable
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.box_polynomials import Boxes
from ..numerics.gather import columns
from ..numerics.vector import dot
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs

__all__ = ["find_depth_order"]


CONTACT_TOLERANCE = 2.0**-30
"""Overlap up to which two objects count as touching and not as intersecting, as a fraction of the
size of what is compared. Objects that touch may overlap by rounding, to no visible effect. A scene
at a distance of a million times its size is rounded to some 2^-33 of its size."""


def find_depth_order(
    plan: Plan, boxes: Boxes, pairs: Pairs, cover: BoxCoverage, count: Ints
) -> tuple[Ints, Mask, Mask, tuple[Ints, Ints]]:
    """Rank of each candidate in the depth order of its box, and whether that order is known.

    Parameters
    ----------
    pairs : (m,) candidates, sorted by box and then by `cover.near`.
    count : (n,) number of candidates of each box.

    Returns
    -------
    rank : (m,) number of candidates of the box that are in front, from 0; all are different within
        a box whose order is known.
    ordered : (n,) whether the depth order is known.
    curved : (n,) whether the box has two objects, neither of them planar, whose order is not known.
    unordered : (p,) and (p,) pairs of candidates whose order is not known.
    """
    box, m = pairs.pixel, pairs.item.size
    rank = np.zeros(m, dtype=np.int64)
    ordered = np.ones(count.size, dtype=np.bool_)
    curved = np.zeros(count.size, dtype=np.bool_)
    open_: list[tuple[Ints, Ints]] = [(np.zeros(0, dtype=np.int64),) * 2]
    for step in range(1, int(count.max(initial=1))):
        one = (box[step:] == box[:-step]).nonzero()[0]
        other = one + step
        behind = other.copy()
        unsure = (cover.far[one] >= cover.near[other]).nonzero()[0]
        a, b = one[unsure], other[unsure]
        ahead = _compare(plan.shapes, boxes, box[a], pairs.item[a], pairs.item[b])
        behind[unsure] = np.where(ahead < 0, a, b)
        open_.append((a[ahead == 0], b[ahead == 0]))
        rank += np.bincount(behind, minlength=m)
    one, other = (np.concatenate(each) for each in zip(*open_, strict=True))
    ordered[box[one]] = False
    planar = plan.shapes.planar
    solid = ~(planar[pairs.item[one]] | planar[pairs.item[other]])
    curved[box[one[solid]]] = True
    # a cycle of objects has no depth order: two of them then have the same rank
    start = np.cumsum(count) - count
    order = np.lexsort((rank, box))
    ordered[box[rank[order] != np.arange(m) - start[box]]] = False
    return rank, ordered, curved, (one, other)


def _compare(shapes: ShapeTable, boxes: Boxes, box: Ints, a: Ints, b: Ints) -> Ints:
    """1 where object a is in front of b for all rays of a box, -1 where behind, 0 if not known."""
    sign = np.where(a <= b, 1, -1)
    a, b = np.minimum(a, b), np.maximum(a, b)
    known = np.zeros(a.size, dtype=np.int64)
    times = boxes.low[2, box], boxes.high[2, box]
    planar, other_planar = shapes.planar[a], shapes.planar[b]
    rows = (~(planar | other_planar)).nonzero()[0]
    if rows.size:
        ends = times[0][rows], times[1][rows]
        known[rows] = _compare_by_radical_plane(shapes, a[rows], b[rows], ends)
    rows = other_planar.nonzero()[0]
    if rows.size:
        ends = times[0][rows], times[1][rows]
        known[rows] = _compare_by_plane(shapes, a[rows], b[rows], ends)
    rows = (planar & (known == 0)).nonzero()[0]
    if rows.size:
        ends = times[0][rows], times[1][rows]
        known[rows] = -_compare_by_plane(shapes, b[rows], a[rows], ends)
    return sign * known


def _compare_by_radical_plane(
    shapes: ShapeTable, a: Ints, b: Ints, times: tuple[Array, Array]
) -> Ints:
    """`_compare` for two objects by the radical plane of their bounding spheres."""
    center, radius = shapes.bounding_spheres
    displacement = shapes.displacement

    def centers(item: Ints) -> list[Array]:
        rest = columns(center, item)
        if displacement is None:
            return [rest, rest]
        change = columns(displacement, item)
        return [rest + time * change for time in times]

    (a0, a1), (b0, b1) = centers(a), centers(b)
    start, turn = b0 - a0, (b1 - a1) - (b0 - a0)
    square = dot(turn, turn)
    part = np.where(square > 0.0, -dot(start, turn), 0.0) / np.where(square > 0.0, square, 1.0)
    closest = start + np.clip(part, 0.0, 1.0) * turn
    reach = (radius[a] + radius[b]) * (1.0 - CONTACT_TOLERANCE)
    apart = dot(closest, closest) >= reach * reach
    # the difference of the powers is quadratic in time: it leaves the chord by a quarter of its
    # leading coefficient at most
    extra = (radius[a] - radius[b]) * (radius[a] + radius[b])
    powers = [dot(q - p, q + p) + extra for p, q in ((a0, b0), (a1, b1))]
    bend = 0.25 * np.abs(dot(b1 - b0, b1 - b0) - dot(a1 - a0, a1 - a0))
    first = apart & (np.minimum(*powers) > bend)
    last = apart & (np.maximum(*powers) < -bend)
    known: Ints = first.astype(np.int64) - last
    return known


def _compare_by_plane(shapes: ShapeTable, a: Ints, b: Ints, times: tuple[Array, Array]) -> Ints:
    """`_compare` for objects a and planar objects b, by the planes of the latter."""
    least, most = np.full(a.size, np.inf), np.full(a.size, -np.inf)
    heights = []
    for time in times:
        normal, height = shapes.plane(b, time)
        low, high = shapes.extent(a, normal, time)
        # signed distances from the plane, positive on the side of the camera
        side = np.where(height < 0.0, -1.0, 1.0)
        least = np.minimum(least, np.where(side > 0.0, height - high, low - height))
        most = np.maximum(most, np.where(side > 0.0, height - low, high - height))
        heights.append(height)
    seen = heights[0] * heights[1] > 0.0
    size = np.sqrt(dot(normal, normal)) * shapes.bounding_spheres[1][a]
    slack = CONTACT_TOLERANCE * np.maximum(np.abs(heights[0]), size)
    first, last = seen & (least >= -slack), seen & (most <= slack)
    known: Ints = first.astype(np.int64) - (last & ~first)
    return known
