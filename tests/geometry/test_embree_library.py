# SPDX-License-Identifier: GPL-3.0-or-later
"""Packets of rays hold what they are given, and the library tells its version."""

import numpy as np

from adaptive_drt.geometry.embree_library import (
    FAR_WORD,
    HIT_WORDS,
    ITEM_WORD,
    NEAR_WORD,
    RAY_WORDS,
    native_version,
    ray_packets,
    word_of_rays,
)


def test_the_version_is_a_tested_one():
    assert native_version() == "none" or native_version().startswith("embree 4.4")


def test_packets_hold_the_rays_and_are_aligned():
    origin, unit = np.arange(60.0).reshape(3, 20), np.arange(60.0, 120.0).reshape(3, 20)
    far, near = np.arange(20.0) + 200.0, np.arange(20.0) + 300.0
    rays = ray_packets(origin, unit, far, RAY_WORDS + HIT_WORDS, near=near, time=0.25)
    assert rays.shape == (2, 21, 16) and rays.ctypes.data % 64 == 0
    flat = rays.transpose(1, 0, 2).reshape(21, 32)[:, :20]
    np.testing.assert_array_equal(flat[:3], origin)
    np.testing.assert_array_equal(flat[4:7], unit)
    np.testing.assert_array_equal(flat[[FAR_WORD, NEAR_WORD]], [far, near])
    np.testing.assert_array_equal(flat[7], 0.75)
    np.testing.assert_array_equal(word_of_rays(rays, ITEM_WORD, 20), np.full(20, -1))
