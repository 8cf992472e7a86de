# SPDX-License-Identifier: GPL-3.0-or-later
"""Environments: skies whose radiance depends on the direction.

What hides an environment, and where, is as for a uniform sky. Its irradiance factors are (k, n):
one for each of k channels, to be multiplied by the `power` of the channels. Distributed rays need
factors of one channel: then each channel is a light of its own.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..numerics.arrays import Array
from ..numerics.vector import dot
from ..scene.description import EnvironmentLight
from .emitter import Emitter, LightMotion, column
from .environment_factor import Environment
from .environment_map import make_environment_map
from .open_irradiance import OpenIrradiance
from .point_light import PointEmitter
from .sky_light import CENTER, RADIUS, SkyEmitter, UnboundedEmitter

__all__ = ["AmbientEnvironmentEmitter", "EnvironmentEmitter", "make_environment_emitter"]


ACCURACY_SHARE = 0.1
"""Error of the unhidden irradiance, as a fraction of the picture's tolerance."""
DEFAULT_ACCURACY = 2e-5
"""The same relative to the mean irradiance, where no tolerance is known."""


@dataclass(frozen=True, kw_only=True)
class _MapEmitter(Emitter):
    """A light whose radiance depends on the direction, by a map."""

    surrounding: Environment
    accuracy: float = DEFAULT_ACCURACY

    @property
    def environment(self) -> Environment:
        """Return the radiance by direction."""
        return self.surrounding

    @cached_property
    def open_irradiance(self) -> OpenIrradiance:
        """Irradiance factors of the unhidden light."""
        return OpenIrradiance(self.environment, self.accuracy)

    @property
    def factor_error(self) -> float:
        """Error of the irradiance factors of the unhidden light."""
        if not self.environment.rest.values.any():
            return 0.0
        return self.open_irradiance.accuracy + self.environment.map.reduction_error

    def irradiance_factor(self, to: Array, point: Array, normal: Array) -> Array:
        """Irradiance over the power, (k, n), or (n,) of a single channel."""
        if not self.environment.rest.values.any():
            factor = np.pi * np.repeat(self.environment.level[:, None], normal.shape[1], axis=1)
        else:
            factor = self.open_irradiance.factor(normal)
        return factor[0] if factor.shape[0] == 1 else factor

    def normal_incidence_factor(self, square: Array, half: Array) -> Array:
        """Mean irradiance factor (n,) over all normals."""
        return np.full_like(square, np.pi * float(self.environment.level.max()))


@dataclass(frozen=True, kw_only=True)
class AmbientEnvironmentEmitter(_MapEmitter, UnboundedEmitter, PointEmitter):
    """An environment without shadows. It has no centre from which they could be cast."""


@dataclass(frozen=True, kw_only=True)
class EnvironmentEmitter(_MapEmitter, SkyEmitter):
    """An environment.

    Attributes
    ----------
    of_channels : the environment of all channels and the number of this one in it; None for lights
        that are no channels of others.
    """

    of_channels: tuple[Environment, int] | None = None

    @property
    def uniform_hemisphere(self) -> bool:
        """Return False: the radiance depends on the direction."""
        return False

    @property
    def channel_of(self) -> tuple[Environment, int] | None:
        """Return `of_channels`."""
        return self.of_channels

    def as_point(self) -> Emitter:
        """Return the same light without shadows."""
        return AmbientEnvironmentEmitter(
            name=self.name, center=self.center, radius=0.0, power=self.power, casts_shadow=False,
            surrounding=self.surrounding, accuracy=self.accuracy,
        )  # fmt: skip

    def sample(
        self, to: Array, point: Array, normal: Array, a: Array, b: Array
    ) -> tuple[Array, Array]:
        """Sample directions in proportion to the cosine with the normals, with their radiance."""
        way, weight = super().sample(to, point, normal, a, b)
        radiance = self.environment.map.radiance(way / np.sqrt(dot(way, way)))
        assert radiance.shape[0] == 1, "distributed rays know lights of one channel only"
        return way, weight * radiance[0]

    def channels(self) -> tuple[Emitter, ...]:
        """Return a light for each channel."""
        if self.channel_count == 1:
            return (self,)
        parts = []
        for index in range(3):
            power = np.where(np.arange(3) == index, self.power, 0.0)
            part = Environment(self.environment.map.channel(index))
            if power.any() and part.map.values.any():
                parts.append(
                    replace(
                        self, surrounding=part, power=power, of_channels=(self.surrounding, index)
                    )
                )
        return tuple(parts)

    def prepared(self, tolerance: float) -> EnvironmentEmitter:
        """Return the light as accurate as a picture of a tolerance needs, with its tables."""
        ready = replace(self, accuracy=ACCURACY_SHARE * tolerance)
        if ready.environment.rest.values.any():
            # made once, and not in each worker
            assert ready.environment.longest_arc > 0.0
            assert ready.open_irradiance.accuracy > 0.0
        return ready


def make_environment_emitter(light: EnvironmentLight, motion: LightMotion) -> EnvironmentEmitter:
    """Return an environment's emitter. No motion of the camera changes it."""
    found = make_environment_map(light)
    power = np.ones(3)
    if (found.values == found.values[:, :, :1]).all():
        found = found.channel(0)
    if not found.values.any():
        power[:] = 0.0
    fields: dict[str, Any] = {"name": light.name, "casts_shadow": light.casts_shadow}
    return EnvironmentEmitter(
        center=column(CENTER), radius=RADIUS, power=power, surrounding=Environment(found), **fields
    )
