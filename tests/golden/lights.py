# SPDX-License-Identifier: GPL-3.0-or-later
"""Golden scenes of lights: each kind alone, several, and where they touch or hold other things."""

from dataclasses import replace

from adaptive_drt.scene.description import (
    DiskLight,
    EllipseLight,
    PointLight,
    Quad,
    QuadLight,
    SkyLight,
    Sphere,
    SphereLight,
    SpotLight,
    SunLight,
    Triangle,
)

from .case import BALL, BULB, CAMERA, DOT, FLOOR, LAMP, LIGHTS, SPOT, box, case, look_at, wall
from .shapes import crowd

__all__ = ["LIGHT_CASES"]

BLOCK = box((-1.6, 0.4, 0.0), (1.0, 0.2, 0.0), (-0.2, 1.0, 0.0), (0.0, 0.0, 1.4))
WALL = wall(-2.5, 1.5, 3.0, 2.0)
SMALL = look_at((0.3, -8.0, 4.0), (0.1, 0.0, 0.5), resolution=(16, 12))
SUN = (1e3, 1e3, 1e3)
DOWN = (-0.4, 0.3, -1.0)
SKY = SkyLight((0.6, 0.8, 1.0))
CONE = SpotLight((1.5, -3.0, 4.5), (-0.3, 0.6, -1.0), (60.0, 50.0, 40.0), 0.7, 0.3, 0.3)
ROUND = EllipseLight((1.0, -1.0, 4.0), (0.7, 0.0, 0.2), (0.0, -0.4, 0.1), (12.0, 11.0, 10.0))
TRIANGLE = Triangle(((-2.5, -1.0, 0.5), (-1.0, -1.5, 0.6), (-1.8, -0.5, 2.0)))


def _unshadowed(light):
    return replace(light, casts_shadow=False)


