# SPDX-License-Identifier: GPL-3.0-or-later
"""Samples that stand for a region must not lie behind what touches it: arms are pulled in.

Places come from moments, and a region need be neither convex nor as even as an ellipse: the arm
of a star may end beside it, where another object hides its own. Far behind that the light is what
it is in the region; where the two touch or cut each other it is dark, as a floor is below a ball
that rests on it, and no estimate tells.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.vector import dot
from ..shading.footprint import make_patch
from ..tracing.closest_approach import hits_or_near
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, pair_hits, surface
from ..visibility.fragments import Regions

__all__ = ["kept_parts"]


PARTS = (1.0, 0.7, 0.4, 0.0)
"""Of an arm: the lengths that are tried, one after the other. The last is the centroid."""
TOUCHING = 8.0
"""Times a region's extent: what is hidden from no farther than that may be in contact."""


def kept_parts(
    plan: Plan, found: Regions, region: Ints, middle: Array, arm: Array, half: Array, lot: Ints
) -> tuple[Array, Mask]:
    """How much of their arms m samples may keep so as not to lie just behind other objects.

    Parameters
    ----------
    found : all regions of the boxes.  region : (m,) which one each sample stands for.
    middle, arm : (3, m) centroids in x, y, t and what is added to them.
    half : (3, m) half the extents of the regions.
    lot : (m,) numbers, ascending, of samples that keep the same part.

    Returns
    -------
    part : (m,) one of `PARTS`.  stray : (m,) even the centroid lies there.
    """
    part = np.ones(region.size)
    number = np.bincount(found.box)
    # who is alone in its box has nothing before it
    open_ = (number[found.box[region]] > 1).nonzero()[0]
    for length in PARTS:
        if not open_.size:
            break
        part[open_] = length
        at = columns(middle, open_) + length * columns(arm, open_)
        lost = np.zeros(int(lot[-1]) + 1, dtype=np.bool_)
        own = region[open_], at, columns(half, open_)
        lost[lot[open_[_behind(plan, found, number.size, *own)]]] = True
        open_ = open_[lost[lot[open_]]]
    stray = np.zeros(region.size, dtype=np.bool_)
    stray[open_] = True
    return part, stray


def _behind(
    plan: Plan, found: Regions, boxes: int, region: Ints, place: Array, half: Array
) -> Ints:
    """Which samples, at m places, other objects of their boxes lie just before.

    boxes : how many there are.  The rest as `kept_parts`.
    """
    w = plan.lens.directions(place[0], place[1])
    time: Array | float = place[2] if plan.motion else 0.0
    item, box = found.item[region], found.box[region]
    own = hits_or_near(plan, w, item, time)
    shown = Pairs(found.box, found.item).of(box, boxes)
    shown = shown.take((shown.item >= 0) & (shown.item != item[shown.pixel]))
    sample, rival = shown.pixel, shown.item
    when = place[2, sample][:, None] if plan.motion else 0.0
    front = np.full(region.size, np.inf)
    np.minimum.at(front, sample, pair_hits(plan, columns(w, sample[:, None]), rival, when)[:, 0])
    rows: Ints = (front < own).nonzero()[0]
    w, t = columns(w, rows), own[rows]
    hits = surface(plan, w, t, item[rows], time[rows] if isinstance(time, np.ndarray) else time)
    with np.errstate(over="ignore", invalid="ignore"):  # sizes that only estimates hang on
        reach = make_patch(plan, w, t, hits, columns(half, rows)).reach
        near: Mask = (t - front[rows]) * np.sqrt(dot(w, w)) < TOUCHING * reach
    return rows[near]
