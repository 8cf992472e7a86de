# SPDX-License-Identifier: GPL-3.0-or-later
"""Which of many caps of the unit sphere have circles that other caps cover all around.

Such a circle bounds nothing of what the caps leave open, though its cap may cover something. Of the
thousand balls of a heap, seen from a floor beside it, some sixty bound the sky; where the circles
of all others cross need not be known.

Each circle is divided into 64 sectors, a bit each. A cap covers an interval of a circle that it
crosses, and so the sectors that lie within it. A circle of which all bits are set is covered. The
largest caps come first, as most circles are covered by these alone. What is found is certain under
rounding; what is not found is only looked at more closely than it has to be.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.vector import dot, perpendicular_pair

__all__ = ["circles_to_keep", "mean_overlaps"]


SECTORS = 64
"""Number of sectors of a circle: the bits of an integer."""
SECTOR_MARGIN = 2.0**-20
"""Part of a sector by which an interval must reach beyond it. The ends of an interval are known to
the root of the unit roundoff where circles touch, and much better elsewhere."""
LEAST_LEVER = 2.0**-23
"""Sine of a circle's half angle, times that of the angle of two axes, from which intervals are
looked for: the cosine of their half width is known to the unit roundoff over this."""
NESTED_MARGIN = 2.0**-28
"""Margin on the cosine of a half width below -1, by which a circle must lie within a cap."""
LEAST_PRODUCT = -0.25
"""Least product of circles that are compared: those that cross at a right angle have 0, those that
touch from outside -1. What a cap of equal size covers is 77 degrees there; less is not worth it."""
OVERLAP_SAMPLES = 16
"""Number of caps by which the overlap of a point's caps is judged."""
FIRST_ROUND, ROUND_GROWTH = 64, 2
"""Number of the largest caps that all circles are compared with first, and the growth of the number
with which those that are left are compared next."""
UNUSED = np.array((0.0, 0.0, 0.0, -1e6), dtype=np.float32)[:, None]
"""A circle that has less than `LEAST_PRODUCT` with all caps but the horizon."""
ALL_BITS = np.uint64(0xFFFFFFFFFFFFFFFF)


def mean_overlaps(axis: Array, cosine: Array) -> Array:
    """Mean number (n,) of other caps that cover the axis of a cap (n, k), by some of them.

    axis : (3, n, k) unit vectors.  cosine : (n, k) of half angles; of unused caps above 1.
    """
    used = (cosine <= 1.0).sum(axis=1)
    rows = np.linspace(0.0, np.maximum(used - 1, 0), OVERLAP_SAMPLES).astype(np.int64).T
    some = np.take_along_axis(axis, rows[None], 2)
    covered = np.matmul(some.transpose(1, 2, 0), axis.swapaxes(0, 1)) > cosine[:, None]
    mean: Array = covered.sum(axis=(1, 2)) / OVERLAP_SAMPLES - 1.0
    return mean


def circles_to_keep(axis: Array, sine: Array, cosine: Array) -> Mask:
    """Circles (n, k) that other caps of their point may leave uncovered in part.

    Parameters
    ----------
    axis : (3, n, k) unit vectors.  sine, cosine : (n, k) of half angles up to 90 degrees, each
        point's caps by size, the largest first. Caps with a cosine above 1 are unused.
    """
    n, k = sine.shape
    alive = cosine <= 1.0
    bits = np.zeros(n * k, dtype=np.uint64)
    axes, sizes = axis.reshape(3, -1), (sine.ravel(), cosine.ravel())
    # single precision: this only chooses what is looked at
    inner = (np.concatenate([axis, -cosine[None]]) / sine).astype(np.float32)
    outer = inner.swapaxes(0, 1).copy()
    outer[:, 3] *= -1.0
    inner = inner.reshape(4, -1)
    ends = [0, FIRST_ROUND]
    while ends[-1] < k:
        ends.append(min(ends[-1] * (1 + ROUND_GROWTH), k))
    for first, last in pairwise(ends):
        number = alive.sum(axis=1)
        most = int(number.max(initial=0))
        if not most:
            break
        ring = np.argsort(~alive, axis=1, kind="stable")[:, :most]
        ring += k * np.arange(n)[:, None]
        own = inner.take(ring.ravel(), axis=1).reshape(4, n, most)
        own[:, np.arange(most) >= number[:, None]] = UNUSED
        product = np.matmul(own.transpose(1, 2, 0), outer[..., first:last])
        found = (product > LEAST_PRODUCT).ravel().nonzero()[0]
        row, cap = np.divmod(found, product.shape[2])
        rings = ring.ravel()[row]
        _mark_sectors(bits, axes, sizes, rings, rings // k * k + first + cap)
        alive &= (bits != ALL_BITS).reshape(n, k)
    return alive


def _mark_sectors(
    bits: NDArray[np.uint64], axis: Array, sizes: tuple[Array, Array], ring: Ints, cap: Ints
) -> None:
    """Set the bits of the sectors of circles `ring` (m,), ascending, that caps (m,) cover."""
    if not ring.size:
        return
    sine, cosine = sizes
    begins = np.diff(ring, prepend=-1).nonzero()[0]
    circles = ring[begins]
    u, w = perpendicular_pair(columns(axis, circles))
    which = np.repeat(np.arange(circles.size), np.diff(begins, append=ring.size))
    other = columns(axis, cap)
    along = dot(columns(axis, ring), other)
    x, y = dot(columns(u, which), other), dot(columns(w, which), other)
    lever = np.sqrt(x * x + y * y) * sine[ring]
    reach = (cosine[cap] - cosine[ring] * along) / np.maximum(lever, LEAST_LEVER)
    half = np.arccos(np.minimum(np.maximum(reach, -1.0), 1.0)) * (lever > LEAST_LEVER)
    turn = 0.5 * SECTORS / np.pi
    middle, half = np.arctan2(y, x) * turn, half * turn - SECTOR_MARGIN
    low = np.ceil(middle - half).astype(np.int64)
    number = np.floor(middle + half).astype(np.int64) - low
    number[reach < -1.0 - NESTED_MARGIN] = SECTORS
    some = (number > 0).nonzero()[0]
    if not some.size:
        return
    ring, low, number = ring[some], low[some] % SECTORS, np.minimum(number[some], SECTORS)
    shift = low.astype(np.uint64)
    mask = ALL_BITS >> (SECTORS - number).astype(np.uint64)
    mask = (mask << shift) | ((mask >> np.uint64(1)) >> (np.uint64(SECTORS - 1) - shift))
    begins = np.diff(ring, prepend=-1).nonzero()[0]
    bits[ring[begins]] |= np.bitwise_or.reduceat(mask, begins)
