# SPDX-License-Identifier: GPL-3.0-or-later
"""Closed meshes that shine: what their inner sides send never gets out, so those are no lights."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...adaptive_drt.scene.description import (
    Camera,
    Cylinder,
    Light,
    Motion,
    PolygonLight,
    Quad,
    QuadLight,
    Quads,
    ShapeRecord,
    Sphere,
    Triangle,
    Triangles,
)
from ...adaptive_drt.scene.mesh_instances import MeshInstances
from ...adaptive_drt.scene.sphere_batch import Spheres
from ...adaptive_drt.scene.triangle_mesh import TriangleMesh

Array = NDArray[np.float64]

FLAT = (Quad, Quads, Triangle, Triangles)
"""Records of flat faces."""

ON_PLANE = 1e-5
"""Distance from a face's plane, as a fraction of a solid's size, of vertices that count as on it:
they come from float32, and sides are told to be parallelograms to 2e-5."""


@dataclass(frozen=True)
class ClosedSolid:
    """Faces of a closed mesh that have all of it on one side, so that their outer sides are known.

    Attributes
    ----------
    normals, offsets : (3, f) outwards and (f,) metres; points inside are below all these planes.
    slack : metres, by which points may be below a plane and count as on it.
    points : (3, k), the vertices.  inner : lights on the inner sides.
    """

    points: Array
    normals: Array
    offsets: Array
    slack: float
    motion: Motion | None
    inner: tuple[Light, ...]

    def may_hold(self, points: Array, motion: Motion | None, radius: Array | float = 0.0) -> bool:
        """Whether one of n things may be inside, each of which v points (3, v, n) enclose, or balls
        of radii (n,) metres around them.
        """
        way = _displacement(motion) - _displacement(self.motion)
        outside = np.zeros(points.shape[2], dtype=np.bool_)
        for normal, offset in zip(self.normals.T, self.offsets, strict=True):
            low = np.tensordot(normal, points, 1).min(axis=0) - 0.5 * abs(float(normal @ way))
            outside |= low - radius >= offset - self.slack
        if points.shape[1] > 2:  # the planes of flat shapes may have all of the solid on one side
            first = points[:, 0]
            normal = np.cross(points[:, 1] - first, points[:, 2] - first, axis=0)
            normal /= np.maximum(np.linalg.norm(normal, axis=0), np.finfo(np.float64).tiny)
            heights = (normal[:, None] * (points - first[:, None])).sum(axis=0)
            own = normal.T @ self.points - (normal * first).sum(axis=0)[:, None]
            room = 0.5 * np.abs(way @ normal) - self.slack
            above = own.min(axis=1) >= heights.max(axis=0) + room
            outside |= above | (own.max(axis=1) <= heights.min(axis=0) - room)
        return not bool(outside.all())


def is_closed(mesh: Any) -> bool:
    """Whether every edge of a Blender mesh's faces joins two of them."""
    edges = np.empty(len(mesh.loops), dtype=np.int32)
    mesh.attributes[".corner_edge"].data.foreach_get("value", edges)
    uses = np.bincount(edges)
    return bool((uses[uses > 0] == 2).all())


def closed_solid(shapes: Sequence[ShapeRecord], lights: Sequence[Light]) -> ClosedSolid | None:
    """Return a closed mesh of flat faces as a solid; None where no outer side is known.

    Parameters
    ----------
    shapes : all of the mesh's faces.  lights : those of its faces, the two sides of each in turn.
    """
    if not lights or not all(isinstance(shape, FLAT) for shape in shapes):
        return None
    points = np.hstack([_points(shape).reshape(3, -1) for shape in shapes])
    slack = ON_PLANE * float(np.ptp(points, axis=1).max())
    normals, offsets, inner = [], [], []
    for pair in zip(lights[::2], lights[1::2], strict=True):
        for light, other in (pair, pair[::-1]):
            normal, place = _front(light)
            offset = float(normal @ place)
            if float((normal @ points).max()) <= offset + slack:
                normals.append(normal)
                offsets.append(offset)
                inner.append(other)
                break
    if not inner:
        return None
    planes = np.array(normals).T, np.array(offsets)
    return ClosedSolid(points, *planes, slack, lights[0].motion, tuple(inner))


def unseen_lights(
    solids: Iterable[tuple[ClosedSolid, Sequence[ShapeRecord]]],
    shapes: Sequence[ShapeRecord],
    camera: Camera,
) -> set[int]:
    """Return the identities of lights that nothing can see.

    Parameters
    ----------
    solids : each with its own shapes, which are among all `shapes`.
    """
    eye = np.array([row[3] for row in camera.matrix[:3]])[:, None, None]
    found: set[int] = set()
    for solid, own in solids:
        faces = set(map(id, own))
        others = (shape for shape in shapes if id(shape) not in faces)
        if solid.may_hold(eye, camera.motion) or any(_may_be_in(solid, each) for each in others):
            continue
        found |= {id(light) for light in solid.inner}
    return found


def _may_be_in(solid: ClosedSolid, shape: ShapeRecord) -> bool:
    if isinstance(shape, MeshInstances):
        return True  # they are many: that none is inside is not worth a proof
    radius = shape.radius if isinstance(shape, Sphere | Spheres) else 0.0
    if isinstance(shape, Cylinder):
        radius = max(shape.radii)
    return solid.may_hold(_points(shape), shape.motion, radius)


def _points(shape: Any) -> Array:
    """Points (3, v, n) that enclose each of n shapes, or the path of a ball's centre or an axis."""
    if isinstance(shape, Sphere):
        return np.array(shape.center)[:, None, None]
    if isinstance(shape, Cylinder):
        return np.stack([shape.start, shape.end], axis=1)[..., None]
    if isinstance(shape, Spheres):
        way = 0.0 if shape.displacement is None else 0.5 * shape.displacement
        return np.stack([shape.center - way, shape.center + way], axis=1)
    if isinstance(shape, TriangleMesh):
        return shape.vertices[..., None]
    if isinstance(shape, Triangles):
        return shape.vertices.transpose(1, 0, 2)
    if isinstance(shape, Quad | Quads):
        names = ("corner", "edge_u", "edge_v")
        place, u, v = (np.reshape(np.array(getattr(shape, name)), (3, -1)) for name in names)
        return np.stack([place, place + u, place + v, place + u + v], axis=1)
    if isinstance(shape, Triangle):
        return np.array(shape.vertices).T[..., None]
    names = ("half_u", "half_v", "half_w")  # an ellipse has two, an ellipsoid three
    axes = np.array([getattr(shape, name) for name in names if hasattr(shape, name)])
    signs = np.array(list(itertools.product((-1.0, 1.0), repeat=len(axes))))
    corners: Array = np.array(shape.center)[:, None] + (signs @ axes).T
    return corners[..., None]


def _front(light: Any) -> tuple[Array, Array]:
    """Unit normal (3,) of the side that a flat light shines on, and a point (3,) of it."""
    if isinstance(light, QuadLight):
        normal, place = np.cross(light.half_u, light.half_v), np.array(light.center)
    else:
        assert isinstance(light, PolygonLight)
        corners = np.array(light.vertices)
        place = corners.mean(axis=0)
        local = corners - place
        normal = np.cross(local, np.roll(local, -1, axis=0)).sum(axis=0)
    unit: Array = normal / np.linalg.norm(normal)
    return unit, place


def _displacement(motion: Motion | None) -> Array:
    return np.zeros(3) if motion is None else np.array(motion.displacement)
