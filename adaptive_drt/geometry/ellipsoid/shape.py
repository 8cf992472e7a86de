# SPDX-License-Identifier: GPL-3.0-or-later
"""Ellipsoids as a kind of shape: balls under any linear map.

What rays hit, cover and cross is that of unit spheres in spaces of their own: see `unit_space`.
What they hide of lights is bounded by the cone over an ellipse: see `geometry.elliptic_cones`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.gather import columns
from ...numerics.jet import Jet
from ...numerics.taylor_range import rectangle_range
from ...numerics.vector import cross, dot, norm
from ...scene.description import Ellipsoid
from ..camera import PinholeCamera
from ..elliptic_cones import ellipsoid_outline
from ..light_plane import LightPlane
from ..light_protocol import AreaLight, LightShape
from ..line_forms import BoxRays
from ..native_solids import Ellipsoids
from ..occluder_outline import CUT, ELLIPSE, NOTHING, RAYS
from ..pixel_coverage import PixelCoverage
from ..quadric_lines import QuadricForms
from ..receivers import Receivers
from ..shaded_patches import ShadedPatches
from ..shadow_edges import ShadowEdges
from ..shape import ShapeSet
from ..sphere.kernels import (
    discriminant,
    discriminant_rounding,
    intersect_sphere,
    sphere_blocks_segment,
    surface_tolerance,
)
from ..sphere.light_occlusion import sphere_hides_from_patch
from ..sphere.line_polynomials import sphere_forms
from ..sphere.outline import kinds_before_ball
from ..sphere.pixel_coverage import coverage_from_ranges, moving_ball_coverage
from ..sphere.plane_section import clipped_sphere_polygons
from .light_occlusion import (
    ellipsoid_casts_sharp_edge,
    ellipsoid_hides_from_footprint,
    ellipsoid_occlusion,
)
from .shadow_edges import ellipsoid_shadow_edges
from .unit_space import UnitSpace

__all__ = ["EllipsoidSet"]


MIN_ELLIPSOID_COSINE = 2.0**-16
"""Least cosine between the normal of an ellipsoid and a ray, as for spheres."""
INNER_HIT_OFFSET = 2.0**-36
"""Distance from the surface at which hits on the inner side are placed, in units of the half axes,
times the ratio of the longest to the shortest: it keeps them inside by more than
`sphere.kernels.SURFACE_TOLERANCE`."""


@dataclass(frozen=True)
class EllipsoidSet(ShapeSet):
    """Ellipsoids: see `ShapeSet`.

    Attributes
    ----------
    center : (3, n) metres.  half_axes : (3, 3, n) metres, whose second axis counts the half axes.
    """

    center: Array
    half_axes: Array
    displacement: Array | None
    traced_natively: ClassVar[bool] = True
    occluder_cost: ClassVar[float] = 2.0
    has_elliptic_outlines: ClassVar[bool] = True
    uneven: ClassVar[bool] = True

    @classmethod
    def from_records(
        cls, records: Sequence[Ellipsoid], origin: Array, displacement: Array | None
    ) -> EllipsoidSet:
        """Ellipsoids relative to the camera at `origin` (3, 1), metres."""
        center, *axes = (
            np.array([getattr(each, name) for each in records], dtype=np.float64).reshape(-1, 3).T
            for name in ("center", "half_u", "half_v", "half_w")
        )
        return cls(center - origin, np.ascontiguousarray(np.stack(axes, axis=1)), displacement)

    @cached_property
    def spaces(self) -> UnitSpace:
        """The spaces in which the ellipsoids are unit spheres."""
        return UnitSpace.make(self.half_axes)

    def centers_at(self, index: Ints, time: Array | float) -> Array:
        """Centres (3, ...) of ellipsoids `index` at shutter times that broadcast against it."""
        return self.at_time(self.center, index, time)

    @property
    def bounding_spheres(self) -> tuple[Array, Array]:
        """Spheres around the centres whose radii are the longest half axes."""
        return self.center, self.spaces.longest

    def native_solids(self, index: Ints | slice) -> Ellipsoids:
        """See `ShapeSet.native_solids`."""
        d = self.displacement
        return Ellipsoids(
            columns(self.center, index),
            columns(self.half_axes, index, -1),
            self.spaces.shortest[index],
            None if d is None else columns(d, index),
        )

    @property
    def inner_radii(self) -> Array:
        """The shortest half axes."""
        return self.spaces.shortest

    @property
    def curvature(self) -> Array:
        """Largest curvatures (n,): those at the ends of the longest axes."""
        return self.spaces.longest / self.spaces.shortest**2

    @property
    def min_cosine(self) -> Array:
        """`MIN_ELLIPSOID_COSINE` for each, (n,)."""
        return np.full(self.count, MIN_ELLIPSOID_COSINE)

    def coverage(self, index: Ints, w: Array, camera: PinholeCamera, order: int) -> PixelCoverage:
        """See `ShapeSet.coverage`: that of a unit sphere by rays of its space."""
        space = self.spaces.take(index)
        v, way, steps, h = self._pixel_rays(space, index, w, camera)
        ww, vv, along = dot(way, way), dot(v, v), dot(way, v)
        slope = 0.5 * (np.abs(dot(steps[0], v)) + np.abs(dot(steps[1], v)))
        ray = Jet.linear(way, steps, order)
        remainder = h * h * np.maximum(1.0, vv)
        low, high = rectangle_range(discriminant(ray, v, 1.0), 0.5, 0.5, remainder)
        side = norm(cross(way, v)) + h * np.sqrt(vv)
        rounding = discriminant_rounding(ww, vv, 1.0, side)
        length = np.sqrt(ww)
        small = np.maximum(length - h, camera.image_plane_distance / space.longest)
        lengths = small, length + h
        return coverage_from_ranges((low, high), rounding, (along, slope), lengths, vv < 1.0)

    def moving_coverage(
        self, index: Ints, w: Array, camera: PinholeCamera, order: int, whole_pixel: bool
    ) -> PixelCoverage:
        """See `ShapeSet.moving_coverage`: that of a moving unit sphere."""
        assert self.displacement is not None
        space = self.spaces.take(index)
        v, way, _, h = self._pixel_rays(space, index, w, camera)
        d = space.coordinates(columns(self.displacement, index))
        one = np.ones(v.shape[1])
        return moving_ball_coverage(v, d, one, way, h if whole_pixel else 0.0, order)

    def _pixel_rays(
        self, space: UnitSpace, index: Ints, w: Array, camera: PinholeCamera
    ) -> tuple[Array, Array, tuple[Array, Array], Array]:
        """Centres and rays of pixels in the spaces of ellipsoids `index` (m,).

        Returns
        -------
        Coordinates (3, m) of centres, of the directions w, and of their changes from pixel to pixel
        along x and y; and bounds (m,) on the distances of a pixel's directions from w.
        """
        v, way = space.coordinates(columns(self.center, index)), space.coordinates(w)
        right, up = (space.coordinates(step[:, None]) for step in (camera.right, camera.up))
        return v, way, (right, up), 0.5 * (norm(right) + norm(up))

    def least_cosine(self, index: Ints, cosine: Array, turn: Array, point: Array) -> Array:
        """See `ShapeSet.least_cosine`.

        In the ellipsoid's own space the cosine is that of a sphere, and all cosines and turns
        differ from those here by no more than the ratio of the longest to the shortest half axis.
        """
        del point
        space = self.spaces.take(index)
        v, stretch = space.coordinates(columns(self.center, index)), space.stretch
        angle = np.arcsin(np.minimum(stretch * turn, 1.0))
        sine = np.sqrt(np.maximum(1.0 - (cosine / stretch) ** 2, 0.0)) + norm(v) * angle
        least: Array = np.sqrt(np.maximum(1.0 - sine * sine, 0.0)) / stretch
        return least

    def intersect(self, index: Ints, w: Array, time: Array | float) -> Array:
        """See `ShapeSet.intersect`."""
        space = self.spaces.take(index)
        place = space.coordinates(self.centers_at(index, time))
        return intersect_sphere(space.coordinates(w), place, 1.0)

    def surface(
        self, index: Ints, w: Array, point: Array, time: Array | float
    ) -> tuple[Array, Array, Mask]:
        """See `ShapeSet.surface`."""
        space, center = self.spaces.take(index), self.centers_at(index, time)
        out = space.coordinates(point - center)
        out /= norm(out)
        eye = space.coordinates(center)
        within = dot(eye, eye) < 1.0
        normal = space.normals(out)
        size = np.where(within, 1.0 - np.minimum(INNER_HIT_OFFSET * space.stretch, 0.5), 1.0)
        return center + space.vectors(size * out), np.where(within, -normal, normal), within

    def blocks(self, index: Ints, start: Array, to: Array, time: Array | float) -> Mask:
        """See `ShapeSet.blocks`."""
        space, center = self.spaces.take(index), self.centers_at(index, time)
        graze = surface_tolerance(start, space.longest) / space.shortest
        place = space.coordinates(center - start)
        return sphere_blocks_segment(space.coordinates(to), place, 1.0, graze)

    def line_forms(self, index: Ints, rows: Ints, rays: BoxRays) -> QuadricForms:
        """See `ShapeSet.line_forms`."""
        space = self.spaces.take(index)
        middle, across, upward = (space.coordinates(w) for w in rays.directions)
        mapped = BoxRays((middle, across, upward), rays.time, rays.duration)
        d = self.displacements(index)
        d = None if d is None else space.coordinates(d)
        center = space.coordinates(columns(self.center, index))
        forms = sphere_forms(rows, mapped, center, d, np.ones(index.size))
        return QuadricForms(rows, forms.polynomials)

    def extent(self, index: Ints, direction: Array, time: Array | float) -> tuple[Array, Array]:
        """See `ShapeSet.extent`."""
        middle = dot(self.centers_at(index, time), direction)
        reach = norm(self.spaces.take(index).covectors(direction))
        return middle - reach, middle + reach

    def occlusion(
        self,
        index: Ints,
        light: LightShape,
        receivers: Receivers,
        time: Array | float,
        order: int,
    ) -> tuple[Mask, Mask]:
        """See `ShapeSet.occlusion`."""
        center = self.centers_at(index, time)
        return ellipsoid_occlusion(light, receivers, center, self.spaces.take(index), time, order)

    def hides_from_patch(
        self, index: Ints, light: LightShape, receivers: Receivers, time: float
    ) -> Mask:
        """See `ShapeSet.hides_from_patch`; by the inner balls."""
        center, radius = self.centers_at(index, time), self.spaces.shortest[index]
        return sphere_hides_from_patch(light, receivers, center, radius, time)

    def casts_sharp_edge(
        self, index: Ints, light: LightShape, receivers: Receivers, order: int
    ) -> Mask:
        """See `ShapeSet.casts_sharp_edge`."""
        del order
        center = columns(self.center, index)
        return ellipsoid_casts_sharp_edge(light, receivers, center, self.spaces.take(index))

    def hides_from_footprint(self, index: Ints, light: LightShape, receivers: Receivers) -> Mask:
        """See `ShapeSet.hides_from_footprint`."""
        center = columns(self.center, index)
        return ellipsoid_hides_from_footprint(light, receivers, center, self.spaces.take(index))

    def shadow_edges(self, index: Ints, receivers: ShadedPatches, light: AreaLight) -> ShadowEdges:
        """See `ShapeSet.shadow_edges`."""
        center = self.centers_at(index, receivers.time)
        return ellipsoid_shadow_edges(
            center, self.spaces.take(index), self.displacements(index), receivers, light
        )

    def outline_kind(
        self, index: Ints, point: Array, own: Mask, light: AreaLight, time: Array | float
    ) -> Ints:
        """See `ShapeSet.outline_kind`; from inside, or near a solid light, none is known."""
        space, center = self.spaces.take(index), self.centers_at(index, time)
        v, to = center - point, light.to_center(point, time)
        if light.solid:
            kind = kinds_before_ball(center, space.longest, to, light, time)
        else:
            plane = light.plane(to)
            height, extent = plane.height_of(v), norm(space.covectors(plane.normal))
            front, behind = height >= extent, height <= -extent
            kind = np.where(front, ELLIPSE, np.where(behind, NOTHING, CUT))
        place = space.coordinates(v)
        return np.where(own | (dot(place, place) <= 1.0), RAYS, kind)

    def elliptic_outline(
        self, index: Ints, point: Array, time: Array | float
    ) -> tuple[Array, Array, Array]:
        """See `ShapeSet.elliptic_outline`."""
        center = self.centers_at(index, time) - point
        return ellipsoid_outline(center, columns(self.half_axes, index, -1))

    def outline_in_plane(
        self, index: Ints, point: Array, time: Array | float, plane: LightPlane, corners: int
    ) -> Array:
        """See `ShapeSet.outline_in_plane`; planes stay planes in the ellipsoids' spaces."""
        v = self.centers_at(index, time) - point
        found = np.empty((index.shape[0], corners, 3, index.shape[1]))
        for i in range(index.shape[0]):
            space = self.spaces.take(index[i])
            normal = space.covectors(plane.normal)
            normal = normal / norm(normal)
            radius = plane.radius / space.shortest
            mapped = LightPlane(normal, space.coordinates(plane.point), radius)
            place, one = space.coordinates(v[:, i])[None], np.ones((1, index.shape[1]))
            for k, corner in enumerate(clipped_sphere_polygons(mapped, place, one, corners)[0]):
                found[i, k] = space.vectors(corner)
        return found

    def closest_points(self, index: Ints, w: Array, time: Array | float) -> Array:
        """See `ShapeSet.closest_points`: nearest in the ellipsoids' spaces."""
        space = self.spaces.take(index)
        way = space.coordinates(w)
        nearest: Array = dot(way, space.coordinates(self.centers_at(index, time))) / dot(way, way)
        return nearest
