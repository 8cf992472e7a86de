# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmark's scenes, one record each, from which every renderer's own scene is made.

Metres, Z up. All lights are rectangles and spheres and all objects spheres and rectangles, which
Cycles (point clouds) and Mitsuba render as such. Lights that move are rectangles.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from adaptive_drt.scene.description import (
    Camera,
    Light,
    Material,
    Motion,
    Quad,
    QuadLight,
    Scene,
    Shape,
    Sphere,
    SphereLight,
    Vector,
)

__all__ = ["SCENES", "bench_scene", "moves"]

FLOOR = Quad(
    (-15.0, -10.0, 0.0),
    (30.0, 0.0, 0.0),
    (0.0, 25.0, 0.0),
    Material((0.62, 0.60, 0.56)),
    name="Floor",
)
WALL = Quad(
    (-15.0, 5.5, -0.5),
    (30.0, 0.0, 0.0),
    (0.0, 1.5, 9.0),
    Material((0.45, 0.55, 0.70)),
    name="Wall",
)
BALLS = (
    Sphere((-2.5, 0.0, 0.95), 0.95, Material((0.72, 0.16, 0.12)), name="Left"),
    Sphere((0.0, -0.4, 1.05), 0.80, Material((0.80, 0.66, 0.16)), name="Middle"),
    Sphere((2.5, 0.0, 0.95), 0.95, Material((0.14, 0.50, 0.20)), name="Right"),
    Sphere((-1.3, 2.6, 0.95), 0.95, Material((0.14, 0.26, 0.72)), name="Behind left"),
    Sphere((1.3, 2.6, 1.40), 0.95, Material((0.55, 0.20, 0.60)), name="Behind right"),
)
SQUARE = QuadLight(
    (-1.8, -1.4, 5.5), (0.9, 0.0, 0.0), (0.0, -0.9, 0.0), (20.0, 19.4, 18.0), name="Q"
)
BULB = SphereLight((2.6, -2.4, 4.6), 0.45, (30.0, 32.0, 36.0), name="B")
TILTED = QuadLight(
    (-4.5, -3.0, 3.5), (0.5, -0.5, 0.0), (-0.2, -0.2, -0.9), (9.0, 7.0, 5.0), name="T"
)
"""Lights are out of the picture, and so are shadows of them: Mitsuba's lights block light."""


def _camera(width: int, height: int) -> Camera:
    """Eye at the front, above; the lens is 45 mm for a square, and wider pictures see more."""
    eye, target = np.array((0.0, -8.5, 5.2)), np.array((0.0, 0.6, 0.45))
    back = (eye - target) / np.linalg.norm(eye - target)
    right = np.cross((0.0, 0.0, 1.0), back)
    right /= np.linalg.norm(right)
    columns = np.stack([right, np.cross(back, right), back, eye], axis=1)
    matrix = (*(tuple(map(float, row)) for row in columns), (0.0, 0.0, 0.0, 1.0))
    lens = 45.0 * min(width, height) / max(width, height)
    return Camera(matrix=matrix, focal_length=lens, resolution=(width, height))


def _moving(thing: Shape | Light, way: Vector) -> Shape | Light:
    return replace(thing, motion=Motion(way))


Content = tuple[tuple[Shape, ...], tuple[Light, ...]]


def _quad_penumbra() -> Content:
    return (*BALLS, FLOOR, WALL), (SQUARE,)


def _sphere_penumbra() -> Content:
    return (*BALLS, FLOOR, WALL), (BULB,)


def _three_lights() -> Content:
    return (*BALLS, FLOOR, WALL), (SQUARE, BULB, TILTED)


