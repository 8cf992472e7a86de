# SPDX-License-Identifier: GPL-3.0-or-later
"""Depth order of objects, where it is the same for all rays of a box.

Two objects on opposite sides of a plane have the same depth order for every camera off that plane:
the object on the camera's side is in front. Separating planes are the plane of a quad and, for two
spheres that do not intersect, their radical plane, where the tangents to both have equal length.
All else moves linearly in time, so that the ends of a box's time interval decide.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.vector import cross, dot
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs
from .polynomials import Boxes, Coverage

__all__ = ["find_depth_order"]


CONTACT_TOLERANCE = 2.0**-30
"""Overlap up to which two objects count as touching and not as intersecting, as a fraction of the
size of what is compared. Objects that touch may overlap by rounding, to no visible effect. A scene
at a distance of a million times its size is rounded to some 2^-33 of its size."""


def find_depth_order(
    plan: Plan, boxes: Boxes, pairs: Pairs, cover: Coverage, number: Ints
) -> tuple[Ints, Mask, Mask, tuple[Ints, Ints]]:
    """Rank of each candidate in the depth order of its box, and whether that order is known.

    Parameters
    ----------
    pairs : (m,) candidates, sorted by box and then by `cover.near`.  number : (n,) candidates of
    each box.

    Returns
    -------
    rank : (m,) number of candidates of the box that are in front, from 0; all are different within
    a box whose order is known.
    settled : (n,) whether the depth order is known.
    balls : (n,) whether the box has two spheres whose order is not known.
    unsure : (p,) and (p,) pairs of candidates whose order is not known.
    """
    box, m = pairs.pixel, pairs.item.size
    rank = np.zeros(m, dtype=np.int64)
    settled = np.ones(number.size, dtype=np.bool_)
    balls = np.zeros(number.size, dtype=np.bool_)
    open_: list[tuple[Ints, Ints]] = [(np.zeros(0, dtype=np.int64),) * 2]
    for step in range(1, int(number.max(initial=1))):
        one = (box[step:] == box[:-step]).nonzero()[0]
        other = one + step
        behind = other.copy()
        unsure = (cover.far[one] >= cover.near[other]).nonzero()[0]
        a, b = one[unsure], other[unsure]
        ahead = _compare(plan, boxes, box[a], pairs.item[a], pairs.item[b])
        behind[unsure] = np.where(ahead < 0, a, b)
        open_.append((a[ahead == 0], b[ahead == 0]))
        rank += np.bincount(behind, minlength=m)
    one, other = (np.concatenate(each) for each in zip(*open_, strict=True))
    settled[box[one]] = False
    spheres = np.maximum(pairs.item[one], pairs.item[other]) < plan.sphere_count
    balls[box[one[spheres]]] = True
    # a cycle of objects has no depth order: two of them then have the same rank
    start = np.cumsum(number) - number
    order = np.lexsort((rank, box))
    settled[box[rank[order] != np.arange(m) - start[box]]] = False
    return rank, settled, balls, (one, other)


def _compare(plan: Plan, boxes: Boxes, box: Ints, a: Ints, b: Ints) -> Ints:
    """1 where object a is in front of b for all rays of a box, -1 where behind, 0 if not known."""
    sign = np.where(a <= b, 1, -1)
    a, b = np.minimum(a, b), np.maximum(a, b)
    known = np.zeros(a.size, dtype=np.int64)
    times = boxes.low[2, box], boxes.high[2, box]
    ball, other_ball = a < plan.sphere_count, b < plan.sphere_count
    # spheres come first, so `a` is a sphere wherever one of the two is
    rows = other_ball.nonzero()[0]
    if rows.size:
        known[rows] = _compare_spheres(plan, a[rows], b[rows], (times[0][rows], times[1][rows]))
    rows = (~other_ball).nonzero()[0]
    if rows.size:
        ends = times[0][rows], times[1][rows]
        known[rows] = _compare_by_quad_plane(plan, a[rows], b[rows], ends)
    rows = (~ball & (known == 0)).nonzero()[0]
    if rows.size:
        ends = times[0][rows], times[1][rows]
        known[rows] = -_compare_by_quad_plane(plan, b[rows], a[rows], ends)
    return sign * known


def _compare_spheres(plan: Plan, a: Ints, b: Ints, times: tuple[Array, Array]) -> Ints:
    """`_compare` for two spheres, by their radical plane."""
    spheres = plan.spheres
    radius = spheres.radius
    (a0, a1), (b0, b1) = ([spheres.moved(i, t) for t in times] for i in (a, b))
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


def _compare_by_quad_plane(plan: Plan, a: Ints, b: Ints, times: tuple[Array, Array]) -> Ints:
    """`_compare` for objects a and quads b, by the planes of the quads."""
    quads, ids = plan.quads, b - plan.sphere_count
    normal = cross(columns(quads.edge_u, ids), columns(quads.edge_v, ids))
    size = np.sqrt(dot(normal, normal))
    least, most = np.full(a.size, np.inf), np.full(a.size, -np.inf)
    heights = []
    for time in times:
        corner = quads.corners_at(ids, time)
        height = dot(normal, corner)
        low, high = _extent(plan, a, time, normal)
        # signed distances from the plane, positive on the side of the camera
        side = np.where(height < 0.0, -1.0, 1.0)
        least = np.minimum(least, np.where(side > 0.0, height - high, low - height))
        most = np.maximum(most, np.where(side > 0.0, height - low, high - height))
        heights.append(height)
    seen = heights[0] * heights[1] > 0.0
    slack = CONTACT_TOLERANCE * np.maximum(np.abs(heights[0]), size * _bounding_radius(plan, a))
    first, last = seen & (least >= -slack), seen & (most <= slack)
    known: Ints = first.astype(np.int64) - (last & ~first)
    return known


def _bounding_radius(plan: Plan, item: Ints) -> Array:
    """Radii (m,) of bounding balls of objects."""
    radius: Array = np.concatenate([plan.spheres.radius, plan.quads.bounding_spheres[1]])[item]
    return radius


def _extent(plan: Plan, item: Ints, time: Array, normal: Array) -> tuple[Array, Array]:
    """Least and greatest dot product (m,) of the points of objects with vectors (3, m)."""
    low, high = np.empty(item.size), np.empty(item.size)
    rows = (item < plan.sphere_count).nonzero()[0]
    middle = dot(plan.spheres.moved(item[rows], time[rows]), columns(normal, rows))
    reach = plan.spheres.radius[item[rows]] * np.sqrt(
        dot(columns(normal, rows), columns(normal, rows))
    )
    low[rows], high[rows] = middle - reach, middle + reach
    rows = (item >= plan.sphere_count).nonzero()[0]
    ids = item[rows] - plan.sphere_count
    corner = dot(plan.quads.corners_at(ids, time[rows]), columns(normal, rows))
    u = dot(columns(plan.quads.edge_u, ids), columns(normal, rows))
    v = dot(columns(plan.quads.edge_v, ids), columns(normal, rows))
    low[rows] = corner + np.minimum(u, 0.0) + np.minimum(v, 0.0)
    high[rows] = corner + np.maximum(u, 0.0) + np.maximum(v, 0.0)
    return low, high
