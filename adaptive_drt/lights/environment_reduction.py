# SPDX-License-Identifier: GPL-3.0-or-later
"""Images of the sphere with fewer pixels, and the error of the light behind occluders by that.

The tables of an environment take `environment_map.TEXEL_BYTES` for each pixel: those of an image of
8192 x 4096 would take gigabytes. Light comes from a whole hemisphere, so that finer pixels matter
only where the outline of an occluder crosses them: of each the part that it hides is then taken to
be as bright as the rest.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array

__all__ = ["MOST_TEXELS", "reduced_image"]


MOST_TEXELS = 1 << 21
"""Number of pixels up to which an image is taken as it is: its tables then take 0.5 GB."""
SPLIT_SHARE = 0.25
"""Error of a pixel's light where an outline splits it, as a fraction of the standard deviation of
the light within. Derived: with a gradient across the outline a half is off by sqrt(3) / 4 of it, at
most; of an outline of any direction, and of fine texture, it is less."""


def reduced_image(
    pixels: NDArray[np.float32] | NDArray[np.float64], most: int = MOST_TEXELS
) -> tuple[Array, float]:
    """Return an image (rows, columns, 3) of at most so many pixels, and an error of irradiance.

    The new pixels are means over solid angle. The error is that of a point that sees a hemisphere
    along whose boundary, of 2 pi radians, pixels are split: RMS over all places of it, in units of
    the pixels' radiance times sr, and the largest of the channels.

    pixels : (rows, columns, 3) from the top down.
    """
    rows, columns_, _ = pixels.shape
    factor = math.sqrt(rows * columns_ / most)
    if factor <= 1.0:
        return np.asarray(pixels, dtype=np.float64), 0.0
    height, width = max(1, int(rows / factor)), max(1, int(columns_ / factor))
    theta = np.linspace(0.0, np.pi, rows + 1)
    area = np.cos(theta[:-1]) - np.cos(theta[1:])
    result, square = np.zeros((height, width, 3)), 0.0
    for row in range(height):
        low, high = row * rows / height, (row + 1) * rows / height
        some = np.arange(int(low), min(math.ceil(high), rows))
        part = np.minimum(some + 1, high) - np.maximum(some, low)
        weight = area[some] * part
        values = np.asarray(pixels[some], dtype=np.float64)
        mean = np.tensordot(weight, values, axes=1) / weight.sum()
        power = np.tensordot(weight, values * values, axes=1) / weight.sum()
        result[row] = _column_means(mean, width)
        spread = np.maximum(_column_means(power, width) - result[row] ** 2, 0.0)
        size = weight.sum() * 2.0 * np.pi / width
        square = square + size * size * spread.sum(axis=0)
    # the boundary crosses a pixel of a size s with the probability 2 pi s / (4 pi)
    crossing = 0.5 * np.pi / height
    return result, SPLIT_SHARE * math.sqrt(crossing * float(np.max(square)))


def _column_means(line: Array, width: int) -> Array:
    """Means (width, 3) of a row (columns, 3) of pixels over equal parts of it."""
    total = np.concatenate([np.zeros((1, 3)), np.cumsum(line, axis=0)])
    place = np.linspace(0.0, line.shape[0], width + 1)
    index = np.minimum(place.astype(np.int64), line.shape[0] - 1)
    at = total[index] + (place - index)[:, None] * line[index]
    means: Array = np.diff(at, axis=0) * (width / line.shape[0])
    return means