def _contact() -> Content:
    """Spheres that rest on the floor, crumbs, and plates, under a wide light."""
    rng = np.random.default_rng(3)
    crumbs = []
    for place in rng.uniform((-3.5, -2.5), (3.5, 2.5), (24, 2)):
        radius = float(rng.uniform(0.04, 0.16))
        x, y = map(float, place)
        crumbs.append(Sphere((x, y, radius), radius, Material((0.75, 0.5, 0.3)), name="Crumb"))
    hung = [
        Sphere((1.1 * k, -1.6, 1.1), 0.09, Material((0.3, 0.6, 0.7))) for k in (-2, -1, 0, 1, 2)
    ]
    plates = (
        Quad((-2.2, 1.0, 0.35), (1.4, 0.3, 0.0), (-0.2, 1.1, 0.25), Material((0.7, 0.3, 0.3))),
        Quad((1.0, 0.4, 0.001), (1.2, 0.5, 0.0), (0.0, 0.0, 0.8), Material((0.3, 0.65, 0.35))),
    )
    pair = (
        Sphere((-0.3, 2.6, 0.7), 0.7, Material((0.8, 0.7, 0.2))),
        Sphere((0.9, 3.0, 0.45), 0.45, Material((0.5, 0.3, 0.7))),
    )
    wide = QuadLight((0.0, 0.5, 4.5), (1.8, 0.0, 0.0), (0.0, -1.2, 0.0), (6.0, 6.0, 6.0), name="W")
    return (*crumbs, *hung, *pair, *plates, FLOOR, WALL), (wide,)


def _moving_sphere() -> Content:
    ways = {"Middle": (1.3, 0.0, 0.0), "Behind right": (-0.2, 0.1, 0.9)}
    balls = tuple(_moving(b, ways[b.name]) if b.name in ways else b for b in BALLS)
    return (*balls, FLOOR, WALL), (SQUARE,)


def _moving_caster() -> Content:
    """What moves hangs between the light and the picture, above what the camera sees."""
    caster = Sphere((-1.9, -1.6, 3.4), 0.45, Material((0.5, 0.5, 0.5)), name="Caster")
    light = replace(SQUARE, center=(-3.2, -3.0, 6.5))
    return (*BALLS, _moving(caster, (1.2, 0.5, 0.0)), FLOOR, WALL), (light,)


def _moving_light() -> Content:
    return (*BALLS, FLOOR, WALL), (_moving(SQUARE, (1.5, 0.4, 0.0)),)


def _four_hundred() -> Content:
    rng = np.random.default_rng(400)
    places = rng.uniform((-4.5, -3.5, 0.15), (4.5, 4.5, 2.2), (400, 3)).tolist()
    radii = rng.uniform(0.05, 0.13, 400).tolist()
    colors = rng.uniform(0.2, 0.9, (400, 3)).tolist()
    balls = [
        Sphere(tuple(place), radius, Material(tuple(color)))
        for place, radius, color in zip(places, radii, colors, strict=True)
    ]
    return (*balls, FLOOR, WALL), (SQUARE,)


def _all() -> Content:
    ways = {"Middle": (0.8, 0.0, 0.0), "Behind right": (-0.2, 0.1, 0.6)}
    balls = tuple(_moving(b, ways[b.name]) if b.name in ways else b for b in BALLS)
    crumbs = _contact()[0][:24]
    plate = Quad((-3.9, -1.6, 0.5), (0.9, 0.2, 0.1), (0.0, 0.8, 0.4), Material((0.7, 0.4, 0.4)))
    caster = Sphere((1.4, -1.6, 3.3), 0.3, Material((0.5, 0.5, 0.5)), name="Caster")
    lights = (_moving(SQUARE, (0.8, 0.3, 0.0)), BULB, TILTED)
    return (*balls, *crumbs, plate, _moving(caster, (-0.9, 0.4, 0.0)), FLOOR, WALL), lights


SCENES: dict[str, Callable[[], Content]] = {
    "quad light": _quad_penumbra,
    "spherical light": _sphere_penumbra,
    "three lights": _three_lights,
    "contact shadows": _contact,
    "moving sphere": _moving_sphere,
    "moving caster": _moving_caster,
    "moving light": _moving_light,
    "400 spheres": _four_hundred,
    "all at once": _all,
}
"""What there is to render, by the names that the report and the command line use."""


def bench_scene(name: str, width: int = 300, height: int = 300) -> Scene:
    """One of `SCENES` at a size in pixels. Nothing hit is black."""
    shapes, lights = SCENES[name]()
    return Scene(_camera(width, height), shapes, lights)


def moves(scene: Scene) -> bool:
    """Whether anything moves within the shutter."""
    camera = () if scene.camera is None else (scene.camera,)
    return any(thing.motion is not None for thing in (*scene.shapes, *scene.lights, *camera))
