# SPDX-License-Identifier: GPL-3.0-or-later
"""Convex polygon lights, which emit to one side."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..geometry.light_protocol import LinearSpan
from ..geometry.sphere.kernels import surface_tolerance
from ..numerics.arrays import Array, Mask
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import cross, dot
from ..scene.description import PolygonLight, Shape, Triangle, vector_of
from .emitter import LightMotion
from .flat_light import FlatEmitter
from .form_factor import polygon_factor

__all__ = ["PolygonEmitter", "make_polygon_emitter"]


PARALLEL = 2.0**-40
"""Sine of the angle between a side and lines across a light up to which they do not meet."""


@dataclass(frozen=True, kw_only=True)
class PolygonEmitter(FlatEmitter):
    """A convex polygon of uniform radiance.

    offsets : (3, k) metres, from the centre to the corners, anticlockwise seen from the side
        that it emits to.
    """

    offsets: Array

    def corners(self, to: Array) -> list[Array]:
        """Corners (3, n) metres from the points, in the order of `offsets`."""
        return [to + offset for offset in self.offsets.T[..., None]]

    def extent(self, vector: Array) -> Array:
        """Largest |offset . vector| over all corners, for vectors (3, n): (n,)."""
        each = [np.abs(dot(offset, vector)) for offset in self.offsets.T[..., None]]
        extent: Array = np.maximum.reduce(each)
        return extent

    @property
    def probe_sides(self) -> tuple[Array, Array]:
        """See `FlatEmitter.probe_sides`."""
        outward = cross(_sides(self.offsets), self.span.normal)
        room = dot(outward, self.offsets)
        u, v = self.span.half_u, self.span.half_v
        most = [float((room / np.maximum(np.abs(dot(outward, x)), TINY)).min()) for x in (u, v)]
        return u * min(1.0, 2.0 * most[0]), v * min(1.0, 2.0 * most[1])

    def visible_shapes(self, reach: float) -> tuple[Shape, ...]:
        """Return triangles that make up the polygon, if the camera is before it."""
        del reach
        if not self.faces_camera():
            return ()
        first, *rest = (vector_of(corner[:, 0]) for corner in self.corners(self.center))
        return tuple(
            Triangle((first, one, other), motion=self.relative_motion, name=self.name)
            for one, other in pairwise(rest)
        )

    def outline_clearance(self, axis: Array, direction: Array, distance: Array) -> Array:
        """Angles (n,) from directions to the nearest side of the light, negative outside it.

        The light's extent towards a direction does not tell the distance to a side that the
        direction is beside.
        """
        corners = self.corners(axis * distance)
        length = np.maximum(np.sqrt(dot(direction, direction)), TINY)
        sines = []
        for start, end in zip(corners, corners[1:] + corners[:1], strict=True):
            inward = cross(end - start, start)
            size = np.maximum(np.sqrt(dot(inward, inward)), TINY)
            sines.append(dot(direction, inward) / (size * length))
        room: Array = np.arcsin(np.clip(np.minimum.reduce(sines), -1.0, 1.0))
        return room

    def _from_nearest(self, to: Array) -> Array:
        """Vectors (3, n) metres from the light's nearest points."""
        away = -to
        normal = self.span.normal
        nearest = dot(normal, away) * normal
        inside = np.ones(away.shape[1:], dtype=np.bool_)
        least = np.full(away.shape[1:], np.inf)
        ends = self.offsets.T[..., None], _sides(self.offsets).T[..., None]
        for offset, side in zip(*ends, strict=True):
            start = away - offset
            beside = dot(cross(normal, side), start) < 0.0
            inside &= ~beside
            part = np.clip(dot(start, side) / dot(side, side), 0.0, 1.0)
            gap = start - part * side
            square = np.where(beside, dot(gap, gap), np.inf)
            nearest = np.where(square < least, gap, nearest)
            least = np.minimum(square, least)
        return nearest

    def height_range(self, to: Array, normal: Array) -> tuple[Array, Array]:
        """See `FlatEmitter.height_range`."""
        heights = [dot(normal, corner) for corner in self.corners(to)]
        return np.minimum.reduce(heights), np.maximum.reduce(heights)

    def is_above_horizon(
        self, to: Array, point: Array, normal: Array, reach: Array, bend: Array
    ) -> Mask:
        """Where the light is above the horizon of all points within reach, and faces them."""
        tilt = self.height_variation(to, reach, bend) + surface_tolerance(point, self.radius)
        low, _ = self.height_range(to, normal)
        whole: Mask = (low > tilt) & (self.height_above(to, point) > reach)
        return whole

    def irradiance_factor(self, to: Array, point: Array, normal: Array) -> Array:
        """Irradiance over the radiance, (n,) in sr, 0 from behind.

        Errors are those of `form_factor.polygon_factor`.
        """
        factor = np.zeros(to.shape[1])
        rows = (self.height_above(to, point) > 0.0).nonzero()[0]
        if rows.size:
            factor[rows] = polygon_factor(self.corners(columns(to, rows)), columns(normal, rows))
        return factor

    @property
    def _area(self) -> float:
        """Area, m^2."""
        return 0.5 * float(dot(self.span.normal, cross(self.offsets, _sides(self.offsets))).sum())

    def normal_incidence_factor(self, square: Array, half: Array) -> Array:
        """Approximate irradiance factor (n,) of the light if it faced the point."""
        most: Array = self._area / square
        return most

    def sample(
        self, to: Array, point: Array, normal: Array, a: Array, b: Array
    ) -> tuple[Array, Array]:
        """Sample the light, uniformly over its area: b goes around it, and a from its centre out.

        Around the centre b grows with the area that is passed, so the map has no gaps.
        """
        along = _sides(self.offsets)
        passed = np.append(0.0, np.cumsum(dot(self.span.normal, cross(self.offsets, along))))
        passed /= passed[-1]
        side = np.clip(np.searchsorted(passed, b, side="right") - 1, 0, along.shape[1] - 1)
        part = (b - passed[side]) / np.diff(passed)[side]
        to = to + np.sqrt(a) * (self.offsets[:, side] + part * along[:, side])
        return to, self._sample_weights(to, point, normal, np.array(self._area))

    @property
    def line_span(self) -> LinearSpan:
        """The rectangle or parallelogram around the light."""
        return self.span

    def chords(self, b: Array) -> tuple[Array, Array]:
        """See `Emitter.chords`: lines end where they leave the first side on their way."""
        u, v = self.span.half_u, self.span.half_v
        inward = cross(self.span.normal, _sides(self.offsets))
        slope, across = 2.0 * dot(inward, u), 2.0 * dot(inward, v)
        # inward . (point - corner) = slope a + level, of points at (a, b)
        level = dot(inward, -u - v - self.offsets)[:, None] + across[:, None] * b
        steep = np.abs(slope) > PARALLEL * np.sqrt(dot(inward, inward) * dot(u, u))
        place = -level / np.where(steep, slope, 1.0)[:, None]
        low = np.where((steep & (slope > 0.0))[:, None], place, 0.0).max(axis=0)
        high = np.where((steep & (slope < 0.0))[:, None], place, 1.0).min(axis=0)
        outside = (~steep[:, None] & (level < 0.0)).any(axis=0)
        low = np.clip(low, 0.0, 1.0)
        return low, np.where(outside, low, np.clip(high, low, 1.0))

    def line_sample(
        self, to: Array, point: Array, normal: Array, a: Array, b: Array
    ) -> tuple[Array, Array]:
        """See `Emitter.line_sample`."""
        half_u, half_v = self.span.half_u[:, :, None], self.span.half_v[:, :, None]
        to = to + ((2.0 * a - 1.0) * half_u + (2.0 * b - 1.0) * half_v)
        edge = cross(half_u, half_v)
        return to, self._sample_weights(to, point, normal, 4.0 * np.sqrt(dot(edge, edge)))

    def silhouette(self, to: Array, normal: Array) -> Array:
        """Return the light's corners: (k, 3, n) metres from the points."""
        return np.array(self.corners(to))


