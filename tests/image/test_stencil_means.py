# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixel means from the centres around them, one by one."""

from __future__ import annotations

import numpy as np

from adaptive_drt.image.stencil_means import StencilMeans
from moving_floor import points_of, settled


def test_crosses_settle_what_is_smooth_and_nothing_with_a_kink():
    # second differences of 25, a 24th of which is what means are off by without them
    bent = points_of(lambda x, y: 12.5 * y * y + 0.0 * x)
    done = settled(StencilMeans(bent))
    assert done.any()
    y = np.divmod(np.arange(done.size), done.shape[1])[0].reshape(done.shape)
    mean = bent.frame.color[0].reshape(done.shape)
    np.testing.assert_allclose(mean[done], (12.5 * (y * y + 1.0 / 12.0))[done], rtol=1e-12)
    for place in np.linspace(30.0, 31.0, 11):
        kinked = settled(StencilMeans(points_of(lambda x, y, k=place: 50.0 * np.abs(y - k))))
        nearest = round(place)
        assert not kinked[nearest].any(), place
        assert kinked[nearest + 5].any()


def test_crosses_ask_only_beside_pixels_that_see_the_same():
    found = points_of(lambda x, y: 0.0 * x)
    width = found.frame.width
    found.known[:] = False
    found.wanted[:] = False
    found.wanted[20 * width + 20] = True
    assert StencilMeans(found).missing_pixels().size == 9
    found.frame.visibility_key[20 * width + 22] = 2
    assert StencilMeans(found).missing_pixels().size == 8
    found.frame.visibility_key[20 * width + 21] = 2
    assert StencilMeans(found).missing_pixels().size == 0
