# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow rays: which segments from surface points to points on a light are occluded."""

from __future__ import annotations

import numpy as np

from ..geometry.parallelogram import edge_planes, quad_blocks_segment, snapped_height
from ..geometry.sphere import sphere_blocks_segment, surface_tolerance
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.vector import dot
from .compile import Plan
from .intersect import Pairs

__all__ = ["batches_by_rank", "blocked_segments"]


def batches_by_rank(count: int, pairs: Pairs) -> list[tuple[Ints, Ints]]:
    """Split pairs, sorted by pixel, into batches: the k-th holds the k-th pair of every pixel.

    Returns
    -------
    [(pixel, item), ...]. No pixel is twice in a batch, so that it can be assigned by one index.
    """
    sizes = np.bincount(pairs.pixel, minlength=count)
    starts = np.cumsum(sizes) - sizes
    rows = sizes.nonzero()[0]
    out = []
    rank = 0
    while rows.size:
        out.append((rows, pairs.item[starts[rows] + rank]))
        rank += 1
        rows = rows[sizes[rows] > rank]
    return out


def blocked_segments(
    plan: Plan, point: Array, to: Array, pairs: Pairs, time: Array | float
) -> Mask:
    """Which segments are intersected by one of the candidate occluders of their point.

    Parameters
    ----------
    point : (3, n) metres.  to : (3, n, k) metres, vectors from the points to points on a light.
    pairs : pairs of points and candidate occluders, sorted by point.
    time : shutter time, a number or (n, k).

    Returns
    -------
    (n, k) bool.
    """
    blocked = np.zeros(to.shape[1:], dtype=np.bool_)
    for rows, item in batches_by_rank(to.shape[1], pairs):
        ball = item < plan.sphere_count
        for part, is_sphere in ((ball.nonzero()[0], True), ((~ball).nonzero()[0], False)):
            if not part.size:
                continue
            at, ids = rows[part], item[part][:, None]
            when = time[at] if isinstance(time, np.ndarray) else time
            start = point[:, at, None]
            if is_sphere:
                center = plan.spheres.moved(ids, when)
                radius = plan.spheres.radius[ids]
                graze = surface_tolerance(start, radius)
                hit = sphere_blocks_segment(columns(to, at), center - start, radius, graze)
            else:
                ids = ids - plan.sphere_count
                q = plan.quads.moved(ids, when) - start
                u, v = columns(plan.quads.edge_u, ids), columns(plan.quads.edge_v, ids)
                planes, normal, height = edge_planes(q, u, v)
                height = snapped_height(
                    height, normal, surface_tolerance(start, np.sqrt(dot(q, q)))
                )
                hit = quad_blocks_segment(columns(to, at), planes, normal, height)
            blocked[at] |= hit
    return blocked
