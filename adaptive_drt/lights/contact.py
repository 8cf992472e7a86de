# SPDX-License-Identifier: GPL-3.0-or-later
"""Contact of lights and quads: which quads lie in the plane of a light, up to rounding.

A light that is set into a ceiling touches it, and its own surface ends every shadow ray: the
ceiling hides nothing of it. Coordinates come from float32, so such a light lies a few units in the
last place above or below the plane; which of the two says nothing about the scene.
"""

from __future__ import annotations

import numpy as np

from ..geometry.parallelogram import QuadSet
from ..numerics.arrays import Array, Mask
from ..numerics.vector import cross, dot
from .emitter import QUAD, Emitter

__all__ = ["coplanar_quads"]


ROUNDINGS = 32.0 * 2.0**-24
"""Of the largest coordinate: how far float32 coordinates of what touches may lie apart. 2^-24 is
float32's unit roundoff. Seen over 400 random positions in Blender, in units of that: 2 where light
and ceiling share their parents' rotations, 24 where each has its own angles and one of those is
applied to the mesh."""
COARSEST = 2.0**-10
"""Of the size of the light (of a point, of the quad): the largest gap that counts as contact. In
scenes so far from the world's origin that rounding is larger, coordinates are taken as they are."""


def coplanar_quads(light: Emitter, quads: QuadSet, origin: Array) -> Mask:
    """Which quads lie in the plane of a light, during the whole shutter: (n,).

    All corners of a quad lie near the plane of a quad light; all of a light of another kind lies
    near the plane of a quad, which only a point does, or a ball no larger than rounding.

    Parameters
    ----------
    light, quads : relative to the tracer's origin.
    origin : (3, 1) that origin in the world, whose coordinates are rounded: metres.
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
    gap = np.maximum.reduce(away) + _drift(light, quads, normal)
    near: Mask = gap <= np.minimum(ROUNDINGS * largest, COARSEST * size)
    return near


def _drift(light: Emitter, quads: QuadSet, normal: Array) -> Array:
    """How far (n,) quads and a light move against each other along normals, to either side."""
    zero = np.zeros_like(quads.corner)
    moved = zero if quads.displacement is None else quads.displacement
    if light.displacement is not None:
        moved = moved - light.displacement
    drift: Array = 0.5 * np.abs(dot(normal, moved))
    return drift
