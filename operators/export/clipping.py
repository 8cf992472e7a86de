# SPDX-License-Identifier: GPL-3.0-or-later
"""What a camera's Clip Start and Clip End would cut off in Blender's own renderers."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ...adaptive_drt.scene.description import (
    Camera,
    Cylinder,
    Ellipsoid,
    Issue,
    Motion,
    ShapeBatch,
    ShapeRecord,
    Sphere,
    Triangle,
    Triangles,
    Vector,
)
from ...adaptive_drt.scene.mesh_instances import MeshInstances
from ...adaptive_drt.scene.sphere_batch import Spheres
from ...adaptive_drt.scene.triangle_mesh import TriangleMesh
from .shutter import Matrix

MOST_POINTS = 100_000
"""Number of vertices of all instances of a mesh from which only some are looked at."""

STILL: Vector = (0.0, 0.0, 0.0)

ELLIPSOID_POINTS = 400
"""Number of points of an ellipsoid's surface that are looked at: they are some 0.1 radii apart."""

MOMENTS = np.linspace(-0.5, 0.5, 9)
"""Of the shutter, at which moving shapes are looked at."""


def clipped(
    data: Any, camera: Camera, shapes: Sequence[ShapeRecord], clip: tuple[float, float]
) -> Iterator[Issue]:
    """Yield an issue for each shape that reaches nearer or farther than the camera shows.

    Here all of a shape is rendered. Near is a ball around the camera as large as the part of the
    view before Clip Start; far is depth along the camera's axis.

    Parameters
    ----------
    data : Blender's camera.
    clip : its Clip Start and Clip End.
    """
    if not shapes:
        return
    start, far = clip
    near = start * _slant(data, camera)
    # what is not finite makes no issue here: it has its own
    with np.errstate(all="ignore"):
        closest, deepest = _reach(camera, shapes)
    owner = np.repeat(np.arange(len(shapes)), list(map(_count, shapes)))
    cut = np.flatnonzero((deepest > 0.0) & ((closest < near) | (deepest > far)))
    # an object of many parts is told once, of its first one
    told = 2 * owner[cut] + (closest[cut] < near)
    for index in cut[np.sort(np.unique(told, return_index=True)[1])]:
        if closest[index] < near:
            said = f"is nearer than the camera's Clip Start, {start:.4g} m"
            remedy = "lower Clip Start, so that all renderers show it, or move it away"
        else:
            said = f"reaches beyond the camera's Clip End, {far:.4g} m"
            remedy = "raise Clip End, so that all renderers show it, or make it smaller"
        yield Issue(shapes[owner[index]].name, f"it {said}, and is not cut there: {remedy}")


def _slant(data: Any, camera: Camera) -> float:
    """Return how much longer than its depth the longest ray of the picture is, at most."""
    half = 0.5 * max(data.sensor_width, data.sensor_height) / camera.focal_length
    side = half * (1.0 + 2.0 * max(abs(camera.shift_x), abs(camera.shift_y)))
    return math.sqrt(1.0 + 2.0 * side * side)


def _reach(camera: Camera, shapes: Sequence[ShapeRecord]) -> tuple[Matrix, Matrix]:
    """Return the shapes' least distances from the camera and greatest depths, (n,) metres."""
    matrix = np.array(camera.matrix)[:3]
    forward = -matrix[:, 2] / np.linalg.norm(matrix[:, 2])
    parts = list(map(_parts, shapes))
    place = np.concatenate([points for points, _, _ in parts]) - matrix[:, 3]
    radius = np.concatenate([each for _, _, each in parts])
    ways = np.concatenate(list(map(_ways, shapes))) - np.array(_way(camera.motion))
    flat = np.repeat([edges is not None for _, edges, _ in parts], [len(each[2]) for each in parts])
    # of a straight motion an end is the deepest
    deepest = place @ forward + 0.5 * np.abs(ways @ forward) + radius
    closest = np.empty(radius.size)
    closest[~flat] = _point_distances(place[~flat], ways[~flat], radius[~flat])
    if flat.any():
        edges = np.concatenate([each for _, each, _ in parts if each is not None])
        closest[flat] = _flat_distances(place[flat], edges, ways[flat], radius[flat])
        deepest[flat] += np.maximum(edges @ forward, 0.0).sum(axis=1)
    return closest, deepest


def _point_distances(place: Matrix, ways: Matrix, radius: Matrix) -> Matrix:
    """Return least distances (n,) of balls from the origin, at `MOMENTS` of straight motions."""
    # there may be millions, which the squares' polynomial takes a tenth of the time for; what it
    # cancels is some 1e-8 of the distance
    square, slope, bend = _products(place, place), _products(place, ways), _products(ways, ways)
    closest = np.abs(np.sqrt(square) - radius)
    for moment in MOMENTS if ways.any() else ():
        at = np.maximum(square + moment * (2.0 * slope + moment * bend), 0.0)
        np.minimum(closest, np.abs(np.sqrt(at) - radius), out=closest)
    return closest


