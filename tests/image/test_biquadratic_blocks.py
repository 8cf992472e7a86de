# SPDX-License-Identifier: GPL-3.0-or-later
"""Blocks of pixels that are interpolated between points, where motion leaves the picture smooth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.exact import ExactRender
from adaptive_drt.image.biquadratic_blocks import SIDES, BiquadraticBlocks, cubic_means, node_means
from adaptive_drt.render import render_image
from adaptive_drt.scene.description import Motion, PointLight, Quad, QuadLight, Scene, Sphere
from adaptive_drt.scene.settings import Settings
from moving_floor import LAMP, moving_scene, points_of, settled
from oracle.converged import relative_rmse
from oracle.kept import converged_color
from random_scenes import look_at


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("whole", [True, False])
def test_pixels_of_a_quadratic_and_cubics_get_its_means(side, whole):
    rng = np.random.default_rng(side)
    c = rng.normal(size=8)
    # a square's mean over a pixel is that of its middle and 1/12
    more = 1.0 / 12.0 if whole else 0.0

    def value(x, y):
        return c[0] + c[1] * x + c[2] * y + c[3] * x * x + c[4] * x * y + c[5] * y * y

    def mean(x, y):
        return value(x, y) + more * (c[3] + c[5])

    y, x = np.divmod(np.arange(9), 3)
    nodes = value(x * side / 2, y * side / 2)
    row, column = np.divmod(np.arange(side * side), side)
    found = node_means(nodes[None, :, None], side, whole)
    np.testing.assert_allclose(found[0, :, 0], mean(column, row), rtol=1e-12, atol=1e-12)

    def cubic(x, more):
        # of size 1 at half the way from the first node to the next, and 0 at the three nodes
        x, more = x / (side / 2), more / (side / 2) ** 2
        return (x**3 + 3.0 * x * more - 3.0 * (x * x + more) + 2.0 * x) / 0.375

    found = cubic_means(c[6:7, None], c[7:, None], side, whole)
    truth = c[6] * cubic(row, more) + c[7] * cubic(column, more)
    np.testing.assert_allclose(found[0, :, 0], truth, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("thing", ["ball", "plate", "crumbs", "light", "point light"])
@pytest.mark.parametrize("tolerance", [1e-2, pytest.param(1e-3, marks=pytest.mark.slow)])
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
    chosen = rng.choice(96 * 64, 200, replace=False)
    x, y = chosen % 96, chosen // 96
    truth = converged_color(scene, np.stack([x, y], axis=1), 0.2 * tolerance)
    settings = Settings(tolerance=tolerance, threads=1)
    film = render_image(scene, settings)
    assert relative_rmse(film.color[:, y, x].T, truth) < tolerance
    if tolerance > 1e-3:  # at 1e-3 a picture this small has few blocks that are smooth enough
        monkeypatch.setattr(ExactRender, "_interpolate_means", lambda *_: iter(()))
        alone = render_image(scene, settings)
        # crumbs are too small to gain from it, and are to lose little
        assert film.samples.sum() < (1.1 if thing == "crumbs" else 0.9) * alone.samples.sum()


@pytest.mark.parametrize("side", SIDES)
def test_blocks_settle_what_is_smooth_and_nothing_with_a_kink(side):
    smooth = points_of(lambda x, y: 1e-2 * (x**3 + y**2 * x))
    assert settled(BiquadraticBlocks(smooth, side)).any()
    # a kink at any place in blocks' rows, as large as a second difference of 30
    for place in np.linspace(0.0, side, 9):
        kinked = points_of(lambda x, y, k=place: 60.0 / side * np.abs(y % side - k) + 0.0 * x)
        assert not settled(BiquadraticBlocks(kinked, side)).any(), place


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
    truth = converged_color(scene, np.array([[113, 160]]), 1e-3, 0.01)[0]
    assert truth.mean() > 5e-4
    assert abs(film.color[:, 0, 1].mean() / truth.mean() - 1.0) < 0.05
