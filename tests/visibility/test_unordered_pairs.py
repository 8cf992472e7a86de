# SPDX-License-Identifier: GPL-3.0-or-later
"""Which candidates of a box may change places in depth."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.scene.description import Motion, Quad, Sphere
from adaptive_drt.visibility import fragments as regions
from adaptive_drt.visibility.depth_order import find_depth_order
from adaptive_drt.visibility.fragments import Boxes, find_fragments
from adaptive_drt.visibility.unordered_pairs import MAX_CANDIDATES_ALL_PAIRS, UnorderedPairs
from visibility_boxes import FLOOR, all_pairs, dense, every_pair, planned, random_boxes

WIDER = np.array([[2.0], [2.0], [0.0]])
"""Pixels to either side: so that many objects meet in a box."""


def heap(rng, moving):
    """Twelve spheres that meet each other, with a plate through them."""
    shapes = []
    for _ in range(12):
        center, motion = rng.normal(size=3) * 0.6 + (0.0, 0.0, -4.0), rng.normal(size=3) * 0.3
        motion = Motion(tuple(motion.tolist())) if moving else None
        shapes.append(Sphere(tuple(center.tolist()), float(rng.uniform(0.3, 0.8)), motion=motion))
    return [*shapes, Quad((-1.0, -1.0, -3.8), (2.0, 0.0, -0.4), (0.3, 2.0, 0.2))]


@pytest.mark.parametrize("moving", [False, True])
def test_only_those_whose_order_is_not_known_can_change_places(moving):
    """Events of all pairs add nothing: spans between them have the same nearest objects."""

    def every_event(*given):
        rank, settled, balls, _ = find_depth_order(*given)
        crowded.append(np.count_nonzero(~settled & (given[4] > 3)))
        return rank, settled, balls, all_pairs(given[2], ~settled)

    crowded = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        plan, boxes = planned(*heap(rng, moving), FLOOR), random_boxes(rng, 150, moving)
        boxes = Boxes(boxes.low - WIDER, boxes.high + WIDER)
        pairs = every_pair(plan, 150)
        found = find_fragments(plan, boxes, pairs, 1e-2)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(regions, "find_depth_order", every_event)
            compared = find_fragments(plan, boxes, pairs, 1e-2)
        one, other = (dense(each, boxes, 40) for each in (found, compared))
        # lines are doubled where errors are above the goal, which rounding may decide
        same = np.abs(one - other).max(axis=1) <= 1e-9
        assert same.mean() >= 0.98, seed
    assert sum(crowded) > 100


def test_pairs_of_alike_boxes_are_numbered_from_their_first_candidates():
    """Boxes of 2, 5 and 5 candidates, of which 1, 3 and 4 pairs may change places."""
    candidates, first = np.array([2, 5, 5]), np.array([0, 2, 7])
    box = np.repeat(np.arange(3), candidates)
    one = np.array([7, 4, 1, 2, 9, 11, 3, 8])
    other = np.array([9, 2, 0, 6, 10, 7, 2, 9])
    meets = UnorderedPairs.from_pairs((one, other), box, candidates)
    assert meets.count.tolist() == [1, 3, 4]
    # all pairs of few, else a power of two
    assert MAX_CANDIDATES_ALL_PAIRS >= 2 and meets.capacity.tolist() == [1, 4, 4]
    met = meets.for_boxes(np.array([1, 2]), first[1:])
    assert met.boxes == 2 and met.capacity == 4
    assert met.box.tolist() == [0, 0, 0, 1, 1, 1, 1]
    assert met.slot.tolist() == [0, 1, 2, 0, 1, 2, 3]
    assert list(zip(met.first_candidate.tolist(), met.second_candidate.tolist(), strict=True)) == [
        (0, 1), (0, 2), (0, 4), (0, 2), (0, 4), (1, 2), (2, 3),
    ]  # fmt: skip
