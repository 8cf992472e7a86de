# SPDX-License-Identifier: GPL-3.0-or-later
"""What shapes ask of a light: the part of `lights.emitter.Emitter` that needs no shape."""

from __future__ import annotations

from typing import Protocol

from ..numerics.arrays import Array
from .light_plane import LightPlane

__all__ = ["LightProtocol"]


class LightProtocol(Protocol):
    """A light as shapes see it; `lights.emitter.Emitter` documents the parameters.

    Attributes
    ----------
    radius : metres, of a ball around the centre that encloses the light.
    displacement : (3, 1) metres over the shutter, or None for a static light.
    span : None if the light is seen as a circle, else the surface that straight edges bound.
    solid : whether points and occluders may lie within the light.
    """

    @property
    def radius(self) -> float:
        """See the class."""

    @property
    def displacement(self) -> Array | None:
        """See the class."""

    @property
    def span(self) -> object | None:
        """See the class."""

    @property
    def solid(self) -> bool:
        """See the class."""

    def to_center(self, point: Array, time: Array | float | None = None) -> Array:
        """Vectors from points (3, ...) to the centre at shutter times: (3, ...) metres."""

    def half_angle(self, distance: Array) -> Array:
        """Half the angle (n,), in radians, of the light, at distances of its centre."""

    def half_angle_along(self, toward: Array, distance: Array) -> Array:
        """Half the angle (n,) of the light along unit vectors (3, n) across the line of sight."""

    def outline_clearance(self, axis: Array, direction: Array, distance: Array) -> Array | None:
        """Angles (n,) from directions to the nearest side of the light; None for round lights."""

    def plane(self, to: Array) -> LightPlane:
        """Return the plane behind which occluders block none of the light, seen from points."""
