# SPDX-License-Identifier: GPL-3.0-or-later
"""Which disks lie within balls and ellipsoids, against points of their rims."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.geometry.cylinder.opaque_balls import opaque_balls
from adaptive_drt.scene.description import EVERYWHERE, Ellipsoid, Motion, Sphere, Visibility
from adaptive_drt.scene.sphere_batch import Spheres

STILL = {(None, EVERYWHERE): 0}
ANGLES = np.linspace(0.0, 2.0 * np.pi, 720)


def ellipsoid(rng, stretched):
    size = rng.uniform(0.5, 1.0, 3) if stretched else np.full(3, rng.uniform(0.5, 1.0))
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0] * size
    return Ellipsoid(tuple(rng.normal(size=3)), *(tuple(each) for each in axes.T)), axes


@pytest.mark.parametrize("stretched", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_disks_that_are_held_have_their_rims_inside(seed, stretched):
    rng = np.random.default_rng(seed)
    print("seed", seed)
    wrong = missed = within = 0
    for _ in range(300):
        ball, axes = ellipsoid(rng, stretched)
        u, v = np.linalg.qr(rng.normal(size=(3, 2)))[0].T
        center = np.array(ball.center) + 0.5 * rng.uniform(-1.0, 1.0, 3)
        radius = rng.uniform(0.05, 0.6)
        rim = radius * (np.outer(u, np.cos(ANGLES)) + np.outer(v, np.sin(ANGLES)))
        local = np.linalg.solve(axes, rim + (center - ball.center)[:, None])
        inside = bool(np.linalg.norm(local, axis=0).max() < 1.0)
        disk = center[:, None], np.cross(u, v)[:, None], np.array([radius])
        held = bool(opaque_balls([ball], STILL).hold(np.array([0]), *disk)[0])
        wrong += held and not inside
        missed += inside and not held
        within += inside
    assert wrong == 0 and within > 50
    # the bound is exact for balls
    assert missed <= (0.3 * within if stretched else 1)


@pytest.mark.parametrize("seed", range(3))
def test_a_camera_is_outside_of_those_that_its_path_misses(seed):
    rng = np.random.default_rng(seed)
    print("seed", seed)
    pairs = [ellipsoid(rng, True) for _ in range(50)]
    balls = opaque_balls([ball for ball, _ in pairs], STILL)
    eye, drift = rng.normal(size=(2, 3))
    path = eye[:, None] + drift[:, None] * np.linspace(-0.5, 0.5, 4001)
    for (ball, axes), outside in zip(pairs, balls.are_outside(eye, drift), strict=True):
        local = np.linalg.solve(axes, path - np.array(ball.center)[:, None])
        nearest = np.linalg.norm(local, axis=0).min()
        assert outside == (nearest > 1.0) or abs(nearest - 1.0) < 1e-3


def test_only_those_of_given_manners_and_of_some_size_are_taken():
    motion, unseen = Motion((1.0, 0.0, 0.0)), Visibility(camera=False)
    slot, place = np.zeros(2, dtype=np.int64), np.zeros((3, 2))
    records = [
        Sphere((1.0, 0.0, 0.0), 0.5),
        Sphere((2.0, 0.0, 0.0), 0.5, motion=motion),
        Sphere((3.0, 0.0, 0.0), 0.5, visibility=unseen),
        Spheres(place, np.array([0.0, 0.25]), slot, (Sphere((0.0, 0.0, 0.0), 1.0).material,)),
    ]
    balls = opaque_balls(records, STILL | {(motion, EVERYWHERE): 1})
    np.testing.assert_allclose(balls.center[0], [1.0, 2.0, 0.0])
    np.testing.assert_allclose(balls.reach, [0.5, 0.5, 0.25])
    np.testing.assert_allclose(balls.moved[0], [0.0, 1.0, 0.0])
    assert balls.manner.tolist() == [0, 1, 0]
