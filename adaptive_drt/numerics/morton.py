# SPDX-License-Identifier: GPL-3.0-or-later
"""Order of points along the Morton curve, in which neighbours in space are mostly neighbours."""

from __future__ import annotations

import numpy as np

from .arrays import Array, Ints

__all__ = ["morton_order"]


FINE_BITS = 16
"""Number of bits along each axis of the Morton curve, where none is given."""
SPREADS = (
    (32, 0x1F00000000FFFF),
    (16, 0x1F0000FF0000FF),
    (8, 0x100F00F00F00F00F),
    (4, 0x10C30C30C30C30C3),
    (2, 0x1249249249249249),
)
"""Shifts and masks that move the bits of a number below 2^21 three places apart."""


def morton_order(point: Array, bits: int = FINE_BITS) -> Ints:
    """Indices (n,) that sort points (3, n) along the Morton curve (Morton 1966).

    bits : number of bits along each axis, up to 21.
    """
    low = point.min(axis=1, keepdims=True)
    size = float((point.max(axis=1, keepdims=True) - low).max()) or 1.0
    cells = 1 << bits
    cell = ((point - low) * (cells / size)).astype(np.int64)
    np.minimum(cell, cells - 1, out=cell)
    for shift, mask in SPREADS:
        if shift < 2 * bits:
            cell |= cell << shift
            cell &= mask
    x, y, z = cell
    return np.argsort(x | (y << 1) | (z << 2), kind="stable")
