# SPDX-License-Identifier: GPL-3.0-or-later
"""Outlines, shadows and paths that touch a pixel or its ray: the blue and green of the mask."""

import numpy as np

from adaptive_drt.scene.description import Motion, PointLight, Scene, Sphere
from adversarial_case import (
    EDGE,
    HEIGHT,
    LAMP,
    MOTION,
    WIDTH,
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
    cap_of,
    directions,
    floor_points,
    leaves_some,
    meets,
    pixel_corners,
    real,
    sweep,
)

__all__ = ["outline", "passing", "passing_shadow", "shadow_line", "speck"]


def outline(rng):
    """Blue: a ball whose outline touches a corner or a side of a pixel."""
    camera = some_camera(rng)
    corners = [
        np.asarray(c[:, 0], dtype=float)
        for c in pixel_corners(camera, [rng.integers(2, WIDTH - 3)], [rng.integers(2, HEIGHT - 3)])
    ]
    goal = corners[0]
    if rng.random() < 0.5:
        goal = goal + rng.random() * (corners[1] - goal)
    return _blue(rng, camera, goal, float(10.0 ** rng.uniform(-5.0, -0.7)))


def speck(rng):
    """Blue: a ball far smaller than a pixel, anywhere in one."""
    camera = some_camera(rng)
    goal = directions(camera, [rng.uniform(1, WIDTH - 1)], [rng.uniform(1, HEIGHT - 1)])
    return _blue(rng, camera, np.asarray(goal[:, 0], dtype=float), 10.0 ** rng.uniform(-12.0, -4.0))


def _blue(rng, camera, goal, half):
    """A ball whose cap touches the direction `goal` from the eye, before the floor."""
    eye = np.array(camera.matrix)[:3, 3]
    way = goal / np.linalg.norm(goal)
    distance = rng.uniform(0.1, 0.5) * abs(eye[2] / way[2])
    center = beside(rng, eye, way, half * (1.0 + off(rng)), distance)
    ball = Sphere(vector(center), float(distance * np.sin(half)))
    columns, rows = raster()
    pixel = pixel_corners(camera, columns, rows)
    eye = real(eye).reshape(3, 1) * np.ones_like(pixel[0])
    cap = cap_of(eye, ball.center, ball.radius)
    margin = np.minimum(meets(cap, pixel), leaves_some(cap, pixel)) / cap.half
    scene = Scene(camera, (floor(), ball), (LAMP,))
    only = {"use_motion": False, "use_penumbra": False}
    return Case.make(scene, only, EDGE, margin, cap.half)


def shadow_line(rng):
    """Blue: the shadow of a ball under a point light touches a corner or a side of a pixel."""
    camera = some_camera(rng)
    i, j = rng.integers(2, WIDTH - 3), rng.integers(2, HEIGHT - 3)
    place, _ = light_place(rng, chosen_point(rng, camera))
    corners = [floor_points(camera, c)[0][:, 0] for c in pixel_corners(camera, [i], [j])]
    goal = np.asarray(corners[0], dtype=float)
    if rng.random() < 0.5:
        goal = goal + rng.random() * (np.asarray(corners[1], dtype=float) - goal)
    way = goal - place
    distance = np.linalg.norm(way) * rng.uniform(0.3, 0.8)
    half = float(10.0 ** rng.uniform(-4.0, -0.7))
    turn = half * (1.0 + off(rng))
    center = beside(rng, place, way / np.linalg.norm(way), turn, distance)
    ball = Sphere(vector(center), float(distance * np.sin(half)))
    columns, rows = raster()
    pixel = pixel_corners(camera, columns, rows)
    # from the light, the ball is a cap and the pixel's piece of floor a polygon
    lamp = real(place).reshape(3, 1)
    ground = [floor_points(camera, way)[0] - lamp for way in pixel]
    cap = cap_of(lamp + 0 * ground[0], ball.center, ball.radius)
    margin = np.minimum(meets(cap, ground), leaves_some(cap, ground)) / cap.half
    eye = real(camera.matrix)[:3, 3].reshape(3, 1) + 0 * ground[0]
    margin = np.where(meets(cap_of(eye, ball.center, ball.radius), pixel) < 0, margin, np.nan)
    scene = Scene(camera, (floor(), ball), (PointLight(vector(place), (1.0,) * 3),))
    only = {"use_motion": False, "use_penumbra": False}
    return Case.make(scene, only, EDGE, margin, cap.half)


