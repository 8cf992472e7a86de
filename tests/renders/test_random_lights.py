# SPDX-License-Identifier: GPL-3.0-or-later
"""Random scenes of all kinds of lights and skies keep their tolerance, against brute force.

`benchmarks/kept_tolerance.py --scenes lights` measures more of them.
"""

from dataclasses import replace

import pytest

pytest.importorskip("numba")

from adaptive_drt.render import render_image
from adaptive_drt.scene.settings import Settings
from light_scenes import light_scene
from oracle.every_light import sampled_every_light

pytestmark = pytest.mark.filterwarnings("error")

NOISE = 0.7
"""Standard deviation of a pixel of the truth's halves, as a fraction of the tolerance."""
SURE = 2.0
"""Standard errors by which an error must be beyond a bound, so that it counts as beyond."""
COUNT = 100
WITHIN = 98
"""Scenes, of `COUNT`, in which the tolerance is kept; in no scene the error is twice as large."""
FOUND = {}
"""Error over tolerance and its standard error, by tolerance and seed, for the last test."""


def ratio(seed, tolerance):
    """Error of a picture over its tolerance, and the standard error of that."""
    scene = light_scene(seed)
    film = render_image(scene, Settings(tolerance=tolerance, threads=1))
    truth = sampled_every_light(scene, NOISE * tolerance, 1000 + seed)
    error, spread = truth.relative_error(film.color)
    return error / tolerance, spread / tolerance


@pytest.mark.parametrize("seed", [3, 7])
def test_the_tolerance_is_kept(seed):
    error, spread = ratio(seed, 1e-2)
    assert error <= 1.0 + SURE * spread, f"seed {seed}: {error} +- {spread}"


def test_light_that_comes_after_a_moving_sphere_has_left_is_foreseen():
    """The middle of the times at which a pixel shows a sphere lay within another one, which moves
    through both: nothing was foreseen, and the pixel was black, 5.9 tolerances for the picture."""
    scene = light_scene(85, 12)
    scene = replace(scene, camera=replace(scene.camera, border=(10, 7, 11, 8)))
    film = render_image(scene, Settings(tolerance=1e-3, threads=1))
    truth = sampled_every_light(scene, 1e-2, 85)
    assert film.color.mean() == pytest.approx(truth.color.mean(), rel=0.04)


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
@pytest.mark.parametrize("seed", range(COUNT))
def test_the_error_is_never_twice_the_tolerance(seed, tolerance):
    error, spread = FOUND[tolerance, seed] = ratio(seed, tolerance)
    assert error <= 2.0 + SURE * spread, f"seed {seed}: {error} +- {spread}"


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
def test_the_tolerance_is_kept_in_most_scenes(tolerance):
    """It needs the results of the test before."""
    found = {seed: each for (own, seed), each in FOUND.items() if own == tolerance}
    if len(found) < COUNT:
        pytest.skip("the test before was not run for all seeds")
    beyond = {seed: error for seed, (error, spread) in found.items() if error > 1.0 + SURE * spread}
    assert COUNT - len(beyond) >= WITHIN, f"beyond the tolerance {tolerance:g}: {beyond}"
