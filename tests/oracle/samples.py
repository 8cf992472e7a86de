# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the oracle looks: grids over each domain, and the spots where things hide from grids."""

import numpy as np

from adaptive_drt.scene.description import QuadLight, Sphere, Triangle

from .camera import project, rays
from .lights import is_area, source
from .trace import dot, flat_of, moved, moves

__all__ = [
    "camera_rays",
    "closest_times",
    "landmarks",
    "light_grid",
    "pixel_grid",
    "rim",
    "shadow_landmarks",
    "squeeze",
]

INSET = 1e-3
"""Share of a quad by which its landmarks lie inside its outline, where they hit it."""


def pixel_grid(k):
    """(k * k, 2) points over the unit square, corners and edges included; the centre first."""
    axis = np.linspace(0.0, 1.0, k)
    grid = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    return np.concatenate([[[0.5, 0.5]], grid])


def light_grid(light, k):
    """(m, 2) points of a light's uv domain, its outline included; the centre first."""
    if not is_area(light):
        return np.zeros((1, 2))
    grid = 2.0 * pixel_grid(k) - 1.0
    if isinstance(light, QuadLight):
        return grid
    # square to disk by shrinking each ray from the centre: its outline goes to the outline
    size = np.linalg.norm(grid, axis=1, keepdims=True)
    return grid * np.abs(grid).max(axis=1, keepdims=True) / np.where(size > 0.0, size, 1.0)


def landmarks(shape):
    """Points (k, 3) of a shape at t = 0 that a grid of rays may miss when it is small or thin."""
    if isinstance(shape, Sphere):
        return np.array([shape.center], dtype=float)
    corner, u, v = flat_of(shape)
    a, b = INSET, 1.0 - INSET
    if isinstance(shape, Triangle):
        spots = [(1.0 / 3.0, 1.0 / 3.0), (a, a), (b - a, a), (a, b - a)]
        return np.array([corner + x * u + y * v for x, y in spots])
    spots = [(0.5, 0.5), (a, a), (b, a), (a, b), (b, b)]
    return np.array([corner + x * u + y * v for x, y in spots])


def rim(shape, p, t):
    """Points (4, n, 3) of a sphere's outline as p (n, 3) sees it, a little outside and inside."""
    center = moved(shape, shape.center, t)
    axis = center - p
    axis = axis / np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), 1e-30)
    side = np.cross(axis, np.eye(3)[np.abs(axis).argmin(axis=1)])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(axis, side)
    r = shape.radius
    return np.stack([center + f * r * s for f in (0.9, 1.2) for s in (side, -side, other, -other)])


def squeeze(scene, pixels, points, t):
    """Picture points (n * k, 2) nearest to world points (k, 3), clamped into each pixel (n, 2)."""
    spots = project(scene.camera, points, t)
    spots = spots[np.isfinite(spots).all(axis=1)]
    inside = np.clip(spots[None], pixels[:, None], pixels[:, None] + 1.0)
    return inside.reshape(-1, 2), len(spots)


def shadow_landmarks(scene, lights):
    """Points (k, 3) where the lights' centres throw each occluder's middle on other shapes."""
    points = []
    for light in lights:
        for shape in scene.shapes:
            for q in landmarks(shape):
                points.extend(_beyond(scene, source(light, q), q))
    return np.array(points).reshape(-1, 3)


def _beyond(scene, source, q):
    """Points where the line from a source through q meets the scene's shapes."""
    way = q - source
    length = np.linalg.norm(way)
    if length == 0.0:
        return
    way = way / length
    for shape in scene.shapes:
        if isinstance(shape, Sphere):
            offset = np.array(shape.center) - source
            along = offset @ way
            half2 = shape.radius**2 - ((offset - along * way) ** 2).sum()
            depths = [along - half2**0.5, along + half2**0.5] if half2 > 0.0 else []
        else:
            corner, u, v = flat_of(shape)
            normal = np.cross(u, v)
            slope = way @ normal
            depths = [(corner - source) @ normal / slope] if slope else []
        for depth in depths:
            if depth > length:
                yield source + depth * way


def closest_times(scene, o, d):
    """Times (m, n) at which each moving shape's landmarks come nearest the lines o + s d (n, 3)."""
    times = []
    for shape in scene.shapes:
        if not moves(shape):
            continue
        move = np.array(shape.motion.displacement)
        across = move - dot(d, move[None])[:, None] * d
        size2 = np.maximum(dot(across, across), 1e-300)
        for q in landmarks(shape):
            offset = o - q
            offset = offset - dot(offset, d)[:, None] * d
            times.append(np.clip(dot(offset, across) / size2, -0.5, 0.5))
    return np.array(times).reshape(len(times), len(o))


def camera_rays(scene, spots, t):
    """Rays through picture points (n, 2) at times t, a number or (n,)."""
    when = np.broadcast_to(np.asarray(t, dtype=float), (len(spots),))
    return (*rays(scene.camera, spots[:, 0], spots[:, 1], when), when)
