# SPDX-License-Identifier: GPL-3.0-or-later
"""What lines through boxes found, summed: weights, moments, and how far weights may be off."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from .line_intervals import Lattice
from .line_visibility import fold
from .polynomials import Cover

__all__ = ["DUST", "KINK", "SQUARES", "Sums"]


KINK = 0.125
"""Of slope times a cell's width squared: the most that a kink within a cell can hide from its
middle. A smooth length's own error is a third of it; that of a jump at most half the jump, which
differs twice, so that three estimates cover it too."""
UNSEEN = 0.5
"""Of the area of an object that falls between the lines: its weight is off by about that."""
MISSED = 0.25
"""Of a cell between lines: what may be seen there of an object that none of them meets. An outline
that runs along the lines may do so in many cells."""
SQUARES = (0, 2, 5)
PRODUCTS = {(0, 1): 1, (1, 0): 1, (0, 2): 3, (2, 0): 3, (1, 2): 4, (2, 1): 4}
"""Where second moments stand in a lower triangle: xx, yx, yy, tx, ty, tt."""
DUST = 2.0**-40
"""Of a box. What the rounding of sums leaves of regions that are not there."""


@dataclass(frozen=True)
class Sums:
    """What lines found, of m candidates and then the background of n boxes; filled in place.

    Attributes
    ----------
    weight, error : (m + n,).  moment : (3, m + n) of the weight, in sizes of the box.
    second : (6, m + n) of its second moments: xx, yx, yy, tx, ty, tt.
    """

    weight: Array
    moment: Array
    second: Array
    error: Array

    @classmethod
    def of(cls, size: int) -> Sums:
        """Nothing found yet, of so many."""
        return cls(np.zeros(size), np.zeros((3, size)), np.zeros((6, size)), np.zeros(size))

    def add(self, seen: Array, lattice: Lattice, place: Ints) -> None:
        """Sum lengths and moments (3, k, rows, columns, n) over the lattice into `place` (k, n)."""
        share = 1.0 / (lattice.rows * lattice.columns)
        a, (b, c) = lattice.axis, (other for other in range(3) if other != lattice.axis)
        by_row = fold(seen, 3)
        total = fold(by_row, 2) * share
        self.weight[place], self.moment[a, place] = total[0], total[1]
        self.second[SQUARES[a], place] = total[2]
        u, v = lattice.u[..., 0], lattice.v.reshape(-1, 1)
        for other, count, at, lines in (
            (b, lattice.rows, u, by_row),
            (c, lattice.columns, v, None),
        ):
            # within a cell of the lattice what is seen counts as spread evenly
            inner = 1.0 / 12.0 / count**2
            if count == 1:
                self.second[SQUARES[other], place] = total[0] * inner
                continue
            if lines is None:
                lines = fold(seen[:2], 2)
            length, turn = lines[0], lines[1]
            parts = np.array([length * at, length * (at * at + inner), turn * at])
            moment, square, product = fold(parts, 2) * share
            self.moment[other, place], self.second[SQUARES[other], place] = moment, square
            self.second[PRODUCTS[a, other], place] = product
        length = seen[0]
        if min(lattice.rows, lattice.columns) > 1:
            both = fold(length * v, 2)
            self.second[PRODUCTS[b, c], place] = fold(both * u, 1) * share
        # kinks lie at random places and add up as such; what bends adds up, to a third of that
        kinks, bends = np.zeros(place.shape), np.zeros(place.shape)
        for axis in (1, 2):
            if length.shape[axis] > 2:
                part = length.transpose(axis, 0, 3 - axis, 3)
                change = part[2:] - 2.0 * part[1:-1] + part[:-2]
                square, bend = (fold(fold(each), 1) for each in (change * change, change))
                kinks, bends = kinks + square, bends + np.abs(bend)
        self.error[place] = (KINK * share) * (np.sqrt(kinks) + bends / 3.0)

    def add_unseen(self, cover: Cover, index: Ints, wide: Mask, axis: int, lines: int) -> None:
        """Widen the errors of candidates (k, n) that may hide between the lines."""
        x, y = cover.reach[0, index], cover.reach[1, index]
        small = ((x < 1.0 / lines) & wide[0]) | ((y < 1.0 / lines) & wide[1])
        area = np.pi * np.minimum(x, 1.0) * np.minimum(y, 1.0)
        unseen = np.where(small & ~cover.full[index], UNSEEN * np.minimum(area, 1.0), 0.0)
        along = 1.0 / np.maximum(cover.across[axis, index], 1.0 / lines)
        unmet = (self.weight[index] <= DUST) & ~cover.full[index]
        hidden = np.where(unmet, MISSED / lines**2 * along, 0.0)
        self.error[index] = np.maximum(self.error[index], np.maximum(unseen, hidden))
