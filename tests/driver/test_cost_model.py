# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's cost model, against times added up pixel by pixel."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.cost_model import adaptive_is_faster, predicted_ratio


@pytest.mark.parametrize("seed", range(20))
def test_ratio_is_that_of_times_summed_over_pixels(seed):
    rng = np.random.default_rng(seed)
    pixels, distributed, rays = 1_000, int(rng.integers(0, 1_001)), int(rng.integers(2, 200))
    slower = float(rng.uniform(1.0, 12.0))
    # a plain ray takes 1; each pixel is traced once with derivatives, and a distributed one
    # has all its rays but that one besides
    adaptive = sum(slower + (rays - 1.0) * (k < distributed) for k in range(pixels))
    ratio = predicted_ratio(distributed / pixels, slower, rays)
    assert ratio == pytest.approx(adaptive / (pixels * rays), rel=1e-12)
    assert adaptive_is_faster(distributed / pixels, slower, rays) == (ratio < 1.0)


def test_limits():
    assert predicted_ratio(1.0, 1.0, 16.0) == 1.0 and not adaptive_is_faster(1.0, 1.0, 16.0)
    assert predicted_ratio(0.0, 3.0, 49.0) == pytest.approx(3.0 / 49.0)
    assert adaptive_is_faster(0.0, 48.9, 49.0) and not adaptive_is_faster(0.0, 49.0, 49.0)
