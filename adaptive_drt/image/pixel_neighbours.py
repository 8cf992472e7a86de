# SPDX-License-Identifier: GPL-3.0-or-later
"""What the pixels around each pixel tell of what its own rays may have missed."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..numerics.arrays import Array, Ints, Mask
from ..shading.center_light import MIXED

__all__ = ["UNKNOWN", "agreeing_neighbours", "agrees_around", "largest_around"]


UNKNOWN = -2
"""What is seen of pixels that are not sampled, or not yet; it agrees with all others."""
AGREEMENT_REACH = 2
"""Number of pixels to each side whose rays count for what a pixel's own rays have missed."""


def agreeing_neighbours(seen: Ints, width: int, rays: Array | None = None) -> Array:
    """Number of pixels (n,) around each one if all of these agree with it, else 1.

    seen : (n,) visibility or items of the pixels of a frame, row by row: see `SampledPixels`.
    rays : (n,) numbers of rays by which pixels count, in any unit; None where all count alike. What
        is returned is then the number of all rays, as a multiple of the pixel's own, if it has any.
    """
    table = seen.reshape(-1, width)
    height, reach = len(table), AGREEMENT_REACH
    weight = np.ones(table.shape) if rays is None else rays.reshape(-1, width)
    wide = np.full((height + 2 * reach, width + 2 * reach), UNKNOWN)
    wide[reach:-reach, reach:-reach] = table
    parts = np.zeros(wide.shape)
    parts[reach:-reach, reach:-reach] = weight
    same, count = np.full(table.shape, True), np.zeros(table.shape)
    for y in range(2 * reach + 1):
        for x in range(2 * reach + 1):
            part = np.s_[y : y + height, x : x + width]
            same &= (wide[part] == table) | (wide[part] == UNKNOWN)
            count += (wide[part] == table) * parts[part]
    count /= np.where(weight > 0.0, weight, 1.0)
    alike = same & (table != MIXED) & (table != UNKNOWN)
    found: Array = np.where(alike, np.maximum(count, 1.0), 1.0).ravel()
    return found


def agrees_around(seen: Ints, width: int) -> Mask:
    """Whether the eight pixels around each one (n,) see what it sees, or nothing is known of them.

    seen : (n,) as in `agreeing_neighbours`.
    """
    table = seen.reshape(-1, width)
    wide = np.pad(table, 1, constant_values=UNKNOWN)
    around = sliding_window_view(wide, (3, 3))
    middle = table[..., None, None]
    same: Mask = ((around == middle) | (around == UNKNOWN)).all(axis=(2, 3)).ravel()
    return same


def largest_around(values: Array, width: int) -> Array:
    """Largest of values (n,) over each pixel and the eight around it, in rows of `width` pixels."""
    table = np.pad(values.reshape(-1, width), 1, constant_values=-np.inf)
    found: Array = sliding_window_view(table, (3, 3)).max(axis=(2, 3)).ravel()
    return found
