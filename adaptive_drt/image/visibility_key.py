# SPDX-License-Identifier: GPL-3.0-or-later
"""What each pixel sees during the shutter, as a number: where neighbours have the same number, the
picture may be interpolated between them.

A moving outline that passes over pixels leaves their means over time smooth: by how long each sees
the object. Those means have a kink where the shutter opens or closes on the outline, and a step
where an outline stands still. So a sight is the list of objects that are seen, and for each of
those that move whether it enters the pixel's centre within the shutter, and whether it leaves it.
Where these differ within a pixel, a kink or a step runs through it, and what its
middle sees says nothing of its mean.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.low_discrepancy import mix
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs
from ..visibility.line_intervals import TIME, Lattice, intervals
from ..visibility.polynomials import Boxes, make_forms

__all__ = ["NO_SIGHT", "find_sights"]


NO_SIGHT = -1
"""An outline that stands still, or more than can be said in a number: nothing to interpolate."""

SMALL = 2.0
"""Pixels: half the size of objects that count wherever they pass a pixel, not its middle alone."""

ACROSS = 3
"""Lines an axis: of a box half as wide again as a pixel they pass its centre, corners and sides."""


def find_sights(plan: Plan, place: Array, half: float, pairs: Pairs) -> Ints:
    """Sights of pixels with outlines: (n,) numbers >= 0, or `NO_SIGHT`.

    Parameters
    ----------
    place : (2, n) picture coordinates of the pixels' centres.  half : half a pixel, or 0 where
        pixels are but their centres.
    pairs : the objects that may be seen in each pixel, sorted by pixel.
    """
    count = place.shape[1]
    time = np.full((1, count), 0.5)
    boxes = Boxes(np.concatenate([place - half, -time]), np.concatenate([place + half, time]))
    _, cover = make_forms(plan, boxes, pairs)
    front = np.full(count, np.inf)
    hides = cover.full.nonzero()[0]
    np.minimum.at(front, pairs.pixel[hides], cover.far[hides])
    kept = (cover.some & (cover.near <= front[pairs.pixel])).nonzero()[0]
    pairs, full, reach = pairs.take(kept), cover.full[kept], columns(cover.reach, kept)
    moves = plan.moves[pairs.item]
    refused = np.zeros(count, dtype=np.bool_)
    refused[pairs.pixel[~moves & ~full]] = True
    # two that stand still, neither wholly before the other: a seam
    refused |= np.bincount(pairs.pixel[~moves], minlength=count) > 1
    code = 4 * (pairs.item + 1)
    mover = moves.nonzero()[0]
    if mover.size:
        phase, seen, differs = _phases(plan, place, half, pairs.take(mover))
        code[mover] += phase
        refused[pairs.pixel[mover[differs]]] = True
        # what is that small may pass between all the middles
        refused[pairs.pixel[mover[~seen & (columns(reach, mover).min(axis=0) < SMALL)]]] = True
    total = np.zeros(count, dtype=np.uint64)
    # spread over 64 bits, so that sums tell lists apart
    np.add.at(total, pairs.pixel, mix(code.astype(np.uint64)))
    sight = (total >> np.uint64(1)).astype(np.int64)
    return np.where(refused, NO_SIGHT, sight)


def _phases(plan: Plan, place: Array, half: float, pairs: Pairs) -> tuple[Ints, Mask, Mask]:
    """Whether movers enter (2) and leave (1) the centres' rays, and whether they meet them.

    Returns with it whether that differs between the centre of the pixel and places on its sides.
    """
    time = np.full((1, place.shape[1]), 0.5)
    wide = 0.5 * ACROSS * half
    boxes = Boxes(np.concatenate([place - wide, -time]), np.concatenate([place + wide, time]))
    forms, cover = make_forms(plan, boxes, pairs)
    lines = ACROSS if half else 1
    low, high = intervals(forms, cover.full, Lattice(TIME, lines, lines))
    phases, seen = 2 * (low > -0.5).astype(np.int64) + (high < 0.5), high > low
    phase, met = phases[lines // 2, lines // 2], seen[lines // 2, lines // 2]
    differs: Mask = ((seen != met) | (met & (phases != phase))).any(axis=(0, 1))
    return phase, met, differs
