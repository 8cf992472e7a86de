# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels that edges of meshes cut, by lines: against pixels of many points."""

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.cubature.cut_pixels import LINE_COUNTS, sample_cut_pixels
from adaptive_drt.cubature.sampled_pixels import SamplingTask, sample_pixels
from adaptive_drt.scene.description import Material, Quad, QuadLight, Scene, Sphere
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Pairs
from adaptive_drt.tracing.occluder_culling import Occluders
from mesh_shapes import ball_mesh, bumpy_mesh
from random_scenes import look_at

FLOOR = Quad((-6.0, -6.0, 0.0), (12.0, 0.0, 0.0), (0.0, 12.0, 0.0), Material((0.8, 0.7, 0.6)))
LAMP = QuadLight((1.0, -1.0, 5.0), (0.9, 0.0, 0.0), (0.0, -0.6, 0.0), (12.0, 11.0, 9.0))
SIZE = (14, 10)
CAMERA = look_at((0.5, -6.0, 3.5), (0.0, 0.0, 1.0), resolution=SIZE)
MESHES = {
    "coarse": ball_mesh(10, 6),
    "smooth": ball_mesh(24, 16, smooth=True),
    # hundreds of faces meet in one pixel at each pole
    "finer than pixels": bumpy_mesh(200, 100, smooth=True),
}


def task_of(plan, limit):
    """All pixels of a picture, each with all objects as candidates."""
    x, y = (each.ravel() for each in np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1])))
    n, objects = x.size, plan.object_count
    pairs = Pairs(np.repeat(np.arange(n), objects), np.tile(np.arange(objects), n))
    none = np.zeros(n)
    return SamplingTask(
        x + 0.5, y + 0.5, y * SIZE[0] + x, none > 0.0, pairs, none + limit, none, none + 1.0
    )


def compiled(*shapes, **fields):
    plan = make_plan(Scene(CAMERA, shapes, (LAMP,), (0.1, 0.2, 0.3), **fields), Settings())
    return plan, Occluders(plan)


@pytest.mark.parametrize("name", MESHES)
def test_pixels_are_those_of_many_points(name):
    plan, occluders = compiled(FLOOR, MESHES[name])
    truth = sample_pixels(plan, occluders, task_of(plan, 1e-4))
    mean = truth.color.mean()
    done = sample_cut_pixels(plan, occluders, task_of(plan, 3e-3 * mean))
    known = np.isfinite(done.spread)
    # the floor's own edges are left to points
    assert known.mean() > 0.8
    off = np.sqrt(((done.color - truth.color) ** 2).mean(axis=0))[known]
    assert np.sqrt((off**2).mean()) < 3e-3 * mean
    assert off.max() < 2e-2 * mean
    stated = np.sqrt((done.spread[known] ** 2).mean())
    assert 0.1 < np.sqrt((off**2).mean()) / stated < 1.5


def test_pixels_end_with_the_fewest_lines_that_keep_their_limits():
    plan, occluders = compiled(FLOOR, MESHES["coarse"])
    rough, fine = (sample_cut_pixels(plan, occluders, task_of(plan, x)) for x in (1e-2, 1e-3))
    assert rough.samples.sum() < fine.samples.sum()
    done = fine.spread <= 1e-3
    assert done.mean() > 0.6
    known = np.isfinite(fine.spread)
    assert (fine.samples[known] >= 2 * LINE_COUNTS[0]).all()


def test_other_outlines_and_motion_are_left_to_points():
    ball = Sphere((0.2, -1.5, 1.1), 0.7, Material((0.5, 0.6, 0.7)))
    plan, occluders = compiled(FLOOR, MESHES["coarse"], ball)
    task = task_of(plan, 1e-2)
    done = sample_cut_pixels(plan, occluders, task)
    unknown = np.isinf(done.spread)
    assert 0.05 < unknown.mean() < 0.6
    moving = replace(task, moves=np.ones(task.x.size, dtype=np.bool_))
    assert np.isinf(sample_cut_pixels(plan, occluders, moving).spread).all()


def test_coverage_before_a_transparent_background_is_its_share():
    plan, occluders = compiled(MESHES["coarse"], transparent=True)
    task = task_of(plan, 1e-3)
    task = replace(task, contrast=np.ones(task.x.size))
    truth, done = (sample(plan, occluders, task) for sample in (sample_pixels, sample_cut_pixels))
    assert np.abs(done.alpha - truth.alpha).max() < 1e-2
    assert 0.1 < done.alpha.mean() < 0.9
