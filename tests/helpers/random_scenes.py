# SPDX-License-Identifier: GPL-3.0-or-later
"""Seeded random scenes: all kinds of shapes, lights and motion, over wide ranges."""

import numpy as np

from adaptive_drt.scene.description import (
    Camera,
    DiskLight,
    Ellipsoid,
    Material,
    Motion,
    PointLight,
    Quad,
    QuadLight,
    Scene,
    Sphere,
    SphereLight,
    Triangle,
    vector_of,
)

__all__ = [
    "look_at",
    "random_camera",
    "random_ellipsoid",
    "random_floor",
    "random_light",
    "random_motion",
    "random_quad",
    "random_scene",
    "random_sphere",
    "scaled",
    "touch",
]


def look_at(location, target, **fields):
    """Camera at a location (3,) that looks at a target, upright as far as that is possible."""
    back = np.subtract(location, target)
    back = back / np.linalg.norm(back)
    up = (0.0, 0.0, 1.0) if abs(back[2]) < 0.99 else (0.0, 1.0, 0.0)
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    columns = np.stack([right, np.cross(back, right), back, np.array(location, dtype=float)], 1)
    rows = (*(tuple(float(x) for x in row) for row in columns), (0.0, 0.0, 0.0, 1.0))
    return Camera(matrix=rows, **fields)


def random_scene(seed, ellipsoids=False):
    """Scene of a seed: the same on every machine.

    ellipsoids : whether some of the spheres are ellipsoids of the same place and motion.
    """
    rng = np.random.default_rng(seed)
    shapes = [random_floor(rng)] if rng.random() < 0.85 else []
    shapes += [random_sphere(rng) for _ in range(rng.integers(1, 6))]
    shapes += [random_quad(rng) for _ in range(rng.integers(0, 3))]
    if ellipsoids:
        own = np.random.default_rng((seed, 1))
        shapes = [
            random_ellipsoid(own, x) if isinstance(x, Sphere) and own.random() < 0.7 else x
            for x in shapes
        ]
    lights = []
    while len(lights) < 1 + (rng.random() < 0.5) + (rng.random() < 0.3):
        light = random_light(rng)
        if not any(touch(light, shape) for shape in shapes):
            lights.append(light)
    scene = Scene(random_camera(rng), tuple(shapes), tuple(lights), tuple(rng.random(3).tolist()))
    return scaled(scene, 10.0 ** rng.uniform(-2, 3)) if rng.random() < 0.3 else scene


def _material(rng):
    return Material(vector_of(rng.uniform(0.1, 1.0, 3)))


def random_motion(rng, share, size=1.5):
    """A motion for a share of things; some go along an axis, as keyframed things do."""
    if rng.random() >= share:
        return None
    move = rng.normal(size=3) * size * rng.random()
    if rng.random() < 0.4:
        move *= np.eye(3)[rng.integers(3)]
    return Motion(vector_of(move))


def random_floor(rng):
    half = rng.uniform(3.0, 20.0)
    motion = random_motion(rng, 0.05)
    corner, u, v = (-half, -half, 0.0), (2.0 * half, 0.0, 0.0), (0.0, 2.0 * half, 0.0)
    return Quad(corner, u, v, _material(rng), motion, "Floor")


def random_sphere(rng):
    radius = float(10.0 ** rng.uniform(-1.8, 0.3))
    center = rng.uniform((-2.0, -2.0, 0.0), (2.0, 2.0, 3.0))
    if rng.random() < 0.4:
        center[2] = radius  # rests on the floor: contact shadows
    return Sphere(vector_of(center), radius, _material(rng), random_motion(rng, 0.3))


def random_ellipsoid(rng, sphere):
    """An ellipsoid within a sphere, of its material and motion."""
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    size = 10.0 ** rng.uniform(-1.0, 0.0, 3) if rng.random() < 0.5 else rng.uniform(0.4, 1.0, 3)
    # any three conjugate half axes
    axes = sphere.radius * turn @ np.diag(size) @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return Ellipsoid(
        sphere.center, *(vector_of(axis) for axis in axes.T), sphere.material, sphere.motion
    )


def random_quad(rng):
    u, v = rng.normal(size=(2, 3)) * rng.uniform(0.1, 1.5, (2, 1))
    if rng.random() < 0.5:
        v = np.cross(u, v) / np.linalg.norm(u)
    corner = rng.uniform((-2.0, -2.0, 0.0), (2.0, 2.0, 3.0)) - (u + v) / 2.0
    return Quad(
        vector_of(corner), vector_of(u), vector_of(v), _material(rng), random_motion(rng, 0.3)
    )


