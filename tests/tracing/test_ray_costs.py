# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays are chosen for many occluders and coarse tolerances."""

from __future__ import annotations

import numpy as np

from adaptive_drt.tracing.ray_costs import rays_cost_less

NUMBER = np.array([0.0, 3.0, 30.0, 300.0, 3e3, 3e4])
CUT, FILLED = np.ones(6, dtype=bool), np.zeros(6, dtype=bool)


def test_rays_cost_less_from_some_number_of_occluders():
    for cut in (CUT, FILLED, None):
        chosen = rays_cost_less(NUMBER, cut, 0.01)
        assert chosen[-1] and (np.diff(chosen.astype(int)) >= 0).all()
    assert not rays_cost_less(NUMBER, FILLED, 0.01)[:2].any()


def test_finer_tolerances_ask_for_more_occluders():
    for cut in (CUT, FILLED, None):
        counts = [rays_cost_less(NUMBER, cut, each).sum() for each in (0.1, 1e-2, 1e-3, 1e-4)]
        assert counts == sorted(counts, reverse=True) and counts[0] > counts[-1]


def test_each_pixel_is_chosen_by_itself():
    both = rays_cost_less(NUMBER, np.arange(6) % 2 == 0, 0.01)
    for row in range(6):
        alone = rays_cost_less(NUMBER[row : row + 1], np.array([row % 2 == 0]), 0.01)
        assert alone[0] == both[row]
