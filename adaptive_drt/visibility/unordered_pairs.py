# SPDX-License-Identifier: GPL-3.0-or-later
"""Pairs of a box's candidates whose depth order is not known, so that it may change.

They are few: of sixteen spheres that form a molecule each meets only some others, which gives some
20 events for 120 pairs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Ints
from ..tracing.intersect import positions_in_runs, run_indices

__all__ = ["GroupPairs", "UnorderedPairs"]


MAX_CANDIDATES_ALL_PAIRS = 3
"""Number of candidates up to which a box gets room for all its pairs. More boxes are then alike and
can be measured in one batch."""


@dataclass(frozen=True)
class GroupPairs:
    """Unordered pairs of n boxes that have the same layout; the boxes are numbered from 0.

    Attributes
    ----------
    boxes, room : number of boxes n, and number of pairs for which each has room.
    box, slot : (p,) the box of each pair, and its index among the pairs of that box.
    one, other : (p,) indices of the two candidates within the box, `one` less than `other`.
    """

    boxes: int
    room: int
    box: Ints
    slot: Ints
    one: Ints
    other: Ints


@dataclass(frozen=True)
class UnorderedPairs:
    """Unordered pairs of n boxes, sorted by box.

    Attributes
    ----------
    number, start : (n,) number of pairs of each box, and index of its first pair.
    room : (n,) number of pairs for which a box has room: the same for boxes of the same layout.
    one, other : (p,) indices of the two candidates among all.
    """

    number: Ints
    start: Ints
    room: Ints
    one: Ints
    other: Ints

    @classmethod
    def of(cls, pair: tuple[Ints, Ints], box: Ints, candidates: Ints) -> UnorderedPairs:
        """Sort pairs (p,) of candidates, given in any order.

        Parameters
        ----------
        box : (m,) the box of each candidate.  candidates : (n,) number of candidates of each box.
        """
        one, other = np.minimum(*pair), np.maximum(*pair)
        order = np.lexsort((other, one))
        one, other = one[order], other[order]
        number = np.bincount(box[one], minlength=candidates.size)
        # round up to powers of 2, at most the number of all pairs: few different layouts
        every = candidates * (candidates - 1) // 2
        power = 1 << np.ceil(np.log2(np.maximum(number, 1))).astype(np.int64)
        some = np.where(candidates <= MAX_CANDIDATES_ALL_PAIRS, every, np.minimum(power, every))
        room = np.where(number > 0, some, 0)
        return cls(number, np.cumsum(number) - number, room, one, other)

    def among(self, some: Ints, first: Ints) -> GroupPairs:
        """Pairs of the boxes `some` (n,), which have the same layout.

        first : (n,) index of the first candidate of each of these boxes.
        """
        number = self.number[some]
        box = np.repeat(np.arange(some.size), number)
        rows = run_indices(self.start[some], number)
        one, other = self.one[rows] - first[box], self.other[rows] - first[box]
        return GroupPairs(
            some.size, int(self.room[some[0]]), box, positions_in_runs(number), one, other
        )
