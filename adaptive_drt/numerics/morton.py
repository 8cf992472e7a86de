# SPDX-License-Identifier: GPL-3.0-or-later
"""Order of points along the Morton curve, in which neighbours in space are mostly neighbours."""

from __future__ import annotations

import numpy as np

from .arrays import Array, Ints

__all__ = ["morton_order"]


MORTON_BITS = 16
"""Number of bits along each axis of the Morton curve."""


def morton_order(point: Array) -> Ints:
    """Indices (n,) that sort points (3, n) along the Morton curve (Morton 1966)."""
    low = point.min(axis=1, keepdims=True)
    size = float((point.max(axis=1, keepdims=True) - low).max()) or 1.0
    most = (1 << MORTON_BITS) - 1
    cell = np.minimum(((point - low) * (most / size)).astype(np.int64), most)
    key = np.zeros(point.shape[1], dtype=np.int64)
    for bit in range(MORTON_BITS):
        for axis in range(3):
            key |= ((cell[axis] >> bit) & 1) << (3 * bit + axis)
    return np.argsort(key, kind="stable")
