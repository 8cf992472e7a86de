# SPDX-License-Identifier: GPL-3.0-or-later
"""Pairs of a box's candidates that may change places in depth: those whose order is not known.

Of sixteen spheres that form a molecule, each meets a few: 120 pairs, and some 20 events.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Ints
from ..tracing.intersect import places, runs

__all__ = ["Meets", "Met"]


FEW = 3
"""Candidates up to which all pairs get room: so more boxes are alike, and are measured together."""


@dataclass(frozen=True)
class Met:
    """The pairs of n boxes that are alike, numbered from 0.

    Attributes
    ----------
    boxes, room : how many there are, n, and how many pairs each is given room for.
    box, slot : (p,) the box of each, and its number among the box's pairs.
    one, other : (p,) which of the box's candidates they are, `one` the first of them.
    """

    boxes: int
    room: int
    box: Ints
    slot: Ints
    one: Ints
    other: Ints


@dataclass(frozen=True)
class Meets:
    """The pairs of n boxes, sorted by box.

    Attributes
    ----------
    number, start : (n,) how many a box has, and its first.
    room : (n,) how many it is given room for: the same for boxes that are alike.
    one, other : (p,) candidates.
    """

    number: Ints
    start: Ints
    room: Ints
    one: Ints
    other: Ints

    @classmethod
    def of(cls, pair: tuple[Ints, Ints], box: Ints, candidates: Ints) -> Meets:
        """Of pairs (p,) of candidates in any order; `box` (m,) of each candidate, and how many
        (n,) each box has."""
        one, other = np.minimum(*pair), np.maximum(*pair)
        order = np.lexsort((other, one))
        one, other = one[order], other[order]
        number = np.bincount(box[one], minlength=candidates.size)
        # powers of 2, as long as there are so many
        every = candidates * (candidates - 1) // 2
        power = 1 << np.ceil(np.log2(np.maximum(number, 1))).astype(np.int64)
        some = np.where(candidates <= FEW, every, np.minimum(power, every))
        room = np.where(number > 0, some, 0)
        return cls(number, np.cumsum(number) - number, room, one, other)

    def among(self, some: Ints, first: Ints) -> Met:
        """The pairs of boxes `some` (n,) that are alike, whose first candidates (n,) are given."""
        number = self.number[some]
        box = np.repeat(np.arange(some.size), number)
        rows = runs(self.start[some], number)
        one, other = self.one[rows] - first[box], self.other[rows] - first[box]
        return Met(some.size, int(self.room[some[0]]), box, places(number), one, other)
