# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes of the multi-node cubature rules: crosses and tetrahedra around a centroid, rotated.

The rules match moments: with the centroid and the second moments of a region (a box, or the part of
one in which an object is visible), their means are exact for quadratic integrands.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.axes import TIME
from ..numerics.gather import columns
from ..numerics.low_discrepancy import generalized_golden_ratio, splitmix64
from ..tracing.intersect import positions_in_runs

__all__ = ["Nodes", "make_nodes", "rotation_index"]


CENTROID_WEIGHT = np.array([0.39, 0.1, 0.15])
"""Weight of the centroid in the mean, for a box in 1, 2 and 3 dimensions; the other nodes are moved
outwards accordingly. They are parameters of the rule, not of the error model. The values are about
where kinks and steps at random places leave the least error: in an interval 0.09 and 0.35 of the
error of the centroid rule, against 0.22 and 0.51 without the centroid; in squares 0.15 and 0.35,
against 0.17 and 0.38. (In an interval 1/3 leaves as much of kinks, but twice as much of a fourth
power; 4/9, the Gauss rule, leaves none of the fourth power, but a fifth more of kinks.) In a box,
the six nodes along the axes lie on its sides even without a centroid, and so do those of regions
that are not boxes, except along a single axis, where regions are intervals: in those cases the
centroid has no weight."""
TETRAHEDRON = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])
"""Four corners of a cube that form a tetrahedron, (nodes, axes): the rule in three dimensions
before it is rotated. It is exact for quadratics, as six nodes along the axes are, with four nodes
that lie less far out."""
NODE_SCALE = 1.0 - 2.0**-10
"""Factor on the distance of all nodes from the centroid. Without it, nodes of a box or a triangle
lie exactly on a side, where rounding decides whether a point on an outline is hit, or whether one
on a seam is inside another object. It changes the second moments of the rule by a five
hundredth."""
ROTATION_COUNT = 256
"""Number of rotations of the rules. An edge that crosses thousands of cells of one size would
otherwise meet identical node patterns at only a few offsets, and their errors would have one sign
(210 random scenes at 0.01 %: with rotations, 1 exceeds the tolerance, by a factor of 1.05; without,
4 do, by up to 1.55, with 7 % more points)."""
HASHED_BITS = 22
"""Bits of a position in the pixel, and in half the shutter, that are hashed to choose the
rotation."""
MID_SHUTTER_ROUNDING = 2.0**-30
"""Fraction of the shutter: regions whose centroid is nearer to mid-shutter than this are taken to
be centred there, as only rounding says otherwise."""


@dataclass(frozen=True)
class Nodes:
    """Cubature nodes: k nodes of the rules of m subdomains.

    Attributes
    ----------
    subdomain : (k,) index of each node's subdomain, ascending.
    count : (m,) nodes of each subdomain; 1 means the centroid rule.
    offset : (3, k) from the centroid, in x, y and t.
    group : (k,) group of each node. The offsets of a group sum to 0, so that its nodes have to be
        scaled together.
    centroid_weight : (m,) weight of the centroid in the mean; the nodes share the rest equally.
    """

    subdomain: Ints
    count: Ints
    offset: Array
    group: Ints
    centroid_weight: Array


def rotation_index(middle: Array) -> Ints:
    """Rotation of the rule of each box, given the boxes' centres (3, c) in x, y and t: (c,) numbers
    >= 0.

    It is a hash of the position within the pixel and of the distance from mid-shutter. So the
    result does not change when the picture is shifted by whole pixels, or when the shutter is
    reversed.
    """
    inside = middle - np.floor(middle)
    inside[TIME] = np.abs(middle[TIME])
    x, y, t = (inside * 2.0**HASHED_BITS).astype(np.uint64)
    return (splitmix64(splitmix64(splitmix64(x) ^ y) ^ t) >> np.uint64(1)).astype(np.int64)


