# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene for any light, and what pictures under one are compared with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.render import render_image
from adaptive_drt.scene.description import Quad, Sphere
from adaptive_drt.scene.settings import Settings
from oracle.picture import reference
from oracle.truth import masks
from random_scenes import look_at

EXACT = Settings(tolerance=1e-3, threads=1)
RAYS = Settings(method="RAYS", light_rays=256, pixel_rays=64, time_rays=64, threads=1)
FEW = Settings(method="RAYS", light_rays=2, time_rays=2, pixel_rays=2, threads=1)
"""For masks, which do not depend on the numbers of rays."""
FLOOR = Quad((-8.0, -8.0, 0.0), (16.0, 0.0, 0.0), (0.0, 16.0, 0.0))
BALL = Sphere((0.0, 0.0, 1.0), 0.7)
CAMERA = look_at((0.0, -6.0, 4.0), (0.0, 0.0, 0.5), resolution=(36, 24), focal_length=35.0)


def rms(a):
    """Root mean square of all values of an array."""
    return float(np.sqrt((a**2).mean()))


def assert_both_methods_agree(scene):
    """With brute force, beyond whose noise a share of the mean is allowed."""
    want, error = reference(scene, 1024)
    noise, mean = rms(error), want.mean()
    exact, rays = (render_image(scene, settings).color for settings in (EXACT, RAYS))
    assert rms(exact - want) < 1.5 * noise + 1e-3 * mean
    assert rms(rays - want) < 1.5 * noise + 0.04 * mean
    assert exact.mean() == pytest.approx(mean, rel=2e-3)


def assert_agrees(scene, settings, samples, share, least=0.0):
    """With brute force of so many samples, beyond whose noise a share of the mean is allowed.

    least : radiance that is allowed as well, for pictures that are black.
    """
    want, error = reference(scene, samples)
    got = render_image(scene, settings).color
    assert rms(got - want) < 1.5 * rms(error) + share * want.mean() + least


def assert_tolerance_is_kept(scene, tolerance):
    """Against a picture of a much smaller tolerance."""
    want = render_image(scene, replace(EXACT, tolerance=5e-5)).color
    got = render_image(scene, replace(EXACT, tolerance=tolerance)).color
    assert rms(got - want) < tolerance * want.mean()


def assert_no_pixel_is_left_out(scene, seed):
    """All pixels that depend on the light's extent, the time or the place in them are flagged."""
    gone = masks(scene) & ~render_image(scene, FEW).mask
    assert not gone.any(), f"seed {seed}: (domain, row, column) {np.argwhere(gone).tolist()}"
