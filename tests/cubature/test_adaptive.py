# SPDX-License-Identifier: GPL-3.0-or-later
"""Refined pixels against a converged truth, and what does not depend on how they are asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.cubature.adaptive import RefinementTask, refine, shade_initial_cells
from adaptive_drt.cubature.error_budget import Goal
from adaptive_drt.cubature.regions import Cells
from adaptive_drt.scene.description import Motion, Scene, Sphere
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Pairs
from adaptive_drt.tracing.occluder_culling import Occluders
from moving_floor import moving_scene
from oracle.kept import converged_color

BALL = Sphere((0.2, 0.0, 0.9), 0.7)
SCENES = {
    "still": moving_scene([BALL], (24, 16)),
    "moving": moving_scene([replace(BALL, motion=Motion((1.1, 0.4, 0.2)))], (24, 16)),
}


def task_of(plan, pixels, error, contrast):
    """All objects as rivals of pixels (n, 2) of which nothing is known."""
    n, half = len(pixels), np.array([0.5, 0.5, 0.5 if plan.motion else 0.0])
    middle = np.stack([*(pixels.T + 0.5), np.zeros(n)])
    true = np.ones(n, dtype=bool)
    cells = Cells.blank(
        np.arange(n), middle - half[:, None], middle + half[:, None], np.ones(n), true
    )
    rivals = Pairs(
        np.repeat(np.arange(n), plan.object_count), np.tile(np.arange(plan.object_count), n)
    )
    return RefinementTask(cells, true, np.full(n, -1), true, rivals, Goal(error, contrast), 0.0)


def asked(name, pixels, tolerance):
    plan = make_plan(SCENES[name], Settings(threads=1))
    scale = 1.5  # about the mean radiance
    return plan, Occluders(plan), task_of(plan, pixels, tolerance * scale, scale)


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("tolerance", [3e-2, 3e-3])
def test_pixels_are_within_their_goal(name, tolerance):
    rng = np.random.default_rng(3)
    pixels = rng.integers((0, 0), (24, 16), (60, 2))
    plan, occluders, task = asked(name, pixels, tolerance)
    refined = refine(plan, occluders, task)
    # motion lets pixels stop a quarter above their goal
    assert (refined.error <= 1.25 * task.goal.error).all()
    truth = converged_color(SCENES[name], pixels, 1e-3)
    off = np.sqrt(((refined.color.T - truth) ** 2).mean(axis=1))
    assert np.sqrt((off**2).mean()) < task.goal.error
    assert off.max() < 4.0 * task.goal.error
    np.testing.assert_allclose(refined.alpha, 1.0, rtol=1e-12)
    first = shade_initial_cells(plan, occluders, task)
    assert (refined.samples >= first.samples).all() and (first.samples > 0).all()
    assert first.cells.pixel.size == 60
    easy = first.error <= task.goal.error
    np.testing.assert_array_equal(refined.samples[easy], first.samples[easy])


def test_a_pixel_does_not_depend_on_those_refined_with_it():
    pixels = np.stack(np.meshgrid(np.arange(6, 18), np.arange(4, 12)), axis=-1).reshape(-1, 2)
    plan, occluders, task = asked("moving", pixels, 1e-2)
    all_ = refine(plan, occluders, task)
    some = np.arange(5, len(pixels), 7)
    part = refine(plan, occluders, asked("moving", pixels[some], 1e-2)[2])
    for field in ("color", "alpha", "samples", "error"):
        np.testing.assert_array_equal(getattr(all_, field)[..., some], getattr(part, field), field)


def test_transparent_backgrounds_are_covered_in_part():
    scene = replace(
        Scene(SCENES["still"].camera, (BALL,), SCENES["still"].lights), transparent=True
    )
    pixels = np.stack(np.meshgrid(np.arange(24), np.arange(16)), axis=-1).reshape(-1, 2)
    plan = make_plan(scene, Settings(threads=1))
    refined = refine(plan, Occluders(plan), task_of(plan, pixels, 1e-3, 1.0))
    side = (np.arange(40) + 0.5) / 40
    w = plan.lens.directions(
        *(
            np.add.outer(pixels[:, k], part.ravel())
            for k, part in enumerate(np.meshgrid(side, side))
        )
    )
    v = np.array(BALL.center)[:, None, None] - plan.lens.origin[:, None, None]
    miss = np.linalg.norm(np.cross(w, v, axis=0), axis=0) > BALL.radius * np.linalg.norm(w, axis=0)
    np.testing.assert_allclose(refined.alpha, 1.0 - miss.mean(axis=1), atol=5e-3)
