# SPDX-License-Identifier: GPL-3.0-or-later
"""Spot lights: points, facing disks and balls whose radiance depends on the direction.

The profile is one of directions only, whatever part of the light they come from: see
`geometry.axial_profile`. So a spot is seen as the same circle as the light without a cone, and
irradiance has a closed form where the profile is uniform over that circle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..geometry.axial_profile import AxialProfile
from ..geometry.light_protocol import ViewCone
from ..geometry.silhouettes import CircularSilhouette
from ..geometry.uneven_profile import UnevenProfile
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import dot
from ..scene.description import SpotLight
from .disk_light import DiskEmitter
from .emitter import Emitter, LightMotion, ProfileEdge, column
from .occluded_form_factor import visible_factor
from .point_light import PointEmitter
from .sphere_light import SphereEmitter

__all__ = ["SpotDiskEmitter", "SpotEmitter", "SpotPointEmitter", "SpotSphereEmitter"]
__all__ += ["make_spot_emitter"]


NODES = np.polynomial.legendre.leggauss(16)  # type: ignore[no-untyped-call]
"""Rule from the middle of a light to its outline, for uneven cones."""
TURNS = 32
"""Number of its nodes around the middle."""
POINTS_AT_ONCE = 2_048
"""Number of points whose nodes are integrated in one batch: 25 MB for each vector of them."""
MIN_BLEND = 2.0**-12
"""Least blend of a spot's cone. Below it the edge of a cone of 45 degrees is narrower than 2 mm at
a distance of 10 m, and would be a step, which estimates of smooth light do not see."""


@dataclass(frozen=True, kw_only=True)
class SpotEmitter(Emitter):
    """A light that shines in a cone."""

    beam: AxialProfile

    @property
    def profile(self) -> AxialProfile | None:
        """Return how the radiance depends on the direction."""
        return self.beam

    def profile_edge(self, to: Array) -> ProfileEdge | None:
        """Return where points are relative to the edge of the cone."""
        distance = np.sqrt(dot(to, to))
        half = self.half_angle(np.maximum(distance, TINY))
        outer, inner = math.acos(self.beam.outer), math.acos(self.beam.inner)
        angle, stretch = self._angle(to, distance), self.beam.stretch
        half = stretch * half
        gap = np.maximum(angle - half - outer, inner - half - angle)
        bound = np.minimum(np.abs(angle - outer), np.abs(angle - inner)) - half
        width = np.maximum(outer - inner, 2.0 * half)
        return ProfileEdge(gap / stretch, np.maximum(bound, 0.0) / stretch, width / stretch)

    def _angle(self, to: Array, distance: Array) -> Array:
        """Angles (n,) between the axis of the cone and points, seen from the light's centre.

        Those of an uneven cone are the angles of the profile: see `AxialProfile.stretch`.
        """
        cosine = self.beam.cosine_along(to) / np.maximum(distance, TINY)
        angle: Array = np.arccos(np.clip(cosine, -1.0, 1.0))
        return angle

    def _misses(self, to: Array, reach: Array | float) -> Mask:
        """Where points (n,) and all within reach of them are outside the cone, at all times."""
        distance = np.sqrt(dot(to, to))
        d = self.displacement
        path = 0.0 if d is None else float(np.sqrt(dot(d, d))[0])
        near = distance - reach - path
        beyond = near > self.radius
        near = np.where(beyond, near, 1.0)
        turn = np.where(beyond, (reach + path) / near, np.inf)
        half = self.beam.stretch * self.half_angle(np.maximum(near, self.radius + TINY))
        turn = self.beam.stretch * turn
        outside: Mask = self._angle(to, distance) - half - turn > math.acos(self.beam.outer)
        return outside & beyond

    def horizon(
        self,
        to: Array,
        point: Array,
        normal: Array,
        reach: Array | float = 0.0,
        bend: Array | float = 0.0,
    ) -> tuple[Mask, Mask]:
        """Where the light is below the horizon or does not shine, and where the horizon cuts it."""
        # the other base of each kind of spot
        dark, cut = super().horizon(to, point, normal, reach, bend)  # type: ignore[safe-super]
        outside = self._misses(to, reach)
        return dark | outside, cut & ~outside

    def _relative(self, direction: Array) -> Array:
        """Relative radiance (...) in unit directions (3, ...) from points."""
        return self.beam.value(self.beam.cosine_along(direction))


@dataclass(frozen=True, kw_only=True)
class SpotPointEmitter(SpotEmitter, PointEmitter):
    """A point that shines in a cone."""

    def irradiance_factor(self, to: Array, point: Array, normal: Array) -> Array:
        """Irradiance over the intensity, (n,) in 1 / m^2."""
        plain = PointEmitter.irradiance_factor(self, to, point, normal)
        return plain * self._relative(to / np.maximum(np.sqrt(dot(to, to)), TINY))


@dataclass(frozen=True, kw_only=True)
class _RoundSpotEmitter(SpotEmitter):
    """A light of a size that shines in a cone."""

    def irradiance_factor(self, to: Array, point: Array, normal: Array) -> Array:
        """Irradiance over the radiance in the middle of the cone, (n,) in sr.

        Where the profile varies over the light, it is integrated by quadrature.
        """
        plain = super().irradiance_factor(to, point, normal)  # type: ignore[safe-super]
        cone = self.view_cone(to)
        half = np.arctan2(cone.sine, cone.cosine)
        level, varies = self.beam.at(cone.axis, half)
        outside = cone.distance > self.radius if self.solid else np.ones_like(varies)
        factor = np.where(outside, level * plain, plain)
        rows = (varies & outside & (plain > 0.0)).nonzero()[0]
        if rows.size:
            some = (columns(each, rows) for each in (to, point, normal))
            factor[rows] = self._varied_factor(cone, rows, *some)
        return factor

    def _varied_factor(
        self, cone: ViewCone, rows: Ints, to: Array, point: Array, normal: Array
    ) -> Array:
        """Factors (n,) of the light where its profile varies over it, by quadrature.

        cone : of all points, of which these are those of index `rows` (n,).
        """
        light = CircularSilhouette(columns(cone.axis, rows), cone.cosine[rows], cone.sine[rows])
        none = np.zeros((0, 3, rows.size)), np.zeros((0, rows.size))
        return visible_factor(light, normal, none, np.zeros((0, 4, 3, rows.size)), self.beam)

    def sample(
        self, to: Array, point: Array, normal: Array, a: Array, b: Array
    ) -> tuple[Array, Array]:
        """Sample the light uniformly over its solid angle, weighted with its profile."""
        way, weight = super().sample(to, point, normal, a, b)  # type: ignore[safe-super]
        relative = self._relative(way / np.maximum(np.sqrt(dot(way, way)), TINY))
        if self.solid:
            relative = np.where(np.sqrt(dot(to, to)) > self.radius, relative, 1.0)
        return way, weight * relative


@dataclass(frozen=True, kw_only=True)
class SpotDiskEmitter(_RoundSpotEmitter, DiskEmitter):
    """A disk that faces each point that it lights, and shines in a cone."""


@dataclass(frozen=True, kw_only=True)
class SpotSphereEmitter(_RoundSpotEmitter, SphereEmitter):
    """A ball that shines in a cone; points within it get all of its light."""


@dataclass(frozen=True, kw_only=True)
class _UnevenSpotEmitter(_RoundSpotEmitter):
    """A light of a size that shines in a cone that is not circular.

    Where its profile varies over it, the whole of it is integrated by `NODES` by `TURNS` nodes, and
    what occluders leave of it by rays. Measured, the nodes are off by up to 1e-4 sr for a cone of
    a blend of 0.4 whose light is as near as three of its radii.
    """

    def _varied_factor(
        self, cone: ViewCone, rows: Ints, to: Array, point: Array, normal: Array
    ) -> Array:
        """Factors (n,) of the light where its profile varies over it, by quadrature."""
        a = np.repeat(0.5 + 0.5 * NODES[0], TURNS)
        b = np.tile((np.arange(TURNS) + 0.5) / TURNS, NODES[0].size)
        share = np.repeat(0.5 * NODES[1], TURNS) / TURNS
        factor = np.empty(rows.size)
        for first in range(0, rows.size, POINTS_AT_ONCE):
            part = slice(first, first + POINTS_AT_ONCE)
            places = (each[:, part, None] for each in np.broadcast_arrays(to, point, normal))
            spots = (np.broadcast_to(each, (factor[part].size, each.size)) for each in (a, b))
            factor[part] = (self.sample(*places, *spots)[1] * share).sum(axis=1)
        return factor

    def has_silhouette(self, to: Array) -> Mask:
        """Where the light's outline has one radiance: (n,)."""
        cone = self.view_cone(to)
        return ~self.beam.at(cone.axis, np.arctan2(cone.sine, cone.cosine))[1]


