# SPDX-License-Identifier: GPL-3.0-or-later
"""What is nearest along lines, against many plain rays along them."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np
import pytest

from adaptive_drt.numerics.axes import TIME
from adaptive_drt.numerics.line_lattice import Lattice
from adaptive_drt.tracing.intersect import Pairs
from adaptive_drt.visibility.line_visibility import pairwise_sum, visible_moments
from adaptive_drt.visibility.polynomials import make_polynomials
from adaptive_drt.visibility.unordered_pairs import GroupPairs
from plain_hits import oracle_hits
from visibility_boxes import PLAIN, planned, random_boxes, random_shapes

BOXES = 60
STEPS = (np.arange(600) + 0.5) / 600 - 0.5


@pytest.mark.parametrize("axis", [0, 1, TIME])
@pytest.mark.parametrize("seed", range(4))
def test_lengths_and_moments_are_those_of_many_rays(axis, seed):
    rng = np.random.default_rng(seed)
    # pairs of spheres have events along time on single lines only
    shapes, lattice = random_shapes(rng, True), Lattice(axis, 1, 1)
    k, plan, boxes = len(shapes), planned(*shapes), random_boxes(rng, BOXES, True)
    pairs = Pairs(np.tile(np.arange(BOXES), k), np.repeat(np.arange(k), BOXES))
    forms, cover = make_polynomials(plan, boxes, pairs)
    both = np.array(list(combinations(range(k), 2)), dtype=np.int64).reshape(-1, 2)
    room = both.shape[0]
    met = GroupPairs(
        BOXES, room, np.repeat(np.arange(BOXES), room), np.tile(np.arange(room), BOXES),
        np.tile(both[:, 0], BOXES), np.tile(both[:, 1], BOXES),
    )  # fmt: skip
    found = visible_moments(forms, cover.all_hit, lattice, k, met if room else None)
    assert found.shape == (3, k + 1, 1, 1, BOXES)
    np.testing.assert_allclose(found[0].sum(axis=0), 1.0, rtol=1e-12)
    for box in range(BOXES):
        place = np.zeros((3, STEPS.size))
        place[axis] = STEPS
        at = boxes.middle[:, [box]] + place * boxes.size[:, [box]]
        hit = oracle_hits(PLAIN, shapes, *at)
        for number in range(k + 1):
            own = STEPS[hit == (number if number < k else -1)]
            want = np.array([own.size, own.sum(), (own**2).sum()]) / STEPS.size
            off = np.abs(found[:, number, 0, 0, box] - want)
            # each end of a visible part may fall between two rays
            assert off.max() < 4.0 / STEPS.size, (seed, box, number)


@pytest.mark.parametrize("size", [1, 2, 3, 7, 64, 100])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_sums_do_not_depend_on_other_axes(size, axis):
    shape = [4, 3, 2]
    shape[axis] = size
    values = np.random.default_rng(size).normal(size=shape)
    found = pairwise_sum(values, axis)
    rows = np.moveaxis(values, axis, 0).reshape(size, -1)
    want = [math.fsum(row) for row in rows.T]
    np.testing.assert_allclose(found.ravel(), want, rtol=1e-13, atol=1e-14)
    for k, row in enumerate(rows.T):
        assert pairwise_sum(row[:, None])[0] == found.ravel()[k]
