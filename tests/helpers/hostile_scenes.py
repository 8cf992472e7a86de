# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes made to break a renderer: named ones, and random scenes spoilt at random by seed."""

from dataclasses import replace

import numpy as np

from adaptive_drt.scene.description import (
    Camera,
    DiskLight,
    Material,
    Motion,
    PointLight,
    Quad,
    QuadLight,
    Scene,
    Sphere,
    SphereLight,
)
from random_scenes import look_at, random_scene, scaled

__all__ = ["HOSTILE", "REFUSED", "brightest", "hostile_scene"]

CAMERA = look_at((0.0, -8.0, 4.0), (0.0, 0.0, 0.5), resolution=(20, 16))
EYE = (0.0, -8.0, 4.0)
FLOOR = Quad((-5.0, -5.0, 0.0), (10.0, 0.0, 0.0), (0.0, 10.0, 0.0))
BALL = Sphere((0.0, 0.0, 1.0), 0.8)
LAMP = QuadLight((0.0, 0.0, 5.0), (0.5, 0.0, 0.0), (0.0, -0.5, 0.0), (9.0,) * 3)
BULB = SphereLight((2.0, -2.0, 4.0), 0.4, (9.0,) * 3)
SPOT = DiskLight((-2.0, -2.0, 4.0), 0.4, (9.0,) * 3)
DOT = PointLight((1.0, -3.0, 4.0), (9.0,) * 3)
LIGHTS = (LAMP, BULB, SPOT, DOT)
SCENE = Scene(CAMERA, (FLOOR, BALL), LIGHTS, (0.1, 0.2, 0.3))
DENORMAL = 5e-324


def _with(*shapes, lights=LIGHTS, **camera):
    return replace(SCENE, shapes=shapes, lights=lights, camera=replace(CAMERA, **camera))


def _all(**fields):
    """Each light with fields that all kinds have."""
    return tuple(replace(light, **fields) for light in LIGHTS)


def _shining(power):
    lights = (replace(x, radiance=(power,) * 3) for x in LIGHTS[:3])
    return (*lights, replace(DOT, intensity=(power,) * 3))


def _matrix(columns):
    """A camera's matrix from its axes and place."""
    rows = np.array(columns, dtype=float).T
    return (*(tuple(float(x) for x in row) for row in rows), (0.0, 0.0, 0.0, 1.0))


AXES = np.array(CAMERA.matrix)[:3].T