@dataclass(frozen=True, kw_only=True)
class UnevenSpotDiskEmitter(_UnevenSpotEmitter, DiskEmitter):
    """A disk that faces each point that it lights, and shines in an uneven cone."""


@dataclass(frozen=True, kw_only=True)
class UnevenSpotSphereEmitter(_UnevenSpotEmitter, SphereEmitter):
    """A ball that shines in an uneven cone; points within it get all of its light."""


def make_spot_emitter(light: SpotLight, motion: LightMotion) -> SpotEmitter:
    """Return a spot's emitter."""
    way = -column(light.direction)
    way = way / np.abs(way).max()  # the square of a very long or short vector is out of range
    way = way / np.sqrt(dot(way, way))
    outer = math.cos(0.5 * light.angle)
    inner = outer + (1.0 - outer) * max(light.blend, MIN_BLEND)
    beam = AxialProfile(way, outer, inner)
    if light.frame is not None:
        rows = np.array(light.frame)
        beam = UnevenProfile(way, outer, inner, rows / np.abs(rows).max())
    if not light.radius:
        fields = motion.placed(light, light.center, light.intensity)
        return SpotPointEmitter(**fields, radius=0.0, beam=beam)
    area = math.pi * light.radius * light.radius
    r, g, b = light.intensity
    fields = motion.placed(light, light.center, (r / area, g / area, b / area))
    kind: type[_RoundSpotEmitter] = SpotDiskEmitter if light.faces else SpotSphereEmitter
    if light.frame is not None:
        kind = UnevenSpotDiskEmitter if light.faces else UnevenSpotSphereEmitter
    return kind(**fields, radius=light.radius, beam=beam)