LIGHT_CASES = {
    "quad light": case((FLOOR, BALL, *BLOCK), (LAMP,), tolerance=1e-3),
    "spherical light": case((FLOOR, BALL, WALL), (BULB,), tolerance=1e-3),
    "disk light": case((FLOOR, BALL, WALL), (SPOT,), tolerance=1e-3),
    "point light": case((FLOOR, BALL, WALL, *BLOCK), (DOT,), tolerance=1e-3),
    "all kinds of lights": case((FLOOR, BALL, WALL), LIGHTS),
    "all lights, 0.01 %": case(
        (FLOOR, BALL), LIGHTS, replace(SMALL, resolution=(12, 9)), tolerance=1e-4
    ),
    "no shadows": case((FLOOR, BALL, WALL), map(_unshadowed, LIGHTS), tolerance=1e-3),
    "some without shadows": case((FLOOR, BALL, WALL), (_unshadowed(LAMP), DOT, _unshadowed(SPOT))),
    "no lights": case((FLOOR, BALL, WALL), (), background=(0.3, 0.2, 0.1)),
    "lights without power": case(
        (FLOOR, BALL), (replace(LAMP, radiance=(0.0,) * 3), replace(DOT, intensity=(0.0,) * 3))
    ),
    "a mirrored quad light": case(
        (FLOOR, BALL), (replace(LAMP, half_v=(0.0, 0.5, 0.0)), replace(DOT, intensity=(1.0,) * 3))
    ),
    "a sheared, tilted quad light": case(
        (FLOOR, BALL, *BLOCK),
        (QuadLight((2.0, -1.0, 2.5), (0.5, 0.4, 0.6), (0.2, -0.7, 0.1), (9.0,) * 3),),
        tolerance=1e-3,
    ),
    "a long thin light": replace(
        case(
            (FLOOR, BALL), (replace(LAMP, half_u=(3.0, 0, 0), half_v=(0, -1e-3, 0), radiance=SUN),)
        ),
        # a factor's error is in proportion to the distance over the least width
        last_bits=1e-11,
    ),
    "tiny lights": case(
        (FLOOR, BALL),
        (
            replace(BULB, radius=1e-9, radiance=(1e19,) * 3),
            replace(SPOT, radius=1e-7, radiance=(1e15,) * 3),
            replace(LAMP, half_u=(1e-8, 0, 0), half_v=(0, -1e-8, 0), radiance=(1e17,) * 3),
        ),
    ),
    "huge lights": case(
        (FLOOR, BALL, WALL),
        (
            SphereLight((30.0, -20.0, 60.0), 40.0, (1.0, 0.8, 0.6)),
            QuadLight((0.0, 0.0, 30.0), (50.0, 0.0, 0.0), (0.0, -50.0, 0.0), (0.5,) * 3),
        ),
    ),
    "lights that hold everything": case(
        (FLOOR, BALL),
        (SphereLight((0.0,) * 3, 100.0, (1.0,) * 3), DiskLight((0.0,) * 3, 100.0, (1.0,) * 3)),
        SMALL,
    ),
    "a light flush in a ceiling": case(
        (FLOOR, BALL, WALL, Quad((-5.0, -5.0, 5.0), (0.0, 10.0, 0.0), (10.0, 0.0, 0.0))), (LAMP,)
    ),
    "lights in planes of surfaces": case(
        (FLOOR, BALL, WALL),
        (
            replace(LAMP, center=(2.0, -1.0, 0.0)),
            replace(DOT, center=(-2.0, -2.0, 0.0)),
            replace(DOT, center=(-3.5, 1.5, 1.0)),
        ),
    ),
    "lights that planes cut": case(
        (FLOOR, BALL, WALL),
        (
            replace(BULB, center=(2.0, -1.0, 0.1)),
            replace(SPOT, center=(-2.0, -1.0, 0.2)),
            QuadLight((-2.0, 1.5, 1.8), (0.0, 0.4, 0.3), (0.5, 0.0, 0.0), (9.0,) * 3),
        ),
        SMALL,
    ),
    "lights below the floor": case(
        (FLOOR, BALL), (replace(BULB, center=(1.0, 1.0, -2.0)), replace(SPOT, center=(1, 0, 2)))
    ),
    "occluders in lights": case(
        (FLOOR, BALL, Sphere((2.2, -2.1, 3.8), 0.35), Sphere((2.0, -2.3, 3.7), 0.2)), (BULB,), SMALL
    ),
    "occluders that cut quad lights": case(
        (
            FLOOR,
            BALL,
            Sphere((1.2, -1.0, 5.0), 0.4),
            Quad((0.6, -1.6, 4.7), (0, 1, 0), (0.1, 0, 1)),
        ),
        (LAMP,),
        SMALL,
        tolerance=1e-3,
    ),
    "a quad in a spherical light": case(
        (FLOOR, Quad((1.8, -2.2, 3.5), (0.5, 0.1, 0.0), (0.0, 0.2, 1.0))), (BULB, SPOT), SMALL
    ),
    "lights in occluders": case(
        (FLOOR, BALL, Sphere(BULB.center, 0.5), Sphere((-2.0, -2.0, 3.9), 0.9)),
        (BULB, SPOT, DOT),
        SMALL,
    ),
    "a sphere is the light": case((FLOOR, Sphere(BULB.center, BULB.radius)), (BULB, DOT), SMALL),
    "a quad is the light": case(
        (FLOOR, Quad((0.3, -1.5, 5.0), (1.4, 0.0, 0.0), (0.0, 1.0, 0.0))), (LAMP, SPOT), SMALL
    ),
    "a box around a light": case(
        (FLOOR, BALL, *box((-0.5, -3.0, 2.0), (3.0, 0, 0), (0, 3.0, 0), (0, 0, 4.0))[1:]),
        (LAMP, PointLight((0.5, -1.0, 3.0), (5.0,) * 3)),
    ),
    "small quad lights at the horizon": case(
        (FLOOR, BALL, replace(BALL, center=(2.0, 1.0, 0.5), radius=0.5)),
        (
            QuadLight((1.0, -4.9, 0.0), (0.01, 0, 0), (0, 0, -0.01), (4e4,) * 3),
            QuadLight((-1.0, -2.0, 0.0), (0.02, 0, 0), (0, 0, -0.02), (4e3,) * 3, None, False),
        ),
    ),
    "two spherical lights that overlap": case(
        (FLOOR, BALL),
        (BULB, replace(BULB, center=(2.3, -2.0, 4.0)), replace(BULB, radius=0.1)),
        SMALL,
    ),
    "camera in lights": case(
        (FLOOR, BALL),
        (
            SphereLight((0.3, -8.0, 4.0), 2.0, (3.0,) * 3),
            DiskLight((0.3, -7.0, 4.0), 1.5, (3.0,) * 3),
            PointLight((0.3, -8.0, 4.0), (3.0,) * 3),
        ),
        CAMERA,
    ),
    "a sun": replace(
        case((FLOOR, BALL, WALL, *BLOCK), (SunLight(DOWN, (2.0,) * 3, 0.01),), tolerance=1e-3),
        # a factor's error is in proportion to the reciprocal of the sun's angle
        last_bits=1e-11,
    ),
    "a wide sun": case((FLOOR, BALL, WALL), (SunLight(DOWN, (2.0, 1.5, 1.0), 0.5), DOT)),
    "a sky": case((FLOOR, BALL), (SKY,), tolerance=1e-3),
    "a sky, quads and triangles": case((FLOOR, WALL, *BLOCK, TRIANGLE), (SKY,)),
    "a sky, a crowd of spheres": case((FLOOR, *crowd(3, 30, 0.2, 0.5)), (SKY,)),
    "a sky and other lights": case(
        (FLOOR, BALL, WALL, TRIANGLE), (SKY, LAMP, SunLight(DOWN, (2.0,) * 3, 0.3))
    ),
    "a disk light that is fixed": case(
        (FLOOR, BALL, WALL, TRIANGLE),
        (replace(ROUND, half_u=(0.5, 0.0, 0.0), half_v=(0.0, -0.5, 0.0)),),
        tolerance=1e-3,
    ),
    "an elliptic light": case((FLOOR, BALL, WALL, *BLOCK), (ROUND,)),
    "an elliptic light that planes cut": case(
        (FLOOR, BALL, Sphere((1.2, -1.0, 4.0), 0.3)),
        (ROUND, replace(ROUND, center=(2.0, 0.5, 0.3), half_u=(0.0, 0.4, 0.5))),
        SMALL,
    ),
    "a spot": case((FLOOR, BALL, WALL, TRIANGLE), (CONE,), tolerance=1e-3),
    "a spot that is a ball": case((FLOOR, BALL, WALL), (replace(CONE, faces=False),)),
    "a spot that is a point": case((FLOOR, BALL, WALL), (replace(CONE, radius=0.0),)),
    "spots of a hard and a soft cone": case(
        (FLOOR, BALL),
        (replace(CONE, blend=0.0), replace(CONE, blend=1.0, center=(-2.0, -2.0, 4.0))),
    ),
    "a sun without size": case((FLOOR, BALL, WALL, *BLOCK), (SunLight(DOWN, (2.0,) * 3, 0.0),)),
}
"""Name: case."""
