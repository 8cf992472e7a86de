# SPDX-License-Identifier: GPL-3.0-or-later
"""Heaps of balls whose light rays find: the same picture for any order of work, tolerance kept."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.geometry.embree_library import native_library
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import EnvironmentLight
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from sphere_heaps import moving_heap, sphere_heap

pytestmark = pytest.mark.skipif(native_library() is None, reason="embree's library is not found")


def relative_error(picture, truth):
    """Root mean square error over the mean."""
    return float(np.sqrt(((picture - truth) ** 2).mean()) / truth.mean())


def test_the_picture_does_not_depend_on_the_order_of_work():
    scene = sphere_heap(1, 100, size=(16, 12))
    one, other = (
        render_image(scene, Settings(tolerance=0.1, threads=threads, batch=batch))
        for threads, batch in ((1, 65_536), (2, 37))
    )
    assert one.stats["sampled_pixels"] > 50
    assert one.stats["rays"]["solid shadow"] > 0
    np.testing.assert_array_equal(one.color, other.color)
    np.testing.assert_array_equal(one.mask, other.mask)


def test_the_mask_is_that_of_closed_forms():
    scene = sphere_heap(2, 100, size=(16, 12))
    by_rays, closed = (
        render_image(scene, Settings(tolerance=tolerance, accelerator=accelerator))
        for accelerator, tolerance in (("AUTO", 0.1), ("ARRAYS", 10.0))
    )
    assert by_rays.stats["sampled_pixels"] and not closed.stats["sampled_pixels"]
    np.testing.assert_array_equal(by_rays.mask, closed.mask)


@pytest.mark.slow
@pytest.mark.parametrize("light", ["sky", "square"])
@pytest.mark.parametrize("tolerance", [0.03, 0.01])
@pytest.mark.parametrize("seed", range(3))
def test_the_tolerance_is_kept(seed, tolerance, light):
    scene = sphere_heap(seed, 150, light)
    truth = render_image(scene, Settings(tolerance=0.2 * tolerance, accelerator="ARRAYS"))
    film = render_image(scene, Settings(tolerance=tolerance))
    assert light != "sky" or film.stats["sampled_pixels"] > 100
    error = relative_error(film.color, truth.color)
    assert error < tolerance
    assert 0.5 < film.stats["error_estimate"] / error < 3.0


@pytest.mark.slow
@pytest.mark.parametrize("count", [150, 400])
def test_heaps_are_those_of_fine_closed_forms(count):
    scene = sphere_heap(7, count, "square")
    truth = render_image(scene, Settings(tolerance=1e-4, accelerator="ARRAYS"))
    film = render_image(scene, Settings(tolerance=0.01))
    assert film.stats["sampled_pixels"] > 100 and not truth.stats["sampled_pixels"]
    assert relative_error(film.color, truth.color) < 0.01
    np.testing.assert_array_equal(film.mask, truth.mask)


@pytest.mark.slow
@pytest.mark.parametrize("light", ["sky", "square"])
@pytest.mark.parametrize("seed", range(3))
def test_the_tolerance_is_kept_under_motion(seed, light):
    scene = moving_heap(sphere_heap(seed, 100, light, (16, 12)), 0.1)
    truth = render_image(scene, Settings(tolerance=0.006, accelerator="ARRAYS"))
    film = render_image(scene, Settings(tolerance=0.03))
    assert film.stats["sampled_pixels"] > 50
    assert relative_error(film.color, truth.color) < 0.03
    np.testing.assert_array_equal(film.mask, truth.mask)


def colored_environment():
    """An environment with a warm glow in a blue sky."""
    turn, height = np.linspace(-np.pi, np.pi, 32), np.linspace(0.0, np.pi, 16)[:, None]
    glow = np.exp(-((height - 1.0) ** 2 + (turn - 0.8) ** 2) / 0.3)
    sky = np.clip(np.cos(height) + 0.3, 0.0, None) + 0.0 * turn
    return EnvironmentLight(np.stack([0.3 * sky + 3.0 * glow, 0.5 * sky + glow, sky], axis=-1))


def test_rays_find_coloured_environments_at_coarse_tolerances():
    scene = replace(sphere_heap(1, 100, size=(16, 12)), lights=(colored_environment(),))
    film = render_image(scene, Settings(tolerance=0.1))
    assert film.stats["sampled_pixels"] > 50
    fine = make_plan(scene, Settings(tolerance=1e-3))
    assert fine.traced is None and fine.lights[0].channel_count == 3


@pytest.mark.slow
def test_the_tolerance_is_kept_under_coloured_environments():
    scene = replace(sphere_heap(1, 100, size=(16, 12)), lights=(colored_environment(),))
    truth = render_image(scene, Settings(tolerance=0.005, accelerator="ARRAYS"))
    film = render_image(scene, Settings(tolerance=0.02))
    error = relative_error(film.color, truth.color)
    assert error < 0.02
    assert 0.5 < film.stats["error_estimate"] / error < 3.0


def test_a_border_joins_the_whole_picture():
    scene = sphere_heap(2, 100, size=(24, 16))
    whole = render_image(scene, Settings(tolerance=0.1))
    border = replace(scene, camera=replace(scene.camera, border=(4, 2, 20, 11)))
    part = render_image(border, Settings(tolerance=0.1))
    np.testing.assert_array_equal(part.color, whole.color[:, 2:11, 4:20])
