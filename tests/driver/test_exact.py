# SPDX-License-Identifier: GPL-3.0-or-later
"""Method EXACT: the error it promises, against a converged truth; the same picture to the bit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.exact import ExactRender
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import Sphere
from adaptive_drt.scene.settings import Settings, SettingsError
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Pairs
from adaptive_drt.tracing.occluder_culling import Occluders
from adaptive_drt.visibility.fragments import Boxes, find_fragments
from oracle.converged import relative_rmse
from oracle.kept import converged_color
from random_scenes import look_at, random_scene

pytestmark = pytest.mark.filterwarnings("error")

TOLERANCES = (1e-2, 1e-3, 1e-4)
PIXELS = 300
"""Random pixels of a scene that its error is measured on."""
TRUTH = 0.1
"""Of the tolerance: the goal of the truth's pixels; what its RMSE reaches is a tenth of that."""
REACHED = {}
"""Error over tolerance by seed and tolerance, gathered for the last test."""


def exact(tolerance=1e-2, threads=1, **more):
    return Settings(method="EXACT", tolerance=tolerance, threads=threads, **more)


def error_over_tolerance(seed, tolerance):
    """Relative RMSE on random pixels of a random scene, in units of the tolerance."""
    scene = random_scene(seed)
    width, height = scene.camera.resolution
    rng = np.random.default_rng(seed)
    chosen = rng.choice(width * height, min(PIXELS, width * height), replace=False)
    x, y = chosen % width, chosen // width
    truth = converged_color(scene, np.stack([x, y], axis=1), TRUTH * tolerance)
    film = render_image(scene, exact(tolerance))
    assert film.stats["error_estimate"] <= tolerance, f"seed {seed}"
    if not truth.any():
        assert not film.color[:, y, x].any()
        return 0.0
    return relative_rmse(film.color[:, y, x].T, truth) / tolerance


@pytest.mark.parametrize("seed", range(100, 104))
def test_the_error_is_within_the_tolerance(seed):
    assert error_over_tolerance(seed, 1e-2) < 1.0, f"seed {seed}"


@pytest.mark.parametrize("tolerance", TOLERANCES[:2])
@pytest.mark.parametrize("seed", [250, 272])
def test_what_hard_shadows_that_move_are_off_by_is_foreseen(seed, tolerance):
    """A point of light's shadow stays a step however short the time: it takes cells."""
    scene = random_scene(seed)
    assert not make_plan(scene, exact()).all_shadows_soft
    assert render_image(scene, exact(tolerance)).stats["error_estimate"] <= tolerance


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", TOLERANCES)
@pytest.mark.parametrize("seed", range(200, 250))
def test_the_error_is_never_twice_the_tolerance(seed, tolerance):
    REACHED[seed, tolerance] = error_over_tolerance(seed, tolerance)
    assert REACHED[seed, tolerance] < 2.0, f"seed {seed}, tolerance {tolerance:g}"


@pytest.mark.slow
def test_the_error_is_mostly_within_the_tolerance(capsys):
    """In 98 % of the scenes and tolerances of the test before."""
    found = np.array(list(REACHED.values()))
    with capsys.disabled():
        for tolerance in TOLERANCES:
            some = np.array([v for (_, t), v in REACHED.items() if t == tolerance])
            print(
                f"\nEXACT {tolerance:g}, {some.size} scenes: error over tolerance: "
                f"median {np.median(some):.2f}, worst {some.max():.2f}"
            )
    assert (found <= 1.0).mean() >= 0.98


@pytest.mark.parametrize("seed", [3, 5, 8])
def test_the_picture_does_not_hang_on_threads_or_batches(seed):
    scene = random_scene(seed)
    want = render_image(scene, exact())
    for threads, batch in ((2, 65_536), (5, 65_536), (3, 700), (1, 130)):
        film = render_image(scene, exact(threads=threads, batch=batch))
        for name in ("color", "alpha", "samples", "mask", "depth", "normal"):
            np.testing.assert_array_equal(getattr(film, name), getattr(want, name), name)


@pytest.mark.parametrize("seed", [3, 5])
def test_borders_join_to_the_last_bit(seed):
    scene = random_scene(seed)
    width, height = scene.camera.resolution
    want = render_image(scene, exact())
    cut = width // 3
    for border in ((0, 0, cut, height), (cut, 0, width, height), (2, 3, cut, height // 2)):
        part = replace(scene, camera=replace(scene.camera, border=border))
        film = render_image(part, exact(threads=2))
        left, bottom, right, top = border
        np.testing.assert_array_equal(film.color, want.color[:, bottom:top, left:right])
        np.testing.assert_array_equal(film.samples, want.samples[bottom:top, left:right])


def test_a_lower_tolerance_takes_more_points():
    scene = random_scene(8)
    counts = [render_image(scene, exact(t)).samples.sum() for t in (1e-1, 1e-2, 1e-3)]
    assert counts[0] < counts[1] < counts[2]


@pytest.mark.parametrize("tolerance", [0.0, -1.0, float("nan"), float("inf"), "fine"])
def test_a_tolerance_that_makes_no_sense_is_refused(tolerance):
    with pytest.raises(SettingsError, match="tolerance"):
        Settings(tolerance=tolerance)


def test_a_seam_seen_from_its_own_plane():
    """Two equal spheres meet in a plane through the eye: there the seam is a double root."""
    eye = look_at((0.3, -6.0, 2.0), (0.3, 0.0, 1.0), resolution=(31, 23))
    balls = Sphere((0.0, 0.0, 1.0), 1.0), Sphere((0.6, 0.0, 1.0), 1.0)
    plan = make_plan(replace(random_scene(3), camera=eye, shapes=balls), exact())
    rows = np.arange(9.0, 14.0)
    # the plane is at x = 15.5; boxes a third of a pixel to its left
    low = np.stack([np.full(5, 14.8), rows, np.zeros(5)])
    boxes = Boxes(low, low + np.array([[1.0], [1.0], [0.0]]))
    pairs = Pairs(np.repeat(np.arange(5), 2), np.tile(np.arange(2), 5))
    found = find_fragments(plan, boxes, pairs, 1e-4)
    np.testing.assert_array_equal(found.item, np.tile([0, 1], 5))
    np.testing.assert_allclose(found.weight, np.tile([0.7, 0.3], 5), atol=1e-6)


def test_a_render_that_has_not_begun_estimates_nothing():
    plan = make_plan(random_scene(4), exact())
    work = ExactRender(plan, Occluders(plan))
    assert work.error_estimate == 0.0 and work.goal.error == 0.0 and work.stage
