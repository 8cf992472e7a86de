# SPDX-License-Identifier: GPL-3.0-or-later
"""Bad and extreme scenes: a clear message or a right picture, never a NaN or a traceback."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from adaptive_drt.render import render_image
from adaptive_drt.scene.description import (
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
)
from adaptive_drt.scene.settings import Settings, SettingsError
from oracle.picture import reference
from random_scenes import look_at, scaled

pytestmark = pytest.mark.filterwarnings("error")

QUICK = Settings(method="RAYS", light_rays=4, time_rays=4, pixel_rays=4, threads=1)
CAMERA = look_at((0.0, -8.0, 4.0), (0.0, 0.0, 0.5), resolution=(20, 16))
MOVE = Motion((0.2, 0.1, 0.3))
FLOOR = Quad((-5.0, -5.0, 0.0), (10.0, 0.0, 0.0), (0.0, 10.0, 0.0), Material((0.8, 0.8, 0.8)))
BALL = Sphere((0.0, 0.0, 1.0), 0.8, motion=MOVE)
QUAD_LIGHT = QuadLight((0.0, 0.0, 5.0), (0.5, 0.0, 0.0), (0.0, -0.5, 0.0), (9.0,) * 3, MOVE)
SPHERE_LIGHT = SphereLight((2.0, -2.0, 4.0), 0.4, (9.0,) * 3, MOVE)
DISK_LIGHT = DiskLight((-2.0, -2.0, 4.0), 0.4, (9.0,) * 3, MOVE)
POINT_LIGHT = PointLight((1.0, -3.0, 4.0), (9.0,) * 3, MOVE)
SCENE = Scene(CAMERA, (FLOOR, BALL), (QUAD_LIGHT, SPHERE_LIGHT, DISK_LIGHT, POINT_LIGHT))

WAYS = [
    Settings(**{**QUICK.__dict__, "order": order, "distribution": d})
    for order, d in ((1, "ADAPTIVE"), (2, "ADAPTIVE"), (2, "EVERYWHERE"))
] + [Settings(method="EXACT", tolerance=1e-2, threads=1)]


def rendered(scene, settings=QUICK):
    """The film, after checking that every number of it can be shown."""
    film = render_image(scene, settings)
    for name in ("color", "alpha", "depth", "normal"):
        assert np.isfinite(getattr(film, name)).all(), name
    assert (film.color >= 0.0).all() and (film.samples >= 1).all()
    assert ((film.alpha >= 0.0) & (film.alpha <= 1.0)).all()
    return film


def reasons(film):
    return [issue["reason"] for issue in film.stats["issues"]]


def spoilt(thing):
    """Copies of a record with NaN or infinity in each number of each of its fields."""
    for field in fields(thing):
        value = getattr(thing, field.name)
        for bad in (math.nan, math.inf, -math.inf):
            if isinstance(value, Motion):
                yield field.name, replace(thing, motion=Motion((0.0, bad, 0.0)))
            elif isinstance(value, Material):
                yield field.name, replace(thing, material=Material((0.5, 0.5, bad)))
            elif isinstance(value, float):
                yield field.name, replace(thing, **{field.name: bad})
            elif isinstance(value, tuple) and isinstance(value[0], float):
                yield field.name, replace(thing, **{field.name: (*value[:-1], bad)})


def test_no_camera():
    with pytest.raises(SceneError, match="camera"):
        render_image(replace(SCENE, camera=None), QUICK)


@pytest.mark.parametrize("settings", WAYS)
def test_no_light_is_black(settings):
    scene = replace(SCENE, lights=(), background=(0.1, 0.2, 0.3), transparent=True)
    film = rendered(scene, settings)
    hit = film.alpha == 1.0
    assert reasons(film) and hit.any() and not film.color[:, hit].any()


@pytest.mark.parametrize("settings", WAYS)
def test_no_object_is_background(settings):
    film = rendered(replace(SCENE, shapes=(), background=(0.1, 0.2, 0.3)), settings)
    assert reasons(film)
    assert settings.distribution == "EVERYWHERE" or not film.mask.any()
    np.testing.assert_allclose(
        film.color,
        np.broadcast_to(0.1, film.color.shape) * np.arange(1.0, 4.0)[:, None, None],
        rtol=1e-12,
    )


def test_nothing_at_all():
    film = rendered(Scene(CAMERA))
    assert reasons(film) and not film.color.any()


@pytest.mark.parametrize(
    "thing",
    [FLOOR, BALL, QUAD_LIGHT, SPHERE_LIGHT, DISK_LIGHT, POINT_LIGHT],
    ids=lambda x: type(x).__name__,
)
def test_a_number_that_is_none_leaves_the_thing_out(thing):
    rest = replace(
        SCENE,
        shapes=tuple(s for s in SCENE.shapes if s is not thing),
        lights=tuple(x for x in SCENE.lights if x is not thing),
    )
    want = rendered(rest)
    for field, bad in spoilt(thing):
        if isinstance(thing, Quad | Sphere):
            scene = replace(rest, shapes=(*rest.shapes, bad))
        else:
            scene = replace(rest, lights=(*rest.lights, bad))
        film = rendered(scene)
        names = [issue["name"] for issue in film.stats["issues"]]
        assert thing.name in names, field
        np.testing.assert_array_equal(film.color, want.color, err_msg=field)


@pytest.mark.parametrize("field", [f.name for f in fields(CAMERA)])
def test_a_camera_that_forms_no_picture(field):
    value = getattr(CAMERA, field)
    for bad in (math.nan, math.inf):
        if field == "matrix":
            value = ((bad, *CAMERA.matrix[0][1:]), *CAMERA.matrix[1:])
        elif field == "motion":
            value = Motion((bad, 0.0, 0.0))
        elif field in ("resolution", "border", "sensor_fit"):
            value = {"resolution": (0, 5), "border": (5, 5, 5, 9), "sensor_fit": "ROUND"}[field]
        else:
            value = (bad, 1.0) if field == "pixel_aspect" else bad
        with pytest.raises(SceneError):
            render_image(replace(SCENE, camera=replace(CAMERA, **{field: value})), QUICK)


def test_a_camera_scaled_to_zero():
    matrix = tuple((0.0, 0.0, 0.0, row[3]) for row in CAMERA.matrix)
    with pytest.raises(SceneError, match="scale"):
        render_image(replace(SCENE, camera=replace(CAMERA, matrix=matrix)), QUICK)


@pytest.mark.parametrize(
    "bad",
    [
        replace(BALL, radius=0.0),
        replace(BALL, radius=-1.0),
        replace(FLOOR, edge_v=(0.0, 0.0, 0.0)),
        replace(FLOOR, edge_v=(20.0, 0.0, 0.0)),
        replace(QUAD_LIGHT, half_u=(0.0, 0.0, 0.0)),
        replace(QUAD_LIGHT, half_u=(0.0, -3.0, 0.0)),
        replace(SPHERE_LIGHT, radius=0.0),
        replace(DISK_LIGHT, radius=-0.1),
    ],
    ids=lambda x: f"{type(x).__name__}",
)
def test_no_size_is_told(bad):
    bad = replace(bad, name="Culprit")
    if isinstance(bad, Quad | Sphere):
        scene = replace(SCENE, shapes=(*SCENE.shapes, bad))
    else:
        scene = replace(SCENE, lights=(*SCENE.lights, bad))
    film = rendered(scene)
    assert [x["name"] for x in film.stats["issues"]] == ["Culprit"]
    np.testing.assert_array_equal(film.color, rendered(SCENE).color)


@pytest.mark.parametrize(
    "field,value",
    [
        ("order", 3),
        ("light_rays", 0),
        ("time_rays", -1),
        ("pixel_rays", 1.5),
        ("threads", -1),
        ("batch", 0),
        ("method", "GUESS"),
        ("distribution", "NOWHERE"),
        ("accelerator", "MAGIC"),
    ],
)
def test_a_setting_out_of_range(field, value):
    with pytest.raises(SettingsError, match=field):
        Settings(**{field: value})


def agree(scene, settings=QUICK):
    """The picture is right: as near the oracle's as both their sampling errors explain."""
    rendered(scene, settings)
    some = replace(settings, light_rays=32, time_rays=16, pixel_rays=16)
    one, two = (rendered(scene, replace(some, seed=seed)).color for seed in (1, 2))
    want, error = reference(scene, 128)
    size = max(want.mean(), 1e-300)
    off, spread, noise = (
        np.sqrt((x**2).mean()) / size for x in ((one + two) / 2.0 - want, one - two, error)
    )
    assert off < 0.03 + 3.0 * (spread + noise)