def make_nodes(place: Array, spread: Array, wide: Mask, star: Mask, box: Mask, turn: Ints) -> Nodes:
    """Make the nodes of m subdomains, given their centroids and roots of second moments.

    Parameters
    ----------
    place, spread : as `place` and `spread` of `Subdomains`.
    wide : (3, m) axes along which the subdomains have an extent.
    star : (m,) which use the multi-node rule; the others use their centroid.
    box : (m,) which are whole boxes, not visible regions within them.
    turn : (m,) rotations, from `rotation_index`.

    Notes
    -----
    A tetrahedron is not symmetric under a reversal of time. Its orientation follows the side of
        mid-shutter on which the subdomain is centred, so that a reversed shutter gives the same
        picture; a subdomain centred at mid-shutter gets nodes along the axes instead.
    """
    axes, time = wide.sum(axis=0), place[TIME]
    side = np.where(np.abs(time) > MID_SHUTTER_ROUNDING, np.sign(time), 0.0)
    cube = star & (axes == 3) & (side != 0.0)
    count = np.where(star & (axes > 0), np.where(cube, len(TETRAHEDRON), 2 * axes), 1)
    region = np.repeat(np.arange(count.size), count)
    number = positions_in_runs(count)
    inner = cube[region]
    unit = _axis_nodes(wide, count, region, number, turn)
    rows = inner.nonzero()[0]
    unit[:, rows] = _TETRAHEDRA[:, turn[region[rows]] % ROTATION_COUNT, number[rows]]
    unit[TIME, rows] *= side[region[rows]]
    inward = (axes == 1) | (box & (cube | (axes == 2)))
    middle = np.where(inward & (count > 1), CENTROID_WEIGHT[axes - 1], 0.0)
    unit *= NODE_SCALE / np.sqrt(1.0 - middle[region])
    xx, yx, yy, tx, ty, tt = columns(spread, region)
    x, y, t = unit
    offset = np.array([xx * x, yx * x + yy * y, tx * x + ty * y + tt * t])
    first = np.where(inner, number == 0, number % 2 == 0)
    return Nodes(region, count, offset, np.cumsum(first) - 1, middle)


def _axis_nodes(wide: Mask, count: Ints, region: Ints, number: Ints, turn: Ints) -> Array:
    """Node offsets (3, k) along the axes, in roots of second moments.

    In two dimensions without time, the cross is rotated in the plane of the picture.
    """
    axes = wide.sum(axis=0)
    sign = np.where(number % 2 == 0, 1.0, -1.0)
    # the j-th pair of nodes lies along the j-th axis that has an extent
    order, along = np.cumsum(wide, axis=0) - 1, number // 2
    own = wide[:, region] & (order[:, region] == along) & (count[region] > 1)
    unit: Array = np.where(own, sign * np.sqrt(axes[region]), 0.0)
    flat = (axes == 2) & ~wide[TIME] & (count > 1)
    rows = flat[region].nonzero()[0]
    angle = (0.5 * np.pi) * ((turn % ROTATION_COUNT / ROTATION_COUNT)[region[rows]] + along[rows])
    unit[:TIME, rows] = np.sqrt(2.0) * sign[rows] * np.array([np.cos(angle), np.sin(angle)])
    return unit


def _rotated_tetrahedra() -> Array:
    """Tetrahedra under many rotations, by coordinate: (3, `ROTATION_COUNT`, nodes).

    The rotations are made from evenly spread points in a cube (Shoemake 1992, "Uniform random
    rotations"; the points are Roberts', see `low_discrepancy`). Only those are kept whose nodes all
    lie inside a box.
    """
    root, i = generalized_golden_ratio(3), np.arange(16 * ROTATION_COUNT)
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
    corners = (rotation[..., None] * TETRAHEDRON.T[None, :, None, :]).sum(axis=1)
    longest = np.sqrt(3.0 * (1.0 - CENTROID_WEIGHT[2]))
    fits = np.abs(corners).max(axis=(0, 2)) <= longest
    kept: Array = corners[:, fits.nonzero()[0][:ROTATION_COUNT]]
    return kept


_TETRAHEDRA = _rotated_tetrahedra()
