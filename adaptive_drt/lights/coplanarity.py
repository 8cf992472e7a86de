# SPDX-License-Identifier: GPL-3.0-or-later
"""Coplanarity of lights and planar shapes, up to the rounding of their coordinates.

A light set into a ceiling is coplanar with it. Shadow rays end on the light's own surface, so the
ceiling cannot occlude it. Coordinates come from float32, so such a light lies a few units in the
last place above or below the plane, and on which side is accidental.
"""

from __future__ import annotations

import numpy as np

from ..geometry.planar_faces import PlanarFaces
from ..numerics.arrays import Array, Mask
from ..numerics.vector import dot

__all__ = ["faces_in_plane", "planes_through_ball"]


COORDINATE_ROUNDING = 32.0 * 2.0**-24
"""Largest distance between float32 coordinates of coplanar surfaces, as a fraction of the largest
coordinate; 2^-24 is float32's unit roundoff. Seen over 400 random positions in Blender, in units of
2^-24 of the largest coordinate: 2 where light and ceiling share their parents' rotations, 24 where
each has its own angles and one of those is applied to the mesh."""
MAX_RELATIVE_GAP = 2.0**-10
"""Largest gap that counts as coplanar, as a fraction of the size of the quad light (for other
lights, of the shape). In scenes so far from the world's origin that rounding is larger, coordinates
are taken as exact."""


def faces_in_plane(
    center: Array,
    normal: Array,
    radius: float,
    displacement: Array | None,
    faces: PlanarFaces,
    origin: Array,
) -> Mask:
    """Return which shapes lie in the plane of a flat light, during the whole shutter: (n,).

    All vertices of a shape must lie near the plane.

    Parameters
    ----------
    center, normal, radius, displacement : the light's centre (3, 1) metres, unit normal (3, 1),
        size in metres, and displacement (3, 1) metres over the shutter, or None.
    faces : the planar shapes, relative to the tracer's origin, as the light is.
    origin : (3, 1) metres, that origin in world space, in which coordinates were rounded.
    """
    largest = _largest_coordinates(center, radius, faces, origin)
    size = np.full(largest.shape, radius)
    away = [np.abs(dot(normal, vertex - center)) for vertex in faces.vertices]
    return _within_rounding(away, displacement, faces, normal, largest, size)


def planes_through_ball(
    center: Array, radius: float, displacement: Array | None, faces: PlanarFaces, origin: Array
) -> Mask:
    """Return which shapes have all of a ball near their plane, during the whole shutter: (n,).

    Only a point or a ball no larger than rounding can. The parameters are those of
    `faces_in_plane`.
    """
    largest = _largest_coordinates(center, radius, faces, origin)
    away = [np.abs(dot(faces.normal, faces.vertices[0] - center)) + radius]
    return _within_rounding(away, displacement, faces, faces.normal, largest, faces.size)


def _largest_coordinates(center: Array, radius: float, faces: PlanarFaces, origin: Array) -> Array:
    """Return bounds (n,) on the coordinates, in world space, of each shape and the light."""
    each = [np.abs(vertex + origin).max(axis=0) for vertex in faces.vertices]
    largest = np.maximum.reduce(each)
    found: Array = np.maximum(largest, float(np.abs(center + origin).max()) + radius)
    return found


def _within_rounding(
    away: list[Array],
    displacement: Array | None,
    faces: PlanarFaces,
    normal: Array,
    largest: Array,
    size: Array,
) -> Mask:
    """Whether distances `away` (n,) from planes are those of coplanar surfaces, up to rounding."""
    gap = np.maximum.reduce(away) + _relative_displacement(displacement, faces, normal)
    near: Mask = gap <= np.minimum(COORDINATE_ROUNDING * largest, MAX_RELATIVE_GAP * size)
    return near


def _relative_displacement(displacement: Array | None, faces: PlanarFaces, normal: Array) -> Array:
    """Largest displacement (n,) along normals of shapes relative to the light, from mid-shutter."""
    zero = np.zeros_like(faces.vertices[0])
    moved = zero if faces.displacement is None else faces.displacement
    if displacement is not None:
        moved = moved - displacement
    drift: Array = 0.5 * np.abs(dot(normal, moved))
    return drift
