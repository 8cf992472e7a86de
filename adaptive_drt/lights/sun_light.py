# SPDX-License-Identifier: GPL-3.0-or-later
"""Suns: lights at infinity, seen in the same directions from every point.

A ball at distance d that is seen in a cone of half angle a has the radius d sin a. A sun is such a
ball whose vectors from points do not depend on the points, at a distance beyond all coordinates of
a scene. So what is known of spherical lights holds for it, and no occluder is behind it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array
from ..numerics.vector import dot
from ..scene.description import Shape, Sphere, SunLight, vector_of
from .distant_light import DISTANCE, DistantEmitter
from .emitter import Emitter, LightMotion, column
from .point_light import PointEmitter
from .sphere_light import SphereEmitter

__all__ = ["HardSunEmitter", "SunEmitter", "make_sun_emitter"]


LARGEST_SINE = 1.0 - 2.0**-40
"""Largest sine of a sun's half angle; half angles from 89.99992 degrees on count as that, so that
every point lies outside the ball."""
SMALLEST_ANGLE = 2.0**-40
"""Least angle of a sun's disk, in radians; smaller suns count as points. The edges of their shadows
are narrower than rounding can resolve in most scenes: a nanometre, a kilometre from an occluder."""


SAFE_DISTANCE, LEAST_REACH = 16.0, 1.0
"""Distance of the ball that is seen as the sun, in units of that of the farthest object, and the
least distance of an object that counts, in metres: the order of their depths is then certain."""


@dataclass(frozen=True, kw_only=True)
class HardSunEmitter(DistantEmitter, PointEmitter):
    """A point at infinity; its power is the irradiance (W / m^2) of surfaces that face it."""

    def irradiance_factor(self, to: Array, point: Array, normal: Array) -> Array:
        """Cosine of the angle of incidence, (n,); the error is at most 8 u."""
        cosine: Array = np.maximum(dot(normal, to), 0.0) / np.sqrt(dot(to, to))
        return cosine

    def normal_incidence_factor(self, square: Array, half: Array) -> Array:
        """Irradiance factor (n,) where the sun is at the zenith: 1."""
        return np.ones_like(square)


@dataclass(frozen=True, kw_only=True)
class SunEmitter(DistantEmitter, SphereEmitter):
    """A disk of uniform radiance at infinity."""

    @property
    def solid(self) -> bool:
        """Whether points and occluders may lie within the light: they may not."""
        return False

    @property
    def occluder_inflation(self) -> float:
        """Return inf: the farther an occluder is, the farther it may be beside the line."""
        return math.inf

    def visible_shapes(self, reach: float) -> tuple[Shape, ...]:
        """Return a ball that is seen as the sun, beyond all objects."""
        sine = self.radius / DISTANCE
        distance = SAFE_DISTANCE * max(reach, LEAST_REACH) / (1.0 - sine)
        way = self.center[:, 0] / DISTANCE
        return (Sphere(vector_of(distance * way), distance * sine, name=self.name),)

    def as_point(self) -> Emitter:
        """Return the light reduced to its centre."""
        return HardSunEmitter(
            name=self.name,
            center=self.center,
            radius=0.0,
            power=self.power,
            casts_shadow=self.casts_shadow,
            passes=self.passes,
            unlit=self.unlit,
        )

    def point_at(self, *offsets: Array) -> Emitter:
        """Return points at the centre plus each of the offsets (3, n) metres."""
        return self.as_point().point_at(*offsets)


def make_sun_emitter(light: SunLight, motion: LightMotion) -> Emitter:
    """Return a sun's emitter. Neither the camera's nor the sun's own motion moves it."""
    way = -column(light.direction)
    way = way / np.abs(way).max()  # the square of a very long or short vector is out of range
    way = way / np.sqrt(dot(way, way))
    soft = light.angle >= SMALLEST_ANGLE
    sine = min(math.sin(0.5 * light.angle), LARGEST_SINE) if soft else 0.0
    irradiance = np.array(light.irradiance, dtype=np.float64)
    kind: type[HardSunEmitter | SunEmitter] = SunEmitter if soft else HardSunEmitter
    return kind(
        name=light.name,
        center=DISTANCE * way,
        radius=DISTANCE * sine,
        power=irradiance / (math.pi * sine * sine) if soft else irradiance,
        casts_shadow=light.casts_shadow,
    )