def _flat_distances(place: Matrix, edges: Matrix, ways: Matrix, radius: Matrix) -> Matrix:
    """Return the same of parallelograms with edges (n, 2, 3), or of capsules around one edge."""
    lengths = (edges * edges).sum(axis=2)
    closest = np.full(radius.size, np.inf)
    for moment in MOMENTS if ways.any() else (0.0,):
        at = place + moment * ways
        # the nearest point of a rectangle; of a slanted parallelogram one that is nearly as near
        along = -(edges * at[:, None]).sum(axis=2) / np.where(lengths > 0.0, lengths, 1.0)
        nearest = at + (np.clip(along, 0.0, 1.0)[..., None] * edges).sum(axis=1)
        closest = np.minimum(closest, np.abs(np.linalg.norm(nearest, axis=1) - radius))
    return closest


def _products(one: Matrix, other: Matrix) -> Matrix:
    """Return dot products (n,) of vectors (n, 3)."""
    found: Matrix = sum(one[:, k] * other[:, k] for k in range(3))
    return found


def _count(shape: ShapeRecord) -> int:
    """Return the number of parts of a record: three of a triangle, the vertices of a mesh."""
    if isinstance(shape, MeshInstances):
        return len(_instance_points(shape))
    if isinstance(shape, TriangleMesh):
        return shape.vertices.shape[1]
    if isinstance(shape, Ellipsoid):
        return ELLIPSOID_POINTS
    count = shape.count if isinstance(shape, ShapeBatch) else 1
    return 3 * count if isinstance(shape, Triangle | Triangles) else count


def _ellipsoid_points(shape: Ellipsoid) -> Matrix:
    """Return points (n, 3) of an ellipsoid's surface, along a spiral around one of its axes."""
    height = 1.0 - (2.0 * np.arange(ELLIPSOID_POINTS) + 1.0) / ELLIPSOID_POINTS
    turn = np.pi * (3.0 - math.sqrt(5.0)) * np.arange(ELLIPSOID_POINTS)
    side = np.sqrt(1.0 - height * height)
    place = np.stack([side * np.cos(turn), side * np.sin(turn), height], axis=1)
    points: Matrix = shape.center + place @ np.array([shape.half_u, shape.half_v, shape.half_w])
    return points


def _parts(shape: ShapeRecord) -> tuple[Matrix, Matrix | None, Matrix]:
    """Return a record's n parts: points (n, 3), two edges from each (n, 2, 3), a radius (n,).

    Instead of edges None: there are none.
    """
    if isinstance(shape, Sphere):
        return np.array([shape.center]), None, np.array([shape.radius])
    if isinstance(shape, Cylinder):
        axis = np.subtract(shape.end, shape.start)
        # the capsule around it
        edges = np.array([[axis, np.zeros(3)]])
        return np.array([shape.start]), edges, np.array([max(shape.radii)])
    if isinstance(shape, Spheres):
        return shape.center.T, None, shape.radius
    if isinstance(shape, MeshInstances | Ellipsoid):
        if isinstance(shape, Ellipsoid):
            points = _ellipsoid_points(shape)
        else:
            points = _instance_points(shape)
        return points, None, np.zeros(len(points))
    if isinstance(shape, TriangleMesh):
        # its faces are so many that the points between their corners may be left out
        return shape.vertices.T, None, np.zeros(shape.vertices.shape[1])
    if isinstance(shape, Triangle | Triangles):
        # it is the union of three parallelograms, one at each vertex, with edges of half the length
        a, b, c = np.reshape(shape.vertices, (3, 3, -1)).transpose(0, 2, 1)
        halves = [
            np.stack([(y - x) / 2.0, (z - x) / 2.0], axis=1)
            for x, y, z in ((a, b, c), (b, c, a), (c, a, b))
        ]
        return np.concatenate([a, b, c]), np.concatenate(halves), np.zeros(3 * len(a))
    corner, u, v = (np.reshape(x, (3, -1)).T for x in (shape.corner, shape.edge_u, shape.edge_v))
    return corner, np.stack([u, v], axis=1), np.zeros(len(corner))


def _ways(shape: ShapeRecord) -> Matrix:
    """Return the displacements (n, 3) of a record's n parts, metres over the shutter."""
    if isinstance(shape, Spheres) and shape.displacement is not None:
        return shape.displacement.T
    return np.tile(np.array(_way(shape.motion)), (_count(shape), 1))


def _instance_points(shape: MeshInstances) -> Matrix:
    """Return points (n, 3) of instances: some of their vertices, where there are many of both."""
    matrices = shape.matrices[len(shape.matrices) // 2]
    vertices = shape.mesh.vertices
    step = max(1, vertices.shape[1] * matrices.shape[2] // MOST_POINTS)
    some = vertices[:, ::step]
    points = matrices.transpose(2, 0, 1)[..., :3] @ some + matrices.transpose(2, 0, 1)[..., 3:]
    return np.ascontiguousarray(points.transpose(0, 2, 1).reshape(-1, 3))


def _way(motion: Motion | None) -> Vector:
    return STILL if motion is None else motion.displacement
