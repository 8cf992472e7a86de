# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow rays begin on the smooth surface near the terminator only."""

import numpy as np

from adaptive_drt.geometry.smooth_surface import TERMINATOR_COSINE, SmoothSurface


def test_rays_near_the_horizon_begin_above_the_facet():
    up = np.array([[0.0], [0.0], [1.0]])
    over = SmoothSurface(0.25 * up, up)
    height = np.array([0.9, 0.2, 0.15, 0.05, 0.0, -0.05])
    to = 7.0 * np.array([np.sqrt(1.0 - height**2), 0.0 * height, height])[:, None]
    share = over.offsets(up, to)[2, 0] / 0.25
    np.testing.assert_allclose(share[:3], 0.0, atol=1e-12)
    np.testing.assert_allclose(share[3], 2.0 - 0.1 / TERMINATOR_COSINE)
    np.testing.assert_allclose(share[4:], 1.0)
    assert over.offsets(up, to)[:2].max() == 0.0


def test_the_surface_of_some_points():
    rng = np.random.default_rng(0)
    rise, facet = rng.normal(size=(2, 3, 5))
    some = SmoothSurface(rise, facet).take(np.array([3, 1]))
    np.testing.assert_array_equal(some.rise, rise[:, [3, 1]])
    np.testing.assert_array_equal(some.facet, facet[:, [3, 1]])
