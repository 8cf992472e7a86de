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
    boxes, capacity : number of boxes n, and number of pairs that each has room for.
    box, slot : (p,) the box of each pair, and its index among the pairs of that box.
    first_candidate, second_candidate : (p,) indices of the two candidates within the box, the first
        less than the second.
    """

    boxes: int
    capacity: int
    box: Ints
    slot: Ints
    first_candidate: Ints
    second_candidate: Ints


@dataclass(frozen=True)
class UnorderedPairs:
    """Unordered pairs of n boxes, sorted by box.

    Attributes
    ----------
    count, start : (n,) number of pairs of each box, and index of its first pair.
    capacity : (n,) number of pairs that a box has room for: the same for boxes of the same layout.
    first_candidate, second_candidate : (p,) indices of the two candidates among all.
    """

    count: Ints
    start: Ints
    capacity: Ints
    first_candidate: Ints
    second_candidate: Ints

    @classmethod
    def from_pairs(cls, pair: tuple[Ints, Ints], box: Ints, candidates: Ints) -> UnorderedPairs:
        """Sort pairs (p,) of candidates, given in any order.

        Parameters
        ----------
        box : (m,) the box of each candidate.  candidates : (n,) number of candidates of each box.
        """
        one, other = np.minimum(*pair), np.maximum(*pair)
        order = np.lexsort((other, one))
        one, other = one[order], other[order]
        count = np.bincount(box[one], minlength=candidates.size)
        # round up to powers of 2, at most the number of all pairs: few different layouts
        every = candidates * (candidates - 1) // 2
        power = 1 << np.ceil(np.log2(np.maximum(count, 1))).astype(np.int64)
        some = np.where(candidates <= MAX_CANDIDATES_ALL_PAIRS, every, np.minimum(power, every))
        capacity = np.where(count > 0, some, 0)
        return cls(count, np.cumsum(count) - count, capacity, one, other)

    def for_boxes(self, some: Ints, first: Ints) -> GroupPairs:
        """Pairs of the boxes `some` (n,), which have the same layout.

        first : (n,) index of the first candidate of each of these boxes.
        """
        count = self.count[some]
        box = np.repeat(np.arange(some.size), count)
        rows = run_indices(self.start[some], count)
        one = self.first_candidate[rows] - first[box]
        other = self.second_candidate[rows] - first[box]
        return GroupPairs(
            some.size, int(self.capacity[some[0]]), box, positions_in_runs(count), one, other
        )
