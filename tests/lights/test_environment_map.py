# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps of radiance by direction: lookups, and antiderivatives along meridians."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from adaptive_drt.lights.environment_map import make_environment_map
from adaptive_drt.scene.description import EnvironmentLight
from sphere_images import noise, radiance_of, random_turn, unit

RNG = np.random.default_rng(1)
LIGHT = EnvironmentLight(noise(RNG), (0.5, 1.0, 2.0), random_turn(RNG))
MAP = make_environment_map(LIGHT)


def test_radiance_is_bilinear_between_the_middles_of_pixels():
    way = unit(RNG, 2_000)
    assert MAP.radiance(way) == pytest.approx(radiance_of(LIGHT, way), abs=1e-12)
    poles = np.array(LIGHT.rotation).T @ np.array([[0.0, 0.0], [0.0, 0.0], [1.0, -1.0]])
    assert np.isfinite(MAP.radiance(poles)).all()


def test_antiderivatives_are_those_of_the_radiance():
    psi = RNG.uniform(-np.pi, np.pi, 200)
    low, high = np.sort(RNG.uniform(0.0, np.pi, (2, 200)), axis=0)
    # texel by texel
    ends = np.clip(MAP.knots[:, None], low, high)
    want = np.zeros((2, 3, 200))
    for a, b in itertools.pairwise(ends):
        for x, w in zip(*np.polynomial.legendre.leggauss(12), strict=True):
            t = 0.5 * (a + b) + 0.5 * (b - a) * x
            own = np.array([np.sin(t) * np.cos(psi), np.sin(t) * np.sin(psi), np.cos(t)])
            value = MAP.radiance(MAP.turn.T @ own) * np.sin(t) * (0.5 * w * (b - a))
            want += value * np.array([np.sin(t), np.cos(t)])[:, None]
    got = np.array(MAP.antiderivatives(high, psi)) - np.array(MAP.antiderivatives(low, psi))
    assert got == pytest.approx(want, abs=1e-12)


def test_whole_meridians_end_at_the_nadir():
    psi = RNG.uniform(-np.pi, np.pi, 100)
    ends = MAP.antiderivatives(np.full(100, np.pi), psi)
    assert np.array(MAP.nadir_antiderivatives(psi)) == pytest.approx(np.array(ends), abs=1e-12)
    # and their integrals have these as derivatives, less a constant, and one value at each place
    step = 1e-6
    slope = (MAP.nadir_integrals(psi + step) - MAP.nadir_integrals(psi - step)) / (2.0 * step)
    sine, height = ends
    want = np.array([sine * np.cos(psi), sine * np.sin(psi), height])
    want -= MAP.total[:, :, None] / (2.0 * np.pi)
    assert slope == pytest.approx(want, abs=1e-6)
    around = MAP.nadir_integrals(np.array([1e-13, -1e-13]))
    assert around[..., 0] == pytest.approx(around[..., 1], abs=1e-11)


def test_means_and_totals():
    flat = make_environment_map(EnvironmentLight(np.full((5, 7, 3), 0.3), (1.0, 2.0, 3.0)))
    assert flat.mean == pytest.approx([0.3, 0.6, 0.9], rel=1e-14)
    assert flat.total == pytest.approx(np.zeros((3, 3)), abs=1e-14)
    assert not flat.shifted(flat.values[0, 0]).values.any()
    count = 200_000
    z = 1.0 - 2.0 * (np.arange(count) + 0.5) / count
    psi = 2.0 * np.pi * 0.618033988749895 * np.arange(count)
    own = np.array([np.sqrt(1 - z * z) * np.cos(psi), np.sqrt(1 - z * z) * np.sin(psi), z])
    value = MAP.radiance(MAP.turn.T @ own)
    assert value.mean(axis=1) == pytest.approx(MAP.mean, abs=1e-4)
    total = 4.0 * np.pi * (own[:, None] * value).mean(axis=2)
    assert total == pytest.approx(MAP.total, abs=1e-3)


def test_channels_and_cells():
    part = MAP.channel(1)
    way = unit(RNG, 50)
    assert np.array_equal(part.radiance(way)[0], MAP.radiance(way)[1])
    cells = MAP.cell_means(6, 12)
    theta = (np.arange(6) + 0.5) * np.pi / 6
    mean = (cells * np.sin(theta)[:, None]).mean(axis=2).sum(axis=1) / np.sin(theta).sum()
    assert mean == pytest.approx(MAP.mean, rel=0.02)
