# SPDX-License-Identifier: GPL-3.0-or-later
"""Seeded random scenes in which lights and shapes reach into, or move through, each other.

There the visible part of a light has no closed form in general. Shapes, lights and motion are those
of `random_scenes`; at least one light with an extent is moved so that it reaches into a shape.
"""

from dataclasses import replace

import numpy as np

from adaptive_drt.scene.description import (
    Material,
    Motion,
    PointLight,
    QuadLight,
    Scene,
    Sphere,
    vector_of,
)
from random_scenes import (
    random_camera,
    random_floor,
    random_light,
    random_motion,
    random_quad,
    random_sphere,
)

__all__ = ["reaches", "reaching_scene"]

MOST_LIGHTS = 3
SIDE = 24, 33
"""Least side of a picture in pixels, and one more than the greatest."""
DOME_RADIUS = 20.0
"""Metres: a sphere that holds the camera and all else: all points then lie within an occluder."""


def reaching_scene(seed):
    """Scene of a seed: the same on every machine."""
    rng = np.random.default_rng(seed)
    shapes = [random_floor(rng)] if rng.random() < 0.85 else []
    shapes += [random_sphere(rng) for _ in range(rng.integers(1, 5))]
    shapes += [random_quad(rng) for _ in range(rng.integers(0, 3))]
    if rng.random() < 0.15:
        shapes.append(_dome(rng))
    lights = [_reaching_light(rng, shapes)]
    while len(lights) < MOST_LIGHTS and rng.random() < 0.4:
        lights.append(_reaching_light(rng, shapes) if rng.random() < 0.5 else random_light(rng))
    width, height = (int(x) for x in rng.integers(*SIDE, 2))
    camera = replace(random_camera(rng), resolution=(width, height))
    background = vector_of(0.3 * rng.random(3))
    return Scene(camera, tuple(shapes), tuple(lights), background)


def _dome(rng):
    center = rng.uniform(-2.0, 2.0, 3)
    return Sphere(vector_of(center), DOME_RADIUS, Material(vector_of(rng.uniform(0.1, 1.0, 3))))


def _reaching_light(rng, shapes):
    """A light with an extent that reaches into one of the shapes at some time of the shutter."""
    while True:
        light = random_light(rng)
        if isinstance(light, PointLight):
            continue
        light = _grown(light, float(10.0 ** rng.uniform(-0.3, 0.5)))
        shape = shapes[rng.integers(len(shapes))]
        light = replace(light, center=vector_of(_place_in(rng, shape)), motion=None)
        if rng.random() < 0.35:
            light = replace(light, motion=random_motion(rng, 1.0))
        elif shape.motion is not None:
            light = replace(light, motion=shape.motion if rng.random() < 0.3 else None)
        if reaches(light, shape):
            return light


def _place_in(rng, shape):
    """A place within a shape, near its surface more often than not."""
    if isinstance(shape, Sphere):
        away = rng.normal(size=3)
        away[2] = abs(away[2])  # the upper half, which floors do not hide
        share = rng.uniform(0.0, 1.3) if rng.random() < 0.7 else rng.uniform(0.9, 1.05)
        return np.array(shape.center) + share * shape.radius * away / np.linalg.norm(away)
    a, b = rng.uniform(0.1, 0.9, 2)
    if shape.name == "Floor":
        a, b = 0.5 + (np.array((a, b)) - 0.5) * 6.0 / np.linalg.norm(shape.edge_u)
    spot = np.array(shape.corner) + a * np.array(shape.edge_u) + b * np.array(shape.edge_v)
    return spot + 0.2 * rng.normal(size=3)


def _grown(light, factor):
    """A light some times as large, with the same power."""
    radiance = vector_of(np.array(light.radiance) / factor**2)
    if isinstance(light, QuadLight):
        u, v = (vector_of(np.array(half) * factor) for half in (light.half_u, light.half_v))
        return replace(light, half_u=u, half_v=v, radiance=radiance)
    return replace(light, radius=light.radius * factor, radiance=radiance)


def reaches(light, shape, times=9):
    """Whether some of a light's points lie on both sides of a shape's surface at some time.

    A light with radius is looked at as a ball.
    """
    for t in np.linspace(-0.5, 0.5, times):
        points = _points_of(light) + _moved(light, t) - _moved(shape, t)
        if isinstance(shape, Sphere):
            inside = np.linalg.norm(points - shape.center, axis=1) < shape.radius
            if inside.any() and not inside.all():
                return True
        elif _crosses(points, shape):
            return True
    return False


def _points_of(light):
    """Points (k, 3) on a light's surface at the middle of the shutter."""
    steps = np.linspace(-1.0, 1.0, 15)
    a, b = (x.ravel()[:, None] for x in np.meshgrid(steps, steps))
    center = np.array(light.center)
    if isinstance(light, QuadLight):
        return center + a * np.array(light.half_u) + b * np.array(light.half_v)
    turn, side = np.pi * b, np.sqrt(1.0 - a * a)
    ball = np.concatenate([side * np.cos(turn), side * np.sin(turn), a], axis=1)
    return center + light.radius * ball


def _moved(thing, t):
    return t * np.array(
        thing.motion.displacement if isinstance(thing.motion, Motion) else (0.0,) * 3
    )


def _crosses(points, quad):
    """Whether points within a quad's outline, as seen along its normal, lie on both its sides."""
    u, v = np.array(quad.edge_u), np.array(quad.edge_v)
    n = np.cross(u, v)
    shares = np.linalg.solve(np.array([u, v, n]).T, (points - quad.corner).T)
    over = ((shares[:2] > 0.0) & (shares[:2] < 1.0)).all(axis=0)
    return bool((shares[2][over] > 0.0).any() and (shares[2][over] < 0.0).any())
