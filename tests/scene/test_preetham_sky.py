# SPDX-License-Identifier: GPL-3.0-or-later
"""Preetham's sky: its symmetry, and values of the paper's formulas."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.scene.preetham_sky import preetham_radiance


def test_it_is_symmetric_about_the_sun_and_blue():
    sun = (0.5, 0.0, 0.8)
    rng = np.random.default_rng(1)
    way = rng.normal(size=(50, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    value = preetham_radiance(way, sun, 3.0)
    assert preetham_radiance(way * (1.0, -1.0, 1.0), sun, 3.0) == pytest.approx(value)
    assert preetham_radiance(way, (1.0, 0.0, 1.6), 3.0) == pytest.approx(value)
    away = preetham_radiance(np.array([[-0.6, 0.0, 0.8]]), sun, 2.5)[0]
    assert away[2] > away[1] > away[0] > 0.0


def test_the_zenith_has_the_luminance_of_the_paper():
    turbidity, angle = 3.0, 0.9
    sun = (np.sin(angle), 0.0, np.cos(angle))
    r, g, b = preetham_radiance(np.array([[0.0, 0.0, 1.0]]), sun, turbidity)[0]
    chi = (4.0 / 9.0 - turbidity / 120.0) * (np.pi - 2.0 * angle)
    want = (4.0453 * turbidity - 4.9710) * np.tan(chi) - 0.2155 * turbidity + 2.4192
    assert 0.2126 * r + 0.7152 * g + 0.0722 * b == pytest.approx(0.06 * want, rel=1e-3)
