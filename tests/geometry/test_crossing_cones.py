# SPDX-License-Identifier: GPL-3.0-or-later
"""Crossings of elliptic cones: which parts of boundaries lie inside others, against points."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.crossing_cones import (
    _split_lines,
    cones_inside_each_other,
    sinusoid_zeros,
)
from elliptic_outlines import MARGIN, form, random_cones, unit

FAMILIES = (
    (1.0, -1.0, 0.5),
    (0.3, -1.0, 0.0),
    (1.0, -3.0, 2.0),
    (1.0, -6.0, 2.0),
    (1e-3, -3.0, -2.5),
    (1e-6, -6.0, -5.5),
)
"""Spread of the ellipses' centres, and the range of their sizes as powers of ten."""


@pytest.mark.parametrize(("spread", "low", "high"), FAMILIES)
def test_boundaries_run_inside_other_cones_where_their_points_do(spread, low, high):
    rng = np.random.default_rng(7)
    count = 2_000
    middle = unit(rng, 1)
    one, other = (random_cones(rng, count, low, high, middle, spread) for _ in range(2))
    for (start, end), (cones, outer) in zip(
        cones_inside_each_other(one, other), ((one, other), (other, one)), strict=True
    ):
        assert (start <= end).all() and ((end - start).sum(axis=0) > 0.0).mean() > 0.1
        for _ in range(20):
            phi = rng.uniform(-np.pi, np.pi, count)
            value, scale, height = form(outer, cones.directions(phi))
            inside = (value < 0.0) & (height > 0.0)
            clear = np.abs(value) > MARGIN * np.maximum(1.0, 1.0 / outer.b) * scale
            got = ((start < phi) & (phi < end)).any(axis=0)
            np.testing.assert_array_equal(got[clear], inside[clear])


def test_of_coinciding_cones_the_second_is_inside():
    rng = np.random.default_rng(8)
    cones = random_cones(rng, 100, -2.0, 1.0)
    first, second = cones_inside_each_other(cones, cones)
    assert ((first[1] - first[0]).sum(axis=0) == 0.0).all()
    np.testing.assert_allclose((second[1] - second[0]).sum(axis=0), 2.0 * np.pi, atol=1e-12)


def test_zeros_of_sinusoids_are_all_found():
    rng = np.random.default_rng(9)
    count = 5_000
    a0, a1, b1, a2, b2 = terms = rng.normal(size=(5, count))
    phi, found = sinusoid_zeros(terms)
    companion = np.zeros((count, 4, 4), dtype=complex)
    last = np.array([a2 + 1j * b2, a1 + 1j * b1, 2.0 * a0, a1 - 1j * b1]) / (a2 - 1j * b2)
    companion[:, [1, 2, 3], [0, 1, 2]] = 1.0
    companion[:, :, 3] = -last.T
    size = np.abs(np.linalg.eigvals(companion))
    on_circle = np.abs(size - 1.0) < 1e-7
    np.testing.assert_array_equal(found.sum(axis=0), on_circle.sum(axis=1))
    value = a0 + a1 * np.cos(phi) + b1 * np.sin(phi) + a2 * np.cos(2 * phi) + b2 * np.sin(2 * phi)
    assert np.abs(value[found]).max() < 1e-9


def test_lines_of_a_conic_are_contiguous():
    """NumPy computes arctan2 of strided arrays by other code where the result's memory follows."""
    conic = np.random.default_rng(2).normal(size=(3, 3, 33))
    conic += conic.transpose(1, 0, 2)
    for line in _split_lines(conic):
        assert line.shape == (3, 33) and line.flags.c_contiguous
