# SPDX-License-Identifier: GPL-3.0-or-later
"""Detection over the pixel: may the nearest object change within the pixel's square?

The shapes tell whether they cover the pixel, miss it or cover a part (`ShapeSet.coverage`). Objects
behind one that covers the whole pixel are ignored.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.pixel_coverage import PixelCoverage
from ..geometry.surface_pairs import depth_order_may_change
from ..numerics.arrays import Array, Mask
from ..numerics.gather import columns
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, nearest_hits
from .separating_planes import are_tried, out_of_pixels

__all__ = ["EdgeTest", "detect_edges"]


@dataclass(frozen=True)
class EdgeTest:
    """Result of detection over n pixels with m candidate pairs.

    Attributes
    ----------
    edge : (n,) whether the nearest object may change within the pixel.
    covered_from : (n,) least upper bound on the ray parameters of an object that covers the whole
        pixel; inf if none does.
    covered_from_at_rest : (n,) the same among objects that do not move.
    nearest_at_rest : (n,) lower bound on the ray parameters of objects that do not move; inf if
        there are none.
    may_hit : (m,) whether some ray of the pixel may hit the candidate.
    may_be_visible : (m,) whether that hit may also be visible.
    near, far : (m,) bounds on the ray parameter of the visible part of the candidate.
    """

    edge: Mask
    covered_from: Array
    covered_from_at_rest: Array
    nearest_at_rest: Array
    may_hit: Mask
    may_be_visible: Mask
    near: Array
    far: Array


def detect_edges(
    plan: Plan, count: int, pairs: Pairs, w: Array, t: Array, blocks: bool = False
) -> EdgeTest:
    """Find the pixels in which a silhouette, or a change of depth order, may be visible.

    Parameters
    ----------
    count : number of pixels in the batch.  pairs : their m candidate pairs.
    w : (3, m) directions through the pixels' centres, per pair.
    t : (m,) ray parameters of the centre rays' hits, inf for a miss.
    blocks : whether the pixels stand for blocks of pixels: see `ShapeSet.block_coverage`.
    """
    cover = _classify_coverage(plan, pairs, w, blocks)
    covered_from = np.full(count, np.inf)
    full = cover.covers.nonzero()[0]
    np.minimum.at(covered_from, pairs.pixel[full], cover.far[full])
    still = full[~plan.is_moving[pairs.item[full]]]
    covered_from_at_rest = np.full(count, np.inf)
    np.minimum.at(covered_from_at_rest, pairs.pixel[still], cover.far[still])
    seen = cover.may_hit & (cover.near <= covered_from[pairs.pixel])
    edge = np.zeros(count, dtype=np.bool_)
    edge[pairs.pixel[seen & ~cover.covers]] = True
    both = seen & cover.covers
    edge |= _intersection_edges(plan, count, pairs.take(both), w, t, both)
    nearest_at_rest = np.full(count, np.inf)
    some_still = (cover.may_hit & ~plan.is_moving[pairs.item]).nonzero()[0]
    np.minimum.at(nearest_at_rest, pairs.pixel[some_still], cover.near[some_still])
    far = np.minimum(cover.far, covered_from[pairs.pixel])
    return EdgeTest(
        edge,
        covered_from,
        covered_from_at_rest,
        nearest_at_rest,
        cover.may_hit,
        seen,
        cover.near,
        far,
    )


def _intersection_edges(
    plan: Plan, count: int, pairs: Pairs, w: Array, t: Array, chosen: Mask
) -> Mask:
    """Whether objects that cover a pixel and overlap in depth may intersect in it: (count,).

    It is enough to test the object that the centre ray hits first against each of the others.
    """
    w, t = columns(w, chosen), t[chosen]
    candidates = np.bincount(pairs.pixel, minlength=count)
    _, front = nearest_hits(count, pairs, t)
    rows = ((candidates[pairs.pixel] > 1) & (pairs.item != front[pairs.pixel])).nonzero()[0]
    seam = np.zeros(count, dtype=np.bool_)
    other = front[pairs.pixel[rows]]
    # no hit at the centre though the pixel is covered is an effect of rounding: flag the pixel
    found = other >= 0
    cut = ~found
    cut[found] = depth_order_may_change(
        plan.shapes,
        other[found],
        pairs.item[rows[found]],
        columns(w, rows[found]),
        plan.lens,
        plan.settings.order,
    )
    seam[pairs.pixel[rows[cut]]] = True
    return seam


def _classify_coverage(plan: Plan, pairs: Pairs, w: Array, blocks: bool) -> PixelCoverage:
    """Coverage of pixels by candidates; w (3, m) are the pixels' centre directions, per pair."""
    m = pairs.item.size
    cover = PixelCoverage(
        np.zeros(m, dtype=np.bool_), np.zeros(m, dtype=np.bool_), np.zeros(m), np.full(m, np.inf)
    )
    for shapes, rows, index in plan.shapes.runs(pairs.item):
        coverage = shapes.block_coverage if blocks else shapes.coverage
        part = coverage(index, columns(w, rows), plan.lens, plan.settings.order)
        cover.may_hit[rows], cover.covers[rows] = part.may_hit, part.covers
        if shapes.uneven and are_tried(plan):
            some = np.arange(m)[rows][part.may_hit & ~part.covers]
            cover.may_hit[some] = ~out_of_pixels(plan, pairs.item[some], columns(w, some), True)
        cover.near[rows], cover.far[rows] = part.near, part.far
    return cover