def _sides(offsets: Array) -> Array:
    """Vectors (3, k) from each corner to the next one."""
    return np.roll(offsets, -1, axis=1) - offsets


def make_polygon_emitter(light: PolygonLight, motion: LightMotion) -> PolygonEmitter:
    """Return a convex polygon light's emitter, whose centre is the polygon's centroid."""
    place = np.array(light.vertices).T
    first = place[:, :1]
    local = place - first
    one, other = local[:, 1:-1], local[:, 2:]
    turned = cross(one, other)
    normal = turned.sum(axis=1, keepdims=True)
    normal /= np.sqrt(dot(normal, normal))
    weight = dot(normal, turned)
    middle = ((one + other) * weight).sum(axis=1, keepdims=True) / (3.0 * weight.sum())
    offsets = local - middle
    return PolygonEmitter(
        **motion.placed(light, vector_of((first + middle)[:, 0]), light.radiance),
        radius=float(np.sqrt(dot(offsets, offsets)).max()),
        span=_enclosing_span(offsets, normal),
        offsets=offsets,
    )


def _enclosing_span(offsets: Array, normal: Array) -> LinearSpan:
    """Return the least rectangle around the centre that holds a polygon, along one of its sides."""
    sides = _sides(offsets)
    u = sides / np.sqrt(dot(sides, sides))
    v = cross(normal, u)
    size = [np.abs(way.T @ offsets).max(axis=1) for way in (u, v)]
    best = int((size[0] * size[1]).argmin())
    return LinearSpan(size[0][best] * u[:, [best]], size[1][best] * v[:, [best]], normal)
