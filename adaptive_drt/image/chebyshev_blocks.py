# SPDX-License-Identifier: GPL-3.0-or-later
"""Chebyshev interpolation over blocks of pixels in which radiance varies smoothly.

A block is a pixel of a coarser picture: `detect` proves properties of blocks as it does for pixels,
with a camera whose pixel steps are longer. Blocks proven free of outlines, shadow edges and moving
objects get a bicubic polynomial through 4 x 4 Chebyshev nodes; the others are subdivided, down to
pixels. So the work of the first pass depends on the amount of edges and penumbrae in the picture,
not on its size.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..numerics.arrays import Array, Ints
from ..numerics.error_coefficients import COEFFICIENT_DECAY
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Tile, find_candidates, run_indices

__all__ = [
    "SIDES",
    "PixelBlocks",
    "block_means",
    "block_nodes",
    "chebyshev_series",
    "coarse_bounds",
    "coarse_plan",
    "interpolation_error",
]


SIDES = (8, 4)
"""Sides of blocks in pixels, the larger first. (Adding 16 takes as long at 1920 x 1080, where it
saves points, and a tenth longer at 640 x 480.)"""
CHEBYSHEV_NODES: Array = np.cos(np.pi * (7.0 - 2.0 * np.arange(4)) / 8.0)
"""(4,) Chebyshev nodes of the interval from -1 to 1."""
DEGREES = np.arange(4)[:, None]
SERIES_MATRIX = np.cos(DEGREES * np.arccos(CHEBYSHEV_NODES)) * np.where(DEGREES == 0, 0.25, 0.5)
"""Matrix (4, 4) from values at the nodes of an interval to its Chebyshev coefficients."""
PAIRS_PER_CHUNK = 1 << 16
"""Number of pairs of blocks and objects that are subdivided at a time: it bounds memory."""


@dataclass(frozen=True)
class PixelBlocks:
    """Blocks of pixels of one side; with side 1 they are pixels.

    Attributes
    ----------
    side : pixels.  x, y : (n,) the lower left corners from the picture's corner, in units of
        `side`.
    pairs : objects that may be visible in each block, sorted by object.
    """

    side: int
    x: Ints
    y: Ints
    pairs: Pairs

    @classmethod
    def of_tile(cls, rough: Plan, side: int, bounds: Ints, tile: Tile) -> PixelBlocks:
        """Blocks of a tile of the coarse picture (see `coarse_plan`), given its `screen_bounds`."""
        x, y = (np.floor(place).astype(np.int64) for place in (tile.x, tile.y))
        return cls(side, x, y, find_candidates(rough, bounds, tile))

    @property
    def centers(self) -> tuple[Array, Array]:
        """Centres x, y of the blocks in units of `side`: two (n,)."""
        x: Array = np.asarray(self.x, dtype=np.float64) + 0.5
        return x, np.asarray(self.y, dtype=np.float64) + 0.5

    def subdivide(
        self, chosen: Ints, side: int, region: tuple[int, int, int, int], bounds: Ints
    ) -> PixelBlocks:
        """Subdivide the chosen blocks to a smaller side, and keep those that overlap a region of
        pixels. Blocks of side 1 have no pairs of objects whose `screen_bounds` exclude the pixel.
        """
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
        blocks = PixelBlocks(side, x[inside], y[inside], self.pairs)
        found = []
        for first in range(0, max(self.pairs.item.size, 1), PAIRS_PER_CHUNK):
            some = self.pairs.take(slice(first, first + PAIRS_PER_CHUNK))
            copies = size[some.pixel]
            child = run_indices(start[some.pixel], copies)
            pairs = Pairs(child, np.repeat(some.item, copies))
            found.append(blocks._within(pairs, bounds) if side == 1 else pairs)
        pixel, item = (
            np.concatenate([getattr(part, name) for part in found]) for name in ("pixel", "item")
        )
        return replace(blocks, pairs=Pairs(pixel, item))

    def _within(self, pairs: Pairs, bounds: Ints) -> Pairs:
        """Pairs of blocks of side 1 and objects whose `screen_bounds` include the pixel."""
        x, y, item = self.x[pairs.pixel], self.y[pairs.pixel], pairs.item
        left, bottom, right, top = columns(bounds, item)
        return pairs.take((x >= left) & (x < right) & (y >= bottom) & (y < top))

    def part(self, first: int, last: int) -> PixelBlocks:
        """Blocks from index `first` up to, but not including, `last`."""
        kept = ((self.pairs.pixel >= first) & (self.pairs.pixel < last)).nonzero()[0]
        pairs = Pairs(self.pairs.pixel[kept] - first, self.pairs.item[kept])
        return PixelBlocks(self.side, self.x[first:last], self.y[first:last], pairs)


def coarse_plan(plan: Plan, side: int) -> Plan:
    """Plan of the coarse picture whose pixels are blocks of a given side."""
    lens = replace(plan.lens, right=side * plan.lens.right, up=side * plan.lens.up)
    left, bottom, right, top = plan.region
    region = (left // side, bottom // side, -(-right // side), -(-top // side))
    return replace(plan, lens=lens, region=region)


def coarse_bounds(bounds: Ints, side: int) -> Ints:
    """Bounds (4, objects) in blocks of a side, given bounds in pixels; both as `screen_bounds`."""
    first = bounds[:2] // side
    last = np.where(bounds[2:] > bounds[:2], -(-bounds[2:] // side), first)
    return np.concatenate([first, last])


def block_nodes(x: Array, y: Array, side: int) -> tuple[Array, Array]:
    """Pixel coordinates x, y of the nodes of blocks with given centres, row by row: two (16, n)."""
    column: Array = np.tile(CHEBYSHEV_NODES, 4)[:, None]
    row: Array = np.repeat(CHEBYSHEV_NODES, 4)[:, None]
    across: Array = float(side) * (x + 0.5 * column)
    up: Array = float(side) * (y + 0.5 * row)
    return across, up


def chebyshev_series(values: Array) -> Array:
    """Chebyshev coefficients (k, 4, 4, n), y first, of values (k, 16, n) at the nodes."""
    grid = values.reshape(values.shape[0], 4, 4, -1)
    return _along_rows(_along_columns(grid, SERIES_MATRIX), SERIES_MATRIX)


def interpolation_error(coefficients: Array) -> Array:
    """Estimated interpolation error of a bicubic polynomial, RMS over channels k: (n,).

    It is extrapolated from the coefficients: those of a smooth function decay at least as quickly
    as the last two do, those of a function with a kink by half at most.
    """
    square = (coefficients * coefficients).mean(axis=0)
    total: Array = np.zeros(square.shape[-1])
    for axis in (0, 1):
        last, before = (np.sqrt(square.take(k, axis=axis).sum(axis=0)) for k in (3, 2))
        ratio = (
            COEFFICIENT_DECAY
            * last
            / np.maximum(before, np.maximum(COEFFICIENT_DECAY * last, TINY))
        )
        total += last * ratio
    return total


def block_means(coefficients: Array, side: int) -> Array:
    """Means over the pixels of blocks: (k, side, side, n), y first."""
    u, h = (2.0 * np.arange(side) + 1.0) / side - 1.0, 1.0 / side
    square = u * u + h * h / 3.0
    weights = np.array([np.ones(side), u, 2.0 * square - 1.0, 4.0 * u * (u * u + h * h) - 3.0 * u])
    return _along_rows(_along_columns(coefficients, weights.T), weights.T)


def _along_columns(grid: Array, weights: Array) -> Array:
    """Transform (k, 4, m, n) by (r, 4) to (k, r, m, n), term by term: the same bits for any n."""
    w = weights[None, :, :, None, None]
    total: Array = w[:, :, 0] * grid[:, :1]
    for j in (1, 2, 3):
        total += w[:, :, j] * grid[:, j : j + 1]
    return total


def _along_rows(grid: Array, weights: Array) -> Array:
    """Transform (k, m, 4, n) by (r, 4) to (k, m, r, n), in the same way."""
    w = weights[None, None, :, :, None]
    total: Array = w[:, :, :, 0] * grid[:, :, :1]
    for j in (1, 2, 3):
        total += w[:, :, :, j] * grid[:, :, j : j + 1]
    return total
