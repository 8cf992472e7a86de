# SPDX-License-Identifier: GPL-3.0-or-later
"""Squares of pixels: those in which nothing changes but smoothly are shaded at a few points.

A square is a pixel of a coarser picture: what is proven of pixels (`detect`) holds for squares by
the same means, with a lens whose steps are as long. Squares that are clear of outlines, shadows
and motion get a bicubic through 4 x 4 Chebyshev nodes; the others are cut, down to pixels. So the
work of the first pass falls on what a picture has of edges and penumbrae, not on its size.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..numerics.arrays import Array, Ints
from ..numerics.floats import TINY
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Tile, find_pairs, runs

__all__ = ["SIDES", "Squares", "coarse", "coarse_bounds", "means", "nodes", "roughness", "series"]


SIDES = (8, 4)
"""Pixels: sides of squares, the larger first. (16 besides takes as long at 1920 x 1080, where it
saves points, and a tenth longer at 640 x 480.)"""
LINE: Array = np.cos(np.pi * (7.0 - 2.0 * np.arange(4)) / 8.0)
"""Chebyshev nodes of a line from -1 to 1."""
DEGREES = np.arange(4)[:, None]
TO_SERIES = np.cos(DEGREES * np.arccos(LINE)) * np.where(DEGREES == 0, 0.25, 0.5)
"""(4, 4) from values at the nodes of a line to the coefficients of its Chebyshev series."""
FALL = 2.0
"""How much less quickly than its last two say the coefficients of a series may fall."""


@dataclass(frozen=True)
class Squares:
    """Squares of one side; of side 1 they are pixels.

    Attributes
    ----------
    side : pixels.  x, y : (n,) the lower left corner, in sides from the picture's.
    pairs : the objects that may be seen in each, sorted by object.
    """

    side: int
    x: Ints
    y: Ints
    pairs: Pairs

    @classmethod
    def of_tile(cls, rough: Plan, side: int, bounds: Ints, tile: Tile) -> Squares:
        """The squares of a tile of the `coarse` picture, whose `screen_bounds` are given."""
        x, y = (np.floor(place).astype(np.int64) for place in (tile.x, tile.y))
        return cls(side, x, y, find_pairs(rough, bounds, tile))

    @property
    def middles(self) -> tuple[Array, Array]:
        """Of the squares, in sides: two (n,)."""
        x: Array = np.asarray(self.x, dtype=np.float64) + 0.5
        return x, np.asarray(self.y, dtype=np.float64) + 0.5

    def cut(self, chosen: Ints, side: int, region: tuple[int, int, int, int]) -> Squares:
        """Smaller squares of some of them, those that a region of pixels has a part of."""
        parts = self.side // side
        left, bottom, right, top = region
        row, column = np.divmod(np.arange(parts * parts), parts)
        x = parts * self.x[chosen, None] + column
        y = parts * self.y[chosen, None] + row
        inside = (side * x < right) & (side * (x + 1) > left)
        inside &= (side * y < top) & (side * (y + 1) > bottom)
        size = np.zeros(self.x.size, dtype=np.int64)
        size[chosen] = inside.sum(axis=1)
        start = np.zeros_like(size)
        start[chosen] = np.cumsum(size[chosen]) - size[chosen]
        copies = size[self.pairs.pixel]
        child = runs(start[self.pairs.pixel], copies)
        pairs = Pairs(child, np.repeat(self.pairs.item, copies))
        return Squares(side, x[inside], y[inside], pairs)

    def within(self, bounds: Ints) -> Squares:
        """Pixels without the pairs of objects whose `screen_bounds` leave them out."""
        x, y, item = self.x[self.pairs.pixel], self.y[self.pairs.pixel], self.pairs.item
        left, bottom, right, top = bounds
        inside = (x >= left[item]) & (x < right[item]) & (y >= bottom[item]) & (y < top[item])
        return replace(self, pairs=self.pairs.take(inside))

    def part(self, first: int, last: int) -> Squares:
        """The squares from the `first` to before the `last`."""
        kept = ((self.pairs.pixel >= first) & (self.pairs.pixel < last)).nonzero()[0]
        pairs = Pairs(self.pairs.pixel[kept] - first, self.pairs.item[kept])
        return Squares(self.side, self.x[first:last], self.y[first:last], pairs)


def coarse(plan: Plan, side: int) -> Plan:
    """The plan of the picture whose pixels are squares of a side."""
    lens = replace(plan.lens, right=side * plan.lens.right, up=side * plan.lens.up)
    left, bottom, right, top = plan.region
    region = (left // side, bottom // side, -(-right // side), -(-top // side))
    return replace(plan, lens=lens, region=region)


def coarse_bounds(bounds: Ints, side: int) -> Ints:
    """The squares (4, objects) of a side that pixels within bounds, as `screen_bounds`, are in."""
    first = bounds[:2] // side
    last = np.where(bounds[2:] > bounds[:2], -(-bounds[2:] // side), first)
    return np.concatenate([first, last])


def nodes(x: Array, y: Array, side: int) -> tuple[Array, Array]:
    """Pixel coordinates of the nodes of squares with given middles, row by row: two (16, n)."""
    column: Array = np.tile(LINE, 4)[:, None]
    row: Array = np.repeat(LINE, 4)[:, None]
    across: Array = float(side) * (x + 0.5 * column)
    up: Array = float(side) * (y + 0.5 * row)
    return across, up


def series(values: Array) -> Array:
    """Chebyshev coefficients (k, 4, 4, n), y first, of values (k, 16, n) at nodes."""
    grid = values.reshape(values.shape[0], 4, 4, -1)
    return _along_rows(_along_columns(grid, TO_SERIES), TO_SERIES)


def roughness(coefficients: Array) -> Array:
    """How far a bicubic may be off what it goes through, RMS over channels k: (n,).

    Coefficients of a smooth function fall at least as quickly as the last two do; those of a kink
    by half at most.
    """
    square = (coefficients * coefficients).mean(axis=0)
    total: Array = np.zeros(square.shape[-1])
    for axis in (0, 1):
        last, before = (np.sqrt(square.take(k, axis=axis).sum(axis=0)) for k in (3, 2))
        ratio = FALL * last / np.maximum(before, np.maximum(FALL * last, TINY))
        total += last * ratio
    return total


def means(coefficients: Array, side: int) -> Array:
    """Means over the pixels of squares: (k, side, side, n), y first."""
    u, h = (2.0 * np.arange(side) + 1.0) / side - 1.0, 1.0 / side
    square = u * u + h * h / 3.0
    weights = np.array([np.ones(side), u, 2.0 * square - 1.0, 4.0 * u * (u * u + h * h) - 3.0 * u])
    return _along_rows(_along_columns(coefficients, weights.T), weights.T)


def _along_columns(grid: Array, weights: Array) -> Array:
    """(k, 4, m, n) times (r, 4) to (k, r, m, n), term by term: the same bits for any n."""
    w = weights[None, :, :, None, None]
    total: Array = w[:, :, 0] * grid[:, :1]
    for j in (1, 2, 3):
        total += w[:, :, j] * grid[:, j : j + 1]
    return total


def _along_rows(grid: Array, weights: Array) -> Array:
    """(k, m, 4, n) times (r, 4) to (k, m, r, n)."""
    w = weights[None, None, :, :, None]
    total: Array = w[:, :, :, 0] * grid[:, :, :1]
    for j in (1, 2, 3):
        total += w[:, :, :, j] * grid[:, :, j : j + 1]
    return total
