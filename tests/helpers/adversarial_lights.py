# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights that one object hides by a hair or leaves by one: the red part of the mask.

At one chosen pixel the object touches the light's outline from inside or outside.
"""

import numpy as np

from adaptive_drt.scene.description import Quad, QuadLight, Scene, Sphere, SphereLight
from adversarial_case import (
    PENUMBRA,
    Case,
    across,
    beside,
    chosen_point,
    floor,
    light_place,
    off,
    raster,
    some_camera,
    vector,
)
from oracle.exact_mask import (
    PI,
    Cap,
    angle,
    cap_of,
    directions,
    floor_points,
    hides_some,
    leaves_some,
    meets,
    real,
    sphere_hits,
)

__all__ = [
    "ball_light",
    "contact",
    "facing_quad_light",
    "light_corners",
    "light_faces",
    "quad_before_ball",
    "quad_light",
    "tiny_ball",
]


def _occluder(rng, point, way, between, half):
    """A sphere of half angle `half` whose axis is at `between` from `way`, near the point."""
    distance = rng.uniform(0.3, 0.8) * rng.uniform(1.0, 2.5)
    center = beside(rng, point, way, between, distance)
    return center, distance * np.sin(half)


def ball_light(rng):
    """Red: a ball before a spherical light, touching its outline from outside or within."""
    camera = some_camera(rng)
    point = chosen_point(rng, camera)
    place, way = light_place(rng, point)
    radius = float(rng.uniform(0.05, 0.5))
    lamp = np.arcsin(radius / np.linalg.norm(place - point))
    half = float(lamp * 10.0 ** rng.uniform(-1.0, 0.7)) if rng.random() < 0.8 else 0.3
    half = min(half, 0.5)
    touch = lamp + half if rng.random() < 0.5 else abs(lamp - half)
    center, size = _occluder(rng, point, way, touch * (1.0 + off(rng)), half)
    light = SphereLight(vector(place), radius, (1.0,) * 3)
    return _red(camera, light, Sphere(vector(center), float(size)))


def tiny_ball(rng):
    """Red: a ball of 1e-12 to 1e-3 of the light's half angle somewhere before it."""
    camera = some_camera(rng)
    point = chosen_point(rng, camera)
    place, way = light_place(rng, point)
    radius = float(rng.uniform(0.05, 0.5))
    lamp = np.arcsin(radius / np.linalg.norm(place - point))
    half = lamp * 10.0 ** rng.uniform(-10.0, -3.0)
    center, size = _occluder(rng, point, way, lamp * rng.random(), half)
    if rng.random() < 0.5:
        return _red(
            camera, SphereLight(vector(place), radius, (1.0,) * 3), Sphere(vector(center), size)
        )
    return _red(camera, facing_quad_light(rng, point, place, radius), Sphere(vector(center), size))


def contact(rng):
    """Red: a ball that rests on the floor, or sinks or floats by a hair, near the point."""
    camera = some_camera(rng)
    point = chosen_point(rng, camera)
    size = float(10.0 ** rng.uniform(-1.5, 0.0))
    place, _ = light_place(rng, point)
    way = np.append(rng.normal(size=2), 0.0)
    center = point + way / np.linalg.norm(way) * size * 10.0 ** rng.uniform(-3.0, 0.5)
    center[2] = size * (1.0 + abs(off(rng)))
    return _red(
        camera,
        SphereLight(vector(place), float(rng.uniform(0.05, 0.5)), (1.0,) * 3),
        Sphere(vector(center), size),
    )


def facing_quad_light(rng, point, place, radius):
    """A quad light that faces the point more or less."""
    back = (point - place) / np.linalg.norm(point - place) + 0.3 * rng.normal(size=3)
    u = across(rng, back)
    v = np.cross(back / np.linalg.norm(back), u)
    v = v + (0.3 * rng.random()) * u if rng.random() < 0.3 else v
    return QuadLight(
        vector(place),
        vector(u * radius),
        vector(v * radius * rng.uniform(0.3, 2.0)),
        (1.0,) * 3,
    )


def light_corners(light):
    c, u, v = (np.array(x) for x in (light.center, light.half_u, light.half_v))
    return [c + u + v, c - u + v, c - u - v, c + u - v]


def quad_light(rng):
    """Red: a ball that touches a side or a corner of a quad light, from either side."""
    camera = some_camera(rng)
    point = chosen_point(rng, camera)
    place, _ = light_place(rng, point)
    light = facing_quad_light(rng, point, place, float(rng.uniform(0.05, 0.5)))
    corners = light_corners(light)
    k = rng.integers(4)
    goal = corners[k]
    if rng.random() < 0.6:
        goal = goal + rng.random() * (corners[(k + 1) % 4] - goal)
    way = (goal - point) / np.linalg.norm(goal - point)
    half = float(10.0 ** rng.uniform(-3.0, -0.4))
    center, size = _occluder(rng, point, way, half * (1.0 + off(rng)), half)
    return _red(camera, light, Sphere(vector(center), float(size)))


