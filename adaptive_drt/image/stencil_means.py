# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixel means by a stencil: second differences of shutter means at neighbouring pixel centres.

The second differences give the mean; their change from pixel to pixel gives its error estimate,
where visibility is the same two pixels to each side: see `midpoint`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array, Ints
from ..numerics.gather import columns
from ..numerics.midpoint import (
    FALLBACK_ERROR_FRACTION,
    SECOND_DIFFERENCE_WEIGHT,
    left,
    second_differences,
)
from .node_values import NodeValues

__all__ = ["StencilMeans"]


class StencilMeans:
    """The pixels that no block has resolved, corrected one by one."""

    def __init__(self, points: NodeValues) -> None:
        """Find the candidate pixels; no node values are requested yet."""
        self.points = points
        # (m,) pixels that may be resolved in this way
        self.pixels: Ints = points.wanted.nonzero()[0]
        if self.pixels.size:
            self.pixels = self.pixels[self._fine(self.pixels)]

    def _fine(self, rows: Ints) -> NDArray[np.bool_]:
        points = self.points
        sight = points.frame.visibility_key[rows]
        fine: NDArray[np.bool_] = (sight >= 0) & (points.remaining_steps[rows] <= points.allowed)
        for near in self._around(rows, 1):
            fine &= self._alike(rows, near) & (points.remaining_steps[near] <= points.allowed)
        return fine

    def missing_pixels(self) -> Ints:
        """Pixels whose values are needed and not yet known: ascending indices."""
        points = self.points
        self.pixels = rows = self.pixels[points.wanted[self.pixels]]
        if not points.frame.plan.edges:
            return points.unknown(rows)
        beyond = [far[self._alike(rows, far)] for far in self._around(rows, 2)]
        return points.unknown(rows, *self._around(rows, 1), *beyond)

    def settle(self) -> None:
        """Enter the means of the pixels whose estimated error is small enough."""
        points, rows = self.points, self.pixels
        if not rows.size:
            return
        mean = points.values(rows)
        off = np.zeros(rows.size)
        if points.frame.plan.edges:
            for step in (1, points.frame.width):
                before, bend, after = second_differences(points.value, rows, step)
                mean = mean + SECOND_DIFFERENCE_WEIGHT * bend
                off = np.maximum(off, self._off(rows, step, before, bend, after))
        sure = (off <= points.allowed).nonzero()[0]
        rows = rows[sure]
        error = np.hypot(points.error[rows], off[sure])
        points.settle(rows, columns(mean, sure), error, points.sampling[rows])

    def _off(self, rows: Ints, step: int, before: Array, bend: Array, after: Array) -> Array:
        """Estimated error of the means due to the variation along one axis: (m,)."""
        size = self.points.size
        off: Array = FALLBACK_ERROR_FRACTION * size(bend)
        some = self._alike(rows, rows - 2 * step) & self._alike(rows, rows + 2 * step)
        return np.where(some, np.minimum(off, left(size, before, bend, after)), off)

    def _alike(self, rows: Ints, other: Ints) -> NDArray[np.bool_]:
        """Whether pixels have the same visibility key as others."""
        alike: NDArray[np.bool_] = (
            self.points.frame.visibility_key[rows] == self.points.frame.visibility_key[other]
        )
        return alike

    def _around(self, rows: Ints, reach: int) -> list[Ints]:
        """Pixels at distance `reach` from each, to both sides along both axes."""
        width = self.points.frame.width
        return [rows + reach * step for step in (-1, 1, -width, width)]
