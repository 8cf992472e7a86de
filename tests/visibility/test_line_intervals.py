# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines through boxes: where they hit things, and how far off, against plain rays along them."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.numerics.axes import TIME
from adaptive_drt.numerics.line_lattice import Lattice
from adaptive_drt.visibility.line_intervals import (
    depth_coefficients,
    evaluate_depth,
    hit_intervals,
)
from adaptive_drt.visibility.polynomials import make_polynomials
from plain_hits import oracle_depth, rays
from visibility_boxes import PLAIN, every_pair, planned, random_boxes, random_shapes

STEPS = np.linspace(-0.5, 0.5, 14)


def places_on(lattice, s):
    """Places (3, rows, columns) in a box of the points s of all lines."""
    u, v = (part[:, :, 0] for part in np.broadcast_arrays(lattice.u, lattice.v))
    place = [u, v]
    place.insert(lattice.axis, np.full(u.shape, s))
    return np.array(place)


@pytest.mark.parametrize("axis", [0, 1, TIME])
@pytest.mark.parametrize("seed", range(5))
def test_lines_hit_things_in_one_interval_and_at_the_right_depth(axis, seed):
    rng = np.random.default_rng(seed)
    shapes = random_shapes(rng, True)
    plan, boxes = planned(*shapes), random_boxes(rng, 30, True)
    pairs, lattice = every_pair(plan, 30), Lattice(axis, 3, 2)
    forms, cover = make_polynomials(plan, boxes, pairs)
    low, high = hit_intervals(forms, cover.all_hit, lattice)
    table = depth_coefficients(forms, lattice)
    assert (low >= -0.5).all() and (high <= 0.5).all() and (low <= high).all()
    for s in STEPS:
        place = places_on(lattice, s)[..., None]
        middle, size = (part[:, None, None, pairs.pixel] for part in (boxes.middle, boxes.size))
        x, y, t = middle + place * size
        inside = (low < s) & (s < high)
        near = np.minimum(np.abs(low - s), np.abs(high - s)) < 1e-6
        depth = evaluate_depth(table, np.full(x.shape, s))
        w = plan.lens.directions(x, y)
        for number, shape in enumerate(shapes):
            own = pairs.item == number
            part = x[..., own], y[..., own], t[..., own]
            far = oracle_depth(
                shape,
                rays(PLAIN, part[0].ravel(), part[1].ravel()),
                part[2].ravel(),
                np.zeros((3, 1)),
            ).reshape(part[0].shape)
            hit, clear = np.isfinite(far), ~near[..., own]
            wrong = (hit != inside[..., own]) & clear
            assert not wrong.any(), (seed, number, s)
            both = hit & inside[..., own]
            ours = depth[..., own] * np.linalg.norm(w[..., own], axis=0)
            # roots of grazing rays lose half the digits
            np.testing.assert_allclose(ours[both], far[both], rtol=1e-5)