def _red(camera, light, ball):
    """A ball and the floor under a light: which points of the floor see the light in part."""
    columns, rows = raster()
    way = directions(camera, columns + 0.5, rows + 0.5)
    point, _ = floor_points(camera, way)
    over = cap_of(point, ball.center, ball.radius)
    margin = _in_part(over, light, point) / over.half
    margin = np.where(_before(ball, light, point), margin, -1)
    # where the ball itself is seen, its horizon cuts the light
    eye = real(camera.matrix)[:3, 3].reshape(3, 1)
    hits, normal, clear = sphere_hits(eye, way, ball.center, ball.radius)
    margin = np.where(clear > 0, margin, _cut(light, hits, normal))
    scene = Scene(camera, (floor(), ball), (light,))
    only = {"use_motion": False, "use_edges": False}
    return Case.make(scene, only, PENUMBRA, margin, over.half)


def _in_part(over, light, point):
    """Margin by which a cap hides some of a light and leaves some."""
    if isinstance(light, SphereLight):
        lamp = cap_of(point, light.center, light.radius)
        return np.minimum(hides_some(over, lamp), leaves_some(over, lamp))
    lamp = [real(c).reshape(3, 1) - point for c in light_corners(light)]
    margin = np.minimum(meets(over, lamp), leaves_some(over, lamp))
    return np.where(light_faces(light, point), margin, -1)


def _before(ball, light, point):
    """Whether a ball is nearer points than a light that it may meet in angle; they do not touch.

    Of two such spheres the one with the shorter tangent is in front.
    """
    v = real(ball.center).reshape(3, 1) - point
    to = real(light.center).reshape(3, 1) - point
    if isinstance(light, SphereLight):
        r, size = real(ball.radius), real(light.radius)
        return (v * v).sum(axis=0) - r * r < (to * to).sum(axis=0) - size * size
    normal = real(np.cross(light.half_u, light.half_v)).reshape(3, 1)
    return ((v - to) * normal).sum(axis=0) > 0


def light_faces(light, point):
    normal = real(np.cross(light.half_u, light.half_v)).reshape(3, 1)
    return ((point - real(light.center).reshape(3, 1)) * normal).sum(axis=0) > 0


def _cut(light, point, normal):
    """Margin by which a light lies on both sides of the horizon of points."""
    if isinstance(light, SphereLight):
        lamp = cap_of(point, light.center, light.radius)
        return lamp.half - np.abs(angle(lamp.axis, normal) - PI / 2)
    corners = [real(c).reshape(3, 1) - point for c in light_corners(light)]
    rise = [PI / 2 - angle(c, normal) for c in corners]
    return np.where(light_faces(light, point), np.minimum(np.max(rise, 0), -np.min(rise, 0)), -1)


def quad_before_ball(rng):
    """Red: a quad whose side or corner touches the outline of a spherical light."""
    camera = some_camera(rng)
    point = chosen_point(rng, camera)
    place, way = light_place(rng, point)
    radius = float(rng.uniform(0.05, 0.5))
    lamp = np.arcsin(radius / np.linalg.norm(place - point))
    side = across(rng, way)
    edge = np.cross(way, side)
    turn = lamp * (1.0 + off(rng))
    distance = rng.uniform(0.3, 2.0)
    corner = point + distance * (np.cos(turn) * way + np.sin(turn) * side)
    size = distance * lamp * 10.0 ** rng.uniform(-1.0, 0.5)
    out = size * (side + 0.3 * rng.normal() * way) * rng.choice([-1.0, 1.0])
    along = size * edge * rng.uniform(0.3, 3.0)
    if rng.random() < 0.6:
        corner = corner - rng.uniform(0.2, 0.8) * along
    else:
        along = along + 0.7 * out
    quad = Quad(vector(corner), vector(out), vector(along))
    columns, rows = raster()
    way = directions(camera, columns + 0.5, rows + 0.5)
    there, _ = floor_points(camera, way)
    c, u, v = (real(x).reshape(3, 1) for x in (quad.corner, quad.edge_u, quad.edge_v))
    ends = [c, c + u, c + u + v, c + v]
    light = SphereLight(vector(place), radius, (1.0,) * 3)
    cap, over = cap_of(there, light.center, light.radius), [q - there for q in ends]
    margin = np.minimum(meets(cap, over), leaves_some(over, cap)) / cap.half
    eye = real(camera.matrix)[:3, 3].reshape(3, 1)
    seen = meets(Cap(way, 0 * way[0]), [q - eye + 0 * way for q in ends])
    margin = np.where(seen < 0, margin, np.nan)
    scene = Scene(camera, (floor(), quad), (light,))
    only = {"use_motion": False, "use_edges": False}
    return Case.make(scene, only, PENUMBRA, margin, cap.half)
