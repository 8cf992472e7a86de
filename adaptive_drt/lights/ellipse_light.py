# SPDX-License-Identifier: GPL-3.0-or-later
"""Elliptic lights, circular disks among them, which emit to one side.

A circular disk that is wholly above the horizon has an elementary closed form, the vector of whose
components are the configuration factors of a differential element and a disk, parallel and
perpendicular (Hamilton and Morgan 1952, NACA TN 2836). All else is that of the cone over the
ellipse: see `geometry.elliptic_cones`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..geometry.elliptic_cones import cones_of_ellipses, whole_cone_factor
from ..geometry.light_protocol import LinearSpan
from ..geometry.silhouettes import EllipticSilhouette, OpenSilhouette
from ..geometry.sphere.kernels import surface_tolerance
from ..numerics.arrays import Array, Mask
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import cross, dot
from ..scene.description import Ellipse, EllipseLight, Shape, vector_of
from .emitter import LightMotion, column
from .flat_light import FlatEmitter
from .occluded_form_factor import visible_factor

__all__ = ["EllipseEmitter", "make_ellipse_emitter"]


NEAREST_STEPS = 4
"""Number of steps of the iteration for the nearest point of an ellipse."""
CIRCULAR = 2.0**-40
"""Largest relative difference of the half axes, and cosine between them, of disks that count as
circular."""


@dataclass(frozen=True, kw_only=True)
class EllipseEmitter(FlatEmitter):
    """An ellipse of uniform radiance.

    span : half of its principal axes, the longer one first.  circular : whether it is a circle.
    """

    circular: bool

    def visible_shapes(self, reach: float) -> tuple[Shape, ...]:
        """Return the ellipse, if the camera is before it."""
        del reach
        if not self.faces_camera():
            return ()
        u, v = self.span.half_u, self.span.half_v
        center, a, b = (vector_of(p[:, 0]) for p in (self.center, u, v))
        return (Ellipse(center, a, b, motion=self.relative_motion, name=self.name),)

    def extent(self, vector: Array) -> Array:
        """Root of the sum of (half axis . vector)^2 over both, for vectors (3, n): (n,)."""
        extent: Array = np.hypot(dot(self.span.half_u, vector), dot(self.span.half_v, vector))
        return extent

    def _from_nearest(self, to: Array) -> Array:
        """Vectors (3, n) metres from the light's nearest points, exact for a circle.

        For an ellipse `NEAREST_STEPS` steps of an iteration that replaces it by its circle of
        curvature leave a hundredth of a shorter half axis at most.
        """
        u, v = self.span.half_u, self.span.half_v
        a, b = -dot(to, u) / dot(u, u), -dot(to, v) / dot(v, v)
        size = np.maximum(np.hypot(a, b), TINY)
        x, y = a / size, b / size
        if not self.circular:
            x, y = self._nearest_on_rim(np.abs(a), np.abs(b))
            x, y = np.copysign(x, a), np.copysign(y, b)
        inside = size <= 1.0
        away: Array = -to - np.where(inside, a, x) * u - np.where(inside, b, y) * v
        return away

    def _nearest_on_rim(self, a: Array, b: Array) -> tuple[Array, Array]:
        """Cosine and sine (n,) of the rim's point nearest to points of the light's plane.

        a, b : (n,) their coordinates in units of the half axes, at least 0.
        """
        p, q = (float(np.sqrt(dot(half, half))[0]) for half in (self.span.half_u, self.span.half_v))
        x, y = np.full_like(a, 0.5**0.5), np.full_like(a, 0.5**0.5)
        for _ in range(NEAREST_STEPS):
            # centre and radius of curvature there
            mid_x, mid_y = (p * p - q * q) / p * x**3, (q * q - p * p) / q * y**3
            radius = np.hypot(p * x - mid_x, q * y - mid_y)
            way_x, way_y = p * a - mid_x, q * b - mid_y
            share = radius / np.maximum(np.hypot(way_x, way_y), TINY)
            x = np.clip((way_x * share + mid_x) / p, 0.0, 1.0)
            y = np.clip((way_y * share + mid_y) / q, 0.0, 1.0)
            size = np.maximum(np.hypot(x, y), TINY)
            x, y = x / size, y / size
        return x, y

    def height_range(self, to: Array, normal: Array) -> tuple[Array, Array]:
        """See `FlatEmitter.height_range`."""
        height, extent = dot(normal, to), self.extent(normal)
        return height - extent, height + extent

    def is_above_horizon(
        self, to: Array, point: Array, normal: Array, reach: Array, bend: Array
    ) -> Mask:
        """Where the light is above the horizon of all points within reach, and faces them."""
        tilt = self.height_variation(to, reach, bend) + surface_tolerance(point, self.radius)
        low = dot(normal, to) - self.extent(normal)
        whole: Mask = (low > tilt) & (self.height_above(to, point) > reach)
        return whole

    def irradiance_factor(self, to: Array, point: Array, normal: Array) -> Array:
        """Irradiance over the radiance, (n,) in sr, 0 from behind."""
        extent = self.extent(normal)
        height = dot(normal, to)
        lit = (self.height_above(to, point) > 0.0) & (height + extent > 0.0)
        whole = lit & (height >= extent)
        factor = np.zeros(height.shape)
        rows = whole.nonzero()[0]
        if rows.size:
            factor[rows] = self._whole_factor(columns(to, rows), columns(normal, rows))
        rows = (lit & ~whole).nonzero()[0]
        if rows.size:
            n = columns(normal, rows)
            outline = self._elliptic_silhouette(columns(to, rows))
            none = np.zeros((0, 3, rows.size)), np.zeros((0, rows.size))
            factor[rows] = visible_factor(outline, n, none, np.zeros((0, 4, 3, rows.size)))
        return factor

    def _whole_factor(self, to: Array, normal: Array) -> Array:
        """Factors (n,) of the light where it faces the points and is above their horizons."""
        if self.circular:
            factor: Array = dot(normal, self._disk_irradiance(to))
        else:
            factor = whole_cone_factor(normal, self._elliptic_silhouette(to).cones)
        return np.maximum(factor, 0.0)

    def _elliptic_silhouette(self, to: Array) -> EllipticSilhouette:
        """The light's outline, for vectors (3, n) metres to its centre."""
        half_u, half_v = self.span.half_u + np.zeros_like(to), self.span.half_v + np.zeros_like(to)
        return EllipticSilhouette(cones_of_ellipses(to, half_u, half_v))

    def _disk_irradiance(self, to: Array) -> Array:
        """Integral (3, n) of w over the directions to a circular disk, seen from its front.

        With h the height over its plane, p the distance from its axis, r its radius,
        S = p^2 + h^2 + r^2 and D^2 = S^2 - 4 p^2 r^2, it is pi r^2 (D + h^2 + r^2 - p^2) /
        (D (D + S)) towards the plane, and 2 pi r^2 h p / (D (D + S)) towards the axis.
        """
        ahead = -self.span.normal
        height = dot(ahead, to)
        aside = to - height * ahead
        hh, pp, rr = height * height, dot(aside, aside), self.radius * self.radius
        total = pp + hh + rr
        gap = pp - rr + hh
        root = np.sqrt(gap * gap + 4.0 * rr * hh)
        away = pp - rr - hh
        # D + h^2 + r^2 - p^2, whose terms cancel far from the axis
        near = np.where(away > 0.0, 4.0 * hh * pp / np.maximum(root + away, TINY), root - away)
        scale = np.pi * rr / np.maximum(root * (root + total), TINY)
        irradiance: Array = (scale * near) * ahead + (2.0 * scale * height) * aside
        return irradiance

    def normal_incidence_factor(self, square: Array, half: Array) -> Array:
        """Approximate irradiance factor (n,) of the light if it faced the point."""
        edge = cross(self.span.half_u, self.span.half_v)
        most: Array = math.pi * float(np.sqrt(dot(edge, edge))[0]) / square
        return most

    def sample(
        self, to: Array, point: Array, normal: Array, a: Array, b: Array
    ) -> tuple[Array, Array]:
        """Sample the light, uniformly over its area."""
        half_u, half_v = self.span.half_u[:, :, None], self.span.half_v[:, :, None]
        size, turn = np.sqrt(a), (2.0 * np.pi) * b
        to = to + ((size * np.cos(turn)) * half_u + (size * np.sin(turn)) * half_v)
        edge = cross(half_u, half_v)
        return to, self._sample_weights(to, point, normal, np.pi * np.sqrt(dot(edge, edge)))

    def silhouette(self, to: Array, normal: Array) -> OpenSilhouette:
        """Return the cones over the ellipse."""
        return self._elliptic_silhouette(to)


def make_ellipse_emitter(light: EllipseLight, motion: LightMotion) -> EllipseEmitter:
    """Return an elliptic light's emitter."""
    half_u, half_v = column(light.half_u), column(light.half_v)
    normal = cross(half_u, half_v)
    normal = normal / np.sqrt(dot(normal, normal))
    uu, vv = float(dot(half_u, half_u)[0]), float(dot(half_v, half_v)[0])
    uv = float(dot(half_u, half_v)[0])
    circular = math.hypot(uu - vv, 2.0 * uv) <= CIRCULAR * (uu + vv)
    if not circular:
        # the principal axes, the longer one first
        turn = 0.5 * math.atan2(2.0 * uv, uu - vv)
        c, s = math.cos(turn), math.sin(turn)
        half_u, half_v = c * half_u + s * half_v, c * half_v - s * half_u
    return EllipseEmitter(
        **motion.placed(light, light.center, light.radiance),
        radius=float(np.sqrt(dot(half_u, half_u))[0]),
        span=LinearSpan(half_u, half_v, normal),
        circular=circular,
    )
