# SPDX-License-Identifier: GPL-3.0-or-later
"""Golden scenes of shapes that stand still: alone, in contact, nested, in crowds, cut and tiny."""

from dataclasses import replace
from random import Random

from adaptive_drt.scene.description import Material, Motion, Quad, Sphere

from .case import BALL, BULB, CAMERA, DOT, FLOOR, LAMP, LIGHTS, SPOT, box, case, look_at, wall

__all__ = ["SHAPE_CASES", "crowd"]

SMALL = look_at((0.3, -8.0, 4.0), (0.1, 0.0, 0.5), resolution=(16, 12))
LARGE = replace(CAMERA, resolution=(56, 40))
ABOVE = look_at((0.0, -0.1, 4.0), (0.0, 0.0, 0.0), resolution=(16, 12))
NAN = float("nan")
NEAR = look_at((0.3, -2.0, 1.0), (0.1, 0.0, 0.8), resolution=(20, 15))


def crowd(seed, count, low, high, spread=1.0):
    """Spheres that overlap."""
    random = Random(seed)

    def between(a, b):
        return a + (b - a) * random.random()

    return [
        Sphere(
            (between(-2.0, 2.0) * spread, between(-2.0, 2.0) * spread, between(0.0, 2.5) * spread),
            between(low, high),
            Material((between(0.2, 0.9), between(0.2, 0.9), between(0.2, 0.9))),
        )
        for _ in range(count)
    ]


