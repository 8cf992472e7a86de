# SPDX-License-Identifier: GPL-3.0-or-later
"""Environments that the camera sees: mean radiance over pixels, and over parts of them.

Means are those of a square lattice of points, turned where texels are larger than boxes, which is
made finer until it agrees with the one before.
"""

from __future__ import annotations

import math

import numpy as np

from ..geometry.camera import PinholeCamera
from ..numerics.arrays import Array
from ..numerics.gather import columns
from ..numerics.vector import rms
from .environment_map import EnvironmentMap

__all__ = ["mean_over_boxes", "radiance_of_regions"]


FIRST_SIDE, FINE_SIDE, LAST_SIDE = 2, 4, 32
"""Number of points a side of the first lattice, at least, also where small errors are asked for,
and number up to which it is doubled."""
FINE_SHARE = 0.25 / 8.0 / (2 * FIRST_SIDE) ** 4
"""Error, as a fraction of the radiance, below which the first lattice has `FINE_SIDE` points.
Derived: where the slope of the radiance jumps by all of the radiance within a pixel, the lattice
after the first is off by 1 / (8 n^2) at most, of n rows, and by a quarter of that often."""
POINTS_PER_TEXEL = 4.0
"""Number of points of the first lattice along a texel: fewer may agree with the next by chance."""
REGION_SIDE = 4
"""Number of points a side of the lattice over boxes of which a part is seen."""
REMAINING_SHARE = 0.5
"""Error of a lattice's mean, as a fraction of its difference from one of half as many points a
side. Derived: where the radiance is smooth a third of it; half where it is not."""
POINTS_AT_A_TIME = 1 << 17
"""Number of points evaluated at a time, which bounds memory."""


def mean_over_boxes(
    backdrop: EnvironmentMap, lens: PinholeCamera, x: Array, y: Array, half: float, share: float
) -> tuple[Array, Array]:
    """Mean radiance (3, n) over boxes of the picture, and its errors (n,), RMS over the channels.

    Parameters
    ----------
    x, y : (n,) centres in pixel coordinates.  half : half their extent in pixels; 0 for points.
    share : error, as a fraction of the radiance, up to which lattices are not made finer.
    """
    count = x.size
    if half == 0.0:
        value = _lattice(backdrop, lens, np.array([x, y]), np.zeros((2, count)), _offsets(1))
        return value.reshape(3, count), np.zeros(count)
    mean, error = np.zeros((3, count)), np.zeros(count)
    side = _first_side(backdrop, lens, half, share)
    # of many texels in a box no single one counts, and a plain lattice is better
    places = _turned_offsets if side <= FINE_SIDE else _offsets
    rows, before = np.arange(count), None
    while rows.size:
        place, offset = np.array([x[rows], y[rows]]), places(side)
        step = max(1, POINTS_AT_A_TIME // (side * side))
        parts = [
            _lattice(backdrop, lens, part, np.full_like(part, half), offset).mean(axis=1)
            for part in (place[:, k : k + step] for k in range(0, rows.size, step))
        ]
        found = np.concatenate(parts, axis=1)
        mean[:, rows] = found
        if before is None:
            more = np.arange(rows.size)
        else:
            error[rows] = REMAINING_SHARE * rms(found - before)
            more = (error[rows] > share * rms(found)).nonzero()[0]
        before = columns(found, more)
        rows, side = rows[more], 2 * side
        if side > LAST_SIDE:
            break
    return mean, error


def radiance_of_regions(
    backdrop: EnvironmentMap, lens: PinholeCamera, center: Array, half: Array, centroid: Array
) -> tuple[Array, Array]:
    """Mean radiance (3, n) over parts of boxes, and their errors (n,).

    It is the one of the plane that fits the radiance over the box best, at the part's centroid; the
    error is by how far the radiance is from the plane.

    Parameters
    ----------
    center, half, centroid : (2, n) pixel coordinates: middles and half extents of the boxes, and
        centroids of the parts.
    """
    offset = _offsets(REGION_SIDE)
    value = _lattice(backdrop, lens, center, half, offset)
    mean = value.mean(axis=1)
    square = float((offset[0] ** 2).mean())
    away = (centroid - center) / np.where(half > 0.0, half, 1.0)
    plane = mean[:, None] + np.zeros_like(value)
    color = mean.copy()
    for place, shift in zip(offset, away, strict=True):
        slope = (place[:, None] * value).mean(axis=1) / square
        plane += slope[:, None] * place[:, None]
        color += slope * shift
    error = np.sqrt(((value - plane) ** 2).mean(axis=(0, 1)))
    return np.maximum(color, 0.0), error


def _first_side(backdrop: EnvironmentMap, lens: PinholeCamera, half: float, share: float) -> int:
    """Number of points a side of the first lattice over boxes of one size."""
    texel = np.pi / max(backdrop.knots.size - 2, backdrop.column_count // 2)
    texels = 2.0 * half * lens.half_pixel / float(np.sqrt((lens.base**2).sum())) / texel
    least = FIRST_SIDE if share >= FINE_SHARE else FINE_SIDE
    wanted = max(POINTS_PER_TEXEL * texels, float(least))
    return int(min(2 ** math.ceil(math.log2(wanted)), LAST_SIDE // 2))


def _offsets(side: int) -> Array:
    """Places (2, side^2) of a square lattice over a square from -1 to 1."""
    line = (2.0 * np.arange(side) + 1.0) / side - 1.0
    return np.array([np.tile(line, side), np.repeat(line, side)])


def _turned_offsets(side: int) -> Array:
    """Places (2, side^2) of a turned lattice over a square from -1 to 1.

    There is one in each of side x side cells, and in each of side^2 columns and rows. Were there
    several in a row, then all pixels along a horizon of the image, where the slope of the radiance
    jumps, would have errors of one size and sign, of which two lattices may agree by chance.
    """
    i, j = np.tile(np.arange(side), side), np.repeat(np.arange(side), side)
    turned = np.array([i * side + j, j * side + (side - 1 - i)])
    offsets: Array = (2.0 * turned + 1.0) / (side * side) - 1.0
    return offsets


def _lattice(
    backdrop: EnvironmentMap, lens: PinholeCamera, center: Array, half: Array, offset: Array
) -> Array:
    """Radiance (3, k, n) over boxes at places (2, k)."""
    x, y = center[:, None] + half[:, None] * offset[:, :, None]
    value = backdrop.radiance(lens.directions(x.ravel(), y.ravel()))
    return value.reshape(3, offset.shape[1], -1)
