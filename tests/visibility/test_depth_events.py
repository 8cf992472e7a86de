# SPDX-License-Identifier: GPL-3.0-or-later
"""Events along lines: between two of them the depth order of two things does not change."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.numerics.axes import TIME
from adaptive_drt.numerics.line_lattice import Lattice
from adaptive_drt.scene.description import Motion, Quad, Sphere, vector_of
from adaptive_drt.tracing.intersect import Pairs
from adaptive_drt.visibility.depth_events import find_depth_events, split_by_candidate
from adaptive_drt.visibility.line_intervals import depth_coefficients
from adaptive_drt.visibility.polynomials import make_polynomials
from adaptive_drt.visibility.unordered_pairs import GroupPairs
from plain_hits import oracle_depth, rays
from visibility_boxes import PLAIN, planned, random_boxes

BOXES = 200
STEPS = np.linspace(-0.5, 0.5, 201)


def two_things(rng, kinds, moving):
    """Two things before the plain camera that cut each other."""
    made = []
    for kind in kinds:
        way = Motion(vector_of(rng.normal(size=3) * 0.5)) if moving else None
        place = np.array([0.0, 0.0, -5.0]) + rng.normal(size=3) * 0.4
        if kind == "sphere":
            made.append(Sphere(vector_of(place), float(rng.uniform(1.5, 2.5)), motion=way))
        else:
            u, v = rng.normal(size=(2, 3)) * 4.0
            made.append(Quad(*(vector_of(p) for p in (place - (u + v) / 2, u, v)), motion=way))
    return made


@pytest.mark.parametrize(
    "kinds", [("sphere",) * 2, ("sphere", "quad"), ("quad",) * 2], ids="-".join
)
@pytest.mark.parametrize("axis", [0, 1, TIME])
@pytest.mark.parametrize("seed", range(3))
def test_orders_change_at_events_only(kinds, axis, seed):
    rng = np.random.default_rng(seed)
    shapes = two_things(rng, kinds, axis == TIME or seed % 2)
    plan, boxes = planned(*shapes), random_boxes(rng, BOXES, True)
    lattice = Lattice(axis, 1, 1)
    pairs = Pairs(np.tile(np.arange(BOXES), 2), np.repeat([0, 1], BOXES))
    forms, _ = make_polynomials(plan, boxes, pairs)
    every, zero = np.arange(BOXES), np.zeros(BOXES, dtype=np.int64)
    met = GroupPairs(BOXES, 1, every, zero, zero, zero + 1)
    events = find_depth_events(depth_coefficients(forms, lattice), forms, met, lattice)
    assert events.shape[1:] == (1, 1, BOXES)
    events, changes = events[:, 0, 0], 0
    place = np.zeros((3, STEPS.size, 1))
    place[axis, :, 0] = STEPS
    x, y, t = boxes.middle[:, None] + place * boxes.size[:, None]
    ray = rays(PLAIN, x.ravel(), y.ravel())
    one, other = (
        oracle_depth(shape, ray, t.ravel(), np.zeros((3, 1))).reshape(x.shape) for shape in shapes
    )
    both = np.isfinite(one) & np.isfinite(other)
    with np.errstate(invalid="ignore"):
        sign = np.sign(one - other)
    for k in range(STEPS.size - 1):
        turned = both[k] & both[k + 1] & (sign[k] * sign[k + 1] < 0.0)
        between = (STEPS[k] - 1e-6 <= events) & (events <= STEPS[k + 1] + 1e-6)
        assert between.any(axis=0)[turned].all(), f"seed {seed}"
        changes += turned.sum()
    assert changes > 0 or axis == TIME or kinds != ("quad", "quad")


def test_candidates_apart():
    values = np.arange(24.0).reshape(2, 2, 6)
    found = split_by_candidate(values, 3)
    assert found.shape == (2, 2, 2, 3)
    np.testing.assert_array_equal(found[1], values[..., 3:])
