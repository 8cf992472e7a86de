# SPDX-License-Identifier: GPL-3.0-or-later
"""Golden scenes of settings and cameras: method RAYS, effects switched off, borders, lenses."""

from dataclasses import replace

from adaptive_drt.scene.description import Motion, Scene, SkyLight, Sphere, SpotLight, SunLight

from .case import BALL, BULB, CAMERA, DOT, FLOOR, LAMP, LIGHTS, SPOT, case, look_at, wall
from .shapes import crowd

__all__ = ["WAY_CASES"]

MOVER = replace(BALL, motion=Motion((0.6, 0.3, 0.2)))
WALL = wall(-2.5, 1.5, 3.0, 2.0)
SHAPES = (FLOOR, MOVER, WALL)
WIDE = replace(CAMERA, resolution=(40, 30))
RAYS = {"method": "RAYS", "light_rays": 9, "time_rays": 8, "pixel_rays": 8}


def scaled(scaled_case, factor):
    """The same picture of things `factor` times as large."""

    def grown(vector):
        return tuple(factor * x for x in vector)

    def grow(thing):
        places = ("center", "corner", "edge_u", "edge_v", "half_u", "half_v")
        fields = {name: grown(getattr(thing, name)) for name in places if hasattr(thing, name)}
        if hasattr(thing, "radius"):
            fields["radius"] = factor * thing.radius
        if hasattr(thing, "intensity"):
            fields["intensity"] = grown(grown(thing.intensity))
        if thing.motion is not None:
            fields["motion"] = Motion(grown(thing.motion.displacement))
        return replace(thing, **fields)

    scene = scaled_case.scene
    matrix = tuple((*row[:3], factor * row[3]) for row in scene.camera.matrix[:3])
    camera = replace(scene.camera, matrix=(*matrix, (0.0, 0.0, 0.0, 1.0)))
    shapes, lights = (tuple(map(grow, group)) for group in (scene.shapes, scene.lights))
    changed = Scene(camera, shapes, lights, scene.background, scene.transparent)
    return replace(scaled_case, scene=changed)


MIXED = case(SHAPES, (LAMP, SPOT), replace(CAMERA, resolution=(16, 12)))

