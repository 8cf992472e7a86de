# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of any numbers at all: each renders to finite numbers, or a message refuses its camera."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from adaptive_drt.render import render_image
from adaptive_drt.scene.description import (
    Camera,
    DiskLight,
    Material,
    Motion,
    PointLight,
    Quad,
    QuadLight,
    Scene,
    SceneError,
    Sphere,
    SphereLight,
    validate,
)
from adaptive_drt.scene.settings import METHODS, Settings
from hostile_scenes import brightest
from random_scenes import look_at

TAME = st.sampled_from((0.0, 0.5, 1.0, -1.0, 2.0, 5.0, -3.0)) | st.floats(-6.0, 6.0)
WIDE = st.floats(-30.0, 29.9).map(lambda x: 10.0**x) | st.floats(-30.0, 29.9).map(
    lambda x: -(10.0**x)
)
ANY = st.floats()
NUMBER = st.one_of(TAME, TAME, TAME, TAME, WIDE, ANY)
"""Half of all vectors are of ordinary size, so that scenes have something to show."""
VECTOR = st.one_of(st.tuples(TAME, TAME, TAME), st.tuples(NUMBER, NUMBER, NUMBER))
SIZE = st.one_of(st.floats(1e-3, 3.0), WIDE.map(abs), ANY)
POWER = st.one_of(st.floats(0.0, 20.0), st.sampled_from((0.0, 5e-324, 1e12, 1e30)), ANY)
COLOR = st.tuples(POWER, POWER, POWER)
MATERIAL = st.builds(Material, st.tuples(*[st.floats(0.0, 1.0)] * 3))
MOTION = st.none() | st.builds(Motion, VECTOR)
SHADOW = st.booleans()
SPHERE = st.builds(Sphere, VECTOR, SIZE, MATERIAL, MOTION)
QUAD = st.builds(Quad, VECTOR, VECTOR, VECTOR, MATERIAL, MOTION)
LIGHT = st.one_of(
    st.builds(QuadLight, VECTOR, VECTOR, VECTOR, COLOR, MOTION, SHADOW),
    st.builds(SphereLight, VECTOR, SIZE, COLOR, MOTION, SHADOW),
    st.builds(DiskLight, VECTOR, SIZE, COLOR, MOTION, SHADOW),
    st.builds(PointLight, VECTOR, COLOR, MOTION, SHADOW),
)
LOOKING = st.builds(
    lambda place, motion, lens: look_at(
        place, (0.0, 0.0, 0.0), resolution=(6, 5), motion=motion, focal_length=lens
    ),
    st.tuples(st.floats(-4.0, 4.0), st.floats(-9.0, -0.5), st.floats(0.0, 5.0)),
    MOTION,
    st.floats(5.0, 200.0),
)
ODD = st.builds(
    Camera,
    st.tuples(*[st.tuples(NUMBER, NUMBER, NUMBER, NUMBER)] * 3),
    SIZE,
    SIZE,
    SIZE,
    st.sampled_from(("AUTO", "HORIZONTAL", "VERTICAL")),
    NUMBER,
    NUMBER,
    st.tuples(SIZE, SIZE),
    st.tuples(st.integers(1, 8), st.integers(1, 8)),
)
SCENE = st.builds(
    Scene,
    st.one_of(LOOKING, LOOKING, LOOKING, ODD),
    st.lists(SPHERE | QUAD, max_size=6).map(tuple),
    st.lists(LIGHT, max_size=4).map(tuple),
    COLOR,
    st.booleans(),
)
RAYS = Settings(method="RAYS", light_rays=3, time_rays=3, pixel_rays=3, threads=1)
WAYS = {
    "RAYS": (RAYS, replace(RAYS, order=1)),
    "EVERYWHERE": (replace(RAYS, distribution="EVERYWHERE"),),
    "hard": (replace(RAYS, use_penumbra=False, accelerator="EMBREE"),),
}
if "EXACT" in METHODS:
    WAYS["EXACT"] = (Settings(method="EXACT", tolerance=1e-2, threads=1),)


def finite(scene, way):
    """The film, if the scene has a picture, every number of which can be shown."""
    try:
        film = render_image(scene, way)
    except SceneError:
        return None
    for name in ("color", "alpha", "depth", "normal"):
        assert np.isfinite(getattr(film, name)).all(), name
    # what is left out does not count
    scene = validate(scene)
    # a background and an albedo may be of any sign; light is not
    if min(scene.background) >= 0.0 and min((min(_power(x)) for x in scene.lights), default=0) >= 0:
        assert (film.color >= 0.0).all()
        assert (film.color <= brightest(scene)[:, None, None]).all()
    assert ((film.alpha >= 0.0) & (film.alpha <= 1.0)).all() and (film.samples >= 1).all()
    return film


def _power(light):
    return light.intensity if isinstance(light, PointLight) else light.radiance


def attempt(scene, name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        films = [finite(scene, way) for way in WAYS[name]]
    if len(films) == 2 and films[0] is not None:
        assert not (films[0].mask & ~films[1].mask).any(), "order 1 flags a superset"


QUIET = {"deadline": None, "database": None, "suppress_health_check": list(HealthCheck)}


@pytest.mark.parametrize("name", WAYS)
@settings(max_examples=25, derandomize=True, **QUIET)
@given(scene=SCENE)
def test_any_scene(name, scene):
    attempt(scene, name)


@pytest.mark.slow
@pytest.mark.parametrize("name", WAYS)
@settings(max_examples=1_000, print_blob=True, **QUIET)
@given(scene=SCENE)
def test_any_scene_at_length(name, scene):
    attempt(scene, name)
