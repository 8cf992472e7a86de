# SPDX-License-Identifier: GPL-3.0-or-later
"""Boxes in which times change smoothly: never one with a kink, against rays through the box."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.numerics.box_polynomials import Boxes
from adaptive_drt.scene.description import Camera, Motion, Quad, Scene, Sphere, SphereLight
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Pairs
from adaptive_drt.visibility.event_smoothness import find_smooth_boxes
from adaptive_drt.visibility.polynomials import make_polynomials
from plain_hits import oracle_depth, rays

LAMP = SphereLight((3.0, -2.0, 9.0), 0.5, (10.0, 10.0, 10.0))
SIZE, LINES, MOMENTS = 48, 9, 4097


def shape(rng):
    place = np.append(rng.uniform(-2.0, 2.0, 2), rng.uniform(-7.0, -4.0))
    way = Motion(tuple(rng.uniform(-2.0, 2.0, 3)))
    if rng.random() < 0.5:
        return Sphere(tuple(place), rng.uniform(0.2, 0.9), motion=way)
    a, b = rng.normal(0.0, 1.0, (2, 3))
    return Quad(tuple(place), tuple(a), tuple(b), motion=way)


@pytest.mark.parametrize(
    "seed", [0, 2, 3, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, *range(4, 40)))]
)
def test_smooth_boxes_have_no_kinks(seed):
    """Fourth differences of a smooth length fall; a kink's are as large as its second's."""
    rng = np.random.default_rng(seed)
    thing, camera = shape(rng), Camera(resolution=(SIZE, SIZE))
    plan = make_plan(Scene(camera, (thing,), (LAMP,)), Settings(threads=1))
    count = 300
    low = np.stack([*rng.uniform(0.0, SIZE - 1.0, (2, count)), rng.uniform(-0.5, 0.3, count)])
    boxes = Boxes(low, low + np.array([[1.0], [1.0], [0.2]]))
    forms, cover = make_polynomials(
        plan, boxes, Pairs(np.arange(count), np.zeros(count, dtype=int))
    )
    smooth = find_smooth_boxes(forms, cover.all_hit, np.arange(count), count)
    share = (np.arange(MOMENTS) + 0.5) / MOMENTS
    for box in np.flatnonzero(smooth & ~cover.all_hit):
        # ends count at once for all rays, or for none
        corner, side = low[:, box], np.array([1.0, 1.0, 0.2])
        u, v = (part.ravel() for part in np.meshgrid(*[np.linspace(0.0, 1.0, LINES)] * 2))
        x, y = corner[0] + u * side[0], corner[1] + v * side[1]
        t = corner[2] + share * side[2]
        ray = np.repeat(rays(camera, x, y), MOMENTS, axis=1)
        far = oracle_depth(thing, ray, np.tile(t, x.size), np.zeros((3, 1)))
        hit = np.isfinite(far).reshape(-1, MOMENTS)
        first, last = hit[:, 0], hit[:, -1]
        assert first.all() or not first.any(), f"seed {seed}, box {box}"
        assert last.all() or not last.any(), f"seed {seed}, box {box}"
        changes = (hit[:, 1:] != hit[:, :-1]).sum(axis=1)
        assert (changes == changes[0]).all(), f"seed {seed}, box {box}"
        length = hit.mean(axis=1).reshape(LINES, LINES)
        for line in (length, length.T):
            second = np.abs(np.diff(line, 2, axis=0)).max()
            fourth = np.abs(np.diff(line, 4, axis=0)).max()
            # a kink anywhere makes it four times the second's half; rounding to moments is noise
            assert fourth < 0.6 * second + 24.0 / MOMENTS, f"seed {seed}, box {box}"


def test_some_boxes_are_smooth():
    plan = make_plan(
        Scene(
            Camera(resolution=(SIZE, SIZE)),
            (Sphere((0.0, 0.0, -5.0), 0.8, motion=Motion((2.0, 0.0, 0.0))),),
            (LAMP,),
        ),
        Settings(threads=1),
    )
    y, x = (part.ravel() for part in np.mgrid[0:SIZE, 0:SIZE].astype(float))
    low = np.stack([x, y, np.full(x.size, -0.5)])
    boxes = Boxes(low, low + 1.0)
    forms, cover = make_polynomials(
        plan, boxes, Pairs(np.arange(x.size), np.zeros(x.size, dtype=int))
    )
    cut = cover.may_hit & ~cover.all_hit
    smooth = find_smooth_boxes(forms, cover.all_hit, np.arange(x.size), x.size)
    assert smooth[cut].mean() > 0.4
