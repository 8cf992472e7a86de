# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights that are seen as a circle from every point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.light_protocol import ViewCone
from ..geometry.silhouettes import CircularSilhouette
from ..geometry.sphere.kernels import surface_tolerance
from ..numerics.arrays import Array, Mask
from ..numerics.floats import TINY
from ..numerics.vector import cross, dot
from .emitter import Emitter
from .point_light import reduced_to_point

__all__ = ["RoundEmitter", "cone_directions"]


@dataclass(frozen=True, kw_only=True)
class RoundEmitter(Emitter):
    """A light of uniform radiance that is seen as a circle, which fills its view cone."""

    @property
    def fills_cone(self) -> bool:
        """Whether the light fills its view cone: it does."""
        return True

    def as_point(self) -> Emitter:
        """Return the light reduced to its centre."""
        return reduced_to_point(self)

    def point_at(self, *offsets: Array) -> Emitter:
        """Return points at the centre plus each of the offsets (3, n) metres."""
        return reduced_to_point(self).point_at(*offsets)

    def extent(self, vector: Array) -> Array:
        """Radius times the length of vectors (3, n): (n,)."""
        extent: Array = self.radius * np.sqrt(dot(vector, vector))
        return extent

    def silhouette(self, to: Array, normal: Array) -> CircularSilhouette:
        """Return the circle as which the light is seen from n points."""
        cone = self.view_cone(to)
        return CircularSilhouette(cone.axis, cone.cosine, cone.sine)

    def has_silhouette(self, to: Array) -> Mask:
        """Where the light is seen as a circle: everywhere (n,)."""
        return np.ones(to.shape[1:], dtype=np.bool_)

    def horizon(
        self,
        to: Array,
        point: Array,
        normal: Array,
        reach: Array | float = 0.0,
        bend: Array | float = 0.0,
    ) -> tuple[Mask, Mask]:
        """Where the light is below the horizon, and where that cuts it: (n,) each."""
        graze = surface_tolerance(point, self.radius)
        cone = self.view_cone(to)
        height = dot(normal, cone.axis)
        distance = np.maximum(cone.distance, TINY)
        tilt, graze = self.height_variation(to, reach, bend) / distance, graze / distance
        dark = height <= -cone.sine - tilt + graze
        return dark, ~dark & (height < cone.sine + graze)

    def is_above_horizon(
        self, to: Array, point: Array, normal: Array, reach: Array, bend: Array
    ) -> Mask:
        """Where all of the light is above the horizon of all points within reach: (n,)."""
        tilt = self.height_variation(to, reach, bend) + surface_tolerance(point, self.radius)
        whole: Mask = dot(normal, to) > tilt + self.radius
        return whole

    def normal_incidence_factor(self, square: Array, half: Array) -> Array:
        """Irradiance factor (n,) where the light is at the zenith: pi sin^2."""
        most: Array = np.pi * np.sin(half) ** 2
        return most


def cone_directions(
    cone: ViewCone, point: Array, normal: Array, a: Array, b: Array
) -> tuple[Array, Array, Array]:
    """Unit directions (3, n, k), uniform over cones' solid angles, and their cosines.

    The third result is 1 less the cosine of the cone's half angle. The cones' axes are (3, n, 1) or
    (3, n, k).
    """
    # 1 - cos without cancellation; every direction where the point lies inside the light
    opening = np.where(cone.cosine < 0.0, 2.0, cone.sine**2 / (1.0 + np.abs(cone.cosine)))
    drop = a * opening
    cosine = 1.0 - drop
    sine = np.sqrt(np.maximum(drop * (2.0 - drop), 0.0))
    u, v = _frame(cone.axis, normal, point)
    # where all points have the same spots, these are rows without a stride
    turn = (2.0 * np.pi) * (b[:1] if b.strides[0] == 0 else b)
    direction = cosine * cone.axis
    direction += (sine * np.cos(turn)) * u
    direction += (sine * np.sin(turn)) * v
    return direction, cosine, opening


MIN_FRAME_SINE = 2.0**-26
"""Smallest sine of the angle between an axis and a normal at which a frame is aligned with the
normal: below it rounding decides the direction, and the frame uses the world's axes instead. Also
the smallest distance from the camera, as a fraction of the point's, of the plane of axis and normal
at which the camera's side of that plane is certain."""


def _frame(axis: Array, normal: Array, point: Array) -> tuple[Array, Array]:
    """Unit vectors that complete frames with axes (3, ...), covariant with rotation and reflection.

    The first is the normal's part perpendicular to the axis, the second points away from the
    camera, which is the origin. Where the axis is along the normal, the frame is built from world
    axes: Duff and others 2017, "Building an orthonormal basis, revisited".
    """
    x, y, z = axis
    sign = np.where(z < 0.0, -1.0, 1.0)
    p = -1.0 / (sign + z)
    q = x * y * p
    u = np.array([1.0 + sign * x * x * p, sign * q, -sign * x])
    v = np.array([q, sign + y * y * p, -y])
    lean = normal - dot(normal, axis) * axis
    size = np.sqrt(dot(lean, lean))
    leans = size > MIN_FRAME_SINE
    lean = lean / np.where(leans, size, 1.0)
    # again: where the vector was short, rounding left a component along the axis
    lean = lean - dot(lean, axis) * axis
    lean = lean / np.where(leans, np.sqrt(dot(lean, lean)), 1.0)
    aside = cross(axis, lean)
    far = np.sqrt(dot(point, point))
    aside = aside * np.where(dot(aside, point) < -MIN_FRAME_SINE * far, -1.0, 1.0)
    return np.where(leans, lean, u), np.where(leans, aside, v)
