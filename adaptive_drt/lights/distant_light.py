# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights at infinity, of which suns and skies are made."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.planar_faces import PlanarFaces
from ..numerics.arrays import Array, Mask
from ..numerics.vector import dot
from .bounds import LightBounds
from .emitter import Emitter

__all__ = ["DISTANCE", "DistantEmitter"]


DISTANCE = 2.0**120
"""Distance in metres at which lights at infinity are placed: 2^20 times the largest coordinate of a
scene. Eighth powers of it stay within float64. Its inverse, by which a light's direction turns as a
point moves a metre, vanishes beside those of the distances in a scene."""


@dataclass(frozen=True, kw_only=True)
class DistantEmitter(Emitter):
    """A light at infinity."""

    def to_center(self, point: Array, time: Array | float | None = None) -> Array:
        """Vectors to the centre, the same for all points (3, ...) and times: (3, ...) metres."""
        to: Array = self.center.reshape(self.center.shape + (1,) * (point.ndim - self.center.ndim))
        return to + np.zeros_like(point)

    def height_over_planes(self, normal: Array, offset: Array) -> Array:
        """Signed distances (n,) of the centre from planes of any offset, in metres."""
        height: Array = dot(normal, self.center)
        return height

    def distance_or(self, distance: Array, local: Array) -> Array:
        """Return the length `local`, since the distance is none that says what is small."""
        return local

    def swept_bounds(self) -> LightBounds:
        """Return the light itself, which does not move."""
        return self

    def bounds_from_anywhere(self) -> LightBounds:
        """Return the light itself, which all points see in the same directions."""
        return self

    def coplanar_faces(self, faces: PlanarFaces, origin: Array) -> Mask:
        """Which planar shapes lie in the light's plane: none (n,)."""
        return np.zeros(faces.size.size, dtype=np.bool_)
