# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow rays: which segments from surface points to points on a light are occluded."""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from .compile import Plan
from .intersect import Pairs, Surface
from .solid_rays import SolidTracer

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
    plan: Plan,
    surface: Surface,
    to: Array,
    pairs: Pairs,
    time: Array | float,
    tracer: SolidTracer | None = None,
) -> Mask:
    """Which segments are intersected by one of the candidate occluders of their point.

    Parameters
    ----------
    surface : n points.  to : (3, n, k) metres, vectors from the points to points on a light.
    pairs : pairs of points and candidate occluders, sorted by point.
    time : shutter time, a number or (n, k).
    tracer : traces the spheres of a scene as one set: a point that has any of them as a
        candidate is tested against all. None where each pair is tested by itself.

    Returns
    -------
    (n, k) bool.
    """
    blocked = np.zeros(to.shape[1:], dtype=np.bool_)
    if tracer is not None:
        pairs = _trace_solids(tracer, surface, to, pairs, time, blocked)
    smooth = surface.smooth
    for rows, item in batches_by_rank(to.shape[1], pairs):
        for shapes, part, index in plan.shapes.groups(item):
            at = rows[part]
            when = time[at] if isinstance(time, np.ndarray) else time
            start, way = surface.point[:, at, None], columns(to, at)
            if shapes.sampled and smooth is not None:
                # facets would hide light from the smooth surface that they stand for
                rise = smooth.take(at).offsets(columns(surface.normal, at), way)
                start, way = start + rise, way - rise
            blocked[at] |= shapes.blocks(index[:, None], start, way, when)
    return blocked


def _trace_solids(
    tracer: SolidTracer,
    surface: Surface,
    to: Array,
    pairs: Pairs,
    time: Array | float,
    blocked: Mask,
) -> Pairs:
    """Mark segments (n, k) that spheres block, in place, and return the other pairs."""
    own = tracer.traced[pairs.item]
    some = np.zeros(to.shape[1], dtype=np.bool_)
    some[pairs.pixel[own]] = True
    at = some.nonzero()[0]
    if at.size:
        point, normal = columns(surface.point, at), columns(surface.normal, at)
        when = np.broadcast_to(time, blocked.shape)[at] if isinstance(time, np.ndarray) else time
        blocked[at] = tracer.blocked(point, normal, columns(to, at), when)
    return pairs.take(~own)
