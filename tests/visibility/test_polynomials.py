# SPDX-License-Identifier: GPL-3.0-or-later
"""Things in boxes as polynomials: their bounds against plain rays through the boxes."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.visibility.polynomials import make_polynomials
from plain_hits import oracle_depth, rays
from visibility_boxes import PLAIN, every_pair, planned, random_boxes, random_shapes


@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("seed", range(5))
def test_signs_and_bounds_are_those_of_rays(moving, seed):
    rng = np.random.default_rng(seed)
    shapes = random_shapes(rng, moving)
    plan, boxes = planned(*shapes), random_boxes(rng, 60, moving)
    pairs = every_pair(plan, 60)
    forms, cover = make_polynomials(plan, boxes, pairs)
    met, missed = np.zeros((2, pairs.item.size), dtype=bool)
    for _ in range(25):
        place = rng.uniform(-0.5, 0.5, (3, pairs.item.size))
        x, y, t = boxes.middle[:, pairs.pixel] + place * boxes.size[:, pairs.pixel]
        w = plan.lens.directions(x, y)
        ray = rays(PLAIN, x, y)
        for number, shape in enumerate(shapes):
            own = np.flatnonzero(pairs.item == number)
            far = oracle_depth(shape, ray[:, own], t[own], np.zeros((3, 1)))
            hit = np.isfinite(far)
            met[own] |= hit
            missed[own] |= ~hit
            with np.errstate(invalid="ignore"):
                far = far / np.linalg.norm(w[:, own], axis=0)
            assert (far[hit] >= cover.near[own][hit] * (1 - 1e-9)).all(), f"seed {seed}"
            assert (far[hit] <= cover.far[own][hit] * (1 + 1e-9)).all(), f"seed {seed}"
    assert not (met & ~cover.may_hit).any() and not (missed & cover.all_hit).any(), f"seed {seed}"
    assert cover.may_hit.mean() < 1.0 or len(shapes) < 3
    for forms_, rows in ((forms.take(np.arange(0, forms.count, 3)), slice(0, None, 3)),):
        np.testing.assert_array_equal(forms_.surface, forms.surface[rows])
