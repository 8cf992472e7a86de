# SPDX-License-Identifier: GPL-3.0-or-later
"""Flat lights of a fixed place, which emit to one side."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass

import numpy as np

from ..geometry.light_plane import LightPlane
from ..geometry.light_protocol import LinearSpan
from ..geometry.planar_faces import PlanarFaces
from ..geometry.sphere.kernels import surface_tolerance
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.vector import dot
from .coplanarity import faces_in_plane
from .emitter import Emitter, LightContact
from .point_light import reduced_to_point

__all__ = ["FlatEmitter"]


@dataclass(frozen=True, kw_only=True)
class FlatEmitter(Emitter):
    """A light of uniform radiance within a parallelogram.

    span : the parallelogram, which holds the light, and whose centre is the light's.
    """

    span: LinearSpan

    @property
    def probe_sides(self) -> tuple[Array, Array]:
        """Vectors (3, 1) metres: the centre plus or less half of one of them is on the light."""
        return self.span.half_u, self.span.half_v

    @abstractmethod
    def _from_nearest(self, to: Array) -> Array:
        """Vectors (3, n) metres from the light's nearest points, approximately.

        to : (3, n) metres from the points to the light's centre.
        """

    @abstractmethod
    def height_range(self, to: Array, normal: Array) -> tuple[Array, Array]:
        """Least and greatest height (n,) metres of the light over the points' tangent planes."""

    def faces_camera(self) -> bool:
        """Whether the camera is before the light at the middle of the shutter."""
        return float(dot(self.span.normal, self.center)[0]) < 0.0

    def as_point(self) -> Emitter:
        """Return the light reduced to its centre."""
        return reduced_to_point(self)

    def point_at(self, *offsets: Array) -> Emitter:
        """Return points at the centre plus each of the offsets (3, n) metres."""
        return reduced_to_point(self).point_at(*offsets)

    def half_angle(self, distance: Array) -> Array:
        """Half the angle (n,) of the ball that encloses the light, in radians."""
        half: Array = np.arcsin(np.minimum(self.radius / distance, 1.0))
        return half

    def half_angle_along(self, toward: Array, distance: Array) -> Array:
        """Half the angle (n,) of the light along unit vectors across the line of sight."""
        half: Array = np.arctan2(self.extent(toward), distance)
        return half

    def falloff_offset(self, point: Array, time: float | None = None) -> tuple[Array, Array]:
        """Vectors (3, n) from the light's nearest points to the points, and their lengths (n,).

        They are exact for a rectangle and a circle; for others, not quite from the nearest point.
        """
        away = self._from_nearest(self.to_center(point, time))
        return away, np.sqrt(dot(away, away))

    def coplanar_faces(self, faces: PlanarFaces, origin: Array) -> Mask:
        """Which planar shapes have all their vertices near the light's plane: (n,)."""
        return faces_in_plane(
            self.center, self.span.normal, self.radius, self.displacement, faces, origin
        )

    def edge_on(self, item: Ints) -> Mask:
        """Which of objects (...), given by index, lie in the light's plane."""
        return self.is_coplanar(item)

    def is_behind(self, to: Array, radius: Array, path: bool = False) -> Mask:
        """Whether balls (n,) lie wholly behind the light's plane.

        to : (3, n) metres from the balls' centres.  path : whether the answer holds during the
        whole shutter, for balls at rest.
        """
        d = self.displacement
        drift = 0.5 * float(np.abs(dot(self.span.normal, d))[0]) if path and d is not None else 0.0
        behind: Mask = dot(self.span.normal, to) >= radius + drift
        return behind

    def height_above(self, to: Array, point: Array) -> Array:
        """Signed distance (metres) of points in front of the light's plane, negative behind it.

        It is 0 for points within the surface tolerance of the plane: a surface in the plane of a
        light, on or beside it, receives nothing from it.
        """
        return self.height_beyond(to, surface_tolerance(point, self.radius))

    def height_beyond(self, to: Array, graze: Array) -> Array:
        """`height_above`, which is 0 for points within `graze` (...) metres of the plane."""
        normal = self.span.normal.reshape((3,) + (1,) * (to.ndim - 1))
        height = -dot(normal, to)
        return np.where(np.abs(height) > graze, height, 0.0)

    def horizon(
        self,
        to: Array,
        point: Array,
        normal: Array,
        reach: Array | float = 0.0,
        bend: Array | float = 0.0,
    ) -> tuple[Mask, Mask]:
        """Where the light is below the horizon or faces away, and where the horizon cuts it."""
        graze = surface_tolerance(point, self.radius)
        low, high = self.height_range(to, normal)
        behind = self.height_beyond(to, graze) <= -reach
        dark = behind | (high <= graze - self.height_variation(to, reach, bend))
        return dark, ~dark & (low <= graze)

    def front_sine(self, to: Array, distance: Array) -> Array:
        """Sine (n,) of the points' elevations over the light's plane, negative behind it."""
        sine: Array = -dot(self.span.normal, to) / distance
        return sine

    def plane(self, to: Array) -> LightPlane:
        """Return the light's own plane."""
        normal = self.span.normal + np.zeros_like(to)
        return LightPlane(normal, to, np.full(to.shape[1], self.radius))

    def contact(self, to: Array, normal: Array) -> LightContact:
        """Return where points are relative to the light's plane; from behind it sends nothing."""
        away = self.span.normal + np.zeros_like(to)
        offset = self._from_nearest(to)
        step = 0.5 * np.pi * (1.0 - dot(normal, away))
        return LightContact(-dot(away, to), away, np.sqrt(dot(offset, offset)), step)

    def has_silhouette(self, to: Array) -> Mask:
        """Where the light is bounded by its edges: everywhere (n,)."""
        return np.ones(to.shape[1:], dtype=np.bool_)

    def _sample_weights(self, to: Array, point: Array, normal: Array, area: Array) -> Array:
        """Irradiance factors of samples that are uniform over the light's area, m^2.

        to : vectors, metres, from the points to the samples.
        """
        square = dot(to, to)
        away = np.maximum(self.height_above(to, point), 0.0)
        weights: Array = np.maximum(dot(normal, to), 0.0) * away * area / (square * square)
        return weights
