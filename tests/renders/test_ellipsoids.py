# SPDX-License-Identifier: GPL-3.0-or-later
"""Random scenes with ellipsoids: the mask and pictures against brute force, and the tolerance."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.render import render_image
from adaptive_drt.scene.settings import Settings
from ellipsoid_truth import ellipsoids_known
from light_checks import rms
from oracle.picture import reference
from oracle.truth import masks
from random_scenes import random_scene

FEW = Settings(method="RAYS", light_rays=2, time_rays=2, pixel_rays=2, threads=1)
QUICK, MORE = (1, 3, 10), tuple(range(12, 60))
EASY = tuple(seed for seed in range(40) if seed not in (0, 7))
"""Seeds of scenes of which a picture of a tenth of the tolerance takes seconds."""


def assert_no_pixel_is_left_out(seed):
    scene = random_scene(seed, ellipsoids=True)
    with ellipsoids_known():
        truth = masks(scene)
    gone = truth & ~render_image(scene, FEW).mask
    assert not gone.any(), f"(domain, row, column) {np.argwhere(gone).tolist()}"


def assert_the_tolerance_is_kept(seed):
    scene = random_scene(seed, ellipsoids=True)
    want = render_image(scene, Settings(tolerance=1e-4, threads=1)).color
    for tolerance in (1e-2, 1e-3):
        got = render_image(scene, Settings(tolerance=tolerance, threads=1)).color
        assert rms(got - want) <= tolerance * want.mean(), f"at {tolerance:g}"
    with ellipsoids_known():
        brute, error = reference(scene, 64)
    assert rms(brute - want) < 1.6 * rms(error) + 1e-3 * want.mean()


@pytest.mark.parametrize("seed", QUICK)
def test_no_pixel_is_left_out(seed):
    assert_no_pixel_is_left_out(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", MORE)
def test_no_pixel_is_left_out_of_more_scenes(seed):
    assert_no_pixel_is_left_out(seed)


@pytest.mark.parametrize("seed", (3,))
def test_the_tolerance_is_kept(seed):
    assert_the_tolerance_is_kept(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", EASY)
def test_the_tolerance_is_kept_in_more_scenes(seed):
    assert_the_tolerance_is_kept(seed)
