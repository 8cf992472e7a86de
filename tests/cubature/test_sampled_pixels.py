# SPDX-License-Identifier: GPL-3.0-or-later
"""Sampled pixels: their means, stated errors, and that they do not depend on batches."""

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.cubature import sampled_pixels as module
from adaptive_drt.cubature.sampled_pixels import SamplingTask, sample_pixels, unseen_error
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import Material, Quad, QuadLight, Scene, Sphere
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Pairs
from adaptive_drt.tracing.occluder_culling import Occluders
from mesh_shapes import ball_mesh
from random_scenes import look_at

FLOOR = Quad((-6.0, -6.0, 0.0), (12.0, 0.0, 0.0), (0.0, 12.0, 0.0), Material((0.8, 0.7, 0.6)))
BALL = Sphere((0.2, 0.1, 1.1), 0.9, Material((0.5, 0.6, 0.7)))
LAMP = QuadLight((1.0, -1.0, 5.0), (0.9, 0.0, 0.0), (0.0, -0.6, 0.0), (12.0, 11.0, 9.0))
SIZE = (20, 14)
SCENE = Scene(
    look_at((0.5, -6.0, 3.5), (0.0, 0.0, 0.6), resolution=SIZE), (FLOOR, BALL), (LAMP,), (0.1,) * 3
)


def task_of(plan, limit, rows=None, moves=False):
    """All pixels of a picture, each with all objects as candidates."""
    x, y = (each.ravel() for each in np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1])))
    index = y * SIZE[0] + x
    rows = index if rows is None else rows
    n, objects = rows.size, plan.object_count
    pairs = Pairs(np.repeat(np.arange(n), objects), np.tile(np.arange(objects), n))
    flags, limits = np.full(n, moves), np.full(n, limit)
    none = np.zeros(n)
    return SamplingTask(x[rows] + 0.5, y[rows] + 0.5, rows, flags, pairs, limits, none, none + 1.0)


@pytest.mark.parametrize("points", [8, 16, 32, 64])
def test_points_leave_no_gap_along_rows_and_columns(points):
    """Else they miss thin shadows there: a Kronecker sequence left gaps of eight of 64 points."""
    plan = make_plan(SCENE, Settings())
    rows = np.arange(280)
    spots = module._Points.make(plan, task_of(plan, 1.0), rows, False, (0, points)).offset
    assert spots.shape == (2, 280, points)
    each = np.sort(spots, axis=2)
    gap = np.diff(np.concatenate([each, each[..., :1] + 1.0], axis=2), axis=2)
    assert gap.max() < 2.0 / points


def sampled(scene, limit, **fields):
    plan = make_plan(scene, Settings())
    return sample_pixels(plan, Occluders(plan), task_of(plan, limit, **fields))


def test_the_means_are_those_of_exact_light():
    exact = render_image(SCENE, Settings(tolerance=1e-4)).color.reshape(3, -1)
    mean = exact.mean()
    for limit in (2e-2, 5e-3):
        done = sampled(SCENE, limit * mean)
        off = np.sqrt(((done.color - exact) ** 2).mean(axis=0))
        assert (done.error(1.0) <= limit * mean).mean() > 0.98
        assert np.sqrt((off**2).mean()) < 1.2 * limit * mean
        # the stated errors are right on average
        known = done.error(1.0) > 0.0
        ratio = off[known] / done.error(1.0)[known]
        assert 0.2 < np.sqrt((ratio**2).mean()) < 1.4
        assert (done.samples >= module.FIRST_POINTS).all()


def test_unhidden_light_on_a_plane_needs_the_fewest_points():
    scene = replace(SCENE, shapes=(FLOOR,))
    rows = np.arange(100)
    done = sampled(scene, 1e-3, rows=rows)
    assert (done.samples == module.FIRST_POINTS).all()
    exact = render_image(scene, Settings(tolerance=1e-4)).color.reshape(3, -1)[:, rows]
    np.testing.assert_allclose(done.color, exact, rtol=1e-3)


@pytest.mark.parametrize("moves", [False, True])
def test_pixels_do_not_depend_on_their_batch(moves, monkeypatch):
    whole = sampled(SCENE, 1e-2, moves=moves)
    monkeypatch.setattr(module, "POINTS_PER_CHUNK", 1 << 9)
    chosen = np.array([3, 57, 58, 120, 279])
    part = sampled(SCENE, 1e-2, rows=chosen, moves=moves)
    np.testing.assert_array_equal(part.color, whole.color[:, chosen])
    np.testing.assert_array_equal(part.spread, whole.spread[chosen])
    np.testing.assert_array_equal(part.samples, whole.samples[chosen])


def test_what_no_point_met_is_counted():
    assert unseen_error(2.0, 8) == pytest.approx(module.UNSEEN_AREA / 4.0)
    plan = make_plan(SCENE, Settings())
    task = replace(task_of(plan, 1e-2), contrast=np.full(SIZE[0] * SIZE[1], 1.0))
    done = sample_pixels(plan, Occluders(plan), task)
    assert done.samples.min() >= module.UNSEEN_AREA / 1e-2


def test_a_transparent_background_gives_coverage():
    scene = replace(SCENE, shapes=(BALL,), transparent=True)
    exact = render_image(scene, Settings(tolerance=1e-3))
    done = sampled(scene, 2e-3)
    assert np.abs(done.alpha - exact.alpha.ravel()).mean() < 0.02
    assert ((done.alpha >= 0.0) & (done.alpha <= 1.0)).all()


@pytest.mark.parametrize("smooth", [False, True])
def test_pixels_tell_where_a_smooth_surface_turns_away_from_a_light(smooth):
    ball = ball_mesh(10, 6, radius=2.0, center=(0.0, 0.0, 0.6), smooth=smooth)
    lamp = replace(LAMP, center=(9.0, 0.0, 0.6), half_u=(0.0, 0.5, 0.0), half_v=(0.0, 0.0, -0.5))
    camera = look_at((0.0, -6.0, 0.6), (0.0, 0.0, 0.6), resolution=SIZE)
    row = 7 * SIZE[0] + np.arange(5, 15)
    done = sampled(Scene(camera, (ball,), (lamp,)), np.inf, rows=row)
    # the light is to the right; on flat faces nothing varies that points might miss
    assert (done.dusk[:2] == smooth).all() and not done.dusk[-2:].any()