HOSTILE = {
    "zero-area quads": _with(
        FLOOR,
        BALL,
        replace(FLOOR, edge_v=(0.0,) * 3),
        replace(FLOOR, edge_u=(3.0, 3.0, 3.0), edge_v=(1.0, 1.0, 1.0)),
        replace(FLOOR, edge_u=(0.1, 0.3, 0.7), edge_v=(0.03, 0.09, 0.21)),
    ),
    "slivers": _with(
        FLOOR,
        BALL,
        Quad((-3.0, -1.0, 1.5), (6.0, 0.0, 0.0), (6.0, 1e-14, 0.0)),
        Quad((-3.0, -2.0, 1.5), (6.0, 0.0, 0.0), (0.0, 0.0, 1e-300)),
        lights=(
            replace(LAMP, half_u=(1e-9, 0.0, 0.0)),
            replace(LAMP, half_u=(0.5, -1e-13, 0.0), half_v=(0.5, 1e-13, 0.0)),
            replace(LAMP, half_u=(1e-160, 0.0, 0.0), half_v=(0.0, -1e-160, 0.0)),
            DOT,
        ),
    ),
    "zero-area lights": _with(
        FLOOR,
        BALL,
        lights=(
            replace(LAMP, half_u=(0.0,) * 3),
            replace(LAMP, half_u=(0.0, -3.0, 0.0)),
            replace(BULB, radius=0.0),
            replace(SPOT, radius=DENORMAL),
            DOT,
        ),
    ),
    "coincident surfaces": _with(
        FLOOR,
        BALL,
        FLOOR,
        BALL,
        replace(FLOOR, edge_u=FLOOR.edge_v, edge_v=FLOOR.edge_u, material=Material((0.9, 0, 0))),
        replace(FLOOR, corner=(-2.0, -2.0, 0.0)),
        replace(BALL, radius=0.8 + 1e-16),
        replace(BALL, radius=0.8 * (1.0 + 1e-13), center=(1e-14, 0.0, 1.0)),
    ),
    "a thousand coincident spheres": _with(FLOOR, *[BALL] * 1_000, resolution=(6, 5)),
    "a thousand coincident quads": _with(
        FLOOR,
        *[replace(FLOOR, corner=(-1.0, -1.0, 2.0), edge_u=(2.0, 0.0, 0.0))] * 1_000,
        resolution=(6, 5),
    ),
    "three thousand spheres in one place": _with(FLOOR, *[BALL] * 3_000, resolution=(4, 4)),
    "a sphere holds the lights": _with(
        FLOOR, BALL, Sphere((0.0, -1.0, 4.0), 3.0), Sphere((2.0, -2.0, 4.0), 0.4)
    ),
    "a sphere is the light": _with(FLOOR, Sphere(BULB.center, BULB.radius)),
    "a quad is the light": _with(FLOOR, Quad((-0.5, -0.5, 5.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))),
    "lights hold the camera": _with(
        FLOOR,
        BALL,
        lights=(
            SphereLight(EYE, 2.0, (3.0,) * 3),
            SphereLight((0.0, -7.0, 4.0), 1.0, (3.0,) * 3),
            DiskLight(EYE, 2.0, (3.0,) * 3),
            QuadLight(EYE, (2.0, 0.0, 0.0), (0.0, -2.0, 0.0), (3.0,) * 3),
            PointLight(EYE, (3.0,) * 3),
        ),
    ),
    "a light holds everything": _with(
        FLOOR,
        BALL,
        lights=(
            SphereLight((0.0, 0.0, 0.0), 100.0, (1.0,) * 3),
            DiskLight((0.0, 0.0, 0.0), 100.0, (1.0,) * 3),
        ),
    ),
    "the camera in a surface": _with(
        FLOOR, BALL, Sphere((0.0, -8.0, 3.0), 1.0), Quad((-1.0, -9.0, 4.0), (2, 0, 0), (0, 2, 0))
    ),
    "the camera in the middle of things": _with(
        FLOOR,
        BALL,
        Sphere((0.5, 0.0, 1.5), 0.8),
        Sphere(EYE, 50.0),
        Quad((-70.0, -78.0, 4.0), (140.0, 0.0, 0.0), (0.0, 140.0, 0.0)),
    ),
    "denormals": _with(
        FLOOR,
        BALL,
        Sphere((0.0, 0.0, 3.0), DENORMAL),
        Sphere((DENORMAL, 1e-310, 3.0), 1e-200),
        Quad((0.0, -2.0, 1.0), (1e-310, 0.0, 0.0), (0.0, 1.0, 0.0)),
        Quad((0.0, -2.0, 1.0), (1e-170, 0.0, 0.0), (0.0, 1e-170, 0.0)),
        replace(BALL, center=(1e-320, -1.0, 0.4), radius=0.4, motion=Motion((1e-310, 0.0, 0.0))),
        lights=(
            replace(LAMP, radiance=(DENORMAL,) * 3, motion=Motion((0.0, DENORMAL, 0.0))),
            replace(BULB, radius=1e-310),
            replace(DOT, intensity=(1e-310, 0.0, 1.0)),
            replace(LAMP, half_u=(1e-310, 0.0, 0.0)),
        ),
    ),
    "1e30": _with(
        FLOOR,
        BALL,
        Sphere((1e30, 0.0, 0.0), 1.0),
        Sphere((0.0, 1e30, 0.0), 9.9e29),
        Sphere((0.0, 0.0, -9e29), 9e29),
        Quad((-1e30, 1e30, -1e30), (1e30, 0.0, 0.0), (0.0, 0.0, 1e30)),
        Quad((-1e30, -1e30, -1.0), (1e30, 0.0, 0.0), (0.0, 1e30, 0.0), motion=Motion((0, 0, 1e30))),
        replace(BALL, motion=Motion((1e30, 1e30, 1e30))),
        lights=(
            replace(LAMP, center=(0.0, 0.0, 1e30), half_u=(1e30, 0.0, 0.0)),
            replace(LAMP, half_u=(1e30, 0.0, 0.0), half_v=(0.0, -1e30, 0.0)),
            replace(BULB, center=(1e30, 1e30, 1e30), radius=9e29),
            replace(SPOT, radius=9e29),
            replace(DOT, center=(1e30, 1e30, 1e30), motion=Motion((-1e30, 0.0, 0.0))),
        ),
    ),
    "the camera at 1e30": scaled(SCENE, 1e29),
    "seams at 1e29": scaled(
        _with(
            replace(FLOOR, corner=(-5.0, -5.0, 0.3)),
            BALL,
            replace(BALL, center=(0.5, 0.0, 1.0)),
            Quad((-1.0, 0.0, 0.0), (2.0, 0.3, 0.0), (0.0, 0.0, 2.0)),
        ),
        1e28,
    ),
    "a scene of 1e-30": scaled(SCENE, 1e-30),
    "motion through the camera": _with(
        FLOOR,
        Sphere(EYE, 0.5, motion=Motion((0.0, 8.0, -4.0))),
        Sphere((0.0, 0.0, 0.5), 0.5, motion=Motion((0.0, -20.0, 10.0))),
        Quad((-1.0, -8.5, 4.0), (2.0, 0, 0), (0, 1.0, 0.3), motion=Motion((0.0, 0.0, 3.0))),
        lights=(
            replace(LAMP, center=EYE, motion=Motion((0.0, 9.0, 1.0))),
            replace(BULB, motion=Motion((-4.0, -12.0, 0.0))),
            replace(DOT, center=(0.0, 0.0, 4.0), motion=Motion((0.0, -16.0, 0.0))),
        ),
    ),
    "motion through the lights": _with(
        FLOOR,
        Sphere(LAMP.center, 0.6, motion=Motion((3.0, 0.0, 0.0))),
        Sphere(BULB.center, 0.2, motion=Motion((0.0, 3.0, 0.0))),
        Quad((-2.5, -2.5, 4.0), (1.0, 0, 0), (0, 1.0, 0), motion=Motion((0.0, 0.0, 2.0))),
        Sphere(DOT.center, 0.1, motion=Motion((0.0, 0.0, 0.2))),
    ),
    "zero-length shutter": _with(
        replace(FLOOR, motion=Motion((0.0,) * 3)),
        replace(BALL, motion=Motion((0.0, -0.0, 0.0))),
        lights=_all(motion=Motion((0.0,) * 3)),
        motion=Motion((0.0,) * 3),
    ),
    "all moves with the camera": _with(
        replace(FLOOR, motion=Motion((3.0, 2.0, 1.0))),
        replace(BALL, motion=Motion((3.0, 2.0, 1.0))),
        lights=_all(motion=Motion((3.0, 2.0, 1.0))),
        motion=Motion((3.0, 2.0, 1.0)),
    ),
    "0 W": _with(FLOOR, BALL, lights=_shining(0.0)),
    "1e12 W": _with(FLOOR, BALL, lights=_shining(1e12)),
    "1e30 W": _with(FLOOR, BALL, lights=_shining(1e30)),
    "one pixel": _with(FLOOR, BALL, resolution=(1, 1)),
    "a row of pixels": _with(FLOOR, BALL, resolution=(16_384, 1), focal_length=20.0),
    "a column of pixels": _with(FLOOR, BALL, resolution=(1, 2_048)),
    "a lens of a million metres": _with(FLOOR, BALL, focal_length=1e9),
    "a lens of a nanometre": _with(FLOOR, BALL, focal_length=1e-6),
    "pixels a million times as high": _with(FLOOR, BALL, pixel_aspect=(1e-3, 1e3)),
    "a shift far out of the picture": _with(FLOOR, BALL, shift_x=1e6, shift_y=-1e6),
    "a camera scaled to 1e-200": _with(
        FLOOR, BALL, matrix=_matrix([*(AXES[:3] * 1e-200), AXES[3]])
    ),
    "a sheared camera": _with(
        FLOOR, BALL, matrix=_matrix([AXES[0] + 0.5 * AXES[1], AXES[1], AXES[2], AXES[3]])
    ),
    "point lights on surfaces": Scene(
        look_at((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), resolution=(9, 9)),
        (FLOOR, Sphere((0.0, 0.0, 0.5), 0.5)),
        tuple(replace(x, center=(0.0, 0.0, 1.0)) for x in LIGHTS),
    ),
}


