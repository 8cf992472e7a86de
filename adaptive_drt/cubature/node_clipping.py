# SPDX-License-Identifier: GPL-3.0-or-later
"""Cubature nodes that are hidden by a touching object are moved towards their centroid.

Nodes are placed by moments, and a visible region need be neither convex nor elliptical: a node may
lie beside it, where another object hides the region's own. If that object is far in front, the
light on the hidden surface is like that in the region; but where the two touch or intersect, the
hidden surface is dark, as is a floor below a sphere that rests on it, and no error estimate shows
it.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.vector import dot
from ..shading.footprint import make_patch
from ..tracing.closest_approach import hits_or_closest_points
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, intersect_pairs, surface
from ..visibility.fragments import Fragments

__all__ = ["clip_nodes"]


SCALES = (1.0, 0.7, 0.4, 0.0)
"""Scale factors of a node's offset that are tried one after the other. The last is the centroid.
Chosen, not fitted."""
CONTACT_DEPTH = 8.0
"""Depth difference, as a multiple of a region's extent on the surface, up to which an object that
hides a node may be in contact with the surface. Chosen, not fitted."""


def clip_nodes(
    plan: Plan, found: Fragments, region: Ints, middle: Array, arm: Array, half: Array, group: Ints
) -> tuple[Array, Mask]:
    """Scale factors of the offsets of m nodes for which no other object lies just in front of them.

    Parameters
    ----------
    found : all visible regions of the boxes.  region : (m,) the region of each node.
    middle, arm : (3, m) centroids in x, y, t and the offsets added to them.
    half : (3, m) half extents of the regions.
    lot : (m,) groups, ascending: nodes of a group get the same factor.

    Returns
    -------
    part : (m,) one of `SCALES`.  stray : (m,) whether the node is hidden even at the centroid.
    """
    part = np.ones(region.size)
    number = np.bincount(found.box)
    # the only region of a box has nothing in front of it
    open_ = (number[found.box[region]] > 1).nonzero()[0]
    for length in SCALES:
        if not open_.size:
            break
        part[open_] = length
        at = columns(middle, open_) + length * columns(arm, open_)
        open_groups = np.zeros(int(group[-1]) + 1, dtype=np.bool_)
        own = region[open_], at, columns(half, open_)
        open_groups[group[open_[_hidden_nodes(plan, found, number.size, *own)]]] = True
        open_ = open_[open_groups[group[open_]]]
    hidden = np.zeros(region.size, dtype=np.bool_)
    hidden[open_] = True
    return part, hidden


def _hidden_nodes(
    plan: Plan, found: Fragments, boxes: int, region: Ints, place: Array, half: Array
) -> Ints:
    """Indices of nodes, at m positions, that have another object of their box just in front of
    them.

    boxes : number of boxes.  The other parameters are those of `clip_nodes`.
    """
    w = plan.lens.directions(place[0], place[1])
    time: Array | float = place[2] if plan.motion else 0.0
    item, box = found.item[region], found.box[region]
    own = hits_or_closest_points(plan, w, item, time)
    shown = Pairs(found.box, found.item).for_pixels(box, boxes)
    shown = shown.take((shown.item >= 0) & (shown.item != item[shown.pixel]))
    sample, rival = shown.pixel, shown.item
    when = place[2, sample][:, None] if plan.motion else 0.0
    front = np.full(region.size, np.inf)
    np.minimum.at(
        front, sample, intersect_pairs(plan, columns(w, sample[:, None]), rival, when)[:, 0]
    )
    rows: Ints = (front < own).nonzero()[0]
    w, t = columns(w, rows), own[rows]
    hits = surface(plan, w, t, item[rows], time[rows] if isinstance(time, np.ndarray) else time)
    with np.errstate(over="ignore", invalid="ignore"):  # overflow affects this test only
        reach = make_patch(plan, w, t, hits, columns(half, rows)).radius
        near: Mask = (t - front[rows]) * np.sqrt(dot(w, w)) < CONTACT_DEPTH * reach
    return rows[near]
