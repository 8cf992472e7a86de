# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the samples of stars lie around centroids: on crosses and tetrahedra, turned any way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.low_discrepancy import generator, mix
from ..tracing.intersect import places
from ..visibility.line_intervals import TIME

__all__ = ["Arms", "make_arms", "turns"]


MIDDLE = np.array([0.39, 0.1, 0.15])
"""Weight of the centroid in a star's mean, by number of axes, of a part that is a box: the arms are
as much longer. About where kinks and steps at random places leave least: in an interval 0.09 and
0.35 of what they leave of the centroid's sample, and 0.22 and 0.51 without; in squares 0.15 and
0.35, and 0.17 and 0.38. (In an interval 1/3 leaves as much of kinks, but twice as much of a fourth
power; 4/9, Gauss' own, none of that, but a fifth more of kinks.) Six arms of a box end on its sides
as it is, and so do those of regions but along one axis, where they are intervals: there no centroid
counts."""
CORNERS = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])
"""Of a cube: the star in three dimensions, (samples, axes), as it may be turned. Exact for
quadratics as six arms along the axes are, in four samples, and not as far out."""
INSIDE = 1.0 - 2.0**-10
"""Of a star's arms: of a box or a triangle they would end on a side. Whether a point on an outline
is hit, or one on a seam is inside another object, is for rounding to say; this keeps the points
off, and the quadrature's second moments to a five hundredth."""
TURNS = 256
"""Ways to turn it. An edge that crosses thousands of cells of one size meets stars that are all
alike at but a few offsets, and their errors have one sign (210 random scenes at 0.01 %: turned, 1
is beyond the tolerance, by 1.05; not turned, 4, by up to 1.55, with 7 % more points)."""
BITS = 22
"""Of places in a pixel, and in half the shutter, that choose the turn."""
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


def turns(middle: Array) -> Ints:
    """How stars of boxes around middles (3, c) in x, y and t are turned: (c,) numbers >= 0.

    By where the box is in its pixel, and how far from the middle of the shutter: pictures that are
    shifted, or whose shutter is reversed, are the same.
    """
    inside = middle - np.floor(middle)
    inside[TIME] = np.abs(middle[TIME])
    x, y, t = (inside * 2.0**BITS).astype(np.uint64)
    return (mix(mix(mix(x) ^ y) ^ t) >> np.uint64(1)).astype(np.int64)


def make_arms(place: Array, spread: Array, wide: Mask, star: Mask, box: Mask, turn: Ints) -> Arms:
    """The samples of parts with centroids and roots of second moments as in `Parts`.

    wide : (3, m) axes that they extend along.  star : (m,) which have stars.
    box : (m,) which are boxes, not regions of them.  turn : (m,) as `turns` gives them.

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
    unit = _unit_arms(wide, count, region, number, turn)
    rows = inner.nonzero()[0]
    unit[:, rows] = _TETRAHEDRA[:, turn[region[rows]] % TURNS, number[rows]]
    unit[TIME, rows] *= side[region[rows]]
    inward = (axes == 1) | (box & (cube | (axes == 2)))
    middle = np.where(inward & (count > 1), MIDDLE[axes - 1], 0.0)
    unit *= INSIDE / np.sqrt(1.0 - middle[region])
    xx, yx, yy, tx, ty, tt = columns(spread, region)
    x, y, t = unit
    offset = np.array([xx * x, yx * x + yy * y, tx * x + ty * y + tt * t])
    first = np.where(inner, number == 0, number % 2 == 0)
    return Arms(region, count, offset, np.cumsum(first) - 1, middle)


def _unit_arms(wide: Mask, count: Ints, region: Ints, number: Ints, turn: Ints) -> Array:
    """Arms (3, k) along axes, in roots of second moments; those across the picture are turned."""
    axes = wide.sum(axis=0)
    sign = np.where(number % 2 == 0, 1.0, -1.0)
    # which axis an arm is along: the k-th of those that are wide
    order, along = np.cumsum(wide, axis=0) - 1, number // 2
    own = wide[:, region] & (order[:, region] == along) & (count[region] > 1)
    unit: Array = np.where(own, sign * np.sqrt(axes[region]), 0.0)
    flat = (axes == 2) & ~wide[TIME] & (count > 1)
    rows = flat[region].nonzero()[0]
    angle = (0.5 * np.pi) * ((turn % TURNS / TURNS)[region[rows]] + along[rows])
    unit[:TIME, rows] = np.sqrt(2.0) * sign[rows] * np.array([np.cos(angle), np.sin(angle)])
    return unit


def _turned() -> Array:
    """The star in three dimensions turned in many ways, by coordinate: (3, `TURNS`, samples).

    Rotations come from even points in a cube (Shoemake 1992, "Uniform random rotations"; the points
    are Roberts', see `low_discrepancy`). Kept are those whose arms all end in boxes.
    """
    root, i = generator(3), np.arange(16 * TURNS)
    a, b, c = (0.5 + i / root**power for power in (1, 2, 3))
    a, b, c = a % 1.0, 2.0 * np.pi * b, 2.0 * np.pi * c
    p, q = np.sqrt(1.0 - a), np.sqrt(a)
    x, y, z, w = p * np.sin(b), p * np.cos(b), q * np.sin(c), q * np.cos(c)
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    # (3, many, samples)
    corners = (rotation[..., None] * CORNERS.T[None, :, None, :]).sum(axis=1)
    longest = np.sqrt(3.0 * (1.0 - MIDDLE[2]))
    fits = np.abs(corners).max(axis=(0, 2)) <= longest
    kept: Array = corners[:, fits.nonzero()[0][:TURNS]]
    return kept


_TETRAHEDRA = _turned()
