# SPDX-License-Identifier: GPL-3.0-or-later
"""Visibility keys: hashes of what each pixel sees during the shutter. Where neighbouring pixels
have the same key, the picture may be interpolated between them.

When a moving outline passes over pixels, their means over time vary smoothly, with the fraction of
the shutter for which each sees the object. Those means have a kink where the outline is on the
pixel when the shutter opens or closes, and a step where an outline stands still. So a key encodes
the list of visible objects, and for each moving one whether it enters the pixel's centre within the
shutter, and whether it leaves it. Where these differ within a pixel, a kink or a step runs through
it, and the value at its centre does not determine its mean.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.axes import TIME
from ..numerics.box_polynomials import Boxes
from ..numerics.gather import columns
from ..numerics.line_lattice import Lattice
from ..numerics.low_discrepancy import splitmix64
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs
from ..visibility.line_intervals import hit_intervals
from ..visibility.polynomials import make_polynomials

__all__ = ["NO_KEY", "find_visibility_keys"]


NO_KEY = -1
"""Key of a pixel that must not be interpolated: an outline in it stands still, or its visibility is
not described by a key."""

SMALL_OBJECT = 2.0
"""Half size in pixels below which an object counts wherever it passes through a pixel, and not only
at the centre."""

LINES_PER_AXIS = 3
"""Number of lines an axis. They are centred in the thirds of a box half as wide again as the pixel,
and so pass through the pixel's centre, its corners and the middles of its sides."""


def find_visibility_keys(plan: Plan, place: Array, half: float, pairs: Pairs) -> Ints:
    """Visibility keys of pixels with outlines: (n,) numbers >= 0, or `NO_KEY`.

    Parameters
    ----------
    place : (2, n) picture coordinates of the pixels' centres.
    half : half a pixel, or 0 where only the centres of pixels count.
    pairs : objects that may be visible in each pixel, sorted by pixel.
    """
    count = place.shape[1]
    time = np.full((1, count), 0.5)
    boxes = Boxes(np.concatenate([place - half, -time]), np.concatenate([place + half, time]))
    _, cover = make_polynomials(plan, boxes, pairs)
    front = np.full(count, np.inf)
    hides = cover.all_hit.nonzero()[0]
    np.minimum.at(front, pairs.pixel[hides], cover.far[hides])
    kept = (cover.may_hit & (cover.near <= front[pairs.pixel])).nonzero()[0]
    pairs, full, reach = pairs.take(kept), cover.all_hit[kept], columns(cover.apparent_size, kept)
    moves = plan.is_moving[pairs.item]
    refused = np.zeros(count, dtype=np.bool_)
    refused[pairs.pixel[~moves & ~full]] = True
    # two still objects, neither wholly in front of the other: a seam
    refused |= np.bincount(pairs.pixel[~moves], minlength=count) > 1
    code = 4 * (pairs.item + 1)
    mover = moves.nonzero()[0]
    if mover.size:
        phase, seen, differs = _shutter_phases(plan, place, half, pairs.take(mover))
        code[mover] += phase
        refused[pairs.pixel[mover[differs]]] = True
        # an object as small as that may pass between all the centres
        refused[pairs.pixel[mover[~seen & (columns(reach, mover).min(axis=0) < SMALL_OBJECT)]]] = (
            True
        )
    total = np.zeros(count, dtype=np.uint64)
    # hashed to 64 bits, so that different lists have different sums
    np.add.at(total, pairs.pixel, splitmix64(code.astype(np.uint64)))
    sight = (total >> np.uint64(1)).astype(np.int64)
    return np.where(refused, NO_KEY, sight)


def _shutter_phases(plan: Plan, place: Array, half: float, pairs: Pairs) -> tuple[Ints, Mask, Mask]:
    """Whether moving objects enter (2) and leave (1) the rays of pixel centres, and whether they
    meet them.

    Returns with it whether that differs between the pixel's centre and places on its sides.
    """
    time = np.full((1, place.shape[1]), 0.5)
    wide = 0.5 * LINES_PER_AXIS * half
    boxes = Boxes(np.concatenate([place - wide, -time]), np.concatenate([place + wide, time]))
    forms, cover = make_polynomials(plan, boxes, pairs)
    lines = LINES_PER_AXIS if half else 1
    low, high = hit_intervals(forms, cover.all_hit, Lattice(TIME, lines, lines))
    phases, seen = 2 * (low > -0.5).astype(np.int64) + (high < 0.5), high > low
    phase, met = phases[lines // 2, lines // 2], seen[lines // 2, lines // 2]
    differs: Mask = ((seen != met) | (met & (phases != phase))).any(axis=(0, 1))
    return phase, met, differs