REFUSED = {
    "a lens of nothing": _with(FLOOR, BALL, focal_length=1e-30),
    "a lens beyond all": _with(FLOOR, BALL, focal_length=1e30),
    "pixels without a width": _with(FLOOR, BALL, pixel_aspect=(1e-20, 1e20)),
    "a shift of 1e20": _with(FLOOR, BALL, shift_x=1e20),
    "a camera squashed flat": _with(
        FLOOR, BALL, matrix=_matrix([AXES[0], AXES[0] * 1.1, AXES[2], AXES[3]])
    ),
}
"""Cameras that form no picture: an error that says why."""


def brightest(scene):
    """(3,) what no pixel exceeds under area lights alone: all they send, and the background."""
    light = np.array(scene.background, dtype=float)
    for x in scene.lights:
        if isinstance(x, PointLight):
            return np.full(3, np.inf)
        light = light + np.array(x.radiance)
    return light * (1.0 + 1e-9)


EXTREME = (0.0, -0.0, DENORMAL, 1e-310, 1e-160, 1e-30, 1e-9, 1.0, 1e9, 1e29)


def hostile_scene(seed):
    """A random scene in which a few things went wrong."""
    rng = np.random.default_rng((seed, 4))
    scene = random_scene(seed)
    scene = replace(scene, camera=replace(scene.camera, resolution=(12, 9)))
    for _ in range(rng.integers(1, 5)):
        scene = TRICKS[rng.integers(len(TRICKS))](scene, rng)
    return scene