STILL_BALL = replace(BALL, motion=None)
EXTREMES = {
    "one pixel": replace(SCENE, camera=replace(CAMERA, resolution=(1, 1))),
    "one column": replace(SCENE, camera=replace(CAMERA, resolution=(1, 30))),
    "light inside a sphere": replace(
        SCENE, lights=(replace(SPHERE_LIGHT, center=(0.0, 0.0, 1.0), radius=0.2, motion=None),)
    ),
    "point light inside a sphere": replace(
        SCENE, lights=(replace(POINT_LIGHT, center=(0.0, 0.0, 1.0), motion=None), QUAD_LIGHT)
    ),
    "sphere inside a light": Scene(
        CAMERA, (FLOOR, Sphere((2.0, -2.0, 4.0), 0.1)), (SPHERE_LIGHT, QUAD_LIGHT)
    ),
    "camera inside a sphere": replace(
        SCENE,
        shapes=(FLOOR, Sphere((0.0, -8.0, 4.0), 1.0)),
        lights=(PointLight((0.2, -7.9, 4.3), (1.0,) * 3),),
    ),
    "camera and area light inside a sphere": Scene(
        CAMERA,
        (Sphere((0.0, -8.0, 4.0), 3.0), Sphere((0.0, -6.0, 3.2), 0.3)),
        (QuadLight((0.0, -7.0, 5.5), (0.3, 0.0, 0.0), (0.0, -0.3, 0.0), (3.0,) * 3),),
    ),
    "a sphere holds everything": replace(
        SCENE, shapes=(FLOOR, STILL_BALL, Sphere((0.0, 0.0, 0.0), 40.0))
    ),
    "camera in a quad's plane": Scene(
        look_at((0.0, -8.0, 1.0), (0.0, 0.0, 1.0), resolution=(21, 15)),
        (
            FLOOR,
            replace(
                FLOOR, corner=(-2.0, -2.0, 1.0), edge_u=(4.0, 0.0, 0.0), edge_v=(0.0, 4.0, 0.0)
            ),
        ),
        (QUAD_LIGHT, POINT_LIGHT),
    ),
    "no power": replace(
        SCENE,
        lights=(
            replace(QUAD_LIGHT, radiance=(0.0,) * 3),
            replace(POINT_LIGHT, intensity=(0.0,) * 3),
            DISK_LIGHT,
        ),
    ),
    "light in the floor's plane": replace(
        SCENE,
        lights=(
            QuadLight((1.0, -1.0, 0.0), (0.5, 0.0, 0.0), (0.0, 0.5, 0.0), (9.0,) * 3),
            POINT_LIGHT,
        ),
    ),
    "a sphere that grazes the floor": replace(SCENE, shapes=(FLOOR, Sphere((0.0, 0.0, 0.8), 0.8))),
    "motion of zero": replace(SCENE, shapes=(FLOOR, replace(BALL, motion=Motion((0.0,) * 3)))),
    "far away": replace(
        SCENE,
        camera=look_at(
            (0.0, -8e6, 4e6), (0.0, 0.0, 0.0), focal_length=50e6 / 8.0, resolution=(16, 12)
        ),
    ),
}