def random_light(rng):
    center = rng.uniform((-4.0, -4.0, 1.5), (4.0, 4.0, 7.0))
    color = vector_of(rng.uniform(0.5, 20.0, 3))
    motion, shadow = random_motion(rng, 0.15), bool(rng.random() < 0.95)
    radius = float(10.0 ** rng.uniform(-1.5, 0.2))
    kind = rng.integers(4)
    if kind == 0:
        down = -center / np.linalg.norm(center) + 0.4 * rng.normal(size=3)
        u = np.cross(down, rng.normal(size=3))
        u *= radius / np.linalg.norm(u)
        v = np.cross(down, u)
        v *= radius * rng.uniform(0.2, 2.0) / np.linalg.norm(v)
        if rng.random() < 0.2:
            v = v + 0.5 * u
        return QuadLight(vector_of(center), vector_of(u), vector_of(v), color, motion, shadow)
    if kind == 1:
        return SphereLight(vector_of(center), radius, color, motion, shadow)
    if kind == 2:
        return DiskLight(vector_of(center), radius, color, motion, shadow)
    return PointLight(vector_of(center), color, motion, shadow)


def touch(light, shape):
    """Whether a light might meet a shape on the way of either; the floor's plane may cut it."""
    reach = getattr(light, "radius", 0.0)
    if hasattr(light, "half_u"):
        reach = np.linalg.norm(np.abs(light.half_u) + np.abs(light.half_v))
    way = [
        np.zeros(3) if x.motion is None else np.array(x.motion.displacement) / 2.0
        for x in (light, shape)
    ]
    if isinstance(shape, Sphere):
        middle, size = np.array(shape.center), shape.radius
    elif isinstance(shape, Ellipsoid):
        axes = np.array([shape.half_u, shape.half_v, shape.half_w])
        middle, size = np.array(shape.center), np.linalg.norm(axes, 2)
    elif isinstance(shape, Triangle):
        middle = np.mean(shape.vertices, axis=0)
        size = np.linalg.norm(np.array(shape.vertices) - middle, axis=1).max()
    else:
        middle = np.array(shape.corner) + np.add(shape.edge_u, shape.edge_v) / 2.0
        size = np.linalg.norm(np.abs(shape.edge_u) + np.abs(shape.edge_v)) / 2.0
        if shape.name == "Floor":
            return light.center[2] - reach < abs(way[0][2]) + abs(way[1][2]) + 0.01
    apart = np.linalg.norm(middle - np.array(light.center))
    return apart < (reach + size + sum(np.linalg.norm(w) for w in way)) * 1.01


def random_camera(rng):
    location = rng.normal(size=3)
    location[2] = abs(location[2]) + 0.2
    location *= rng.uniform(5.0, 12.0) / np.linalg.norm(location)
    width, height = (int(x) for x in rng.integers(24, 41, 2))
    fields = {"focal_length": float(rng.uniform(20.0, 90.0)), "resolution": (width, height)}
    if rng.random() < 0.3:
        fields["sensor_fit"] = str(rng.choice(["HORIZONTAL", "VERTICAL"]))
        fields["shift_x"], fields["shift_y"] = (float(x) for x in rng.uniform(-0.2, 0.2, 2))
        fields["pixel_aspect"] = (1.0, float(rng.uniform(0.6, 1.7)))
    if rng.random() < 0.08:
        fields["motion"] = random_motion(rng, 1.0, 0.3)
    target = rng.uniform((-1.0, -1.0, 0.0), (1.0, 1.0, 1.0))
    return look_at(vector_of(location), vector_of(target), **fields)


def scaled(scene, factor):
    """The same picture from a scene `factor` times as large (point lights get brighter)."""

    def grow(thing):
        changes = {}
        for name in ("center", "corner", "edge_u", "edge_v", "half_u", "half_v", "half_w"):
            if hasattr(thing, name):
                changes[name] = vector_of(np.array(getattr(thing, name)) * factor)
        if hasattr(thing, "radius"):
            changes["radius"] = thing.radius * factor
        if hasattr(thing, "intensity"):
            changes["intensity"] = vector_of(np.array(thing.intensity) * factor**2)
        if thing.motion is not None:
            changes["motion"] = Motion(vector_of(np.array(thing.motion.displacement) * factor))
        return type(thing)(**{**thing.__dict__, **changes})

    rows = [list(row) for row in scene.camera.matrix]
    for row in rows[:3]:
        row[3] *= factor
    fields = {**scene.camera.__dict__, "matrix": tuple(tuple(row) for row in rows)}
    if scene.camera.motion is not None:
        move = np.array(scene.camera.motion.displacement) * factor
        fields["motion"] = Motion(vector_of(move))
    shapes, lights = (tuple(grow(x) for x in group) for group in (scene.shapes, scene.lights))
    return Scene(Camera(**fields), shapes, lights, scene.background, scene.transparent)
