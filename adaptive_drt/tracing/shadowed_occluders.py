# SPDX-License-Identifier: GPL-3.0-or-later
"""Occluders that others hide, as seen from all points of a block.

Under a light that surrounds the points an occluder adds nothing to what another one covers, before
it or behind. Let a block of points lie within s of its middle. If from the middle a ball, larger
than the occluder by s, lies within the cone of a sphere smaller by s, then from each point of the
block the occluder lies within the cone of the sphere: a ray from the point through the occluder is,
moved to the middle, one through the larger ball, so it meets the smaller sphere.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.floats import TINY
from ..numerics.gather import columns

__all__ = ["hidden_by_spheres"]


CONTAINERS = 12
"""Number of the spheres that look largest from a block of which the cones are searched."""
MANY_OCCLUDERS = 64
"""Number of occluders of a block from which the search pays."""
ROUNDING = 2.0**-40
"""Margin, relative to radii and in cosines, by which a ball must lie within a cone: far above
rounding."""
BATCH_PAIRS = 1 << 17
"""Number of pairs of blocks and occluders in a batch, rounded up to whole blocks: 1 MB an array."""


def hidden_by_spheres(
    middle: Array,
    span: Array,
    block: Ints,
    item: Ints,
    balls: tuple[Array, Array],
    solid: Array,
) -> Mask:
    """Whether occluders lie within the cone of a sphere for all points of their block: (m,).

    Parameters
    ----------
    middle, span : (3, b) and (b,) metres, balls around the points of the blocks.
    block, item : (m,) numbers of blocks, ascending, and of their occluders.
    balls : centres (3, objects) and radii (objects,) of balls around the objects, metres.
    solid : (objects,) metres, radii of the spheres about the same centres that are solid during the
        whole shutter; 0 for objects that are no spheres.
    """
    hidden = np.zeros(item.size, dtype=np.bool_)
    number = np.bincount(block, minlength=span.size)
    first = np.cumsum(number) - number
    number[number < MANY_OCCLUDERS] = 0
    for some, index, used in _batches(number, first):
        place = item[index]
        v = columns(balls[0], place) - columns(middle, some)[:, None]
        length = np.maximum(np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]), TINY)
        # a cone that is not below 90 degrees hides nothing and is hidden by none
        wide = (balls[1][place] + span[some]) * (1.0 + ROUNDING)
        narrow = np.maximum(solid[place] - span[some], 0.0) * (1.0 - ROUNDING)
        narrow[(narrow >= length) | ~used] = 0.0
        inner = _cones(v, length, wide)
        rows = np.argpartition(-narrow / length, CONTAINERS, axis=0)[:CONTAINERS]
        column = np.arange(some.size)
        outer = _cones(v[:, rows, column], length[rows, column], narrow[rows, column])
        found = np.zeros(index.shape, dtype=np.bool_)
        for k in range(CONTAINERS):
            within = outer[3][k] * inner[3]
            within += outer[4][k] * inner[4]
            along = outer[0][k] * inner[0]
            along += outer[1][k] * inner[1]
            along += outer[2][k] * inner[2]
            found |= (along >= within + ROUNDING) & (inner[4] < outer[4][k])
        found &= (wide < length) & used
        hidden[index[found]] = True
    return hidden


def _cones(v: Array, length: Array, radius: Array) -> tuple[Array, ...]:
    """Axes' components, cosines and sines (k, n) of the cones of balls at vectors v (3, k, n)."""
    sine = np.minimum(radius / length, 1.0)
    cosine = np.sqrt(np.maximum((1.0 - sine) * (1.0 + sine), 0.0))
    x, y, z = v / length
    return x, y, z, cosine, sine


def _batches(number: Ints, first: Ints) -> Iterator[tuple[Ints, Ints, Mask]]:
    """Yield blocks (n,) of alike numbers of occluders, and indices (k, n) of these.

    With them comes whether each is in use: others repeat the first one of their block.

    number, first : (b,) numbers of occluders, 0 for blocks that are left out, and first ones.
    """
    order = np.argsort(number, kind="stable")
    begin = int(number[order].searchsorted(1))
    while begin < order.size:
        # those of up to a quarter more occluders together
        most = max(int(number[order[begin]]) * 5 // 4, MANY_OCCLUDERS)
        end = int(number[order].searchsorted(most, side="right"))
        end = min(end, begin + max(1, BATCH_PAIRS // most))
        some = order[begin:end]
        most = int(number[some].max())
        rank = np.arange(most)[:, None]
        used = rank < number[some]
        yield some, first[some] + np.where(used, rank, 0), used
        begin = end