@pytest.mark.parametrize("settings", WAYS, ids=["order 1", "order 2", "everywhere", "exact"])
@pytest.mark.parametrize("name", EXTREMES)
def test_extremes_are_right(name, settings):
    agree(EXTREMES[name], settings)


@pytest.mark.parametrize("settings", WAYS, ids=["order 1", "order 2", "everywhere", "exact"])
def test_a_light_that_stands_on_the_floor_is_finite(settings):
    """Its light grows without bound towards the line where they meet, and jumps there."""
    half_u, half_v = (0.0, 0.5, 0.0), (0.0, 0.0, 0.5)
    light = QuadLight((1.0, -1.0, 0.0), half_u, half_v, (9.0,) * 3)
    rendered(replace(SCENE, lights=(light,)), settings)


@pytest.mark.parametrize("settings", WAYS, ids=["order 1", "order 2", "everywhere", "exact"])
def test_two_things_in_one_place_look_like_one(settings):
    """A copy left in place does not shadow what it coincides with."""
    one = rendered(replace(SCENE, shapes=(FLOOR, STILL_BALL)), settings)
    two = rendered(replace(SCENE, shapes=(FLOOR, STILL_BALL, STILL_BALL)), settings)
    # a copy may add flags, and a flagged pixel is sampled: the rest is the same to rounding
    same = (one.mask == two.mask).all(axis=0)
    assert same.mean() > 0.9
    np.testing.assert_allclose(two.color[:, same], one.color[:, same], rtol=1e-9)


