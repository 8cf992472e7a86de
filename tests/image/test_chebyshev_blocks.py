# SPDX-License-Identifier: GPL-3.0-or-later
"""Chebyshev interpolation over blocks of pixels, and how blocks are cut down to pixels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.image.chebyshev_blocks import (
    SIDES,
    PixelBlocks,
    block_means,
    block_nodes,
    chebyshev_series,
    coarse_plan,
    interpolation_error,
)
from adaptive_drt.scene.settings import Settings
from adaptive_drt.tracing.compile import make_plan
from adaptive_drt.tracing.intersect import Tile, screen_bounds
from random_scenes import random_scene


def cubic(rng):
    """A random bicubic of pixel coordinates, and its mean over the pixel at (x, y)."""
    c = rng.normal(size=(4, 4)) / 8.0 ** np.add.outer(range(4), range(4))

    def value(x, y):
        return sum(c[i, j] * x**i * y**j for i in range(4) for j in range(4))

    def antiderivative(x, y):
        return sum(
            c[i, j] * x ** (i + 1) * y ** (j + 1) / ((i + 1) * (j + 1))
            for i in range(4)
            for j in range(4)
        )

    def mean(x, y):
        high, low = antiderivative(x + 1, y + 1), antiderivative(x, y)
        return high - antiderivative(x, y + 1) - antiderivative(x + 1, y) + low

    return value, mean


@pytest.mark.parametrize("side", SIDES)
def test_pixels_of_a_bicubic_get_its_means(side):
    rng = np.random.default_rng(side)
    value, mean = cubic(rng)
    x, y = rng.integers(-2, 3, (2, 5))
    values = value(*block_nodes(x + 0.5, y + 0.5, side))
    found = block_means(chebyshev_series(values[None]), side)[0]
    row, column = np.mgrid[:side, :side]
    want = mean(side * x + column[..., None], side * y + row[..., None])
    np.testing.assert_allclose(found, want, rtol=1e-10, atol=1e-10 * np.abs(want).max())


def test_how_far_a_bicubic_is_off_is_seen():
    """Of smooth functions and of kinks it is not said to be less than it is, nor 50 times more."""
    rng = np.random.default_rng(2)
    side, place = 8, np.zeros(400)
    x, y = block_nodes(place + 0.5, place + 0.5, side)
    angle, shift = rng.uniform(0, 2 * np.pi, 400), rng.uniform(-4, 4, 400)
    for name, shape in {
        "wave": lambda s: np.sin(0.25 * s),
        "root": lambda s: np.sqrt(36.0 + s * s),
        "kink": lambda s: np.maximum(s, 0.0),
    }.items():

        def at(x, y, shape=shape):
            across = (x - 4) * np.cos(angle) + (y - 4) * np.sin(angle)
            return shape(across - shift)

        coefficients = chebyshev_series(at(x, y)[None])
        # the means of pixels need a finer look than their middles where there is a kink
        fine = (np.arange(8 * side) + 0.5) / 8
        exact = at(fine[None, :, None], fine[:, None, None])
        exact = exact.reshape(side, 8, side, 8, -1).mean(axis=(1, 3))
        off = np.sqrt(((block_means(coefficients, side)[0] - exact) ** 2).mean(axis=(0, 1)))
        said = interpolation_error(coefficients)
        assert np.sqrt((off**2).mean()) < np.sqrt((said**2).mean()), name
        assert np.median(said / np.maximum(off, 1e-300)) < 50.0, name


@pytest.mark.parametrize("region", [(-3, -3, 40, 21), (5, 7, 6, 8), (0, 0, 16, 16)])
def test_squares_are_cut_down_to_each_pixel_once(region):
    plan = replace(make_plan(random_scene(3), Settings()), region=region)
    side = SIDES[0]
    rough = coarse_plan(plan, side)
    squares = PixelBlocks.of_tile(rough, side, screen_bounds(rough), Tile.make(rough, 0, 1))
    bounds = screen_bounds(plan)
    for smaller in (*SIDES[1:], 1):
        squares = squares.subdivide(np.arange(squares.x.size), smaller, region, bounds)
    item = squares.pairs.item
    place = np.array([squares.x, squares.y])[:, squares.pairs.pixel]
    assert ((place >= bounds[:2, item]) & (place < bounds[2:, item])).all()
    left, bottom, right, top = region
    width = right - left
    number = np.sort((squares.y - bottom) * width + squares.x - left)
    np.testing.assert_array_equal(number, np.arange(width * (top - bottom)))
    assert (np.diff(squares.pairs.item) >= 0).all()
    half = squares.part(0, number.size // 2)
    assert half.pairs.pixel.size == (squares.pairs.pixel < number.size // 2).sum()
