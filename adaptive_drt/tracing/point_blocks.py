# SPDX-License-Identifier: GPL-3.0-or-later
"""Points along the Morton curve (Morton 1966), and balls around blocks of consecutive ones."""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Ints
from ..numerics.vector import dot

__all__ = ["group_balls", "morton_order"]

MORTON_CELLS = 1 << 10
"""Number of cells of the Morton curve along each axis."""
MORTON_SPREADS = ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3), (2, 0x09249249))
"""Shifts and masks that move the bits of a number below `MORTON_CELLS` three places apart."""


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


def morton_order(point: Array) -> Ints:
    """Indices (n,) that sort points (3, n) along the Morton curve."""
    low = point.min(axis=1, keepdims=True)
    size = float((point.max(axis=1, keepdims=True) - low).max()) or 1.0
    cell = ((point - low) * (MORTON_CELLS / size)).astype(np.int64)
    np.minimum(cell, MORTON_CELLS - 1, out=cell)
    for shift, mask in MORTON_SPREADS:
        cell |= cell << shift
        cell &= mask
    x, y, z = cell
    return np.argsort(x | (y << 1) | (z << 2), kind="stable")
