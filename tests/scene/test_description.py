# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes that are checked: what can be rendered is kept, and all else is named with a reason."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adaptive_drt.scene.description import (
    Camera,
    DiskLight,
    Issue,
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
    vector_of,
)
from random_scenes import random_scene

GOOD = (
    Sphere((1.0, 2.0, 3.0), 0.5, name="one"),
    Quad((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), name="two"),
    QuadLight((0.0, 0.0, 4.0), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (1.0, 1.0, 1.0), name="three"),
    SphereLight((0.0, 0.0, 4.0), 0.5, (1.0, 1.0, 1.0), name="four"),
    DiskLight((0.0, 0.0, 4.0), 0.5, (1.0, 1.0, 1.0), name="five"),
    PointLight((0.0, 0.0, 4.0), (1.0, 1.0, 1.0), name="six"),
)
VECTORS = ("center", "corner", "edge_u", "edge_v", "half_u", "half_v", "radiance", "intensity")
BAD_NUMBERS = (np.nan, np.inf, -np.inf, 1e31)


def scene_of(*things):
    shapes = tuple(thing for thing in things if isinstance(thing, Sphere | Quad))
    return Scene(Camera(), shapes, tuple(thing for thing in things if thing not in shapes))


def assert_left_out(bad, reason):
    """What is bad is left out with its name; all else stays, in its order."""
    others = tuple(thing for thing in GOOD if thing.name != bad.name)
    kept = validate(scene_of(*others, bad))
    assert kept.shapes + kept.lights == others
    assert len(kept.issues) == 1 and kept.issues[0].name == bad.name
    assert kept.issues[0].missing and reason in kept.issues[0].reason


@pytest.mark.parametrize("seed", range(50))
def test_good_scenes_are_kept_as_they_are(seed):
    scene = random_scene(seed)
    assert validate(scene) == scene


@pytest.mark.parametrize("number", BAD_NUMBERS)
@pytest.mark.parametrize("thing", GOOD, ids=lambda thing: type(thing).__name__)
def test_numbers_that_are_none_leave_a_thing_out(thing, number):
    for name in VECTORS:
        if hasattr(thing, name):
            for k in range(3):
                broken = list(getattr(thing, name))
                broken[k] = number
                assert_left_out(replace(thing, **{name: tuple(broken)}), name)
    assert_left_out(replace(thing, motion=Motion((0.0, number, 0.0))), "motion")
    if hasattr(thing, "material"):
        assert_left_out(replace(thing, material=Material((number, 0.5, 0.5))), "colour")
    if hasattr(thing, "radius"):
        assert_left_out(replace(thing, radius=number), "radius")


@pytest.mark.parametrize("radius", [0.0, -1.0, 1e-61])
@pytest.mark.parametrize("thing", [GOOD[0], GOOD[3], GOOD[4]], ids=lambda t: type(t).__name__)
def test_radii_are_positive(thing, radius):
    assert_left_out(replace(thing, radius=radius), "radius")


@pytest.mark.parametrize("u, v", [
    ((0.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    ((1.0, 2.0, 3.0), (-2.0, -4.0, -6.0)),
    ((1.0, 0.0, 0.0), (1.0, 1e-17, 0.0)),
    ((1e-61, 0.0, 0.0), (0.0, 1.0, 0.0)),
])  # fmt: skip
def test_parallelograms_have_an_area(u, v):
    assert_left_out(replace(GOOD[1], edge_u=u, edge_v=v), "no area")
    assert_left_out(replace(GOOD[2], half_u=u, half_v=v), "no area")
    # long and thin ones have
    thin = replace(GOOD[1], edge_u=(1e8, 0.0, 0.0), edge_v=(0.0, 1e-8, 0.0))
    assert validate(scene_of(thin)).shapes == (thin,)


def test_backgrounds_are_finite():
    kept = validate(
        replace(scene_of(*GOOD), background=(0.0, np.nan, 0.0), issues=(Issue("a", "b"),))
    )
    assert kept.background == (0.0, 0.0, 0.0)
    assert [issue.name for issue in kept.issues] == ["a", "World"]


def matrix(*columns):
    """Rows of a camera's matrix from its x, y and z axes."""
    rows = np.zeros((4, 4))
    rows[:3, :3], rows[3, 3] = np.array(columns).T, 1.0
    return tuple(map(tuple, rows.tolist()))


X, Y, Z = np.eye(3)


@pytest.mark.parametrize("changes, message", [
    ({"matrix": matrix(X, Y, Z)[:2]}, "3 or 4 rows"),
    ({"matrix": matrix(X, Y, Z * np.nan)}, "not finite"),
    ({"matrix": matrix(X, Y, 0 * Z)}, "scaled to zero"),
    ({"matrix": matrix(X, Y, X + Y)}, "squashed flat"),
    ({"motion": Motion((np.inf, 0.0, 0.0))}, "motion"),
    ({"resolution": (0, 5)}, "no pixels"),
    ({"border": (5, 5, 5, 9)}, "border"),
    ({"border": (0, 0, 301, 9)}, "border"),
    ({"border": (-1, 0, 3, 9)}, "border"),
    ({"focal_length": 0.0}, "above zero"),
    ({"sensor_width": np.nan}, "above zero"),
    ({"pixel_aspect": (1.0, -1.0)}, "above zero"),
    ({"shift_x": np.inf}, "shift"),
    ({"focal_length": 1e11}, "too far apart"),
    ({"pixel_aspect": (1e6, 1e-6)}, "too far apart"),
    ({"sensor_fit": "WIDE"}, "sensor fit"),
])  # fmt: skip
def test_cameras_that_form_no_picture_are_refused(changes, message):
    with pytest.raises(SceneError, match=message):
        validate(Scene(replace(Camera(), **changes)))


def test_a_scene_without_a_camera_is_refused():
    with pytest.raises(SceneError, match="no camera"):
        validate(Scene())


def test_regions_are_borders_or_everything():
    assert Camera(resolution=(7, 5)).region == (0, 0, 7, 5)
    assert Camera(resolution=(7, 5), border=(1, 2, 3, 4)).region == (1, 2, 3, 4)


def test_vectors_are_tuples_of_floats():
    found = vector_of(np.arange(3))
    assert found == (0.0, 1.0, 2.0) and all(type(x) is float for x in found)
    with pytest.raises(ValueError):
        vector_of((1.0, 2.0))
