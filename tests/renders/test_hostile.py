# SPDX-License-Identifier: GPL-3.0-or-later
"""Degenerate and hostile scenes: no NaN, no infinity, no exception, no warning, no excess light."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from adaptive_drt.render import render_image
from adaptive_drt.scene.description import SceneError
from adaptive_drt.scene.film import PASSES
from adaptive_drt.scene.settings import Settings
from hostile_meshes import hostile_mesh_scene
from hostile_scenes import HOSTILE, REFUSED, brightest, hostile_scene

pytestmark = pytest.mark.filterwarnings("error")

RAYS = Settings(method="RAYS", light_rays=4, time_rays=4, pixel_rays=4, threads=1)
WAYS = {
    "order 1": replace(RAYS, order=1),
    "order 2": RAYS,
    "everywhere": replace(RAYS, distribution="EVERYWHERE"),
    "embree": replace(RAYS, accelerator="EMBREE"),
}
WAYS |= {
    f"exact to {tolerance:g}": Settings(method="EXACT", tolerance=tolerance, threads=1)
    for tolerance in (1e-1, 1e-2, 1e-3)
}


def check(scene, settings):
    """Render, and see that every number can be shown and that no light comes from nowhere."""
    film = render_image(scene, settings)
    for name in ("color", "alpha", "depth", "normal"):
        assert np.isfinite(getattr(film, name)).all(), name
    assert (film.color >= 0.0).all() and (film.samples >= 1).all()
    assert ((film.alpha >= 0.0) & (film.alpha <= 1.0)).all()
    assert (film.color <= brightest(scene)[:, None, None]).all()
    for each in PASSES:
        assert np.isfinite(film.pixels(each.name)).all(), each.name


def check_or_refused(scene, settings):
    """The same, but where the camera was spoilt a message may say so."""
    try:
        check(scene, settings)
    except SceneError as error:
        assert "camera" in str(error)


SLOW = {
    ("1e30", "exact to 0.01"),
    ("1e30", "exact to 0.001"),
    ("motion through the camera", "exact to 0.01"),
    ("motion through the camera", "exact to 0.001"),
    ("point lights on surfaces", "exact to 0.001"),
    ("motion through the lights", "exact to 0.001"),
    ("a light holds everything", "exact to 0.001"),
    ("the camera in the middle of things", "exact to 0.001"),
}
"""Each takes 5 to 100 seconds: spheres reach into the lights of most of those scenes, and each of
their points takes a thousand rays. The same scenes are rendered to other tolerances."""


@pytest.mark.parametrize(
    ("name", "way"),
    [
        pytest.param(*case, marks=[pytest.mark.slow] if case in SLOW else [])
        for case in product(HOSTILE, WAYS)
    ],
)
def test_a_named_scene(name, way):
    check(HOSTILE[name], WAYS[way])


WORK = {"1e30": 700, 18: 220, 35: 2, 93: 130, 117: 3_000}
"""Points a pixel, twice what is needed. Each was split to its limit, at ten times that and more:
an occluder that moves far beyond a light's centre, objects that come and go sooner than they
cross a pixel, a black picture, within a sphere and without, and a light and an occluder nearer to
each other than directions to them round."""


@pytest.mark.parametrize(
    "case", [pytest.param(k, marks=pytest.mark.slow) if k in ("1e30", 117) else k for k in WORK]
)
def test_work_is_bounded(case):
    """Cells that no split would settle are not split to the end."""
    scene = HOSTILE[case] if isinstance(case, str) else hostile_scene(case)
    if case == "1e30":
        scene = replace(scene, camera=replace(scene.camera, resolution=(5, 4)))
    film = render_image(scene, Settings(method="EXACT", tolerance=1e-2, threads=1))
    assert film.samples.mean() <= WORK[case]


@pytest.mark.parametrize("name", REFUSED)
def test_a_camera_that_forms_no_picture(name):
    with pytest.raises(SceneError, match="camera"):
        render_image(REFUSED[name], RAYS)


@pytest.mark.parametrize("seed", range(60))
def test_random_scenes_with_faults(seed):
    """Each seed by one of the ways."""
    way = list(WAYS)[seed % len(WAYS)]
    check_or_refused(hostile_scene(seed), WAYS[way])


@pytest.mark.parametrize("seed", range(1, 9))
def test_random_meshes_with_faults(seed):
    """Each seed by one of three ways; `make stress` renders more of them."""
    way = ("order 2", "everywhere", "exact to 0.1")[seed % 3]
    check_or_refused(hostile_mesh_scene(seed), WAYS[way])


@pytest.mark.parametrize("seed", (1247, 1301, 1306, 1355, 1820))
@pytest.mark.parametrize("way", ("order 2", "exact to 0.01"))
def test_scenes_that_warned(seed, way):
    """A camera in a surface seen edge-on; points in a ball that shines, a quad beside it; light
    1e308 times what was foreseen."""
    check_or_refused(hostile_scene(seed), WAYS[way])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(60, 260))
def test_many_random_scenes_with_faults(seed):
    for settings in WAYS.values():
        check_or_refused(hostile_scene(seed), settings)
