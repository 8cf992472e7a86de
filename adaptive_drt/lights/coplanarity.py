# SPDX-License-Identifier: GPL-3.0-or-later
"""Coplanarity of lights and quads: which quads lie in the plane of a light, up to rounding.

A light set into a ceiling is coplanar with it. Shadow rays end on the light's own surface, so the
ceiling cannot occlude it. Coordinates come from float32, so such a light lies a few units in the
last place above or below the plane, and on which side is accidental.
"""

from __future__ import annotations

import numpy as np

from ..geometry.polygon.shape import ParallelogramSet
from ..numerics.arrays import Array, Mask
from ..numerics.vector import cross, dot

__all__ = ["planes_through_ball", "quads_in_plane"]


COORDINATE_ROUNDING = 32.0 * 2.0**-24
"""Largest distance between float32 coordinates of coplanar surfaces, as a fraction of the largest
coordinate; 2^-24 is float32's unit roundoff. Seen over 400 random positions in Blender, in units of
2^-24 of the largest coordinate: 2 where light and ceiling share their parents' rotations, 24 where
each has its own angles and one of those is applied to the mesh."""
MAX_RELATIVE_GAP = 2.0**-10
"""Largest gap that counts as coplanar, as a fraction of the size of the quad light (for other
lights, of the quad). In scenes so far from the world's origin that rounding is larger, coordinates
are taken as exact."""


def quads_in_plane(
    center: Array,
    normal: Array,
    radius: float,
    displacement: Array | None,
    quads: ParallelogramSet,
    origin: Array,
) -> Mask:
    """Return which quads lie in the plane of a flat light, during the whole shutter: (n,).

    All corners of a quad must lie near the plane.

    Parameters
    ----------
    center, normal, radius, displacement : the light's centre (3, 1) metres, unit normal (3, 1),
        size in metres, and displacement (3, 1) metres over the shutter, or None.
    quads : relative to the tracer's origin, as the light is.
    origin : (3, 1) metres, that origin in world space, in which coordinates were rounded.
    """
    corners = _corners(quads)
    largest = _largest_coordinates(center, radius, corners, origin)
    size = np.full(largest.shape, radius)
    away = [np.abs(dot(normal, corner - center)) for corner in corners]
    return _within_rounding(away, displacement, quads, normal, largest, size)


def planes_through_ball(
    center: Array, radius: float, displacement: Array | None, quads: ParallelogramSet, origin: Array
) -> Mask:
    """Return which quads have all of a ball near their plane, during the whole shutter: (n,).

    Only a point or a ball no larger than rounding can. The parameters are those of
    `quads_in_plane`.
    """
    largest = _largest_coordinates(center, radius, _corners(quads), origin)
    u, v = quads.edge_u, quads.edge_v
    normal = cross(u, v)
    normal = normal / np.sqrt(dot(normal, normal))
    size = np.sqrt(np.minimum(dot(u, u), dot(v, v)))
    away = [np.abs(dot(normal, quads.corner - center)) + radius]
    return _within_rounding(away, displacement, quads, normal, largest, size)


def _corners(quads: ParallelogramSet) -> tuple[Array, ...]:
    """Return the four corners (3, n) of quads."""
    q, u, v = quads.corner, quads.edge_u, quads.edge_v
    return (q, q + u, q + v, q + u + v)


def _largest_coordinates(
    center: Array, radius: float, corners: tuple[Array, ...], origin: Array
) -> Array:
    """Return bounds (n,) on the coordinates, in world space, of each quad and the light."""
    largest = np.maximum.reduce([np.abs(corner + origin).max(axis=0) for corner in corners])
    found: Array = np.maximum(largest, float(np.abs(center + origin).max()) + radius)
    return found


def _within_rounding(
    away: list[Array],
    displacement: Array | None,
    quads: ParallelogramSet,
    normal: Array,
    largest: Array,
    size: Array,
) -> Mask:
    """Whether distances `away` (n,) from planes are those of coplanar surfaces, up to rounding."""
    gap = np.maximum.reduce(away) + _relative_displacement(displacement, quads, normal)
    near: Mask = gap <= np.minimum(COORDINATE_ROUNDING * largest, MAX_RELATIVE_GAP * size)
    return near


def _relative_displacement(
    displacement: Array | None, quads: ParallelogramSet, normal: Array
) -> Array:
    """Largest displacement (n,) along normals of quads relative to the light, from mid-shutter."""
    zero = np.zeros_like(quads.corner)
    moved = zero if quads.displacement is None else quads.displacement
    if displacement is not None:
        moved = moved - displacement
    drift: Array = 0.5 * np.abs(dot(normal, moved))
    return drift