def _tiles(count):
    """Quads side by side, each with its own height and slope."""
    random = Random(count)
    return [
        Quad(
            (-2.0 + k % 4, -2.0 + k // 4, 1.5 * random.random()),
            (0.9, 0.0, 0.3 * random.random()),
            (0.1, 0.8, 0.2),
            Material((random.random(), 0.5, 0.7)),
        )
        for k in range(count)
    ]


SHAPE_CASES = {
    "no shapes": case((), (LAMP, DOT)),
    "one sphere": case((BALL,), (BULB,), tolerance=1e-3),
    "an unlit quad alone": case((FLOOR,), (replace(DOT, center=(0.0, 0.0, -1.0)),), ABOVE),
    "one quad": case((FLOOR,), (LAMP, DOT), tolerance=1e-3),
    "large and clear": case((FLOOR, BALL), (LAMP, SPOT), LARGE),
    "a ball on the floor": case((FLOOR, replace(BALL, center=(0.0, 0.0, 0.8))), (LAMP, BULB)),
    "balls that touch": case(
        (FLOOR, BALL, replace(BALL, center=(1.6, 0.0, 1.0)), Sphere((0.8, 0.9, 0.3), 0.3)), (LAMP,)
    ),
    "balls through surfaces": case(
        (FLOOR, replace(BALL, center=(0.0, 0.0, 0.2)), wall(0.2, 0.0, 1.6, 1.8)), (BULB, DOT)
    ),
    "nested balls": case(
        (FLOOR, BALL, replace(BALL, radius=0.5), replace(BALL, center=(0.6, 0.0, 1.0))),
        (LAMP, SPOT),
    ),
    "inside a sphere": case(
        (Sphere((0.0, 0.0, 1.0), 9.0), BALL),
        (replace(LAMP, center=(1.0, -1.0, 4.0)), replace(BULB, center=(-2.0, -2.0, 3.0))),
        NEAR,
    ),
    "inside a box": case(
        (*box((-3.0, -3.0, -1.0), (6.0, 0, 0), (0, 6.0, 0), (0, 0, 5.0)), BALL),
        (replace(LAMP, center=(0.0, 0.0, 3.9)), replace(DOT, center=(1.0, -1.0, 2.0))),
        NEAR,
    ),
    "boxes": case(
        (
            FLOOR,
            *box((-2.0, 0.0, 0.0), (1.2, 0.3, 0.0), (-0.3, 1.2, 0.0), (0.0, 0.0, 1.5), name="A"),
            *box((0.3, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.3, 0.7), name="B"),
            *box((0.5, -0.8, 0.7), (0.5, 0.1, 0.0), (0.0, 0.5, 0.0), (0.0, 0.0, 0.5), name="C"),
        ),
        (LAMP, BULB),
    ),
    "quads in one plane": case(
        (
            FLOOR,
            replace(FLOOR, corner=(-2.0, -2.0, 0.0), material=Material((0.9, 0.0, 0.0))),
            Quad((-1.0, -1.0, 0.0), (2.0, 0.5, 0.0), (0.0, 1.0, 0.0), Material((0.0, 0.9, 0.0))),
            Quad((0.0, -2.0, 1e-9), (2.0, 0.5, 0.0), (0.0, 1.0, 0.0)),
        ),
        (LAMP,),
    ),
    "copies in one place": case(
        (FLOOR, BALL, FLOOR, BALL, replace(BALL, radius=0.8 * (1.0 + 1e-13))), (LAMP, DOT)
    ),
    "quads that cross": case(
        (
            FLOOR,
            Quad((-2.0, -1.0, 0.5), (4.0, 1.0, 0.5), (0.0, 0.3, 1.5)),
            Quad((-1.0, -1.5, 0.2), (2.5, 2.5, 0.4), (-0.3, 0.2, 2.0)),
            Quad((-2.0, 1.0, -0.5), (3.0, -1.0, 0.6), (0.1, 1.0, 1.1)),
        ),
        (LAMP, SPOT),
    ),
    "slivers": case(
        (
            FLOOR,
            BALL,
            Quad((-3.0, -1.0, 1.5), (6.0, 0.0, 0.0), (6.0, 1e-13, 0.0)),
            Quad((-3.0, -2.0, 1.5), (6.0, 0.0, 0.0), (0.0, 0.0, 1e-5)),
            Sphere((1.5, -3.0, 1.0), 1e-6),
        ),
        (LAMP, DOT),
    ),
    "a needle's edge on": case(
        (FLOOR, Quad((-1.0, -1.0, 1.0), (0.0, 3.0, 0.0), (0.0, 0.0, 1e-3)), wall(0.5, -2, 1e-3, 2)),
        (LAMP, BULB),
    ),
    "huge balls": replace(
        case((Sphere((0.0, 0.0, -1e6), 1e6), BALL, Sphere((0.0, 2e4, 1e4), 1.9e4)), (LAMP, BULB)),
        # the ground's radius is a million times what stands on it
        last_bits=1e-10,
    ),
    "a crowd of spheres": case((FLOOR, *crowd(1, 30, 0.2, 0.7)), (LAMP, DOT)),
    "a crowd under round lights": case((FLOOR, *crowd(2, 22, 0.2, 0.6)), (BULB, SPOT)),
    "a crowd, finely": case((FLOOR, *crowd(3, 8, 0.3, 0.9)), (BULB,), SMALL, tolerance=1e-3),
    "sixty spheres in arrays": case(
        (FLOOR, *crowd(4, 60, 0.05, 0.2)), (BULB, DOT), accelerator="ARRAYS"
    ),
    "sixty spheres by embree": case(
        (FLOOR, *crowd(4, 60, 0.05, 0.2)), (BULB, LAMP, DOT), accelerator="EMBREE"
    ),
    "a heap of dust": case((FLOOR, *crowd(5, 200, 0.005, 0.02)), (DOT,), SMALL),
    "tiles": case((FLOOR, *_tiles(16)), (LAMP, BULB), SMALL),
    "things that cannot be rendered": case(
        (
            FLOOR,
            BALL,
            replace(BALL, radius=0.0),
            replace(BALL, radius=1e-70),
            replace(BALL, center=(NAN, 0.0, 0.0)),
            replace(BALL, motion=Motion((0.0, 0.0, 1e31))),
            replace(BALL, material=Material((NAN, 0.0, 0.0))),
            replace(FLOOR, edge_v=(3.0, 0.0, 0.0)),
            replace(FLOOR, edge_v=(0.0, 0.0, 0.0)),
        ),
        (LAMP, replace(LAMP, half_u=(0.0, 3.0, 0.0)), replace(BULB, radius=-1.0)),
        background=(NAN, 0.0, 0.0),
    ),
    "a room in sunlight through a slit": case(
        (
            FLOOR,
            BALL,
            Quad((-4.0, -4.0, 3.0), (3.6, 0.0, 0.0), (0.0, 8.0, 0.0)),
            Quad((-0.3, -4.0, 3.0), (4.3, 0.0, 0.0), (0.0, 8.0, 0.0)),
        ),
        LIGHTS,
        SMALL,
    ),
}
"""Name: case."""
