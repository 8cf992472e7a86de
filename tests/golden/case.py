# SPDX-License-Identifier: GPL-3.0-or-later
"""A golden case: a scene and the settings it is rendered with, and the parts that scenes share.

All numbers come from +, -, *, / and square roots, which IEEE 754 rounds alike everywhere: a scene
is the same to the last bit on every machine. So no NumPy here: its dot products may round
otherwise elsewhere.
"""

import math
from dataclasses import dataclass, replace

from adaptive_drt.render import render_image
from adaptive_drt.scene.description import (
    Camera,
    DiskLight,
    Material,
    PointLight,
    Quad,
    QuadLight,
    Scene,
    Sphere,
    SphereLight,
)
from adaptive_drt.scene.film import Film
from adaptive_drt.scene.settings import Settings

__all__ = [
    "BALL",
    "BULB",
    "CAMERA",
    "DOT",
    "FLOOR",
    "LAMP",
    "LIGHTS",
    "SPOT",
    "Case",
    "box",
    "case",
    "look_at",
    "wall",
]

LAST_BITS = 1e-13
"""Of a picture's mean: what its colours may differ by from processor to processor. Seen at most:
4e-14 between four sets of features and two versions of NumPy, in all but two pixels."""


@dataclass(frozen=True)
class Case:
    """A scene and its settings, by one thread.

    last_bits : of the picture's mean, what another processor's rounding may make of its colours.
        It is more than `LAST_BITS` only where the scene itself is badly conditioned.
    """

    scene: Scene
    settings: Settings
    last_bits: float = LAST_BITS

    def film(self, **changes) -> Film:
        """The picture, with some settings changed."""
        return render_image(self.scene, replace(self.settings, **changes))


def _unit(v):
    length = math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    return (v[0] / length, v[1] / length, v[2] / length)


def _cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def look_at(location, target, **fields):
    """A camera at a location that looks at a target, +Z up."""
    x, y, z = (float(a) for a in location)
    back = _unit((x - target[0], y - target[1], z - target[2]))
    right = _unit(_cross((0.0, 0.0, 1.0), back))
    up = _cross(back, right)
    rows = tuple((right[k], up[k], back[k], (x, y, z)[k]) for k in range(3))
    return Camera(matrix=(*rows, (0.0, 0.0, 0.0, 1.0)), **fields)


CAMERA = look_at((0.3, -8.0, 4.0), (0.1, 0.0, 0.5), resolution=(24, 18))
FLOOR = Quad((-5.0, -5.0, 0.0), (10.0, 0.0, 0.0), (0.0, 10.0, 0.0), Material((0.8, 0.7, 0.6)))
BALL = Sphere((0.0, 0.0, 1.0), 0.8, Material((0.3, 0.5, 0.9)))
LAMP = QuadLight((1.0, -1.0, 5.0), (0.7, 0.0, 0.0), (0.0, -0.5, 0.0), (9.0, 8.0, 7.0))
BULB = SphereLight((2.0, -2.0, 4.0), 0.4, (9.0, 7.0, 5.0))
SPOT = DiskLight((-2.0, -2.0, 4.0), 0.4, (5.0, 7.0, 9.0))
DOT = PointLight((1.0, -3.0, 4.0), (9.0, 9.0, 9.0))
LIGHTS = (LAMP, BULB, SPOT, DOT)


def case(shapes, lights, camera=CAMERA, background=(0.1, 0.2, 0.3), transparent=False, **settings):
    """A case of method EXACT at 1 %, unless settings say otherwise."""
    scene = Scene(camera, tuple(shapes), tuple(lights), background, transparent)
    return Case(scene, Settings(**{"tolerance": 1e-2, "threads": 1, **settings}))


def wall(x, y, width, height, **fields):
    """An upright quad that faces the camera, from a lower left corner on the floor."""
    return Quad((x, y, 0.0), (width, 0.0, 0.0), (0.0, 0.0, height), **fields)


def box(corner, u, v, w, **fields):
    """Six quads: the parallelepiped of three edges at a corner."""
    far = [tuple(a + b for a, b in zip(corner, edge, strict=True)) for edge in (w, u, v)]
    sides = ((u, v), (v, w), (w, u))
    return [
        Quad(start, *side, **fields)
        for side, there in zip(sides, far, strict=True)
        for start in (corner, there)
    ]
