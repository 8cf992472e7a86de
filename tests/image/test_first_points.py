# SPDX-License-Identifier: GPL-3.0-or-later
"""What few rays tell of sampled pixels, and how their neighbours confirm it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from adaptive_drt.image.first_points import FirstPoints

WIDTH = 9
COUNT = WIDTH * WIDTH
MIDDLE = np.array([4 * WIDTH + 4])
NONE = np.zeros(COUNT, dtype=bool)


def points(visibility, dusk=False):
    """Records of a square of pixels whose rays have all met the same, with errors of 1."""
    every, ones = np.arange(COUNT), np.ones(COUNT)
    found = FirstPoints(COUNT, WIDTH)
    found.enter_points(
        every,
        SimpleNamespace(
            spread=0.1 * ones, unseen=ones, visibility=np.full(COUNT, visibility),
            item=np.full(COUNT, 3), dusk=np.full(COUNT, dusk),
        ),
    )  # fmt: skip
    return found


def compared(found, bright=1.0, together=0):
    found.compare_neighbours(NONE, NONE, NONE, together, np.full(COUNT, bright))
    return found.errors(MIDDLE, NONE[MIDDLE], 5.0)[0]


def test_neighbours_that_agree_make_what_is_unseen_less_likely():
    error = compared(points(1))
    assert error == 0.1  # the spread: 25 pixels agree, so that 1 / 25 is left of the rest
    odd = points(1)
    odd.visibility[MIDDLE + 1] = 2
    assert compared(odd) > 1.0


def test_rays_of_a_point_miss_a_thin_shadow_together():
    odd = points(1)
    odd.visibility[MIDDLE + 1] = 2
    assert compared(odd, together=4) == 4.0 and compared(odd, together=8) == 8.0


def test_contrasts_are_those_across_outlines_and_towards_dusk():
    found = points(1)
    compared(found, bright=7.0)
    assert found.contrasts(MIDDLE, np.array([True]), 5.0)[0] == 5.0
    assert found.contrasts(MIDDLE, np.array([False]), 5.0)[0] == 0.0
    found = points(1, dusk=True)
    compared(found, bright=7.0)
    assert found.contrasts(MIDDLE, np.array([False]), 5.0)[0] == 7.0
