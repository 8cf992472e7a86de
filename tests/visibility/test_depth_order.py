# SPDX-License-Identifier: GPL-3.0-or-later
"""Depth orders that are said to be known hold for all rays of the box, by plain formulas."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.tracing.intersect import Pairs
from adaptive_drt.visibility.depth_order import find_depth_order
from adaptive_drt.visibility.polynomials import make_polynomials
from plain_hits import oracle_depth, rays
from shape_sets import spheres_of
from visibility_boxes import FLOOR, PLAIN, every_pair, planned, random_boxes, random_shapes


@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_ranks_are_those_of_depths(moving, seed):
    rng = np.random.default_rng(seed)
    shapes = [*random_shapes(rng, moving), FLOOR]
    plan, boxes = planned(*shapes), random_boxes(rng, 80, moving)
    every = every_pair(plan, 80)
    _, cover = make_polynomials(plan, boxes, every)
    kept = np.flatnonzero(cover.may_hit)
    kept = kept[np.lexsort((cover.near[kept], every.pixel[kept]))]
    pairs, cover = Pairs(every.pixel[kept], every.item[kept]), cover.take(kept)
    number = np.bincount(pairs.pixel, minlength=80)
    rank, settled, balls, (one, other) = find_depth_order(plan, boxes, pairs, cover, number)
    assert settled.any()
    start = np.cumsum(number) - number
    for box in np.flatnonzero(number):
        own = slice(start[box], start[box] + number[box])
        if settled[box]:
            assert sorted(rank[own]) == list(range(number[box]))
        x, y, t = rng.uniform(boxes.low[:, [box]], boxes.high[:, [box]], (3, 60))
        ray = rays(PLAIN, x, y)
        far = np.array([oracle_depth(shapes[k], ray, t, np.zeros((3, 1))) for k in pairs.item[own]])
        unsure = {tuple(sorted(p)) for p in zip(one, other, strict=True)}
        for i in range(number[box]):
            for j in range(i):
                both = np.isfinite(far[i]) & np.isfinite(far[j])
                both[both] = np.abs(far[i][both] - far[j][both]) > 1e-9 * far[j][both]
                before = far[i][both] < far[j][both]
                if not settled[box]:
                    known = (start[box] + j, start[box] + i) not in unsure
                    assert not known or not before.any() or before.all(), (seed, box)
                elif both.any():
                    assert (before == (rank[own][i] < rank[own][j])).all(), (seed, box)
        held = [p for p in unsure if start[box] <= p[0] < start[box] + number[box]]
        assert balls[box] == any(max(pairs.item[list(p)]) < spheres_of(plan).count for p in held)
