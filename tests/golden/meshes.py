# SPDX-License-Identifier: GPL-3.0-or-later
"""A golden scene of meshes recognised as spheres and parallelograms, under lights in watts."""

import math

import numpy as np

from adaptive_drt.scene.description import (
    Material,
    PointLight,
    QuadLight,
    Quads,
    Sphere,
    SphereLight,
)
from adaptive_drt.scene.primitive_recognition import MeshSphere, recognise_primitive
from adaptive_drt.scene.units import area_radiance, light_power, point_intensity, sphere_radiance

from .case import case

__all__ = ["MESH_CASES"]

CLAY = Material((0.7, 0.5, 0.3))


def _shapes(points, faces):
    """The shapes that a mesh stands for; none where some are triangles."""
    # float32, as Blender holds them: so the last bits of sines and cosines do not count
    places = np.array(points, dtype=np.float32).T.astype(np.float64)
    sizes = [len(face) for face in faces]
    starts = np.cumsum([0, *sizes[:-1]])
    corners = np.concatenate([np.array(face) for face in faces])
    found = recognise_primitive(places, corners, starts, np.zeros(len(faces), dtype=np.int64))
    if isinstance(found, MeshSphere):
        return [Sphere(found.center, found.radius, CLAY)]
    if isinstance(found, str) or found.triangles.slot.size:
        return []
    flat = found.parallelograms
    return [Quads(flat.corner, flat.edge_u, flat.edge_v, flat.slot, (CLAY,), name="Quad")]


def _uv_sphere(center, radius, segments, rings):
    points, faces = [(0.0, 0.0, 1.0)], []
    for ring in range(1, rings):
        height, wide = math.cos(math.pi * ring / rings), math.sin(math.pi * ring / rings)
        turns = (2.0 * math.pi * k / segments for k in range(segments))
        points += [(wide * math.cos(t), wide * math.sin(t), height) for t in turns]
    points.append((0.0, 0.0, -1.0))

    def at(ring, k):
        return 1 + (ring - 1) * segments + k % segments

    for k in range(segments):
        faces.append((0, at(1, k), at(1, k + 1)))
        for ring in range(1, rings - 1):
            above, below = (at(ring, k), at(ring, k + 1)), (at(ring + 1, k + 1), at(ring + 1, k))
            faces.append((above[0], below[1], below[0], above[1]))
        faces.append((len(points) - 1, at(rings - 1, k + 1), at(rings - 1, k)))
    return _placed(points, center, radius), faces


def _icosphere(center, radius, divided):
    g = 0.5 * (1.0 + math.sqrt(5.0))
    flat = [(a, b) for a in (-1.0, 1.0) for b in (-g, g)]
    points = [p for a, b in flat for p in ((0.0, a, b), (a, b, 0.0), (b, 0.0, a))]

    def near(a, b):
        return abs(math.dist(points[a], points[b]) - 2.0) < 1e-9

    faces = [
        (a, b, c)
        for a in range(12)
        for b in range(a)
        for c in range(b)
        if near(a, b) and near(b, c) and near(a, c)
    ]
    if divided:
        middle = {}
        for face in faces:
            for a, b in zip(face, face[1:] + face[:1], strict=True):
                if (b, a) not in middle and (a, b) not in middle:
                    middle[a, b] = middle[b, a] = len(points)
                    points.append(tuple(x + y for x, y in zip(points[a], points[b], strict=True)))
        smaller = []
        for a, b, c in faces:
            ab, bc, ca = middle[a, b], middle[b, c], middle[c, a]
            smaller += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        faces = smaller
    lengths = [math.hypot(*p) for p in points]
    unit = [tuple(x / n for x in p) for p, n in zip(points, lengths, strict=True)]
    return _placed(unit, center, radius), faces


def _placed(points, center, radius):
    return [tuple(c + radius * x for c, x in zip(center, p, strict=True)) for p in points]


def _cube(corner, size):
    points = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return [tuple(c + size * x for c, x in zip(corner, p, strict=True)) for p in points], faces


def _grid(corner, count, step, triangles):
    """A plane of count x count faces, in quads or triangles, with a loose vertex."""
    x0, y0, z0 = corner
    points = [
        (x0 + step * i, y0 + step * j, z0) for j in range(count + 1) for i in range(count + 1)
    ]
    faces = []
    for j in range(count):
        for i in range(count):
            a, b = j * (count + 1) + i, (j + 1) * (count + 1) + i
            faces += [(a, a + 1, b + 1), (a, b + 1, b)] if triangles else [(a, a + 1, b + 1, b)]
    return [*points, (50.0, 0.0, 0.0)], faces


def _bent_strip():
    """An L of three squares, which is no parallelogram, and has parts that are."""
    points, faces = _grid((-2.5, 1.0, 0.8), 2, 0.7, False)
    return points, faces[:3]


TETRAHEDRON = (
    ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)),
    (
        (0, 1, 2),
        (0, 3, 1),
        (0, 2, 3),
        (1, 3, 2),
    ),
)
MESHES = (
    _grid((-5.0, -5.0, 0.0), 3, 10.0 / 3.0, True),
    _uv_sphere((0.0, 0.0, 1.0), 0.8, 12, 7),
    _icosphere((1.5, -1.0, 0.5), 0.5, False),
    _icosphere((-1.5, -1.0, 0.4), 0.4, True),
    _cube((0.6, 0.6, 0.0), 0.9),
    _bent_strip(),
    TETRAHEDRON,
)
WATTS = light_power(300.0, (1.0, 0.9, 0.8), 0.5, (1.0, 0.95, 0.9))

MESH_CASES = {
    "meshes, lights in watts": case(
        [shape for points, faces in MESHES for shape in _shapes(points, faces)],
        (
            QuadLight((1.0, -1.0, 5.0), (0.7, 0, 0), (0, -0.5, 0), area_radiance(WATTS, 1.4)),
            SphereLight((2.0, -2.0, 4.0), 0.4, sphere_radiance(WATTS, 0.4)),
            PointLight((-2.0, -2.0, 4.0), point_intensity(WATTS)),
        ),
    ),
}
"""Name: case."""