WAY_CASES = {
    "rays, order 2": case(SHAPES, LIGHTS, WIDE, **RAYS),
    "rays, a sun": replace(
        case(SHAPES, (SunLight((-0.4, 0.3, -1.0), (2.0,) * 3, 0.1),), WIDE, **RAYS),
        last_bits=1e-11,
    ),
    "rays, a sky": case(SHAPES, (SkyLight((0.6, 0.8, 1.0)),), **RAYS),
    "rays, a spot": case(
        SHAPES,
        (SpotLight((1.5, -3.0, 4.5), (-0.3, 0.6, -1.0), (60.0,) * 3, 0.7, 0.3, 0.3),),
        WIDE,
        **RAYS,
    ),
    "rays, order 1": case(SHAPES, LIGHTS, WIDE, order=1, **RAYS),
    "rays, nothing kept": case(SHAPES, LIGHTS, WIDE, reuse=False, **RAYS),
    "rays everywhere": case(SHAPES, LIGHTS, distribution="EVERYWHERE", **RAYS),
    "rays everywhere, still": case(
        (FLOOR, BALL), (LAMP, BULB), distribution="EVERYWHERE", use_motion=False, **RAYS
    ),
    "rays, another seed": case(SHAPES, (LAMP, BULB), seed=-7, **RAYS),
    "rays, one of each": case(
        SHAPES, (LAMP, SPOT), **{**RAYS, "light_rays": 1, "time_rays": 1, "pixel_rays": 1}
    ),
    "rays, no penumbrae": case(SHAPES, LIGHTS, use_penumbra=False, **RAYS),
    "rays, no motion": case(SHAPES, LIGHTS, use_motion=False, **RAYS),
    "rays, no edges": case(SHAPES, LIGHTS, use_edges=False, **RAYS),
    "rays, nothing": case(
        SHAPES, LIGHTS, use_penumbra=False, use_motion=False, use_edges=False, **RAYS
    ),
    "rays, lights and camera move": case(
        SHAPES,
        (replace(light, motion=Motion((0.2, 0.3, 0.0))) for light in LIGHTS),
        replace(CAMERA, motion=Motion((0.1, 0.0, 0.05))),
        **RAYS,
    ),
    "rays, a crowd in arrays": case(
        (FLOOR, *crowd(7, 40, 0.1, 0.5)), (LAMP, DOT), accelerator="ARRAYS", **RAYS
    ),
    "rays, a crowd by embree": case(
        (FLOOR, *crowd(7, 40, 0.1, 0.5)), (LAMP, DOT), WIDE, accelerator="EMBREE", **RAYS
    ),
    "rays everywhere, a crowd by embree": case(
        (FLOOR, *crowd(8, 80, 0.1, 0.4)),
        (LAMP, DOT, replace(BULB, casts_shadow=False), replace(SPOT, radius=0.1)),
        accelerator="EMBREE",
        distribution="EVERYWHERE",
        **RAYS,
    ),
    "rays everywhere, a crowd in arrays": case(
        (FLOOR, *crowd(8, 80, 0.1, 0.4)),
        (LAMP, DOT),
        accelerator="ARRAYS",
        distribution="EVERYWHERE",
        **RAYS,
    ),
    "rays, nothing there": case((), (LAMP,), background=(0.5, 0.6, 0.7), **RAYS),
    "rays everywhere, nothing there": case(
        (), (), background=(0.7, 0.6, 0.5), distribution="EVERYWHERE", **RAYS
    ),
    "rays, a border without a world": case(
        SHAPES, (LAMP,), replace(WIDE, border=(5, 4, 30, 25)), transparent=True, **RAYS
    ),
    "no penumbrae": case((FLOOR, BALL, WALL), LIGHTS, use_penumbra=False, tolerance=1e-3),
    "no edges": case(SHAPES, (LAMP, BULB), use_edges=False),
    "nothing but centres": case(
        SHAPES, LIGHTS, use_penumbra=False, use_motion=False, use_edges=False
    ),
    "motion alone": case(SHAPES, LIGHTS, use_penumbra=False, use_edges=False),
    "edges alone": case(SHAPES, LIGHTS, use_penumbra=False, use_motion=False),
    "a border": case((FLOOR, BALL, WALL), (LAMP, BULB), replace(WIDE, border=(7, 5, 29, 22))),
    "a border in motion": case(SHAPES, (LAMP,), replace(CAMERA, border=(5, 5, 17, 13))),
    "a border of two pixels in motion": case(
        SHAPES, (LAMP,), replace(CAMERA, border=(11, 8, 13, 9))
    ),
    "a border of one pixel": case((FLOOR, BALL), (LAMP,), replace(WIDE, border=(18, 20, 19, 21))),
    "film without a world": case(SHAPES, (LAMP,), transparent=True),
    "a black world": case((BALL,), (DOT,), background=(0.0, 0.0, 0.0), tolerance=1e-3),
    "a bright world": case((BALL, WALL), (DOT,), background=(50.0, 60.0, 70.0), tolerance=1e-3),
    "a lens shifted, pixels wide": case(
        (FLOOR, BALL, WALL),
        (BULB,),
        replace(CAMERA, shift_x=0.2, shift_y=-0.1, pixel_aspect=(1.7, 1.0), focal_length=35.0),
    ),
    "a sensor fitted upright": case(
        (FLOOR, BALL),
        (LAMP,),
        replace(CAMERA, sensor_fit="VERTICAL", pixel_aspect=(1.0, 1.3), resolution=(14, 21)),
    ),
    "a fish's eye": case((FLOOR, BALL, WALL), (LAMP,), replace(CAMERA, focal_length=4.0)),
    "a telescope": case((FLOOR, BALL), (LAMP, DOT), replace(CAMERA, focal_length=2e3)),
    "along the floor": case(
        (FLOOR, BALL),
        (LAMP, DOT),
        look_at((0.0, -8.0, 1e-3), (0.0, 0.0, 1e-3), resolution=(24, 18)),
    ),
    "symmetric": case(
        (replace(BALL, center=(0.0, 0.0, 0.0)), Sphere((0.0, -2.0, 0.0), 0.5)),
        (replace(BULB, center=(0.0, -6.0, 0.0)),),
        look_at((0.0, -8.0, 0.0), (0.0, 0.0, 0.0), resolution=(20, 20)),
    ),
    "one pixel": case((FLOOR, BALL), LIGHTS, replace(CAMERA, resolution=(1, 1))),
    "a row of pixels": case((FLOOR, BALL), (LAMP,), replace(CAMERA, resolution=(200, 1))),
    "in nanometres": scaled(MIXED, 2.0**-30),
    "in light years": scaled(MIXED, 2.0**53),
    "a scale that rounds": scaled(MIXED, 1e-3 / 3.0),
    "an unlit picture": case(
        (FLOOR, BALL), (replace(LAMP, half_v=(0, 0.5, 0)),), background=(0,) * 3
    ),
    # no ray through a pixel's middle meets it: light is found between these
    "a light found late": case(
        (Sphere((0.12, 0.0, 0.62), 0.03),), (LAMP, DOT), background=(0.0, 0.0, 0.0)
    ),
}
"""Name: case."""