@pytest.mark.parametrize("factor", [1e-12, 1e-6, 1e6, 1e12])
def test_size_does_not_matter(factor):
    """The same picture from a scene of another size; powers of ten round a little otherwise."""
    film, other = rendered(SCENE), rendered(scaled(SCENE, factor))
    same = np.isclose(film.color, other.color, rtol=1e-6, atol=1e-9).all(axis=0)
    assert same.mean() > 0.99
    assert (film.mask == other.mask).mean() > 0.99


@pytest.mark.parametrize("size", [1e15, 1e25, 1e29])
@pytest.mark.parametrize("settings", WAYS, ids=["order 1", "order 2", "everywhere", "exact"])
def test_huge_coordinates_do_not_break_it(size, settings):
    for thing in (
        Sphere((size, 0.0, 0.0), 1.0),
        Sphere((0.0, size, 0.0), size / 2.0),
        Quad((-size, size, -size), (2.0 * size, 0.0, 0.0), (0.0, 0.0, 2.0 * size)),
    ):
        rendered(replace(SCENE, shapes=(*SCENE.shapes, thing)), settings)
        moving = replace(BALL, motion=Motion((size, 0.0, 0.0)))
        rendered(replace(SCENE, shapes=(FLOOR, moving)), settings)
    light = replace(QUAD_LIGHT, center=(0.0, 0.0, size), half_u=(size / 10.0, 0.0, 0.0))
    rendered(replace(SCENE, lights=(light, replace(POINT_LIGHT, center=(0.0, size, size)))))


def test_light_at_a_surface_point_is_finite():
    """A point light exactly on the floor under the middle pixel, and at the camera."""
    camera = look_at((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), resolution=(9, 9))
    for center in ((0.0, 0.0, 0.0), (0.0, 0.0, 5.0)):
        lights = tuple(
            replace(x, center=center, motion=None)
            for x in (QUAD_LIGHT, SPHERE_LIGHT, DISK_LIGHT, POINT_LIGHT)
        )
        for settings in WAYS:
            rendered(Scene(camera, (FLOOR,), lights), settings)


def test_passes_of_a_bad_scene_are_finite():
    film = rendered(replace(SCENE, shapes=()))
    for name in ("Combined", "Depth", "Normal", "Adaptive Mask", "Sample Count"):
        assert np.isfinite(film.pixels(name)).all()
