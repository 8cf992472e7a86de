# SPDX-License-Identifier: GPL-3.0-or-later
"""Weights and moments of visible parts of boxes, summed over lines, with error estimates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.line_forms import BoxCoverage
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.line_lattice import Lattice
from .line_visibility import pairwise_sum

__all__ = ["KINK_ERROR", "MIN_WEIGHT", "SQUARE_INDICES", "MomentSums"]


KINK_ERROR = 0.125
"""Largest error of the midpoint of a cell that a kink within it can cause, as a fraction of the
change of slope times the squared width of the cell. The error of a smooth length is a third of it.
The error of a jump is at most half the jump, which shows in two second differences, so that three
estimates cover it too."""
SMALL_OBJECT_ERROR = 0.5
"""Error of the weight of an object that is smaller than the spacing of the lines, as a fraction of
its area: lines may miss it."""
MISSED_WEIGHT = 0.25
"""Weight of an object that no line meets, as a fraction of a cell between lines. An outline that
runs along the lines may be missed in many cells."""
SQUARE_INDICES = (0, 2, 5)
"""Indices of the second moments xx, yy, tt in the lower triangle xx, yx, yy, tx, ty, tt."""
PRODUCT_INDICES = {(0, 1): 1, (1, 0): 1, (0, 2): 3, (2, 0): 3, (1, 2): 4, (2, 1): 4}
"""Indices of the mixed second moments of two axes in the lower triangle xx, yx, yy, tx, ty, tt."""
MIN_WEIGHT = 2.0**-40
"""Weight, as a fraction of the box, that counts as zero: it comes from the rounding of sums."""


@dataclass(frozen=True)
class MomentSums:
    """Sums over lines for m candidates, followed by the backgrounds of n boxes; filled in place.

    Attributes
    ----------
    weight, error : (m + n,) visible fraction of the box, and estimate of its absolute error.
    moment : (3, m + n) first moments, in units of the box's size.
    second : (6, m + n) second moments: xx, yx, yy, tx, ty, tt.
    """

    weight: Array
    moment: Array
    second: Array
    error: Array

    @classmethod
    def zeros(cls, size: int) -> MomentSums:
        """Zero sums for `size` entries."""
        return cls(np.zeros(size), np.zeros((3, size)), np.zeros((6, size)), np.zeros(size))

    def add(self, seen: Array, lattice: Lattice, place: Ints) -> None:
        """Sum lengths and moments (3, k, rows, columns, n) over the lattice into entries `place`
        (k, n).

        The error is estimated from second differences between neighboring lines.
        """
        share = 1.0 / (lattice.rows * lattice.columns)
        a, (b, c) = lattice.axis, (other for other in range(3) if other != lattice.axis)
        by_row = pairwise_sum(seen, 3)
        total = pairwise_sum(by_row, 2) * share
        self.weight[place], self.moment[a, place] = total[0], total[1]
        self.second[SQUARE_INDICES[a], place] = total[2]
        u, v = lattice.u[..., 0], lattice.v.reshape(-1, 1)
        for other, count, at, lines in (
            (b, lattice.rows, u, by_row),
            (c, lattice.columns, v, None),
        ):
            # within a cell of the lattice the visible part is taken to be uniformly distributed
            inner = 1.0 / 12.0 / count**2
            if count == 1:
                self.second[SQUARE_INDICES[other], place] = total[0] * inner
                continue
            if lines is None:
                lines = pairwise_sum(seen[:2], 2)
            length, turn = lines[0], lines[1]
            parts = np.array([length * at, length * (at * at + inner), turn * at])
            moment, square, product = pairwise_sum(parts, 2) * share
            self.moment[other, place], self.second[SQUARE_INDICES[other], place] = moment, square
            self.second[PRODUCT_INDICES[a, other], place] = product
        length = seen[0]
        if min(lattice.rows, lattice.columns) > 1:
            both = pairwise_sum(length * v, 2)
            self.second[PRODUCT_INDICES[b, c], place] = pairwise_sum(both * u, 1) * share
        # kinks lie at random positions and add in quadrature; curvature adds linearly, a third as
        # much
        kinks, bends = np.zeros(place.shape), np.zeros(place.shape)
        for axis in (1, 2):
            if length.shape[axis] > 2:
                part = length.transpose(axis, 0, 3 - axis, 3)
                change = part[2:] - 2.0 * part[1:-1] + part[:-2]
                square, bend = (
                    pairwise_sum(pairwise_sum(each), 1) for each in (change * change, change)
                )
                kinks, bends = kinks + square, bends + np.abs(bend)
        self.error[place] = (KINK_ERROR * share) * (np.sqrt(kinks) + bends / 3.0)

    def raise_errors(
        self, cover: BoxCoverage, index: Ints, wide: Mask, axis: int, lines: int
    ) -> None:
        """Increase the errors of candidates `index` (k, n) that may be hidden between the lines.

        Parameters
        ----------
        wide : (3,) the axes along which the boxes extend.  axis : the axis of the lines.
        lines : number of lines along each of the other axes.
        """
        x, y = cover.apparent_size[0, index], cover.apparent_size[1, index]
        small = ((x < 1.0 / lines) & wide[0]) | ((y < 1.0 / lines) & wide[1])
        area = np.pi * np.minimum(x, 1.0) * np.minimum(y, 1.0)
        unseen = np.where(
            small & ~cover.all_hit[index], SMALL_OBJECT_ERROR * np.minimum(area, 1.0), 0.0
        )
        along = 1.0 / np.maximum(cover.outline_normal[axis, index], 1.0 / lines)
        unmet = (self.weight[index] <= MIN_WEIGHT) & ~cover.all_hit[index]
        hidden = np.where(unmet, MISSED_WEIGHT / lines**2 * along, 0.0)
        self.error[index] = np.maximum(self.error[index], np.maximum(unseen, hidden))
