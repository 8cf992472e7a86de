# SPDX-License-Identifier: GPL-3.0-or-later
"""Visible arcs of many circles on the unit sphere, by the pairs of circles that cross.

Of k outlines seen from a point few pairs cross, and only those need trigonometric functions: their
number decides the work, and not k^2. Two circles of half angles a and b whose axes are g apart
cross where |cos g - cos a cos b| < sin a sin b; a circle within another one has no visible arc.
"""

from __future__ import annotations

import math

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.vector import dot
from .spherical_curves import (
    BoundaryAntiderivative,
    Circles,
    Intervals,
    boundary_values,
    circles_inside_cones,
)

__all__ = [
    "from_minus_pi",
    "gaps_of_rings",
    "open_circles",
    "open_circles_integral",
    "order_on_rings",
    "split_at_pi",
]


CROSSING_TOLERANCE = 2.0**-48
"""Bound on the rounding error of the cosines by which circles are compared. Pairs within it count
as crossing, for which the arcs tell how they lie."""
KEY_BITS = 43
"""Number of bits of an angle in a key that sorts; 20 bits are left for the number of its circle."""
KEY_SCALE = 2.0 ** (KEY_BITS - 1) / (2.0 * math.pi)
"""Units of these keys per radian, of which a turn takes half the range."""


def open_circles_integral(
    circles: Circles,
    center: Array,
    half: Array,
    spans: Intervals | None,
    potential: BoundaryAntiderivative,
) -> Array:
    """Integral of n.(w x dw) along the arcs of circles that lie in no other circle: (n,).

    It is `boundary_integral` of what `complement_on_circle` leaves of circles (k, n), to rounding.
    Of circles that coincide, only the first has visible arcs.

    Parameters
    ----------
    center, half : (j, k, n) rad, further intervals that are not visible.
    spans : (i, k, n) further such intervals within [-pi, pi], or None.
    """
    ring, low, high = open_circles(circles, center, half, spans)
    part = BoundaryAntiderivative(
        potential.a.ravel()[ring], potential.b.ravel()[ring], potential.c.ravel()[ring], None
    )
    value = boundary_values(part, high) - boundary_values(part, low)
    # in the order of the circles, whatever other points there are
    n = circles.sine.shape[1]
    total = np.zeros(n)
    total += np.bincount(ring % n, weights=value, minlength=n)
    return total


def open_circles(
    circles: Circles, center: Array, half: Array, spans: Intervals | None
) -> tuple[Ints, Array, Array]:
    """Arcs of circles (k, n) that lie in no other circle; parameters as `open_circles_integral`.

    Returns
    -------
    ring : (m,) indices k n + point of their circles, ascending.  low, high : (m,) radians.
    """
    k, n = circles.sine.shape
    first, second, point, hidden = _crossing_pairs(circles)
    wins = np.where(second < first, 1.0, -1.0)
    mid, width, _ = circles_inside_cones(
        circles.take_pairs(first, point), circles.take_pairs(second, point), wins
    )
    rings = np.arange(k * n)
    ring = np.concatenate([first * n + point, np.tile(rings, center.shape[0])])
    low, high = from_minus_pi(
        np.concatenate([mid, center.ravel()]), np.concatenate([width, half.ravel()])
    )
    ring, low, high = split_at_pi(ring, low, high)
    if spans is not None:
        ring = np.concatenate([ring, np.tile(rings, spans[0].shape[0])])
        low, high = (
            np.concatenate([own, more.ravel()])
            for own, more in zip((low, high), spans, strict=True)
        )
    # a circle of no visible arc needs no intervals, and empty intervals hide nothing
    kept = ((high > low) & ~hidden.ravel()[ring]).nonzero()[0]
    ring, low, high = gaps_of_rings(ring[kept], low[kept], high[kept], k * n)
    live = ((high > low) & ~hidden.ravel()[ring]).nonzero()[0]
    return ring[live], low[live], high[live]


def _crossing_pairs(circles: Circles) -> tuple[Ints, Ints, Ints, Mask]:
    """Ordered pairs of circles that may cross, and which circles lie within another one.

    Returns
    -------
    first, second, point : (m,) indices of the pair's circles and of their point, ordered.
    hidden : (k, n) bool.
    """
    axis, sine, cosine = circles.axis, circles.sine, circles.cosine
    apart = dot(axis[:, :, None], axis[:, None]) - cosine[:, None] * cosine
    both = sine[:, None] * sine
    within = apart > both + CROSSING_TOLERANCE
    hidden: Mask = (within & (cosine[:, None] > cosine)).any(axis=1)
    cross = ~within & (apart >= -both - CROSSING_TOLERANCE)
    each = np.arange(sine.shape[0])
    cross[each, each] = False
    # neither has an arc outside the larger circle
    cross &= ~hidden[:, None]
    first, second, point = cross.nonzero()
    return first, second, point, hidden


def from_minus_pi(center: Array, half: Array) -> Intervals:
    """Intervals (m,) of angles with starts from -pi to pi."""
    low = center - half
    low += 2.0 * np.pi * (low < -np.pi)
    low -= 2.0 * np.pi * (low >= np.pi)
    return low, low + 2.0 * half


def split_at_pi(ring: Ints, low: Array, high: Array) -> tuple[Ints, Array, Array]:
    """Intervals (m,) of angles, of which those beyond pi continue as others from -pi on."""
    over = (high > np.pi).nonzero()[0]
    ends = high[over] - 2.0 * np.pi
    return (
        np.concatenate([ring, ring[over]]),
        np.concatenate([low, np.full(over.size, -np.pi)]),
        np.concatenate([np.minimum(high, np.pi), ends]),
    )


def gaps_of_rings(ring: Ints, low: Array, high: Array, count: int) -> tuple[Ints, Array, Array]:
    """What intervals (m,) within [-pi, pi] leave of `count` rings: (m + count,) each, maybe empty.

    As in `complement_intervals` gaps run from the i-th end to the next start, both sorted.
    """
    sizes = np.bincount(ring, minlength=count)
    place = np.arange(ring.size) + np.repeat(np.arange(count), sizes)
    begin, finish = np.full(ring.size + count, -np.pi), np.full(ring.size + count, np.pi)
    begin[place + 1] = high[order_on_rings(ring, high)]
    finish[place] = low[order_on_rings(ring, low)]
    return np.repeat(np.arange(count), sizes + 1), begin, finish


def order_on_rings(ring: Ints, angle: Array) -> Ints:
    """Indices (m,) that sort angles from -pi to pi by ring and, within it, by angle.

    Keys of one number each sort many times faster than two keys, and tell almost all angles apart.
    """
    key = ((angle + np.pi) * KEY_SCALE).astype(np.int64)
    order = np.argsort((ring << KEY_BITS) + key)
    own, value = ring[order], angle[order]
    if ((value[1:] < value[:-1]) & (own[1:] == own[:-1])).any():
        order = np.lexsort((angle, ring))
    return order
