# SPDX-License-Identifier: GPL-3.0-or-later
"""Deviations that are foreseen of shadows of spheres that lights reach into."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.scene.description import DiskLight, Motion, QuadLight, Sphere
from adaptive_drt.shading.direct_light import shade
from adaptive_drt.tracing.occluder_culling import Occluders
from deviations import foreseen_and_found
from shaded import patches_at, plan_of

POINTS, TIMES = 40, 33
COLOR = (1.0, 1.0, 1.0)
LIGHTS = {
    "quad": QuadLight((0.0, 0.0, 2.0), (0.4, 0.0, 0.0), (0.0, -0.4, 0.0), COLOR),
    "disk": DiskLight((0.0, 0.0, 2.0), 0.4, COLOR),
}


def found(light, way, half):
    """RMS of deviations and of what is foreseen, and the fraction of points much beyond it.

    half : half the extents of the patches: in pixels or, of means over the shutter, in its times.
    """
    plan = plan_of(Sphere((0.1, 0.2, 2.5), 0.6, motion=way), light=light)
    x, y = np.random.default_rng(4).uniform((60, 30), (140, 100), (POINTS, 2)).T
    if half[2]:
        deviation, off = over_time(plan, x, y, half)
    else:
        deviation, off = foreseen_and_found(plan, x, y, 1, half)
    said = deviation.sum(axis=(0, 1))
    beyond = (off > 3.0 * said + 1e-7).mean()
    return np.sqrt((off**2).mean()), np.sqrt((said**2).mean()), beyond


def over_time(plan, x, y, half):
    """`foreseen_and_found` of the floor at rest, for patches that extend in time alone."""
    occluders = Occluders(plan)
    hits, patch = patches_at(plan, x, y, 1, half)
    middle = shade(plan, occluders, hits, 0.0, patch)
    times = half[2] * ((np.arange(TIMES) + 0.5) / TIMES * 2.0 - 1.0)
    light = [shade(plan, occluders, hits, np.full(x.size, t), patch).color for t in times]
    return middle.deviation, np.sqrt(((middle.color - np.mean(light, axis=0)) ** 2).mean(axis=0))


@pytest.mark.parametrize("kind", LIGHTS)
@pytest.mark.parametrize("way", [(0.0, 0.0, 0.6), (0.5, 0.3, 0.2), (0.0, 0.0, -1.2)], ids=str)
def test_a_sphere_that_moves_through_a_light_is_foreseen(kind, way):
    """It hid a third more of the disk within the shutter, and next to nothing was foreseen."""
    off, said, beyond = found(LIGHTS[kind], Motion(way), (0.0, 0.0, 0.5))
    assert off < said < 60.0 * off
    assert beyond < 0.03


@pytest.mark.parametrize("kind", LIGHTS)
def test_a_sphere_at_rest_in_a_light_is_foreseen(kind):
    off, said, beyond = found(LIGHTS[kind], None, (2.0, 2.0, 0.0))
    assert off < said
    assert beyond < 0.03


def test_light_and_sphere_that_move_as_one_have_no_edges_in_time():
    way = Motion((0.02, 0.0, 0.0))
    disk = LIGHTS["disk"]
    carried = DiskLight(disk.center, disk.radius, COLOR, motion=way)
    (_, apart, _), (_, together, _) = (found(x, way, (0.0, 0.0, 0.5)) for x in (disk, carried))
    assert together < 0.5 * apart