def _some(rng, things):
    return int(rng.integers(len(things)))


def _put(things, index, thing):
    return (*things[:index], thing, *things[index + 1 :])


def _spoil(thing, rng):
    """The thing with one of its numbers at an extreme."""
    names = ("center", "corner", "edge_u", "edge_v", "half_u", "half_v", "radius", "motion")
    names = [name for name in names if hasattr(thing, name)]
    name = names[rng.integers(len(names))]
    value = float(rng.choice(EXTREME) * rng.choice([-1.0, 1.0]))
    if name == "radius":
        return replace(thing, radius=value)
    vector = [0.0, 0.0, 0.0] if name == "motion" else list(getattr(thing, name))
    vector[rng.integers(3)] = value
    vector = tuple(vector)
    return replace(thing, **{name: Motion(vector) if name == "motion" else vector})


def _spoil_shape(scene, rng):
    k = _some(rng, scene.shapes)
    return replace(scene, shapes=_put(scene.shapes, k, _spoil(scene.shapes[k], rng)))


def _spoil_light(scene, rng):
    k = _some(rng, scene.lights)
    return replace(scene, lights=_put(scene.lights, k, _spoil(scene.lights[k], rng)))


def _copy(scene, rng):
    """Copies of a shape in its own place, some a hair larger."""
    shape = scene.shapes[_some(rng, scene.shapes)]
    copies = [shape] * int(rng.choice([1, 3, 100]))
    if isinstance(shape, Sphere):
        copies.append(replace(shape, radius=shape.radius * (1.0 + 10.0 ** rng.uniform(-17, -1))))
    return replace(scene, shapes=(*scene.shapes, *copies))


def _hold(scene, rng):
    """A sphere around a light, or a light around the camera."""
    k = _some(rng, scene.lights)
    light = scene.lights[k]
    if rng.random() < 0.5:
        return replace(scene, shapes=(*scene.shapes, Sphere(light.center, float(rng.random() * 2))))
    place = tuple(row[3] for row in scene.camera.matrix[:3])
    return replace(scene, lights=_put(scene.lights, k, replace(light, center=place)))


def _rest(scene, rng):
    """Things that touch each other or the camera."""
    place = np.array([row[3] for row in scene.camera.matrix[:3]])
    radius = float(10.0 ** rng.uniform(-9, 0))
    way = rng.normal(size=3)
    center = place + radius * way / np.linalg.norm(way)
    return replace(scene, shapes=(*scene.shapes, Sphere(tuple(center.tolist()), radius)))


def _cross(scene, rng):
    """Something that moves through the camera or through a light."""
    goal = [row[3] for row in scene.camera.matrix[:3]]
    if rng.random() < 0.5:
        goal = list(scene.lights[_some(rng, scene.lights)].center)
    k = _some(rng, scene.shapes)
    shape = scene.shapes[k]
    start = np.array(shape.center if isinstance(shape, Sphere) else shape.corner)
    move = Motion(tuple((2.0 * (np.array(goal) - start)).tolist()))
    return replace(scene, shapes=_put(scene.shapes, k, replace(shape, motion=move)))


def _power(scene, rng):
    k = _some(rng, scene.lights)
    light = scene.lights[k]
    name = "intensity" if isinstance(light, PointLight) else "radiance"
    power = (float(rng.choice([0.0, DENORMAL, 1e-30, 1e12, 1e30])),) * 3
    return replace(scene, lights=_put(scene.lights, k, replace(light, **{name: power})))


def _lens(scene, rng):
    changes = (
        {"focal_length": float(10.0 ** rng.uniform(-9, 9))},
        {"sensor_width": float(10.0 ** rng.uniform(-9, 9))},
        {"pixel_aspect": (1.0, float(10.0 ** rng.uniform(-6, 6)))},
        {"shift_x": float(10.0 ** rng.uniform(-3, 6))},
        {"resolution": (int(rng.integers(1, 200)), 1)},
    )
    fields = changes[rng.integers(len(changes))]
    camera = Camera(**{**scene.camera.__dict__, **fields})
    return replace(scene, camera=camera)


def _resize(scene, rng):
    try:
        return scaled(scene, float(10.0 ** rng.uniform(-40, 25)))
    except OverflowError:
        return scene


TRICKS = (
    _spoil_shape,
    _spoil_shape,
    _spoil_light,
    _copy,
    _hold,
    _rest,
    _cross,
    _power,
    _lens,
    _resize,
)
