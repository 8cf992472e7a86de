# SPDX-License-Identifier: GPL-3.0-or-later
"""Skies: lights of uniform radiance that surround the whole scene.

Each point sees the part of a sky that is above its own horizon, a hemisphere about its normal. So
an open sky gives the same irradiance everywhere, no horizon cuts it, and no occluder is behind it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.light_plane import LightPlane
from ..geometry.light_protocol import ViewCone
from ..geometry.silhouettes import Hemisphere
from ..numerics.arrays import Array, Mask
from ..numerics.vector import dot
from ..scene.description import SkyLight
from .distant_light import DISTANCE, DistantEmitter
from .emitter import Emitter, LightMotion, column
from .point_light import PointEmitter
from .round_light import cone_directions

__all__ = ["CENTER", "RADIUS", "AmbientEmitter", "SkyEmitter", "UnboundedEmitter"]
__all__ += ["make_sky_emitter"]


CENTER = (0.0, 0.0, DISTANCE)
"""Nominal centre of skies, in metres. A sky has none; a place beyond all shapes keeps what is asked
of it finite, such as on which side of occluders it is."""
RADIUS = 2.0 * DISTANCE
"""Radius of skies around their nominal centre, in metres: it encloses all points of a scene."""


@dataclass(frozen=True, kw_only=True)
class UnboundedEmitter(DistantEmitter):
    """A light that no horizon cuts."""

    def horizon(
        self,
        to: Array,
        point: Array,
        normal: Array,
        reach: Array | float = 0.0,
        bend: Array | float = 0.0,
    ) -> tuple[Mask, Mask]:
        """Where the light contributes nothing, and where the horizon cuts it: nowhere (n,)."""
        nowhere = np.zeros(to.shape[1:], dtype=np.bool_)
        return nowhere, nowhere.copy()

    def is_above_horizon(
        self, to: Array, point: Array, normal: Array, reach: Array, bend: Array
    ) -> Mask:
        """Where all of what the points see of the light is above their horizons: everywhere."""
        return np.ones(to.shape[1:], dtype=np.bool_)


@dataclass(frozen=True, kw_only=True)
class AmbientEmitter(UnboundedEmitter, PointEmitter):
    """A sky without shadows. It has no centre from which they could be cast."""


@dataclass(frozen=True, kw_only=True)
class SkyEmitter(UnboundedEmitter):
    """A sky of uniform radiance."""

    @property
    def surrounds(self) -> bool:
        """Whether the light surrounds all points: it does."""
        return True

    @property
    def uniform_hemisphere(self) -> bool:
        """Whether the light has one radiance above each point's horizon: it does."""
        return True

    @property
    def fills_cone(self) -> bool:
        """Whether the light fills its view cone: it does, all directions."""
        return True

    @property
    def occluder_inflation(self) -> float:
        """Return inf: all objects around a point may occlude some of the sky."""
        return np.inf

    def as_point(self) -> Emitter:
        """Return the same light without shadows."""
        return AmbientEmitter(
            name=self.name, center=self.center, radius=0.0, power=self.power, casts_shadow=False
        )

    def point_at(self, *offsets: Array) -> Emitter:
        """Return the light without shadows: no point of it tells where its shadows are."""
        return self.as_point()

    def view_cone(self, to: Array) -> ViewCone:
        """Return cones that hold all directions."""
        distance = np.sqrt(dot(to, to))
        one = np.ones_like(distance)
        return ViewCone(to / distance, distance, -one, one, 0.0 * one, distance + self.radius)

    def falloff_offset(self, point: Array, time: float | None = None) -> tuple[Array, Array]:
        """Vectors (3, n) and distances (n,) in metres, at which irradiance does not fall off."""
        away = -self.to_center(point, time)
        return away, np.sqrt(dot(away, away))

    def extent(self, vector: Array) -> Array:
        """Radius times the length of vectors (3, n): (n,)."""
        extent: Array = self.radius * np.sqrt(dot(vector, vector))
        return extent

    def half_angle(self, distance: Array) -> Array:
        """Half the angle (n,) of a cone of all directions: pi."""
        return np.full_like(distance, np.pi)

    def plane(self, to: Array) -> LightPlane:
        """Return planes beyond all occluders."""
        axis = to / np.sqrt(dot(to, to))
        return LightPlane(-axis, to, np.full(to.shape[1], self.radius))

    def irradiance_factor(self, to: Array, point: Array, normal: Array) -> Array:
        """Irradiance over the radiance, (n,) in sr: pi, correctly rounded."""
        return np.full(to.shape[1:], np.pi)

    def normal_incidence_factor(self, square: Array, half: Array) -> Array:
        """Irradiance factor (n,): pi."""
        return np.full_like(square, np.pi)

    def sample(
        self, to: Array, point: Array, normal: Array, a: Array, b: Array
    ) -> tuple[Array, Array]:
        """Sample the sky in proportion to the cosine with the normals: all weights are pi.

        A direction that is uniform over the unit disk of its projection has that density (Malley).
        The cosine is cos t where cos^2 t = 1 - a, a cone's is 1 - 2 a' with a' = (1 - cos t) / 2.
        """
        cosine = np.sqrt(1.0 - a)
        lift = np.ones(normal.shape[1:])
        around = ViewCone(normal, lift, -lift, lift, lift, lift)
        drop = 0.5 * a / (1.0 + cosine)
        direction, _, _ = cone_directions(around, point, normal, drop, b)
        return self.radius * direction, np.full(a.shape, np.pi)

    def silhouette(self, to: Array, normal: Array) -> Hemisphere:
        """Return what is above the horizons of n points."""
        return Hemisphere()

    def has_silhouette(self, to: Array) -> Mask:
        """Where the light's outline is known: everywhere (n,), it is the horizon."""
        return np.ones(to.shape[1:], dtype=np.bool_)


def make_sky_emitter(light: SkyLight, motion: LightMotion) -> SkyEmitter:
    """Return a sky's emitter. No motion of the camera changes it."""
    return SkyEmitter(
        name=light.name,
        center=column(CENTER),
        radius=RADIUS,
        power=np.array(light.radiance, dtype=np.float64),
        casts_shadow=light.casts_shadow,
    )
