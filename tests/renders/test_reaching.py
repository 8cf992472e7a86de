# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights and occluders that reach into each other: the error that is stated, against the true one.

The visible part of such a light has no closed form in general; distributed rays estimate it, and
their error is a part of the stated one.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("numba")

from adaptive_drt.render import render_image
from adaptive_drt.scene.settings import Settings
from oracle.sampled import sampled
from reaching_scenes import reaching_scene

pytestmark = pytest.mark.filterwarnings("error")

NOISE = 0.4
"""Of the tolerance: noise of a pixel of the truth's halves, which its error is free of."""
SURE = 2.0
"""Standard errors by which a true error must be beyond a bound, so that it counts as beyond."""
CASES = {1e-2: range(50), 1e-3: range(10)}
WITHIN = 0.96
"""Of the scenes: where the true error is within the stated one."""
FOUND = {}
"""Stated error, true one and its uncertainty by tolerance and seed, for the last test."""


def errors(seed, tolerance):
    """Stated error, true error and its standard error, relative to the picture's mean."""
    scene = reaching_scene(seed)
    film = render_image(scene, Settings(method="EXACT", tolerance=tolerance, threads=1))
    truth = sampled(scene, noise=NOISE * tolerance, seed=1000 + seed)
    return (film.stats["error_estimate"], *truth.relative_error(film.color))


@pytest.mark.parametrize("seed", [pytest.param(4, marks=pytest.mark.slow), 6])
def test_the_true_error_is_within_the_stated_one(seed):
    stated, true, spread = errors(seed, 1e-2)
    assert stated <= 1e-2
    assert true <= stated + SURE * spread, f"seed {seed}: {true} +- {spread}, stated {stated}"


def test_a_bright_spot_that_is_soon_covered_is_found_in_time():
    """A sphere that reaches into another one, so that lines may not run along t, covers the spot
    after a twentieth of the shutter. The pixel was off by 1.0 %, ten times its stated error.
    """
    scene = reaching_scene(7)
    scene = replace(scene, camera=replace(scene.camera, border=(15, 14, 16, 15)))
    film = render_image(scene, Settings(method="EXACT", tolerance=1e-2, threads=1))
    true, spread = sampled(scene, noise=5e-4, seed=7).relative_error(film.color)
    stated = film.stats["error_estimate"]
    assert true <= stated + SURE * spread < 3e-3, f"{true} +- {spread}, stated {stated}"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("tolerance", "seed"),
    [(tolerance, seed) for tolerance, some in CASES.items() for seed in some],
)
def test_the_true_error_is_never_twice_the_stated_one(seed, tolerance):
    stated, true, spread = FOUND[tolerance, seed] = errors(seed, tolerance)
    assert true <= 2.0 * stated + SURE * spread, f"{true} +- {spread}, stated {stated}"


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", CASES)
def test_the_true_error_is_mostly_within_the_stated_one(tolerance, capsys):
    """It needs the results of the test before."""
    found = {seed: each for (own, seed), each in FOUND.items() if own == tolerance}
    if len(found) < len(CASES[tolerance]):
        pytest.skip("the test before was not run for all seeds")
    with capsys.disabled():
        print(f"\ntolerance {tolerance:g}: seed, stated, true, its standard error, ratio")
        for seed, (stated, true, spread) in found.items():
            print(f"{seed:3d}  {stated:.2e}  {true:.2e}  {spread:.0e}  {true / stated:.2f}")
    within = np.mean([true <= stated for stated, true, _ in found.values()])
    assert within >= WITHIN, f"{within:.0%}"
