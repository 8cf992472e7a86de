# SPDX-License-Identifier: GPL-3.0-or-later
"""Golden scenes in which shapes, lights and the camera move."""

from dataclasses import replace

from adaptive_drt.scene.description import (
    EllipseLight,
    Motion,
    Quad,
    SkyLight,
    Sphere,
    SpotLight,
    SunLight,
)

from .case import BALL, BULB, CAMERA, DOT, FLOOR, LAMP, LIGHTS, SPOT, box, case, look_at, wall
from .shapes import crowd

__all__ = ["MOTION_CASES"]

SMALL = look_at((0.3, -8.0, 4.0), (0.1, 0.0, 0.5), resolution=(16, 12))
LARGE = replace(CAMERA, resolution=(48, 36))
WAY = Motion((0.6, 0.3, 0.2))


def moving(thing, *way):
    return replace(thing, motion=Motion(way))


THROUGH = (
    moving(BALL, 0.5, 0.0, 0.0),
    Sphere((0.4, -0.5, 1.2), 0.7),
    Sphere((-0.4, -0.4, 0.8), 0.6, motion=Motion((0.0, -0.2, 0.4))),
)
MOTION_CASES = {
    "a moving sphere": case((FLOOR, moving(BALL, 0.6, 0.3, 0.2)), (LAMP,)),
    "a moving sphere, 0.1 %": case(
        (FLOOR, moving(BALL, 0.6, 0.0, 0.0)), (BULB,), SMALL, tolerance=1e-3
    ),
    "a moving sphere under a sun": replace(
        case(
            (FLOOR, moving(BALL, 0.6, 0.0, 0.0)),
            (SunLight((-0.4, 0.3, -1.0), (2.0,) * 3, 0.02),),
            SMALL,
        ),
        last_bits=1e-11,
    ),
    "a moving sphere under a sky": case(
        (FLOOR, moving(BALL, 0.6, 0.0, 0.0), wall(-1.5, 1.5, 2.0, 1.5)),
        (SkyLight((0.6, 0.8, 1.0)),),
        SMALL,
    ),
    "a moving quad": case((FLOOR, moving(wall(-1.5, 0.0, 2.0, 1.5), 0.5, 0.1, 0.2)), (SPOT,)),
    "a moving box": case(
        (
            FLOOR,
            *box((-1.0, 0.0, 0.2), (1.2, 0.3, 0), (-0.3, 1.2, 0), (0, 0, 1.0), motion=WAY),
        ),
        (DOT,),
    ),
    "a sphere towards the camera": case((FLOOR, moving(BALL, 0.0, -2.0, 1.0)), (LAMP,), SMALL),
    "a sphere through the camera": case(
        (FLOOR, Sphere((0.3, -8.0, 4.0), 0.5, motion=Motion((0.0, 8.0, -4.0)))), (LAMP,), SMALL
    ),
    "a sliding floor": case((moving(FLOOR, 0.7, 0.3, 0.0), BALL), (LAMP, DOT)),
    "a quad light moves": case((FLOOR, BALL), (moving(LAMP, 1.0, 0.5, 0.0),)),
    "a spherical light moves": case((FLOOR, BALL), (moving(BULB, 0.0, 1.0, -0.5),)),
    "a disk light moves": case((FLOOR, BALL, wall(1, 1, 1, 1)), (moving(SPOT, 0.5, 0.0, 0.5),)),
    "an elliptic light moves": case(
        (FLOOR, BALL),
        (
            EllipseLight(
                (1.0, -1.0, 4.0),
                (0.7, 0.0, 0.2),
                (0.0, -0.4, 0.1),
                (12.0,) * 3,
                motion=Motion((0.6, 0.3, 0.0)),
            ),
        ),
    ),
    "a spot moves": case(
        (FLOOR, BALL),
        (
            SpotLight(
                (1.5, -3.0, 4.5),
                (-0.3, 0.6, -1.0),
                (60.0,) * 3,
                0.7,
                0.3,
                0.3,
                motion=Motion((0.5, 0.5, 0.0)),
            ),
        ),
    ),
    "a point light moves": case((FLOOR, BALL), (moving(DOT, 0.5, 0.5, 0.0),)),
    "the camera moves": case(
        (FLOOR, BALL, wall(-2.5, 1.5, 3.0, 2.0)),
        (LAMP, DOT),
        replace(CAMERA, motion=Motion((0.1, 0.0, 0.05))),
    ),
    "all move": case(
        (FLOOR, moving(BALL, 0.6, 0.3, 0.2), moving(wall(0.5, 0.0, 1.0, 1.5), -0.4, 0.0, 0.0)),
        (moving(LAMP, 0.0, 0.5, 0.0), moving(SPOT, 0.3, 0.0, 0.0)),
        replace(SMALL, motion=Motion((0.1, 0.0, 0.05))),
    ),
    "all move together": case(
        (replace(FLOOR, motion=WAY), replace(BALL, motion=WAY)),
        (replace(light, motion=WAY) for light in LIGHTS),
        replace(CAMERA, motion=WAY),
    ),
    "motion switched off": case(
        (FLOOR, moving(BALL, 0.6, 0.3, 0.2)), (moving(LAMP, 1.0, 0.5, 0.0),), use_motion=False
    ),
    "spheres pass each other": case(
        (
            FLOOR,
            moving(BALL, 1.0, 0.0, 0.0),
            Sphere((0.5, -1.0, 0.8), 0.5, motion=Motion((-1.0, 0.2, 0.0))),
            Sphere((0.0, 0.3, 1.0), 0.6),
        ),
        (LAMP,),
        SMALL,
    ),
    "spheres pass through each other": case(THROUGH, (DOT,), SMALL, tolerance=1e-3),
    "spheres pass through each other, centres": case(THROUGH, (DOT, LAMP), use_edges=False),
    "a sphere and its light move": case(
        (FLOOR, moving(BALL, 0.2, 0.0, 0.0), wall(-2.5, 1.5, 3.0, 2.0)),
        (moving(BULB, 0.3, 0.0, 0.1),),
        SMALL,
    ),
    "the camera moves along": case(
        (FLOOR, BALL),
        (moving(BULB, 0.3, 0.0, 0.1), SPOT),
        replace(SMALL, motion=Motion((0.0, 0.5, 0.0))),
    ),
    "quads cross in motion": case(
        (
            FLOOR,
            Quad((-2.0, -1.0, 0.5), (4.0, 1.0, 0.5), (0.0, 0.3, 1.5), motion=Motion((0, 0.8, 0))),
            Quad((-1.0, -1.5, 0.2), (2.5, 2.5, 0.4), (-0.3, 0.2, 2.0)),
        ),
        (BULB,),
        SMALL,
    ),
    "motion through lights": case(
        (
            FLOOR,
            Sphere(LAMP.center, 0.6, motion=Motion((3.0, 0.0, 0.0))),
            Sphere(BULB.center, 0.2, motion=Motion((0.0, 3.0, 0.0))),
        ),
        (LAMP, BULB),
        replace(SMALL, resolution=(12, 9)),
    ),
    "a crowd moves": case(
        (
            FLOOR,
            *(
                replace(ball, motion=Motion((0.3, 0.1 * k, 0.0)) if k % 2 else None)
                for k, ball in enumerate(crowd(6, 8, 0.2, 0.6))
            ),
        ),
        (LAMP,),
        SMALL,
    ),
    "smooth motion": case((moving(FLOOR, 0.0, 0.0, 0.1),), (moving(LAMP, 0.3, 0, 0), BULB), LARGE),
    "a sphere on a large floor": case((FLOOR, moving(BALL, 0.3, 0.2, 0.1)), (LAMP,), LARGE),
    "a sinking ball": case(
        (FLOOR, Sphere((0.0, 0.0, 0.6), 0.5, motion=Motion((0.0, 0.0, -0.6)))), (LAMP, BULB), SMALL
    ),
    "a ball past a wall": case(
        (FLOOR, wall(-0.5, -0.5, 1.0, 1.2), moving(BALL, 1.5, 0.0, 0.0)),
        (DOT,),
        SMALL,
        tolerance=1e-3,
    ),
}
"""Name: case."""
