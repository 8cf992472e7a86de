# SPDX-License-Identifier: GPL-3.0-or-later
"""Counts of rays by thread."""

from concurrent.futures import ThreadPoolExecutor

from adaptive_drt.geometry.ray_counts import RAY_KINDS, count_rays, counted_rays, rays_since


def test_each_thread_counts_its_own_rays():
    before, none = counted_rays(), dict.fromkeys(RAY_KINDS, 0)
    count_rays("shadow", 5)

    def other():
        count_rays("nearest", 7)
        return counted_rays()

    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(other).result() == none | {"nearest": 7}
    assert rays_since(before) == none | {"shadow": 5}
    assert set(before) == set(RAY_KINDS)
