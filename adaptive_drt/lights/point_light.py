# SPDX-License-Identifier: GPL-3.0-or-later
"""Point lights, and other lights reduced to a point."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..geometry.light_plane import LightPlane
from ..geometry.sphere.kernels import surface_tolerance
from ..numerics.arrays import Array, Mask
from ..numerics.floats import TINY
from ..numerics.vector import dot
from ..scene.description import PointLight
from .emitter import Emitter, LightMotion

__all__ = ["PointEmitter", "make_point_emitter", "reduced_to_point"]


@dataclass(frozen=True, kw_only=True)
class PointEmitter(Emitter):
    """A point that emits its intensity (W / sr) to all sides."""

    radius: float = 0.0

    @property
    def extended(self) -> bool:
        """Whether the light has a size: it has none."""
        return False

    def as_point(self) -> PointEmitter:
        """Return the light itself."""
        return self

    def point_at(self, *offsets: Array) -> PointEmitter:
        """Return points at the centre plus each of the offsets (3, n) metres."""
        return replace(self, center=sum(offsets, self.center))

    def extent(self, vector: Array) -> Array:
        """Zeros (n,)."""
        return np.zeros(vector.shape[1:])

    def half_angle(self, distance: Array) -> Array:
        """Zeros (n,)."""
        return np.zeros_like(distance)

    def plane(self, to: Array) -> LightPlane:
        """Return the plane through the point that faces the points that see it."""
        axis = to / np.sqrt(np.maximum(dot(to, to), TINY))
        return LightPlane(-axis, to, np.zeros(to.shape[1]))

    def horizon(
        self,
        to: Array,
        point: Array,
        normal: Array,
        reach: Array | float = 0.0,
        bend: Array | float = 0.0,
    ) -> tuple[Mask, Mask]:
        """Where the point is below the horizon; the horizon never cuts it: (n,) each."""
        graze = surface_tolerance(point, self.radius)
        dark = ~(dot(normal, to) > graze - self.height_variation(to, reach, bend))
        return dark, np.zeros_like(dark)

    def is_above_horizon(
        self, to: Array, point: Array, normal: Array, reach: Array, bend: Array
    ) -> Mask:
        """Where the point is above the horizon of all surface points within reach: (n,)."""
        tilt = self.height_variation(to, reach, bend) + surface_tolerance(point, self.radius)
        whole: Mask = dot(normal, to) > tilt
        return whole

    def irradiance_factor(self, to: Array, point: Array, normal: Array) -> Array:
        """Irradiance over the intensity, (n,) in 1 / m^2; the error is at most 8 u / d^2."""
        dd = dot(to, to)
        distance = np.sqrt(dd)
        cosine = dot(normal, to) / np.maximum(distance, TINY)
        with np.errstate(over="ignore"):  # infinite on the light itself; `Film.pixels` clips
            bright: Array = np.maximum(cosine, 0.0) / np.maximum(dd, TINY)
        return bright

    def normal_incidence_factor(self, square: Array, half: Array) -> Array:
        """Irradiance factor (n,) where the point is at the zenith."""
        most: Array = 1.0 / square
        return most

    def sample(
        self, to: Array, point: Array, normal: Array, a: Array, b: Array
    ) -> tuple[Array, Array]:
        """Return the point itself for all samples."""
        to = np.broadcast_to(to, (3, *a.shape))
        return to, self.irradiance_factor(to, point, normal)


def make_point_emitter(light: PointLight, motion: LightMotion) -> PointEmitter:
    """Return a point light's emitter."""
    return PointEmitter(**motion.placed(light, light.center, light.intensity))


def reduced_to_point(light: Emitter) -> PointEmitter:
    """Return the centre of an extended light as a point light."""
    return PointEmitter(
        name=light.name,
        center=light.center,
        power=light.power,
        displacement=light.displacement,
        casts_shadow=light.casts_shadow,
        coplanar=light.coplanar,
        passes=light.passes,
        unlit=light.unlit,
    )
