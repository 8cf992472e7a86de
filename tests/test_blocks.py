# SPDX-License-Identifier: GPL-3.0-or-later
"""Blocks of pixels that are interpolated between points, where motion leaves the picture smooth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt import blocks
from adaptive_drt.blocks import _means
from adaptive_drt.frame import Frame, widened
from adaptive_drt.plan import make_plan
from adaptive_drt.primary import Pairs
from adaptive_drt.render import render_image
from adaptive_drt.scene import Motion, PointLight, Quad, QuadLight, Scene, Sphere
from adaptive_drt.settings import Settings
from adaptive_drt.sights import NO_SIGHT, find_sights
from oracle.converged import converged, relative_rmse
from random_scenes import look_at

FLOOR = Quad((-9.0, -9.0, 0.0), (18.0, 0.0, 0.0), (0.0, 18.0, 0.0))
LAMP = QuadLight((-1.0, -1.0, 4.0), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (9.0, 8.0, 7.0))


def moving_scene(shapes, size=(96, 64)):
    eye = look_at((0.0, -7.0, 3.0), (0.0, 0.0, 0.5), resolution=size)
    return Scene(eye, (*shapes, FLOOR), (LAMP,))


@pytest.mark.parametrize("side", blocks.SIDES)
@pytest.mark.parametrize("whole", [True, False])
def test_pixels_of_a_quadratic_get_its_means(side, whole):
    rng = np.random.default_rng(side)
    c = rng.normal(size=6)

    def mean(x, y):
        # a square's mean over a pixel is that of its middle and 1/12
        more = 1.0 / 12.0 if whole else 0.0
        return (
            c[0] + c[1] * x + c[2] * y + c[3] * (x * x + more) + c[4] * x * y
            + c[5] * (y * y + more)
        )  # fmt: skip

    y, x = np.divmod(np.arange(9), 3)
    step = side / 2
    at = x * step, y * step
    nodes = c[0] + c[1] * at[0] + c[2] * at[1] + c[3] * at[0] ** 2 + c[4] * at[0] * at[1]
    nodes = nodes + c[5] * at[1] ** 2
    row, column = np.divmod(np.arange(side * side), side)
    found = _means(nodes[None, :, None], side, whole)
    np.testing.assert_allclose(found[0, :, 0], mean(column, row), rtol=1e-12, atol=1e-12)


def sights_of(shapes, places):
    plan = make_plan(moving_scene(shapes), Settings())
    count = len(places)
    objects = plan.object_count
    pairs = Pairs(np.repeat(np.arange(count), objects), np.tile(np.arange(objects), count))
    return find_sights(plan, np.array(places, dtype=float).T, 0.5, pairs)


def test_sights_tell_what_passes_and_when():
    ball = Sphere((0.0, 0.0, 1.0), 0.8, motion=Motion((2.0, 0.0, 0.0)))
    # across the middle of the ball's way: the floor; left within the shutter; passed; entered
    found = sights_of([ball], [(x + 0.5, 34.5) for x in range(96)])
    kept = found[found != NO_SIGHT]
    stretches = kept[np.flatnonzero(np.diff(kept, prepend=NO_SIGHT))]
    assert len(stretches) == 5 and len(set(stretches)) == 4 and stretches[0] == stretches[-1]
    # kinks run through the pixels between
    assert (found == NO_SIGHT).sum() <= 8


def test_an_outline_that_stands_still_is_no_sight():
    still = Sphere((0.0, 0.0, 1.0), 0.8)
    ball = Sphere((3.0, 0.0, 1.0), 0.3, motion=Motion((0.1, 0.0, 0.0)))
    found = sights_of([still, ball], [(x + 0.5, 34.5) for x in range(96)])
    assert 1 <= (found == NO_SIGHT).sum() <= 8


def test_what_is_smaller_than_a_pixel_is_no_sight():
    crumb = Sphere((0.0, 0.0, 1.0), 0.01, motion=Motion((0.5, 0.0, 0.0)))
    found = sights_of([crumb], [(x + 0.5, y + 0.5) for x in range(96) for y in range(64)])
    passed = found[found != sights_of([crumb], [(1.5, 1.5)])[0]]
    assert (passed == NO_SIGHT).any()


@pytest.mark.parametrize("thing", ["ball", "plate", "crumbs", "light", "point light"])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
def test_what_moves_is_within_the_tolerance_and_is_interpolated(thing, tolerance, monkeypatch):
    way = Motion((1.1, 0.4, 0.2))
    scene = {
        "ball": moving_scene([Sphere((0.2, 0.0, 0.9), 0.7, motion=way)]),
        "plate": moving_scene([Quad((-1, 0, 0.8), (1.5, 0, 0.2), (0.1, 1, 0.5), motion=way)]),
        "crumbs": moving_scene(
            [Sphere((x, 0.3 * x, 0.4), 0.15, motion=way) for x in (-1.5, -0.7, 0.1, 0.9)]
        ),
        "light": replace(
            moving_scene([Sphere((0.2, 0.0, 0.9), 0.7)]), lights=(replace(LAMP, motion=way),)
        ),
        "point light": replace(
            moving_scene([Sphere((0.2, 0.0, 0.9), 0.7, motion=way)]),
            lights=(PointLight((-1.0, -1.0, 4.0), (9.0, 8.0, 7.0)),),
        ),
    }[thing]
    rng = np.random.default_rng(5)
    chosen = rng.choice(96 * 64, 400, replace=False)
    x, y = chosen % 96, chosen // 96
    truth = converged(scene, np.stack([x, y], axis=1), goal=0.2 * tolerance)
    settings = Settings(tolerance=tolerance, threads=1)
    film = render_image(scene, settings)
    assert relative_rmse(film.color[:, y, x].T, truth.color) < tolerance
    if tolerance > 1e-3:  # at 1e-3 a picture this small has few blocks that are smooth enough
        monkeypatch.setattr(blocks.Blocks, "ask", lambda *_: np.zeros(0, dtype=np.int64))
        alone = render_image(scene, settings)
        # crumbs are too small to gain from it, and are to lose little
        assert film.samples.sum() < (1.1 if thing == "crumbs" else 0.9) * alone.samples.sum()


def test_a_kink_that_shows_no_second_difference_is_seen_by_the_block_above():
    scene = moving_scene([Sphere((0.2, 0.0, 0.9), 0.7, motion=Motion((1.0, 0.0, 0.0)))])
    frame = _frame_of(scene)
    found = blocks.Blocks(frame, blocks.Goal(1.0, 1.0))
    width = frame.width
    rows = np.arange(frame.height)[:, None] + np.zeros(width)
    # 0 at rows 0, 4 and 8 of a block, but not in the middle of its upper half
    table = np.where(rows % 8 == 6, 30.0, 0.0)
    found.value[:] = table.ravel()
    large = _level(width, 8, 8 * width)
    small = _level(width, 4, 12 * width)
    assert found._bends(found.value[:, large.nodes]).max() == 0.0
    seen = found._surprise(small, (large, found.value[:, large.nodes]), found.value[:, small.nodes])
    np.testing.assert_allclose(seen, 30.0)


def _level(width, side, origin):
    y, x = np.divmod(np.arange(9), 3)
    first = np.array([origin])
    return blocks._Level(side, first, first + (side // 2 * (y * width + x))[:, None], width)


def _frame_of(scene):
    plan = make_plan(scene, Settings())
    region = plan.region
    return Frame(widened(plan, region), region)


def test_what_moves_along_its_own_edge_has_an_outline_that_stands_still():
    plate = Quad((-2.0, 0.0, 0.3), (2.0, 0.0, 0.0), (0.0, 0.0, 1.0), motion=Motion((1.5, 0.0, 0.0)))
    scene = moving_scene([plate])
    x, y = np.full(64, 40), np.arange(64)
    found = sights_of([plate], np.stack([x, y], axis=1) + 0.5)
    # its upper edge and the lower one, and the floor's
    assert (found == NO_SIGHT).sum() == 3
    film = render_image(scene, Settings(tolerance=1e-3, threads=1))
    truth = converged(scene, np.stack([x, y], axis=1), goal=1e-4)
    assert relative_rmse(film.color[:, y, x].T, truth.color) < 1e-3


def test_a_kink_before_the_first_node_is_seen():
    """Only a corner of the pixel is lit, on the side that its block has no node beyond."""
    floor = Quad((-15.0, -10.0, 0.0), (30.0, 0.0, 0.0), (0.0, 25.0, 0.0))
    ball = Sphere((-1.3, 2.6, 0.95), 0.95)
    light = QuadLight(
        (-1.8, -1.4, 5.5), (0.9, 0.0, 0.0), (0.0, -0.9, 0.0), (20.0, 20.0, 20.0),
        motion=Motion((1.5, 0.4, 0.0)),
    )  # fmt: skip
    camera = look_at(
        (0.0, -8.5, 5.2), (0.0, 0.6, 0.45), focal_length=45.0, resolution=(300, 300),
        border=(112, 160, 114, 162),
    )  # fmt: skip
    scene = Scene(camera, (floor, ball), (light,))
    film = render_image(scene, Settings(tolerance=1e-4))
    truth = converged(scene, np.array([[113, 160]]), goal=1e-3, scale=0.01).color[0]
    assert truth.mean() > 5e-4
    assert abs(film.color[:, 0, 1].mean() / truth.mean() - 1.0) < 0.05
