# SPDX-License-Identifier: GPL-3.0-or-later
"""Deviations that are foreseen of shadows of spheres, against many points of the patches."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.scene.description import DiskLight, Motion, QuadLight, Sphere, SphereLight
from deviations import foreseen_and_found
from shaded import plan_of

COLOR = (1.0, 1.0, 1.0)
LIGHTS = {
    "quad": QuadLight((0.3, 0.2, 6.0), (0.7, 0.0, 0.1), (0.0, -0.5, 0.0), COLOR),
    "sphere": SphereLight((0.3, 0.2, 6.0), 0.5, COLOR),
    "disk": DiskLight((0.3, 0.2, 6.0), 0.5, COLOR),
}
WAY = Motion((0.5, 0.2, 0.1))


@pytest.mark.parametrize("kind", LIGHTS)
@pytest.mark.parametrize(
    "half",
    [(0.5, 0.5, 0.0), (3.0, 3.0, 0.0), pytest.param((0.5, 0.5, 0.5), marks=pytest.mark.slow)],
    ids=str,
)
def test_deviations_are_foreseen_and_not_much_too_large(kind, half):
    way = WAY if half[2] else None
    balls = (Sphere((0.2, 0.1, 2.5), 0.5, motion=way), Sphere((-0.9, 0.4, 1.0), 0.3))
    plan = plan_of(*balls, light=LIGHTS[kind])
    x, y = np.random.default_rng(4).uniform((60, 30), (140, 100), (250, 2)).T
    deviation, off = foreseen_and_found(plan, x, y, 2, half)
    said = deviation.sum(axis=(0, 1))
    rms = np.sqrt((off**2).mean()), np.sqrt((said**2).mean())
    assert rms[0] < rms[1] < 100.0 * rms[0]
    assert (off > 3.0 * said + 1e-7).mean() < 0.04
