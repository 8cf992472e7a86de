# SPDX-License-Identifier: GPL-3.0-or-later
"""Profiles of spot lights that are scaled unevenly."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.axial_profile import AxialProfile
from adaptive_drt.geometry.uneven_profile import UnevenProfile


def turned(rng):
    return np.linalg.qr(rng.normal(size=(3, 3)))[0]


def unit(rng, count):
    way = rng.normal(size=(3, count))
    return way / np.sqrt((way * way).sum(axis=0))


def test_an_even_frame_gives_an_axial_profile():
    rng = np.random.default_rng(1)
    turn, way = turned(rng), 3.0 * unit(rng, 100)
    axis = turn[:, 2:]
    plain, uneven = AxialProfile(axis, 0.5, 0.8), UnevenProfile(axis, 0.5, 0.8, 0.4 * turn.T)
    assert uneven.cosine_along(way) == pytest.approx(plain.cosine_along(way), abs=1e-14)
    assert uneven.stretch == pytest.approx(1.0) and plain.stretch == 1.0


@pytest.mark.parametrize("seed", range(4))
def test_angles_change_by_the_stretch_at_most(seed):
    rng = np.random.default_rng(seed)
    frame = turned(rng) @ np.diag(10.0 ** rng.uniform(-0.7, 0.7, 3)) @ turned(rng)
    profile = UnevenProfile(np.array([[0.0], [0.0], [1.0]]), 0.2, 0.6, frame)
    way = unit(rng, 2_000)
    near = way + 0.01 * rng.normal(size=way.shape)
    near /= np.sqrt((near * near).sum(axis=0))
    turn = np.arccos(np.clip((way * near).sum(axis=0), -1.0, 1.0))
    angle, other = (
        np.arccos(np.clip(profile.cosine_along(each), -1.0, 1.0)) for each in (way, near)
    )
    assert np.all(np.abs(angle - other) <= profile.stretch * turn * 1.0001 + 1e-7)
    low, high = profile.range(profile.cosine_along(way), profile.stretch * turn)
    value = profile.value(profile.cosine_along(near))
    assert np.all((low <= value + 1e-6) & (value <= high + 1e-6))
