# SPDX-License-Identifier: GPL-3.0-or-later
"""Detection over the shutter for visibility: may a moving object pass through a pixel?

The shapes tell when they cover the pixel during the shutter (`ShapeSet.moving_coverage`). The tests
are conservative: they never miss a passage.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs
from .separating_planes import are_tried, out_of_pixels

__all__ = ["detect_moving_silhouettes", "moves_under_fixed_ray"]


def detect_moving_silhouettes(
    plan: Plan, count: int, pairs: Pairs, w: Array, depth: Array, clear: Array
) -> tuple[Mask, Mask]:
    """Find the pixels in which a moving object may be visible at some time.

    Parameters
    ----------
    count : number of pixels.  pairs : their m candidate pairs with moving objects.
    w : (3, m) directions through the pixels' centres, per pair.
    depth : (count,) ray parameter beyond which objects at rest hide everything, inf for none.
    clear : (count,) ray parameter below which no object at rest is visible.

    Returns
    -------
    motion : (count,) a moving object may be visible, and its silhouette may pass through the pixel
        or the point that a fixed ray hits moves along the ray.
    outline : (count,) a moving silhouette, or a curve in which a moving object intersects another,
        may pass through the pixel's square (only with edges).
    """
    motion = np.zeros(count, dtype=np.bool_)
    outline = np.zeros(count, dtype=np.bool_)
    parts = []
    front = np.full(count, np.inf)
    for shapes, rows, index in plan.shapes.groups(pairs.item):
        chosen = pairs.take(rows)
        cover = shapes.moving_coverage(
            index, columns(w, rows), plan.lens, plan.settings.order, plan.edges
        )
        seen = cover.may_hit & (cover.near <= depth[chosen.pixel])
        if shapes.uneven and are_tried(plan):
            some = (seen & ~cover.covers).nonzero()[0]
            way = columns(w, rows[some])
            seen[some] &= ~out_of_pixels(plan, chosen.item[some], way, plan.edges, moving=True)
        parts.append((chosen, cover, seen))
        np.minimum.at(front, chosen.pixel[cover.covers], cover.far[cover.covers])
    movers = np.zeros(count, dtype=np.int64)
    for chosen, cover, seen in parts:
        # an object is invisible behind another that covers the pixel all the time
        seen = seen & (cover.near <= front[chosen.pixel])
        shifts = moves_under_fixed_ray(plan, chosen.item)
        motion[chosen.pixel[seen & (shifts | ~cover.covers)]] = True
        # a silhouette, or an intersection with an object at rest
        cut = ~cover.covers | (cover.far > clear[chosen.pixel])
        outline[chosen.pixel[seen & cut]] = True
        movers += np.bincount(chosen.pixel[seen], minlength=count)
    # or an intersection of two moving objects
    outline |= movers > 1
    if not plan.edges:
        outline[:] = False
    return motion, outline


def moves_under_fixed_ray(plan: Plan, item: Ints) -> Mask:
    """Whether the point that a fixed ray hits moves with the object: (n,) for objects, -1 for none.

    It does on a moving sphere, and on a moving polygon unless that moves within its own plane.
    """
    return np.append(plan.shapes.moves_under_fixed_ray, False)[item]
