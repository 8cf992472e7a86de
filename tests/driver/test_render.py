# SPDX-License-Identifier: GPL-3.0-or-later
"""The driver: a generator of progress that ends with a film, and what its statistics say."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.render import render, render_image
from adaptive_drt.scene.description import Scene, SceneError, Sphere
from adaptive_drt.scene.settings import METHODS, Settings
from random_scenes import look_at, random_scene

SCENE = random_scene(4)
FEW = {"light_rays": 4, "time_rays": 4, "pixel_rays": 4, "tolerance": 1e-2, "threads": 1}


def of(method, **more):
    return Settings(method=method, **{**FEW, **more})


@pytest.mark.parametrize("method", METHODS)
def test_progress_never_goes_back_and_ends_with_the_film(method):
    steps, told = render(SCENE, of(method, batch=200)), []
    while True:
        try:
            told.append(next(steps))
        except StopIteration as end:
            film = end.value
            break
    done = [one.done for one in told]
    assert done[0] == 0 and done == sorted(done) and done[-1] == told[-1].total
    assert all(one.total == film.width * film.height for one in told)
    assert all(one.film is film for one in told)
    alone = render_image(SCENE, of(method, batch=200))
    for name in ("color", "alpha", "mask", "samples", "depth", "normal"):
        np.testing.assert_array_equal(getattr(film, name), getattr(alone, name), name)


@pytest.mark.parametrize("method", METHODS)
def test_borders_are_parts_of_the_picture(method):
    whole = render_image(SCENE, of(method))
    part = replace(SCENE, camera=replace(SCENE.camera, border=(5, 3, 17, 14)))
    film = render_image(part, of(method))
    assert (film.width, film.height) == (12, 11)
    for name in ("depth", "normal", "mask"):
        np.testing.assert_array_equal(getattr(film, name), getattr(whole, name)[..., 3:14, 5:17])
    if method == "RAYS":
        np.testing.assert_array_equal(film.color, whole.color[:, 3:14, 5:17])


@pytest.mark.parametrize("method", METHODS)
def test_statistics_are_plain_and_count_what_was_done(method):
    film = render_image(SCENE, of(method))
    stats = json.loads(json.dumps(film.stats))
    assert sum(stats["rays"].values()) > 0
    assert all(seconds >= 0.0 for seconds in stats["seconds"].values())
    if method == "EXACT":
        assert 0.0 < stats["error_estimate"] <= 1e-2


@pytest.mark.parametrize("method", METHODS)
def test_an_empty_scene_is_its_background(method):
    camera = look_at((0.0, -5.0, 1.0), (0.0, 0.0, 0.0), resolution=(9, 7))
    film = render_image(Scene(camera, background=(0.1, 0.2, 0.3)), of(method))
    np.testing.assert_array_equal(
        film.color, np.tile(np.reshape((0.1, 0.2, 0.3), (3, 1, 1)), (7, 9))
    )
    assert (film.alpha == 1.0).all() and not film.mask.any()
    clear = render_image(Scene(camera, background=(0.1, 0.2, 0.3), transparent=True), of(method))
    assert not clear.color.any() and not clear.alpha.any()


def test_scenes_that_cannot_be_rendered_are_refused_and_others_say_what_is_left_out():
    with pytest.raises(SceneError, match="no camera"):
        render_image(Scene())
    bad = replace(SCENE, shapes=(*SCENE.shapes, Sphere((0.0, 0.0, 0.0), -1.0, name="bad")))
    film = render_image(bad, of("RAYS"))
    assert any(issue["name"] == "bad" for issue in film.stats["issues"])
    np.testing.assert_array_equal(film.color, render_image(SCENE, of("RAYS")).color)


def test_without_settings_the_method_is_exact():
    camera = look_at((0.0, -5.0, 1.0), (0.0, 0.0, 0.0), resolution=(3, 2))
    assert "error_estimate" in render_image(Scene(camera, (Sphere((0, 0, 0), 1.0),))).stats
