# SPDX-License-Identifier: GPL-3.0-or-later
"""Integration cells: boxes in pixel x, y and shutter time, with mean radiance and its error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..shading.variation import zero_variation

__all__ = ["Cells", "grouped_sums", "merge", "split"]


@dataclass(frozen=True)
class Cells:
    """Arrays of c integration cells, sorted by pixel.

    Attributes
    ----------
    pixel : (c,) index of the cell's pixel within the batch.
    low, high : (3, c) bounds in pixel x, pixel y and shutter time; an axis may have no extent.
    volume_fraction : (c,) fraction of the pixel's whole integration domain.
    color : (3, c) mean radiance.  alpha : (c,) mean coverage.
    deviation : (4, 3, c) estimated error of the mean by kind and axis: see `variation`.
    shape_error : (c,) estimated error of the mean due to the measured shape of its visible regions.
    sampling : (c,) estimated error of the mean due to light that was estimated by distributed rays
        or in another way that is not exact; subdivision does not reduce it, more rays do.
    multi_node : (c,) whether the multi-node rule may be used for the cell's regions, or has been
        where it was worth its cost; if false, only the centroid rule is used.
    """

    pixel: Ints
    low: Array
    high: Array
    volume_fraction: Array
    color: Array
    alpha: Array
    deviation: Array
    shape_error: Array
    sampling: Array
    multi_node: Mask

    @classmethod
    def blank(cls, pixel: Ints, low: Array, high: Array, share: Array, star: Mask) -> Cells:
        """Make cells that have bounds but are not yet shaded: colour, coverage and errors are 0."""
        c = pixel.size
        return cls(
            pixel, low, high, share, np.zeros((3, c)), np.zeros(c),
            zero_variation(c), np.zeros(c), np.zeros(c), star,
        )  # fmt: skip

    def take(self, keep: Mask | Ints) -> Cells:
        """Select cells by a mask or an index."""
        return Cells(*(columns(getattr(self, name), keep, -1) for name in CELL_FIELDS))

    @property
    def error(self) -> Array:
        """Contribution of each cell to its pixel's error that subdivision reduces: (c,)."""
        total: Array = self.volume_fraction * (self.deviation.sum(axis=(0, 1)) + self.shape_error)
        return total


CELL_FIELDS = tuple(Cells.__dataclass_fields__)


def merge(parts: list[Cells]) -> Cells:
    """Concatenate lists of cells and sort them by pixel; within a pixel the order of the lists is
    kept.
    """
    fields = [np.concatenate([getattr(p, name) for p in parts], axis=-1) for name in CELL_FIELDS]
    order = np.argsort(fields[0], kind="stable")
    return Cells(*(columns(field, order, -1) for field in fields))


def split(cells: Cells, parts: Ints) -> Cells:
    """Split each cell into equal children, not yet shaded.

    parts : (3, c) number of children along each axis.
    """
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
    share = cells.volume_fraction[parent] / size[parent]
    return Cells.blank(cells.pixel[parent], low, high, share, cells.multi_node[parent])


def grouped_sums(row: Ints, values: Array, count: int) -> Array:
    """Sum values by group: (count,). `row` is the group of each value; they are added in their
    order.
    """
    return np.bincount(row, weights=values, minlength=count).astype(np.float64, copy=False)
