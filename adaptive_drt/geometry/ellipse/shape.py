# SPDX-License-Identifier: GPL-3.0-or-later
"""Flat ellipses as a kind of shape: they are seen exactly, and hide lights by elliptic cones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.axes import SHUTTER_ENDS
from ...numerics.gather import columns
from ...numerics.vector import cross, dot, norm
from ...scene.description import Ellipse
from ..camera import PinholeCamera
from ..implicit_surface import ImplicitPlane
from ..light_protocol import AreaLight, LightShape
from ..line_forms import BoxRays
from ..occluder_outline import ELLIPSE, NOTHING, RAYS
from ..pixel_coverage import PixelCoverage
from ..planar_faces import NO_SOLID, PlanarFaces
from ..polygon.kernels import moves_in_own_plane, plane_hits
from ..receivers import Receivers
from ..shape import ShapeSet
from ..sphere.kernels import surface_tolerance
from ..sphere.light_occlusion import enclosed_may_cast_sharp_edge
from ..sphere.outline import kinds_before_ball
from .line_polynomials import EllipseForms, ellipse_forms
from .pixel_coverage import ellipse_coverage

__all__ = ["EllipseSet"]


@dataclass(frozen=True)
class EllipseSet(ShapeSet):
    """Flat ellipses: see `ShapeSet`.

    Attributes
    ----------
    center : (3, n) metres.  half_u, half_v : (3, n) metres, the half axes. Of faces of solids their
        cross product points out of the solid.
    bodies : see `ShapeSet.bodies`.
    """

    center: Array
    half_u: Array
    half_v: Array
    displacement: Array | None
    bodies: Ints | None = None
    planar: ClassVar[bool] = True
    uneven: ClassVar[bool] = True

    @classmethod
    def from_records(
        cls, records: Sequence[Ellipse], origin: Array, displacement: Array | None
    ) -> EllipseSet:
        """Ellipses relative to the camera at `origin` (3, 1), metres."""
        parts = [
            np.array([getattr(each, name) for each in records], dtype=np.float64).reshape(-1, 3).T
            for name in ("center", "half_u", "half_v")
        ]
        center, u, v = map(np.ascontiguousarray, parts)
        bodies = np.array([each.body for each in records], dtype=np.int64)
        return cls(center - origin, u, v, displacement, bodies)

    @cached_property
    def unit_normal(self) -> Array:
        """Unit normals (3, n) along half_u x half_v."""
        normal = cross(self.half_u, self.half_v)
        return normal / norm(normal)

    @property
    def bounding_spheres(self) -> tuple[Array, Array]:
        """Spheres around the centres: (3, n) and (n,), metres."""
        u, v = self.half_u, self.half_v
        uu, vv, uv = dot(u, u), dot(v, v), dot(u, v)
        # the longer principal half axis
        return self.center, np.sqrt(0.5 * (uu + vv + np.hypot(uu - vv, 2.0 * uv)))

    @cached_property
    def faces(self) -> PlanarFaces:
        """See `ShapeSet.faces`; the vertices are those of the parallelogram around the ellipse."""
        vertices = _corners(self.center, self.half_u, self.half_v)
        size = 2.0 * np.minimum(norm(self.half_u), norm(self.half_v))
        solid = np.full(self.count, NO_SOLID)
        return PlanarFaces(vertices, self.unit_normal, size, self.displacement, solid)

    @property
    def moves_under_fixed_ray(self) -> Mask:
        """See `ShapeSet.moves_under_fixed_ray`: not where an ellipse moves within its plane."""
        d = self.displacement
        if d is None:
            return np.zeros(self.count, dtype=np.bool_)
        moves: Mask = d.any(axis=0) & ~moves_in_own_plane(d, self.half_u, self.half_v)
        return moves

    def implicit_surface(self, index: Ints) -> ImplicitPlane:
        """See `ShapeSet.implicit_surface`."""
        normal = cross(columns(self.half_u, index), columns(self.half_v, index))
        return ImplicitPlane(normal, columns(self.center, index))

    def centers_at(self, index: Ints, time: Array | float) -> Array:
        """Centres (3, ...) of ellipses `index` at shutter times that broadcast against it."""
        return self.at_time(self.center, index, time)

    def coverage(self, index: Ints, w: Array, camera: PinholeCamera, order: int) -> PixelCoverage:
        """See `ShapeSet.coverage`."""
        u, v = columns(self.half_u, index), columns(self.half_v, index)
        return ellipse_coverage(columns(self.center, index), u, v, w, camera, order)

    def moving_coverage(
        self, index: Ints, w: Array, camera: PinholeCamera, order: int, whole_pixel: bool
    ) -> PixelCoverage:
        """See `ShapeSet.moving_coverage`.

        For a fixed ray the discriminant is concave in time, and the height is linear, so a pixel
        that is covered at both ends of the shutter is covered all the time.
        """
        bound = super().moving_coverage(index, w, camera, order, whole_pixel)
        u, v = columns(self.half_u, index), columns(self.half_v, index)
        ends = [self.centers_at(index, time) for time in SHUTTER_ENDS]
        one, other = (ellipse_coverage(end, u, v, w, camera, order) for end in ends)
        normal = cross(u, v)
        same = dot(ends[0], normal) * dot(ends[1], normal) > 0.0
        covers = one.covers & other.covers & same
        near = np.where(covers, np.minimum(one.near, other.near), bound.near)
        far = np.where(covers, np.maximum(one.far, other.far), bound.far)
        return PixelCoverage(bound.may_hit, covers, near, far)

    def least_cosine(self, index: Ints, cosine: Array, turn: Array, point: Array) -> Array:
        """See `ShapeSet.least_cosine`: the normal is the same everywhere."""
        del index, point
        return cosine - turn

    def intersect(self, index: Ints, w: Array, time: Array | float) -> Array:
        """See `ShapeSet.intersect`."""
        inside, facing, height = self._meets(index, 0.0, w, time)
        found = inside & (facing > 0.0) & (height > 0.0)
        with np.errstate(over="ignore"):  # a grazing hit beyond float64's range is a miss
            t: Array = np.where(found, height, np.inf) / np.where(found, facing, 1.0)
        return t

    def _meets(
        self, index: Ints, start: Array | float, w: Array, time: Array | float
    ) -> tuple[Mask, Array, Array]:
        """Whether lines along w from `start` meet ellipses, w.normal and the height of the start.

        The normal, of any length, is turned away from the start.
        """
        u, v = columns(self.half_u, index), columns(self.half_v, index)
        place = self.centers_at(index, time) - start
        normal = cross(u, v)
        facing, height = dot(w, normal), dot(place, normal)
        a, b = dot(w, cross(v, place)), dot(w, cross(place, u))
        side = np.where(height < 0.0, -1.0, 1.0)
        return facing * facing >= a * a + b * b, side * facing, side * height

    def surface(
        self, index: Ints, w: Array, point: Array, time: Array | float
    ) -> tuple[Array, Array, Mask]:
        """See `ShapeSet.surface`."""
        del time
        across = columns(self.unit_normal, index)
        away = dot(across, w) > 0.0
        return point, np.where(away, -across, across), np.zeros(index.size, dtype=np.bool_)

    def blocks(self, index: Ints, start: Array, to: Array, time: Array | float) -> Mask:
        """See `ShapeSet.blocks`."""
        inside, facing, height = self._meets(index, start, to, time)
        normal = cross(columns(self.half_u, index), columns(self.half_v, index))
        away = self.centers_at(index, time) - start
        graze = surface_tolerance(start, norm(away)) * norm(normal)
        blocked: Mask = inside & (facing > height) & (height > graze)
        return blocked

    def line_forms(self, index: Ints, rows: Ints, rays: BoxRays) -> EllipseForms:
        """See `ShapeSet.line_forms`."""
        u, v = columns(self.half_u, index), columns(self.half_v, index)
        return ellipse_forms(
            rows, rays, columns(self.center, index), self.displacements(index), u, v
        )

    def casts_sharp_edge(
        self, index: Ints, light: LightShape, receivers: Receivers, order: int
    ) -> Mask:
        """See `ShapeSet.casts_sharp_edge`; only for faces of solids more than the default."""
        may = super().casts_sharp_edge(index, light, receivers, order)
        if self.bodies is not None and light.extended:
            rows = (self.bodies[index] >= 0).nonzero()[0]
            center, r = (part.take(index[rows], axis=-1) for part in self.bounding_spheres)
            may[rows] = enclosed_may_cast_sharp_edge(light, receivers.take(rows), center, r)
        return may

    def outline_kind(
        self, index: Ints, point: Array, own: Mask, light: AreaLight, time: Array | float
    ) -> Ints:
        """See `ShapeSet.outline_kind`: those that a light's plane cuts have none."""
        u, v = columns(self.half_u, index), columns(self.half_v, index)
        center = self.centers_at(index, time)
        to, away = light.to_center(point, time), center - point
        if light.solid:
            radius = self.bounding_spheres[1][index]
            kind = kinds_before_ball(center, radius, to, light, time)
        else:
            plane = light.plane(to)
            extent = np.hypot(dot(plane.normal, u), dot(plane.normal, v))
            height = plane.height_of(away)
            kind = np.where(height >= extent, ELLIPSE, np.where(height <= -extent, NOTHING, RAYS))
        # seen edge-on, from within its plane
        above = np.abs(dot(columns(self.unit_normal, index), away))
        flat = own | (above <= surface_tolerance(point, norm(away)))
        return np.where(flat, NOTHING, kind)

    def elliptic_outline(
        self, index: Ints, point: Array, time: Array | float
    ) -> tuple[Array, Array, Array]:
        """See `ShapeSet.elliptic_outline`: the ellipses themselves."""
        center = self.centers_at(index, time) - point
        return center, columns(self.half_u, index), columns(self.half_v, index)

    def extent(self, index: Ints, direction: Array, time: Array | float) -> tuple[Array, Array]:
        """See `ShapeSet.extent`."""
        middle = dot(self.centers_at(index, time), direction)
        u, v = columns(self.half_u, index), columns(self.half_v, index)
        reach = np.hypot(dot(u, direction), dot(v, direction))
        return middle - reach, middle + reach

    def closest_points(self, index: Ints, w: Array, time: Array | float) -> Array:
        """See `ShapeSet.closest_points`: where the rays meet the ellipses' planes."""
        place = self.centers_at(index, time)
        u, v = columns(self.half_u, index), columns(self.half_v, index)
        return plane_hits(w, cross(u, v), place, _corners(place, u, v))


def _corners(center: Array, u: Array, v: Array) -> tuple[Array, Array, Array, Array]:
    """Corners (3, ...) of the parallelograms around ellipses, in order."""
    return center - u - v, center + u - v, center + u + v, center - u + v