def passing(rng):
    """Green: a moving ball that touches a pixel's ray on its way."""
    camera = some_camera(rng)
    eye = np.array(camera.matrix)[:3, 3]
    i, j = rng.integers(2, WIDTH - 2), rng.integers(2, HEIGHT - 2)
    way = np.asarray(directions(camera, [i + 0.5], [j + 0.5])[:, 0], dtype=float)
    way /= np.linalg.norm(way)
    distance = rng.uniform(0.1, 0.4) * abs(eye[2] / way[2])
    size = distance * float(10.0 ** rng.uniform(-5.0, -1.0))
    move = _path(rng, way, size)
    side = np.cross(way, move)
    side /= np.linalg.norm(side)
    center = eye + distance * way + side * size * (1.0 + off(rng)) + move * rng.uniform(-0.6, 0.6)
    ball = Sphere(vector(center), float(size), motion=Motion(vector(move)))
    columns, rows = raster()
    rays = directions(camera, columns + 0.5, rows + 0.5)
    start = real(ball.center - eye).reshape(3, 1) + 0 * rays
    margin = sweep(start, ball.motion.displacement, ball.radius, rays)
    scene = Scene(camera, (floor(), ball), (LAMP,))
    only = {"use_edges": False, "use_penumbra": False}
    return Case.make(scene, only, MOTION, margin, size / distance)


def _path(rng, way, size):
    """A displacement across a direction, of 0.01 to 30 radii."""
    move = across(rng, way) + 0.5 * rng.random() * way
    return move * size * 10.0 ** rng.uniform(-2.0, 1.5)


def passing_shadow(rng):
    """Green: a moving ball whose point shadow touches a pixel's point of the floor."""
    camera = some_camera(rng)
    point = chosen_point(rng, camera)
    place, way = light_place(rng, point)
    distance = rng.uniform(0.2, 0.7) * np.linalg.norm(place - point)
    size = distance * float(10.0 ** rng.uniform(-5.0, -1.0))
    move = _path(rng, way, size)
    side = np.cross(way, move)
    side /= np.linalg.norm(side)
    center = point + distance * way + side * size * (1.0 + off(rng)) + move * rng.uniform(-0.6, 0.6)
    ball = Sphere(vector(center), float(size), motion=Motion(vector(move)))
    light = PointLight(vector(place), (1.0,) * 3)
    columns, rows = raster()
    rays = directions(camera, columns + 0.5, rows + 0.5)
    there, _ = floor_points(camera, rays)
    lamp = real(light.center).reshape(3, 1) - there
    start, move = real(ball.center).reshape(3, 1) - there, ball.motion.displacement
    # hidden at some time, but not for all of it; or the ball itself is seen
    some = sweep(start, move, ball.radius, lamp)
    ends = [
        -sweep(start + side * real(move).reshape(3, 1) / 2, (0.0,) * 3, ball.radius, lamp)
        for side in (-1, 1)
    ]
    margin = np.minimum(some, np.maximum(*ends))
    eye = real(camera.matrix)[:3, 3].reshape(3, 1)
    seen = sweep(real(ball.center).reshape(3, 1) - eye + 0 * rays, move, ball.radius, rays)
    margin = np.where(seen > 0, seen, np.maximum(margin, seen))
    only = {"use_edges": False, "use_penumbra": False}
    scene = Scene(camera, (floor(), ball), (light,))
    return Case.make(scene, only, MOTION, margin, size / distance)
