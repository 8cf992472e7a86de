# SPDX-License-Identifier: GPL-3.0-or-later
"""Means of unhidden light from the centres of pixels, and what is said of their errors."""

import numpy as np

from adaptive_drt.image.center_values import CenterValues
from adaptive_drt.shading.center_light import CenterLight


def values_of(field, width=12):
    """Light at all pixels of a square frame that one object fills."""
    y, x = np.divmod(np.arange(width * width), width)
    light = np.tile(field(x, y), (3, 1))
    none = np.zeros(light.shape[1])
    values = CenterValues(width, light.shape[1])
    values.enter(
        np.arange(none.size), CenterLight(light, 0.0 * light, 0.5 * light, none, none, none)
    )
    values.item[:] = 0
    return values


def test_means_of_quadratic_light_are_exact():
    values = values_of(lambda x, y: 1.0 + 0.1 * x + 0.02 * x * x - 0.01 * y * y)
    rows = values.correct()
    y, x = np.divmod(rows, 12)
    mean = 1.0 + 0.1 * x + 0.02 * x * x - 0.01 * y * y + (0.02 - 0.01) / 12.0
    np.testing.assert_allclose(values.mean[:, rows], np.tile(mean, (3, 1)), rtol=1e-12)
    assert rows.size == 100 and values.fraction[:, rows].max() == 0.5
    assert values.variation[values.usable].max() < 0.01


def test_light_that_varies_within_pixels_is_seen():
    rng = np.random.default_rng(0)
    values = values_of(lambda x, y: 1.0 + 0.1 * rng.normal(size=x.size), width=40)
    rows = values.correct()
    assert 0.1 < np.sqrt((values.variation[rows] ** 2).mean()) < 0.3
    assert (values.variation[rows] > 0.05).mean() > 0.9


def test_pixels_beside_another_object_are_not_usable():
    values = values_of(lambda x, y: 1.0 + 0.0 * x)
    values.item[5 * 12 + 6] = 1
    rows = values.correct()
    beside = 5 * 12 + 6 + np.array([-12, -1, 0, 1, 12])
    assert not np.isin(beside, rows).any() and rows.size == 95


def test_first_fractions_are_means_by_radiance():
    values = CenterValues(4, 16)
    unhidden, color = np.array([[1.0], [3.0], [0.0]]), np.array([[1.0], [1.0], [0.0]])
    none = np.zeros(1)
    rows = np.array([5])
    values.enter(rows, CenterLight(unhidden, 0.0 * color, color, none, none, none))
    values.enter_first(rows, np.array([2]), np.array([True]))
    assert values.first_fraction[5] == 0.5 and values.item[5] == 2
    np.testing.assert_allclose(values.fraction[:, 5], [1.0, 1.0 / 3.0, 1.0])
