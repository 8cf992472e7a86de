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
from .emitter import QUAD, Emitter

__all__ = ["coplanar_quads"]


COORDINATE_ROUNDING = 32.0 * 2.0**-24
"""Largest distance between float32 coordinates of coplanar surfaces, as a fraction of the largest
coordinate; 2^-24 is float32's unit roundoff. Seen over 400 random positions in Blender, in units of
2^-24 of the largest coordinate: 2 where light and ceiling share their parents' rotations, 24 where
each has its own angles and one of those is applied to the mesh."""
MAX_RELATIVE_GAP = 2.0**-10
"""Largest gap that counts as coplanar, as a fraction of the size of the quad light (for other
lights, of the quad). In scenes so far from the world's origin that rounding is larger, coordinates
are taken as exact."""


def coplanar_quads(light: Emitter, quads: ParallelogramSet, origin: Array) -> Mask:
    """Return which quads lie in the plane of a light, during the whole shutter: (n,).

    For a quad light, all corners of a quad must lie near the light's plane. For another light, all
    of the light must lie near the quad's plane, as only a point or a ball no larger than rounding
    can.

    Parameters
    ----------
    light, quads : relative to the tracer's origin.
    origin : (3, 1) metres, that origin in world space, in which coordinates were rounded.
    """
    q, u, v = quads.corner, quads.edge_u, quads.edge_v
    corners = (q, q + u, q + v, q + u + v)
    largest = np.maximum.reduce([np.abs(corner + origin).max(axis=0) for corner in corners])
    largest = np.maximum(largest, float(np.abs(light.center + origin).max()) + light.radius)
    if light.kind == QUAD:
        normal, size = light.normal, np.full(largest.shape, light.radius)
        away = [np.abs(dot(normal, corner - light.center)) for corner in corners]
    else:
        normal = cross(u, v)
        normal = normal / np.sqrt(dot(normal, normal))
        size = np.sqrt(np.minimum(dot(u, u), dot(v, v)))
        away = [np.abs(dot(normal, q - light.center)) + light.radius]
    gap = np.maximum.reduce(away) + _relative_displacement(light, quads, normal)
    near: Mask = gap <= np.minimum(COORDINATE_ROUNDING * largest, MAX_RELATIVE_GAP * size)
    return near


def _relative_displacement(light: Emitter, quads: ParallelogramSet, normal: Array) -> Array:
    """Largest displacement (n,) along normals of quads relative to the light, from mid-shutter."""
    zero = np.zeros_like(quads.corner)
    moved = zero if quads.displacement is None else quads.displacement
    if light.displacement is not None:
        moved = moved - light.displacement
    drift: Array = 0.5 * np.abs(dot(normal, moved))
    return drift
