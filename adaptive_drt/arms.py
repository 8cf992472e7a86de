# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the samples of stars lie around centroids: along axes, or at corners of a cube."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from .lines import TIME
from .primary import places

__all__ = ["Arms", "make_arms"]

Array: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Mask: TypeAlias = NDArray[np.bool_]

MIDDLE = np.array([1.0 / 3.0, 0.1, 0.15])
"""Weight of the centroid in a star's mean, by number of axes, of a part that is a box: the arms are
as much longer. About where kinks and steps at random places leave least: in an interval 0.09 and
0.34 of what they leave of the centroid's sample, and 0.22 and 0.51 without; in squares 0.15 and
0.35, and 0.17 and 0.38. Six arms of a box end on its sides as it is, and so do those of regions
but along one axis, where they are intervals: there no centroid counts."""
CORNERS = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])
"""Of a cube: the star in three dimensions, (samples, axes). Exact for quadratics as six arms along
the axes are, in four samples, and not as far out."""
INSIDE = 1.0 - 2.0**-10
"""Of a star's arms: of a box or a triangle they would end on a side. Whether a point on an outline
is hit, or one on a seam is inside another object, is for rounding to say; this keeps the points
off, and the quadrature's second moments to a five hundredth."""
ASIDE = 2.0**-30
"""Of the shutter: regions whose centroids are nearer to its middle lie in it but for rounding."""


@dataclass(frozen=True)
class Arms:
    """k samples of m parts.

    Attributes
    ----------
    region : (k,) which part each stands for, ascending.  count : (m,) of each; 1 is no star.
    offset : (3, k) from its centroid.
    lot : (k,) numbers of those samples that balance each other.
    middle : (m,) weight of the centroid in the mean; the samples share the rest.
    """

    region: Ints
    count: Ints
    offset: Array
    lot: Ints
    middle: Array


def make_arms(place: Array, spread: Array, wide: Mask, star: Mask, box: Mask) -> Arms:
    """The samples of parts with centroids and roots of second moments as in `Parts`.

    wide : (3, m) axes that they extend along.  star : (m,) which have stars.
    box : (m,) which are boxes, not regions of them.

    A tetrahedron has a sense of direction. It follows the side of the shutter that a region lies
    on, so that a reversed shutter gives the same picture; one that lies on both gets a star.
    """
    axes, time = wide.sum(axis=0), place[TIME]
    side = np.where(np.abs(time) > ASIDE, np.sign(time), 0.0)
    cube = star & (axes == 3) & (side != 0.0)
    count = np.where(star & (axes > 0), np.where(cube, len(CORNERS), 2 * axes), 1)
    region = np.repeat(np.arange(count.size), count)
    number = places(count)
    inner = cube[region]
    many, sign = count[region] > 1, np.where(number % 2 == 0, 1.0, -1.0)
    # which axis an arm is along: the k-th of those that are wide
    order = np.cumsum(wide, axis=0) - 1
    offset = np.zeros((3, region.size))
    for axis, entries in ((0, (0, 1, 3)), (1, (-1, 2, 4)), (2, (-1, -1, 5))):
        own = many & wide[axis, region] & (inner | (order[axis, region] == number // 2))
        rows = np.flatnonzero(own)
        which = region[rows]
        corner = CORNERS[number[rows] % len(CORNERS), axis]
        if axis == TIME:
            corner = corner * side[which]
        length = np.where(inner[rows], corner, sign[rows] * np.sqrt(axes[which]))
        for along, column in enumerate(entries):
            if column >= 0:
                offset[along, rows] += length * spread[column, which] * INSIDE
    first = np.where(inner, number == 0, number % 2 == 0)
    inward = (axes == 1) | (box & (cube | (axes == 2)))
    middle = np.where(inward & (count > 1), MIDDLE[axes - 1], 0.0)
    offset /= np.sqrt(1.0 - middle[region])
    return Arms(region, count, offset, np.cumsum(first) - 1, middle)
