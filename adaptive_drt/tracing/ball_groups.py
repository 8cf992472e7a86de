# SPDX-License-Identifier: GPL-3.0-or-later
"""Groups of neighbouring balls, so that a few tests settle what very many balls have in common.

A ball around each group of consecutive balls of the Morton curve is tested before the balls
themselves, from large groups to small ones. Tests must be conservative: one that a ball passes is
passed by every ball around it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.morton import morton_order
from .point_blocks import BLOCK_BITS, group_balls

__all__ = ["MANY_OBJECTS", "BallGroups", "BallTest"]

BallTest: TypeAlias = Callable[[tuple[Array, Array], Ints, Ints], Mask]
"""Test of pairs of points and balls: it takes the balls (centres (3, n) and radii (n,), metres) and
the numbers (k,) of points and of balls, and returns (k,) bool."""

MANY_OBJECTS = 4_096
"""Number of objects from which groups of them are tested before they are.

Embree's proxies (`embree.ProxyScene`) are then not built: under a small light, 8,000 balls took 0.4
s of processor time with them for 2,300 points and 0.1 s in groups, 100,000 balls 3.2 and 0.1 s, and
300 MB more."""
GROUP_SIZES = (32_768, 4_096, 512, 64, 8)
"""Numbers of balls in a group, by level."""
ENCLOSING = 1.0 + 2.0**-40
"""Factor on the radii of balls around groups: far above the rounding of what they enclose."""
POINTS_PER_CHUNK = 512
"""Number of points whose pairs are looked for together: it bounds the time without a test."""
PAIRS_PER_CHUNK = 1 << 15
"""Number of pairs that are tested in one call: what is gathered for them stays in the cache."""


class BallGroups:
    """Balls (centres (3, n) and radii (n,), metres) in groups, by level."""

    def __init__(self, center: Array, radius: Array, item: Ints | None = None) -> None:
        """Sort the balls, and enclose the groups. item : (n,) their numbers, if not 0, 1, ..."""
        order = morton_order(center, BLOCK_BITS)
        sorted_balls = columns(center, order), radius[order]
        self._order = order if item is None else item[order]
        groups = group_balls(*sorted_balls, GROUP_SIZES)
        self._levels = [(middle, ENCLOSING * wide) for middle, wide in groups] + [sorted_balls]

    def pairs(self, count: int, test: BallTest) -> tuple[Ints, Ints]:
        """Pairs (m,) of `count` points and balls that pass a test, sorted by point."""
        none = np.zeros(0, dtype=np.int64)
        found = [(none, none)]
        for first in range(0, count, POINTS_PER_CHUNK):
            points = np.arange(first, min(first + POINTS_PER_CHUNK, count))
            found.append(self._pairs_of(points, test))
        at, number = (np.concatenate([part[k] for part in found]) for k in (0, 1))
        return at, number

    def _pairs_of(self, points: Ints, test: BallTest) -> tuple[Ints, Ints]:
        """The pairs of some points."""
        groups = self._levels[0][1].size
        at, number = np.repeat(points, groups), np.tile(np.arange(groups), points.size)
        sizes = (*GROUP_SIZES, 1)
        for level, balls in enumerate(self._levels):
            kept = [np.zeros(0, dtype=np.int64)]
            for first in range(0, at.size, PAIRS_PER_CHUNK):
                part = slice(first, first + PAIRS_PER_CHUNK)
                some = test(balls, at[part], number[part])
                kept.append(some.nonzero()[0] + first)
            rows = np.concatenate(kept)
            at, number = at[rows], number[rows]
            if level < len(GROUP_SIZES):
                smaller = sizes[level + 1]
                low, most = number * (sizes[level] // smaller), -(-self._order.size // smaller)
                inside = np.minimum(low + sizes[level] // smaller, most) - low
                begun = np.cumsum(inside) - inside
                at = np.repeat(at, inside)
                number = np.repeat(low - begun, inside) + np.arange(at.size)
        return at, self._order[number]
