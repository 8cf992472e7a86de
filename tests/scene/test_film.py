# SPDX-License-Identifier: GPL-3.0-or-later
"""Films: passes as flat float32 images, against plain loops over pixels."""

from __future__ import annotations

import numpy as np
import pytest

from adaptive_drt.scene.film import NO_DEPTH, PASSES, Film

WIDTH, HEIGHT = 5, 3


@pytest.fixture
def film():
    rng = np.random.default_rng(3)
    made = Film(WIDTH, HEIGHT)
    made.color[:], made.alpha[:] = rng.normal(size=(3, HEIGHT, WIDTH)), rng.random((HEIGHT, WIDTH))
    made.mask[:] = rng.random((3, HEIGHT, WIDTH)) < 0.5
    made.samples[:] = rng.integers(1, 900, (HEIGHT, WIDTH))
    made.depth[:] = rng.uniform(1.0, 9.0, (HEIGHT, WIDTH))
    made.normal[:] = rng.normal(size=(3, HEIGHT, WIDTH))
    return made


def channels_of(film, name, y, x):
    """Values of one pixel, in the order of a pass's channels."""
    return {
        "Combined": [*film.color[:, y, x], film.alpha[y, x]],
        "Depth": [film.depth[y, x]],
        "Normal": list(film.normal[:, y, x]),
        "Adaptive Mask": [*film.mask[:, y, x], 1.0],
        "Sample Count": [film.samples[y, x]],
    }[name]


@pytest.mark.parametrize("one", PASSES, ids=lambda one: one.name)
def test_passes_are_pixels_row_by_row_from_the_bottom(film, one):
    places = [(y, x) for y in range(HEIGHT) for x in range(WIDTH)]
    want = [value for place in places for value in channels_of(film, one.name, *place)]
    found = film.pixels(one.name)
    assert found.dtype == np.float32 and found.size == HEIGHT * WIDTH * len(one.channels)
    np.testing.assert_array_equal(found, np.array(want, dtype=np.float32))
    width = WIDTH * len(one.channels)
    np.testing.assert_array_equal(film.pixels(one.name, slice(1, 3)), found[width : 3 * width])


def test_arrays_that_are_given_are_filled_from_the_beginning(film):
    room = np.full(100, -7.0, dtype=np.float32)
    found = film.pixels("Depth", out=room)
    assert found.base is room or found.base is room.base
    np.testing.assert_array_equal(room[: WIDTH * HEIGHT], film.pixels("Depth"))
    assert (room[WIDTH * HEIGHT :] == -7.0).all()


@pytest.mark.filterwarnings("error")
def test_no_image_holds_an_infinity(film):
    film.color[0, 0, 0], film.color[1, 0, 0] = 1e300, -1e300
    found = film.pixels("Combined")
    assert np.isfinite(found).all() and found[0] == -found[1] == np.finfo(np.float32).max


def test_a_new_film_shows_nothing():
    blank = Film(2, 2)
    assert not blank.color.any() and not blank.alpha.any() and not blank.mask.any()
    assert (blank.depth == NO_DEPTH).all() and not blank.normal.any() and blank.stats == {}
