# SPDX-License-Identifier: GPL-3.0-or-later
"""Coverage of pixels by sides of cylinders, against plain rays."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.cylinder.pixel_coverage import hit_depths, product_range, side_coverage
from adaptive_drt.numerics.gather import columns
from solid_cylinders import cylinders_of, planned, random_cylinder, sizes_of

RAYS = 64


@pytest.mark.parametrize("tapers", [False, True])
@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("around", [False, True])
def test_coverage_holds_for_rays_of_the_pixels(order, around, tapers):
    covered, missed = 0, 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        plan = planned(random_cylinder(rng, False, around, tapers))
        shapes, camera = cylinders_of(plan), plan.lens
        x, y = rng.uniform(0.0, 24.0, (2, 60))
        w = camera.directions(x, y)
        index = np.zeros(60, dtype=np.int64)
        found = side_coverage(
            columns(shapes.center, index), *sizes_of(shapes, index), w, camera, order
        )
        dx, dy = rng.uniform(-0.5, 0.5, (2, 60, RAYS))
        ray = camera.directions((x[:, None] + dx).ravel(), (y[:, None] + dy).ravel())
        t = shapes.intersect(np.zeros(60 * RAYS, dtype=np.int64), ray, 0.0).reshape(60, RAYS)
        hit = np.isfinite(t)
        assert hit[found.covers].all()
        assert not hit[~found.may_hit].any()
        near, far = found.near[:, None], found.far[:, None]
        assert ((t >= near * (1.0 - 1e-9)) & (t <= far * (1.0 + 1e-9)))[hit].all()
        covered += np.count_nonzero(found.covers)
        missed += np.count_nonzero(~found.may_hit)
    assert missed > 100 and (around or covered > 50)


def test_bounds_of_depths_and_products():
    near, far, certain = hit_depths(*((np.array([low]), np.array([high])) for low, high in
                             ((2.0, 3.0), (1.0, 4.0), (5.0, 6.0))))  # fmt: skip
    np.testing.assert_allclose((near[0], far[0]), (5.0 / 5.0, 6.0 / 3.0))
    assert certain[0]
    low, high = product_range((near, far), (np.array([-1.0]), np.array([2.0])))
    np.testing.assert_allclose((low[0], high[0]), (-2.0, 4.0))
    endless = np.array([np.inf])
    low, high = product_range((near, endless), (np.array([0.0]), np.array([0.0])))
    assert low[0] <= 0.0 <= high[0]
