# SPDX-License-Identifier: GPL-3.0-or-later
"""Parallelogram lights: polygons whose formulas are shorter, and that lines can run across."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.light_protocol import LinearSpan
from ..geometry.sphere.kernels import surface_tolerance
from ..numerics.arrays import Array, Mask
from ..numerics.floats import TINY
from ..numerics.vector import cross, dot
from ..scene.description import Quad, QuadLight, Shape, vector_of
from .emitter import LightMotion, column
from .form_factor import QUAD_CORNERS, parallelogram_factor
from .polygon_light import PolygonEmitter

__all__ = ["QuadEmitter", "make_quad_emitter"]


@dataclass(frozen=True, kw_only=True)
class QuadEmitter(PolygonEmitter):
    """A parallelogram of uniform radiance."""

    def extent(self, vector: Array) -> Array:
        """Sum of |half edge . vector| over both half edges, for vectors (3, n): (n,)."""
        extent: Array = np.abs(dot(self.span.half_u, vector)) + np.abs(
            dot(self.span.half_v, vector)
        )
        return extent

    def visible_shapes(self, reach: float) -> tuple[Shape, ...]:
        """Return the parallelogram, if the camera is before it."""
        del reach
        if not self.faces_camera():
            return ()
        u, v = self.span.half_u, self.span.half_v
        corner, a, b = (vector_of(p[:, 0]) for p in (self.center - u - v, 2.0 * u, 2.0 * v))
        return (Quad(corner, a, b, motion=self.relative_motion, name=self.name),)

    def corners(self, to: Array) -> list[Array]:
        """Corners (3, n) metres from the points, in the order of `QUAD_CORNERS`."""
        sides = {1.0: to + self.span.half_u, -1.0: to - self.span.half_u}
        return [sides[su] + sv * self.span.half_v for su, sv in QUAD_CORNERS]

    def outline_clearance(self, axis: Array, direction: Array, distance: Array) -> Array:
        """Angles (n,) from directions to the nearest side of the light, negative outside it.

        The light's extent towards a direction does not tell the distance to a side that the
        direction is beside.
        """
        rooms = []
        half_u, half_v = self.span.half_u, self.span.half_v
        along = dot(axis, direction)
        for side, other in ((half_u, half_v), (half_v, half_u)):
            across = cross(axis, other + np.zeros_like(axis))
            size = np.maximum(np.sqrt(dot(across, across)), TINY)
            wide = np.abs(dot(side, across)) / size
            beside = np.abs(dot(direction, across)) / size
            rooms.append(np.arctan2(wide, distance) - np.arctan2(beside, along))
        room: Array = np.minimum(*rooms)
        return room

    def _from_nearest(self, to: Array) -> Array:
        """Vectors (3, n) metres from the light's nearest points, as `falloff_offset` finds them."""
        away = -to
        for half in (self.span.half_u, self.span.half_v):
            part = np.clip(dot(away, half) / dot(half, half), -1.0, 1.0)
            away = away - part * half
        return away

    def is_above_horizon(
        self, to: Array, point: Array, normal: Array, reach: Array, bend: Array
    ) -> Mask:
        """Where the light is above the horizon of all points within reach, and faces them."""
        tilt = self.height_variation(to, reach, bend) + surface_tolerance(point, self.radius)
        low = dot(normal, to)
        low -= np.abs(dot(normal, self.span.half_u))
        low -= np.abs(dot(normal, self.span.half_v))
        whole: Mask = (low > tilt) & (self.height_above(to, point) > reach)
        return whole

    def irradiance_factor(self, to: Array, point: Array, normal: Array) -> Array:
        """Irradiance over the radiance, (n,) in sr, 0 from behind.

        Errors are those of `form_factor.parallelogram_factor`.
        """
        lit = self.height_above(to, point) > 0.0
        half_u, half_v = self.span.half_u, self.span.half_v
        return np.where(lit, parallelogram_factor(to, half_u, half_v, normal), 0.0)

    def normal_incidence_factor(self, square: Array, half: Array) -> Array:
        """Approximate irradiance factor (n,) of the light if it faced the point."""
        u, v = self.span.half_u, self.span.half_v
        most: Array = 4.0 * float(np.sqrt(dot(u, u) * dot(v, v))[0]) / square
        return most

    def sample(
        self, to: Array, point: Array, normal: Array, a: Array, b: Array
    ) -> tuple[Array, Array]:
        """Sample the light, uniformly over its area: it fills the parallelogram of its lines."""
        return self.line_sample(to, point, normal, a, b)

    @property
    def probe_sides(self) -> tuple[Array, Array]:
        """Its half edges: see `FlatEmitter.probe_sides`."""
        return self.span.half_u, self.span.half_v

    def chords(self, b: Array) -> tuple[Array, Array]:
        """Lines run from one side to the other: see `Emitter.chords`."""
        return np.zeros_like(b), np.ones_like(b)


def make_quad_emitter(light: QuadLight, motion: LightMotion) -> QuadEmitter:
    """Return a parallelogram light's emitter."""
    half_u, half_v = column(light.half_u), column(light.half_v)
    normal = cross(half_u, half_v)
    normal = normal / np.sqrt(dot(normal, normal))
    diagonals = (half_u + half_v, half_u - half_v)
    radius = max(float(np.sqrt(dot(diagonal, diagonal))[0]) for diagonal in diagonals)
    return QuadEmitter(
        **motion.placed(light, light.center, light.radiance),
        radius=radius,
        span=LinearSpan(half_u, half_v, normal),
        offsets=np.hstack([su * half_u + sv * half_v for su, sv in QUAD_CORNERS]),
    )
