# SPDX-License-Identifier: GPL-3.0-or-later
"""Cells: boxes in pixel x, y and shutter time, each with the mean radiance of its regions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..shading.variation import no_variation

__all__ = ["Cells", "merge", "split", "sums"]


@dataclass(frozen=True)
class Cells:
    """c cells, sorted by pixel.

    Attributes
    ----------
    pixel : (c,) number within the batch.
    low, high : (3, c) pixel coordinates x, y and shutter time; an axis may have no extent.
    share : (c,) part of the pixel's whole domain.
    color : (3, c) mean radiance.  alpha : (c,) mean coverage.
    deviation : (4, 3, c) estimated deviation of the mean by kind and axis: see `variation`.
    edge : (c,) estimated deviation by the shape of the regions.
    star : (c,) whether stars of points may sample regions, or have where they were worth it; else
        their centroids do.
    """

    pixel: Ints
    low: Array
    high: Array
    share: Array
    color: Array
    alpha: Array
    deviation: Array
    edge: Array
    star: Mask

    @classmethod
    def blank(cls, pixel: Ints, low: Array, high: Array, share: Array, star: Mask) -> Cells:
        """Cells not yet shaded."""
        c = pixel.size
        return cls(
            pixel, low, high, share, np.zeros((3, c)), np.zeros(c),
            no_variation(c), np.zeros(c), star,
        )  # fmt: skip

    def take(self, keep: Mask | Ints) -> Cells:
        """The cells at a mask or an index."""
        return Cells(*(columns(getattr(self, name), keep, -1) for name in FIELDS))

    @property
    def error(self) -> Array:
        """What each cell may be off by, of its pixel's value: (c,)."""
        total: Array = self.share * (self.deviation.sum(axis=(0, 1)) + self.edge)
        return total


FIELDS = tuple(Cells.__dataclass_fields__)


def merge(parts: list[Cells]) -> Cells:
    """Cells of several lists by pixel; those of one pixel in the order of the lists."""
    fields = [np.concatenate([getattr(p, name) for p in parts], axis=-1) for name in FIELDS]
    order = np.argsort(fields[0], kind="stable")
    return Cells(*(columns(field, order, -1) for field in fields))


def split(cells: Cells, parts: Ints) -> Cells:
    """Blank children of cells, cut into `parts` (3, c) equal parts along each axis."""
    size = parts.prod(axis=0)
    parent = np.repeat(np.arange(cells.pixel.size), size)
    number = np.arange(parent.size) - np.repeat(np.cumsum(size) - size, size)
    low, high = np.empty((3, parent.size)), np.empty((3, parent.size))
    for axis in range(3):
        n = parts[axis, parent]
        number, place = np.divmod(number, n)
        start, end = cells.low[axis, parent], cells.high[axis, parent]
        width = (end - start) / n
        low[axis] = start + place * width
        high[axis] = np.where(place == n - 1, end, start + (place + 1) * width)
    share = cells.share[parent] / size[parent]
    return Cells.blank(cells.pixel[parent], low, high, share, cells.star[parent])


def sums(row: Ints, values: Array, count: int) -> Array:
    """Sums (count,) of the values of each row, in their order."""
    return np.bincount(row, weights=values, minlength=count).astype(np.float64, copy=False)
