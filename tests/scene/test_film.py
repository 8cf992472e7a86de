# SPDX-License-Identifier: GPL-3.0-or-later
"""The film as a sink: what is written is read back, and shows while a render goes on."""

import numpy as np
import pytest

from adaptive_drt.render import render
from adaptive_drt.scene.film import FILM_BORDER, NO_DEPTH, Film
from adaptive_drt.scene.settings import Settings
from random_scenes import random_scene

PLANES = ("color", "alpha", "mask", "samples", "depth", "normal")


def test_rows_and_pixels_are_read_back():
    film, values = Film(5, 4), np.arange(3 * 2 * 5, dtype=float).reshape(3, 2, 5)
    film.write_rows(slice(1, None, 2), color=values, samples=1)
    np.testing.assert_array_equal(film.color[:, 1::2], values)
    assert not film.color[:, ::2].any() and film.samples.sum() == 10
    x, y = np.array([0, 4]), np.array([3, 0])
    film.write_pixels(x, y, alpha=np.array([0.5, 1.0]), normal=np.ones((3, 2)))
    assert film.alpha[3, 0] == 0.5 and film.alpha[0, 4] == 1.0 and film.alpha.sum() == 1.5
    assert film.normal.sum() == 6.0
    film.add_samples(x, y, np.array([7, 2]))
    assert film.samples[3, 0] == 8 and film.samples[0, 4] == 2


def test_coordinates_broadcast_and_the_border_is_not_seen():
    film, side = Film(6, 3), np.arange(-FILM_BORDER, FILM_BORDER)
    depth = np.add.outer(side, side).astype(float)
    film.write_pixels(side, side[:, None], depth=depth)
    y, x = np.mgrid[:3, :6]
    np.testing.assert_array_equal(film.depth, (x + y).astype(float))
    film.write_pixels(x[:0], y[:0], depth=np.zeros(x[:0].shape))


def test_depths_of_no_hit_are_the_host_s():
    film = Film(2, 1)
    film.write_rows(slice(None), depth=np.array([[np.inf, 3.0]]))
    assert film.depth.tolist() == [[NO_DEPTH, 3.0]]
    film.write_pixels(np.array([1]), np.array([0]), depth=np.array([np.inf]))
    assert film.depth.tolist() == [[NO_DEPTH, NO_DEPTH]]


@pytest.mark.parametrize("method", ["EXACT", "RAYS"])
def test_the_picture_shows_while_it_is_rendered(method):
    """One film with the same arrays from the first progress to the end, and ever more in it."""
    settings = Settings(method=method, threads=1, batch=256, light_rays=4, pixel_rays=4)
    seen, arrays, before = [], None, 0
    for progress in render(random_scene(8), settings):
        film = progress.film
        now = [getattr(film, name) for name in PLANES]
        assert arrays is None or all(a is b for a, b in zip(arrays, now, strict=True))
        arrays = now
        written = film.samples > 0
        assert written.sum() >= before
        before = int(written.sum())
        seen.append(written.mean())
        assert not film.color[:, ~written].any()
    assert seen[0] == 0.0 and seen[-1] == 1.0
    assert any(0.0 < share < 1.0 for share in seen)
