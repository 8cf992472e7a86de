# SPDX-License-Identifier: GPL-3.0-or-later
"""Random scenes of balls and sticks, and pictures of them by plain rays, which share no code."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from adaptive_drt.scene.description import (
    Cylinder,
    Ellipsoid,
    Material,
    Motion,
    Quad,
    QuadLight,
    Scene,
    SkyLight,
    Sphere,
    SphereLight,
    vector_of,
)
from plain_hits import oracle_depth, rays
from random_scenes import look_at

LIGHTS = {
    "quad": QuadLight((0.5, -1.0, 4.0), (0.6, 0.0, 0.0), (0.0, -0.6, 0.1), (10.0, 10.0, 10.0)),
    "sphere": SphereLight((1.0, -1.5, 4.0), 0.5, (10.0, 10.0, 10.0)),
    "sky": SkyLight((1.0, 1.0, 1.0)),
}


def stick_scene(seed, light="quad", moving=False, resolution=(60, 45), tapers=False):
    """A floor, balls, sticks between some of them, and one that lies about and may move.

    tapers : whether the sticks are cones, truncated or not, and that one is a wide one.
    """
    rng = np.random.default_rng(seed)
    place, radius = (
        rng.uniform((-1.0, -1.0, 0.4), (1.0, 1.0, 1.8), (4, 3)),
        rng.uniform(0.12, 0.3, 4),
    )
    shapes = [Quad((-5.0, -5.0, 0.0), (10.0, 0.0, 0.0), (0.0, 10.0, 0.0), Material((0.7,) * 3))]
    for center, size in zip(place, radius, strict=True):
        shapes.append(Sphere(vector_of(center), float(size), _material(rng)))
    for _ in range(3):
        one, other = (vector_of(each) for each in place[rng.choice(4, 2, replace=False)])
        size = float(rng.uniform(0.03, 0.1))
        end = size * float(rng.uniform(0.0, 2.0)) if tapers else None
        shapes.append(Cylinder(one, other, size, _material(rng), end_radius=end))
    start = rng.uniform((-1.0, -1.0, 0.3), (1.0, 1.0, 1.5))
    end = start + rng.normal(size=3) * 0.4
    end[2] = max(end[2], 0.3)
    motion = Motion(vector_of(rng.normal(size=3) * 0.3)) if moving else None
    size = float(rng.uniform(0.05, 0.25)) * (2.0 if tapers else 1.0)
    ends, last = (vector_of(start), vector_of(end)), 0.0 if tapers else None
    shapes.append(Cylinder(*ends, size, _material(rng), motion, end_radius=last))
    eye = rng.normal(size=3)
    eye[2] = abs(eye[2]) + 0.3
    eye *= 6.0 / np.linalg.norm(eye)
    camera = look_at(vector_of(eye), (0.0, 0.0, 0.8), resolution=resolution, focal_length=60.0)
    return Scene(camera, tuple(shapes), (LIGHTS[light],), (0.05, 0.06, 0.08))


def solid_scene(seed, resolution=(12, 12)):
    """The same with two ellipsoids: the lights in turn, every second scene with a stick that moves,
    every second pair of scenes with cones for sticks.
    """
    rng, light = np.random.default_rng(10_000 + seed), tuple(LIGHTS)[seed % len(LIGHTS)]
    scene = stick_scene(seed, light, seed % 2 == 1, resolution, tapers=bool(seed // 2 % 2))
    shapes = list(scene.shapes)
    for k in (1, 2):
        ball = shapes[k]
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0] * ball.radius * rng.uniform(0.5, 1.6, 3)
        shapes[k] = Ellipsoid(ball.center, *(vector_of(each) for each in axes.T), ball.material)
    return replace(scene, shapes=tuple(shapes))


def _material(rng):
    return Material(vector_of(rng.uniform(0.2, 0.9, 3)))


def hits_of(scene, x, y, t):
    """What rays hit: index of the shape, -1 for none; point and normal (3, n); number of a face.

    The faces of cylinders are their sides and both ends.
    """
    eye, way = np.array(scene.camera.matrix)[:3, 3:], rays(scene.camera, x, y)
    depth = np.array([oracle_depth(shape, way, t, eye) for shape in scene.shapes])
    item = np.where(np.isfinite(depth).any(axis=0), depth.argmin(axis=0), -1)
    point = eye + np.where(item >= 0, depth.min(axis=0), 0.0) * way
    normal, face = np.zeros_like(point), np.zeros(item.size, dtype=int)
    for number, shape in enumerate(scene.shapes):
        own = item == number
        move = np.zeros(3) if shape.motion is None else np.array(shape.motion.displacement)
        normal[:, own], face[own] = _normals(shape, point[:, own] - t[own] * move[:, None])
    back = (normal * way).sum(axis=0) > 0.0
    return item, point, np.where(back, -normal, normal), 3 * item + face


def _normals(shape, point):
    if isinstance(shape, Sphere):
        return (point - np.array(shape.center)[:, None]) / shape.radius, 0
    if isinstance(shape, Quad):
        normal = np.cross(shape.edge_u, shape.edge_v)
        return (normal / np.linalg.norm(normal))[:, None], 0
    start, axis = np.array(shape.start), np.subtract(shape.end, shape.start)
    length = np.linalg.norm(axis)
    axis = axis[:, None] / length
    rest = point - start[:, None]
    height = (axis * rest).sum(axis=0)
    rest = rest - height * axis
    off = np.linalg.norm(rest, axis=0)
    wide, narrow = shape.radii
    rate = (narrow - wide) / length
    gap = np.abs(off - wide - rate * height) / np.sqrt(1.0 + rate**2)
    side = gap < np.minimum(np.abs(height), np.abs(height - length))
    upper = height > 0.5 * length
    ends = np.where(upper, 1.0, -1.0) * axis
    out = (rest / np.maximum(off, 1e-300) - rate * axis) / np.sqrt(1.0 + rate**2)
    return np.where(side, out, ends), np.where(side, 0, 1 + upper)


def blocked(scene, start, way, length, t):
    """Whether shapes block segments from `start` along unit vectors, up to a length."""
    found = np.zeros(t.size, dtype=bool)
    for shape in scene.shapes:
        found |= oracle_depth(shape, way, t, start) < length * (1.0 - 1e-7)
    return found


def light_rays(light, point, normal, rng):
    """Directions (3, n) to the light, distances, and irradiance that each stands for if open."""
    count = point.shape[1]
    if isinstance(light, SkyLight):
        # cosine-weighted about the normal
        way = rng.normal(size=(3, count))
        way = normal + way / np.linalg.norm(way, axis=0)
        way /= np.linalg.norm(way, axis=0)
        return way, np.full(count, np.inf), np.full(count, np.pi * light.radiance[0])
    if isinstance(light, SphereLight):
        out = rng.normal(size=(3, count))
        out /= np.linalg.norm(out, axis=0)
        spot = np.array(light.center)[:, None] + light.radius * out
        area = 4.0 * np.pi * light.radius**2
    else:
        a, b = rng.uniform(-1.0, 1.0, (2, count))
        u, v = np.array(light.half_u)[:, None], np.array(light.half_v)[:, None]
        spot, out = np.array(light.center)[:, None] + a * u + b * v, np.cross(u, v, axis=0)
        area = 4.0 * np.linalg.norm(out)
        out = out / np.linalg.norm(out)
    to = spot - point
    length = np.linalg.norm(to, axis=0)
    way = to / length
    cosines = np.maximum((normal * way).sum(axis=0), 0.0) * np.maximum(
        -(out * way).sum(axis=0), 0.0
    )
    return way, length, cosines * area / length**2 * light.radiance[0]


def plain_picture(scene, samples, seed=0):
    """Colour (3, height, width) by random rays over pixels, shutter and light, and its error."""
    rng, (width, height) = np.random.default_rng(seed), scene.camera.resolution
    albedo = np.array([shape.material.color for shape in scene.shapes])
    total, square = np.zeros((2, 3, height, width))
    column, row = (each.ravel() for each in np.meshgrid(np.arange(width), np.arange(height)))
    for _ in range(samples):
        dx, dy, t = rng.random((3, row.size))
        item, point, normal, _ = hits_of(scene, column + dx, row + dy, t - 0.5)
        point = point + 1e-7 * normal
        way, length, light = light_rays(scene.lights[0], point, normal, rng)
        light = np.where(blocked(scene, point, way, length, t - 0.5), 0.0, light)
        color = np.where(
            item >= 0, albedo[item].T / np.pi * light, np.array(scene.background)[:, None]
        )
        color = color.reshape(total.shape)
        total += color
        square += color * color
    mean = total / samples
    return mean, np.sqrt(np.maximum(square / samples - mean * mean, 0.0) / samples)


def plain_mask(scene, places=9, spots=300, seed=0):
    """Pixels (height, width) in a penumbra at their centres, and those that show several faces."""
    rng, (width, height) = np.random.default_rng(seed), scene.camera.resolution
    column, row = (each.ravel() for each in np.meshgrid(np.arange(width), np.arange(height)))
    now = np.zeros(row.size)
    item, point, normal, _ = hits_of(scene, column + 0.5, row + 0.5, now)
    point = point + 1e-7 * normal
    hidden, seen = np.zeros((2, row.size), dtype=int)
    for _ in range(spots):
        way, length, light = light_rays(scene.lights[0], point, normal, rng)
        shut = blocked(scene, point, way, length, now)
        hidden += shut & (light > 1e-6)
        seen += ~shut & (light > 1e-6)
    penumbra = (item >= 0) & (hidden > 0) & (seen > 0)
    low, high = np.full(row.size, 1 << 30), np.full(row.size, -(1 << 30))
    steps = (np.arange(places) + 0.5) / places
    for dx in steps:
        for dy in steps:
            face = hits_of(scene, column + dx, row + dy, now)[3]
            low, high = np.minimum(low, face), np.maximum(high, face)
    return penumbra.reshape(height, width), (low != high).reshape(height, width)
