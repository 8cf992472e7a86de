# SPDX-License-Identifier: GPL-3.0-or-later
"""Low-discrepancy points: their hash against plain integers, their spread against random points."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from adaptive_drt.numerics.low_discrepancy import (
    generalized_golden_ratio,
    hashed_kronecker_points,
    hashed_sequence_points,
    hashed_shifts,
    low_discrepancy_points,
    shifted_lattices,
    splitmix64,
)
from adaptive_drt.numerics.sobol_points import net_points

MODULUS = 2**64


def plain_splitmix64(z):
    """SplitMix64 in Python's integers."""
    z = (z + 0x9E3779B97F4A7C15) % MODULUS
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9 % MODULUS
    z = (z ^ (z >> 27)) * 0x94D049BB133111EB % MODULUS
    return z ^ (z >> 31)


def test_hash_is_splitmix64():
    # the first two outputs of its reference implementation for the seed 0
    assert int(splitmix64(np.uint64(0))) == 0xE220A8397B1DCDAF
    assert int(splitmix64(np.uint64(0x9E3779B97F4A7C15))) == 0x6E789E6AA1B965F4
    numbers = np.random.default_rng(1).integers(0, MODULUS, 500, dtype=np.uint64, endpoint=False)
    assert splitmix64(numbers).tolist() == [plain_splitmix64(z) for z in numbers.tolist()]


@pytest.mark.parametrize("seed", [0, 7, -1, 2**64 + 7])
def test_shifts_are_a_function_of_seed_pixel_stream_and_dimension(seed):
    pixel = np.array([0, 1, 12_345, 2**40])
    for stream, dimension in ((0, 0), (3, 2)):
        key = plain_splitmix64(seed % MODULUS) ^ (64 * stream + dimension)
        bits = [plain_splitmix64(plain_splitmix64(key) ^ number) for number in pixel.tolist()]
        found = hashed_shifts(seed, pixel, stream, dimension)
        assert found.tolist() == [(each >> 11) / 2**53 for each in bits]
        assert hashed_shifts(seed, pixel[2:3], stream, dimension)[0] == found[2]


def test_shifts_are_uniform_and_those_of_streams_independent():
    pixel = np.arange(20_000)
    shifts = np.array([hashed_shifts(5, pixel, stream, k) for stream in (0, 1) for k in (0, 1)])
    assert shifts.min() >= 0.0 and shifts.max() < 1.0
    for row in shifts:
        number = np.histogram(row, 50, (0.0, 1.0))[0]
        # chi-square of 49 degrees of freedom exceeds 100 once in 40,000 times
        assert ((number - 400.0) ** 2 / 400.0).sum() < 100.0
    apart = np.corrcoef(shifts) - np.eye(4)
    assert np.abs(apart).max() < 0.03


@pytest.mark.parametrize("dimensions", range(1, 7))
def test_golden_ratios_are_roots(dimensions):
    with mpmath.workdps(40):
        root = mpmath.findroot(lambda x: x ** (dimensions + 1) - x - 1, 1.3)
        assert abs(generalized_golden_ratio(dimensions) - root) < 4e-16
    assert generalized_golden_ratio(1) == pytest.approx((1.0 + 5.0**0.5) / 2.0, rel=1e-15)


@pytest.mark.parametrize("count", [1, 8, 49, 128])
@pytest.mark.parametrize("dimensions", [1, 2, 3])
def test_first_coordinates_are_evenly_spaced(count, dimensions):
    points = low_discrepancy_points(3, np.arange(20), 2, count, dimensions)
    assert len(points) == dimensions
    assert all(part.shape == (20, count) and (0 <= part).all() and (part < 1).all()
               for part in points)  # fmt: skip
    gaps = np.diff(np.sort(points[0], axis=1), axis=1)
    np.testing.assert_allclose(gaps, 1.0 / count, rtol=0, atol=1e-15)


@pytest.mark.parametrize("dimensions", [2, 3])
def test_means_over_points_are_far_better_than_over_random_ones(dimensions):
    count, pixels = 128, 400
    points = low_discrepancy_points(11, np.arange(pixels), 0, count, dimensions)
    value = np.prod([4.0 * part * (1.0 - part) for part in points], axis=0)
    off = value.mean(axis=1) - (2.0 / 3.0) ** dimensions
    spread = np.sqrt((8.0 / 15.0) ** dimensions - (4.0 / 9.0) ** dimensions)
    assert np.sqrt((off**2).mean()) < 0.2 * spread / np.sqrt(count)
    # shifts of pixels make the errors unbiased
    assert abs(off.mean()) < 4.0 * np.sqrt((off**2).mean() / pixels)


def test_hashed_sequences_are_extended_by_later_parts():
    pixel = np.array([3, 99, 4])
    whole = hashed_sequence_points(5, pixel, 7, (0, 64), 4)
    assert whole.shape == (4, 3, 64) and (whole >= 0.0).all() and (whole < 1.0).all()
    parts = [hashed_sequence_points(5, pixel, 7, span, 4) for span in ((0, 16), (16, 64))]
    np.testing.assert_array_equal(np.concatenate(parts, axis=-1), whole)
    # the points of each pixel are those of the others, shifted
    turn = np.exp(2j * np.pi * (whole - whole[..., :1]))
    np.testing.assert_allclose(turn, np.repeat(turn[:, :1], 3, axis=1), atol=1e-9)


def test_points_from_a_number_on_are_those_of_the_sequence():
    pixel, first = np.array([3, 99, 3]), np.array([8, 0, 24])
    a, b = hashed_kronecker_points(5, pixel, 7, first, 8)
    whole = hashed_sequence_points(5, pixel, 7, (0, 32), 2)
    for row, start in enumerate(first):
        np.testing.assert_allclose(a[row], whole[0, row, start : start + 8], atol=1e-12)
        np.testing.assert_allclose(b[row], whole[1, row, start : start + 8], atol=1e-12)


@pytest.mark.parametrize("axes", [1, 2, 3])
def test_points_on_lights_fill_the_space_with_those_of_the_pixel(axes):
    """No harmonic with few periods along each axis is met always in the same phase: consecutive
    points of one sequence would be the eightfold of the pixel's own."""
    count, pixel, index = 4_096, np.array([3]), np.arange(4_096)
    spots = net_points(5, pixel, 7, index, tuple(range(axes)))[:, 0]
    a, b = shifted_lattices(net_points(5, pixel, 9, index, (axes, axes + 1))[:, 0])
    assert a.shape == (count, 8) and min(a.min(), b.min()) >= 0.0 and max(a.max(), b.max()) < 1.0
    for one in range(1, 17):
        for axis in spots:
            phase = np.exp(2j * np.pi * one * axis)[:, None]
            for other in (a, b):
                for periods in (-1, 1):
                    mean = (phase * np.exp(2j * np.pi * periods * other)).mean()
                    assert abs(mean) < 0.02
