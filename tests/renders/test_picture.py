# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures against the oracle's: distributed everywhere, and adaptive, with many rays."""

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.render import render_image
from adaptive_drt.scene.settings import Settings
from oracle.picture import reference
from random_scenes import random_scene


def relative_rmse(a, b):
    """Root mean square difference of two pictures over the second one's mean."""
    return np.sqrt(((a - b) ** 2).mean()) / b.mean()


@pytest.mark.parametrize("distribution", ["ADAPTIVE", "EVERYWHERE"])
@pytest.mark.parametrize(
    "seed", [2, 5, *(pytest.param(k, marks=pytest.mark.slow) for k in (7, 8, 12, 13, 15))]
)
def test_picture_agrees_with_brute_force(seed, distribution):
    """All effects at once. Both errors, by groups and by seeds, are part of the bound."""
    scene = random_scene(seed)
    want, error = reference(scene, 256)
    some = Settings(
        method="RAYS",
        light_rays=16,
        time_rays=32,
        pixel_rays=32,
        distribution=distribution,
        threads=1,
    )
    one, two = (render_image(scene, replace(some, seed=k)).color for k in (1, 2))
    noise = np.sqrt((error**2).mean()) / want.mean() + relative_rmse(one, two)
    assert relative_rmse((one + two) / 2.0, want) < 0.01 + 2.0 * noise, f"seed {seed}"
    assert one.mean() == pytest.approx(want.mean(), rel=0.01)


@pytest.mark.parametrize(
    "seed", [2, 5, *(pytest.param(k, marks=pytest.mark.slow) for k in (13, 19))]
)
def test_penumbrae_alone_agree_pixel_by_pixel(seed):
    """No pixel is off by more than seven standard errors of the oracle and a small bias."""
    scene = random_scene(seed)
    want, error = reference(scene, 512, use_motion=False, use_edges=False)
    film = render_image(
        scene, Settings(method="RAYS", light_rays=1024, use_motion=False, use_edges=False)
    )
    bound = 7.0 * error + 0.01 * want.mean()
    off = np.abs(film.color - want) > bound
    assert not off.any(), f"seed {seed}: (channel, row, column) {np.argwhere(off).tolist()}"
