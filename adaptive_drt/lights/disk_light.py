# SPDX-License-Identifier: GPL-3.0-or-later
"""Disks that face each point that they light: Blender's point lights with a soft falloff."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.light_plane import LightPlane
from ..geometry.light_protocol import ViewCone
from ..numerics.arrays import Array
from ..numerics.floats import TINY
from ..numerics.vector import cross, dot
from ..scene.description import DiskLight, Ellipse, Shape, vector_of
from .bounds import LightBounds
from .emitter import LightMotion
from .form_factor import cap_factor
from .round_light import RoundEmitter, cone_directions

__all__ = ["DiskEmitter", "make_disk_emitter"]


@dataclass(frozen=True, kw_only=True)
class DiskEmitter(RoundEmitter):
    """A disk of uniform radiance that always faces the shaded point."""

    def visible_shapes(self, reach: float) -> tuple[Shape, ...]:
        """Return the disk that faces the camera at the middle of the shutter."""
        del reach
        distance = float(np.sqrt(dot(self.center, self.center))[0])
        if not distance:
            return ()
        axis = self.center / distance
        least = (np.abs(axis) == np.abs(axis).min()).astype(np.float64)
        u = cross(axis, least)
        u *= self.radius / np.sqrt(dot(u, u))
        center, a, b = (vector_of(each[:, 0]) for each in (self.center, u, cross(axis, u)))
        return (Ellipse(center, a, b, motion=self.relative_motion, name=self.name),)

    def bounds_from_anywhere(self) -> LightBounds:
        """Return the ball that the disk turns in."""
        return LightBounds(center=self.center, radius=self.radius, displacement=self.displacement)

    def view_cone(self, to: Array) -> ViewCone:
        """Return the cones of directions to the disk."""
        dd = dot(to, to)
        distance = np.sqrt(dd)
        axis = to / np.where(distance > 0.0, distance, 1.0)
        slant = np.sqrt(dd + self.radius * self.radius)
        return ViewCone(axis, distance, distance / slant, self.radius / slant, distance, slant)

    def half_angle(self, distance: Array) -> Array:
        """Half the angle (n,) of the disk, in radians."""
        return np.arctan2(self.radius, distance)

    def plane(self, to: Array) -> LightPlane:
        """Return the planes of the disks that face the points."""
        axis = to / np.sqrt(np.maximum(dot(to, to), TINY))
        return LightPlane(-axis, to, np.full(to.shape[1], self.radius))

    def irradiance_factor(self, to: Array, point: Array, normal: Array) -> Array:
        """Irradiance over the radiance, (n,) in sr; the error is at most 32 u sin^2 t sr."""
        dd = dot(to, to)
        distance = np.sqrt(dd)
        cosine = dot(normal, to) / np.maximum(distance, TINY)
        slant = np.sqrt(dd + self.radius * self.radius)
        return cap_factor(cosine, self.radius / slant, distance / slant)

    def sample(
        self, to: Array, point: Array, normal: Array, a: Array, b: Array
    ) -> tuple[Array, Array]:
        """Sample the disk, uniformly over its solid angle."""
        cone = self.view_cone(to)
        direction, cosine, opening = cone_directions(cone, point, normal, a, b)
        length = cone.distance / cosine
        return direction * length, (2.0 * np.pi) * opening * np.maximum(dot(normal, direction), 0.0)


def make_disk_emitter(light: DiskLight, motion: LightMotion) -> DiskEmitter:
    """Return a facing disk's emitter."""
    return DiskEmitter(**motion.placed(light, light.center, light.radiance), radius=light.radius)
