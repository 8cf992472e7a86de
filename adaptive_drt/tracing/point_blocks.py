# SPDX-License-Identifier: GPL-3.0-or-later
"""Balls around blocks of consecutive points, which are sorted so that these are neighbours."""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array
from ..numerics.vector import dot

__all__ = ["BLOCK_BITS", "group_balls"]


BLOCK_BITS = 10
"""Number of bits along each axis of the Morton curve along which points of blocks are sorted."""


def group_balls(point: Array, reach: Array, sizes: tuple[int, ...]) -> list[tuple[Array, Array]]:
    """Centres (3, b) and radii (b,) of balls around blocks of points and their reach, by level.

    Parameters
    ----------
    point, reach : (3, n) and (n,) metres.
    sizes : numbers of consecutive points in a block, by level, each a multiple of the next.
    """
    balls, low, high, far, before = [], point, point, reach, 1
    for size in reversed(sizes):
        # of the blocks of the level below: bounds of bounds are the same numbers
        starts = np.arange(0, far.size, size // before)
        low = np.minimum.reduceat(low, starts, axis=1)
        high = np.maximum.reduceat(high, starts, axis=1)
        far, before = np.maximum.reduceat(far, starts), size
        gap = high - low
        balls.append((0.5 * (low + high), 0.5 * np.sqrt(dot(gap, gap)) + far))
    return balls[::-1]
