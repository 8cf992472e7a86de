# SPDX-License-Identifier: GPL-3.0-or-later
"""Spheres that a point sees behind another one: they hide nothing more of a light behind both.

What k outlines enclose takes k^2 arcs. In a heap of spheres most of those before a light are
hidden by larger or nearer ones.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from .columns import columns
from .plan import Plan
from .primary import Pairs, Surface
from .vector import dot

__all__ = ["nested"]

Array: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Mask: TypeAlias = NDArray[np.bool_]

LEAST = 4
"""Spheres before a light from which it is worth to look: of so many a tenth is behind another."""
CHUNK = 1 << 16
"""Pairs of spheres at a time, about."""
ROUNDING = 16.0 * 2.0**-53
"""Radians: what the directions, sines and cosines of outlines may be off by, together."""


def nested(plan: Plan, surface: Surface, pairs: Pairs, time: Array | float) -> Mask:
    """Whether another of a point's spheres hides each one (m,), for sure.

    Parameters
    ----------
    pairs : points and spheres that they lie outside of, sorted by point.
    time : shutter time, a number or (m,).
    """
    hidden = np.zeros(pairs.item.size, dtype=np.bool_)
    number = np.bincount(pairs.pixel, minlength=surface.item.size)
    if number.max(initial=0) < LEAST:
        return hidden
    start = np.cumsum(number) - number
    v = plan.spheres.moved(pairs.item, time) - columns(surface.point, pairs.pixel)
    r, length = plan.spheres.radius[pairs.item], np.sqrt(dot(v, v))
    axis, sine = v / length, r / length
    cosine = np.sqrt(np.maximum((length - r) * (length + r), 0.0)) / length
    for k in np.unique(number[number >= LEAST]).tolist():
        points = (number == k).nonzero()[0]
        step = max(1, CHUNK // (k * k))
        for first in range(0, points.size, step):
            index = start[points[first : first + step]] + np.arange(k)[:, None]
            hidden[index] = _within(columns(axis, index), sine[index], cosine[index])
    return hidden


def _within(axis: Array, sine: Array, cosine: Array) -> Mask:
    """Whether cones (k, n) lie within another of the same column.

    One of half angle a lies within one of b where their axes are b - a apart at most; of that
    angle twice the sine of its half is compared, which is exact to rounding however small it is.
    """
    turn = sine[None] * cosine[:, None] - cosine[None] * sine[:, None]
    even = cosine[None] * cosine[:, None] + sine[None] * sine[:, None]
    gap = axis[:, :, None] - axis[:, None]
    within: Mask = np.sqrt(dot(gap, gap)) + ROUNDING <= turn * np.sqrt(2.0 / (1.0 + even))
    some: Mask = within.any(axis=1)
    return some
