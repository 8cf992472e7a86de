# SPDX-License-Identifier: GPL-3.0-or-later
"""Cylinders and truncated cones as a kind of shape: their curved sides.

The ends are ellipses, shapes of their own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.floats import TINY
from ...numerics.gather import columns
from ...numerics.vector import dot, norm
from ...scene.description import Cylinder
from ..camera import PinholeCamera
from ..light_protocol import AreaLight, LightShape
from ..line_forms import BoxRays
from ..native_solids import Cones
from ..occluder_outline import NOTHING, POLYGON, RAYS
from ..pixel_coverage import PixelCoverage
from ..polygon.kernels import distance_to_quad
from ..polygon.shadow_edges import polygon_shadow_edges
from ..polygon.shape import ParallelogramSet
from ..receivers import Receivers
from ..shaded_patches import ShadedPatches
from ..shadow_edges import ShadowEdges
from ..shape import UNKNOWN_CURVATURE, ShapeSet
from ..sphere.kernels import surface_tolerance
from .kernels import axial_view, cylinder_blocks_segment, intersect_side, tangent_trapezoid
from .line_polynomials import SideForms, side_forms
from .outline import SolidView, casts_sharp_edge, hides_from_patch, meets_light, side_occlusion
from .pixel_coverage import side_coverage

__all__ = ["CylinderSet"]


MIN_SIDE_COSINE = 2.0**-16
"""Least cosine between the normal of a side and a ray: at the limb it is only rounding."""
INNER_HIT_OFFSET = 2.0**-37
"""Distance from the surface at which hits on the inner side are placed, in radii: more than the
tolerance by which points count as on the surface."""
POINTED = 2.0**-20
"""Radius of an end, as a fraction of the largest radius, up to which it counts as an apex."""
ESTIMATED_TIP = 2.0**-8
"""Least radius of a cone, as a fraction of its largest, down to which estimates of variation take
its curvature. Nearer to the apex, in a 65,536th of the side's area, they are too low."""
REFINEMENTS = 2
"""Number of times that a bound on cosines is improved by what it says of the radius."""
UNBOUNDED = 2.0**256
"""Extent, in metres, of solids that may hold the camera: their depth order is then found by ray."""


@dataclass(frozen=True)
class CylinderSet(ShapeSet):
    """Curved sides of solid cylinders and truncated cones: see `ShapeSet`.

    Attributes
    ----------
    center : (3, n) metres, the middles.  axis : (3, n) unit, towards the smaller end.
    half, radius : (n,) metres, half the lengths, and the radii in the middle.
    slope : (n,) change of the radius by length along the axis, never positive.
    """

    center: Array
    axis: Array
    half: Array
    radius: Array
    slope: Array
    displacement: Array | None
    traced_natively: ClassVar[bool] = True
    occluder_cost: ClassVar[float] = 40.0
    has_elliptic_outlines: ClassVar[bool] = True
    uneven: ClassVar[bool] = True

    @classmethod
    def from_records(
        cls, records: Sequence[Cylinder], origin: Array, displacement: Array | None
    ) -> CylinderSet:
        """Solids relative to the camera at `origin` (3, 1), metres."""
        start, end = (
            np.array([getattr(each, name) for each in records], dtype=np.float64).reshape(-1, 3).T
            for name in ("start", "end")
        )
        way = np.ascontiguousarray(end - start)
        length = norm(way)
        middle = np.ascontiguousarray(0.5 * (start + end)) - origin
        first, last = np.array([each.radii for each in records], dtype=np.float64).reshape(-1, 2).T
        slope = (last - first) / length
        axis = way / length * np.where(slope > 0.0, -1.0, 1.0)
        radius = np.ascontiguousarray(0.5 * (first + last))
        return cls(middle, axis, 0.5 * length, radius, -np.abs(slope), displacement)

    @cached_property
    def largest(self) -> Array:
        """The largest radii (n,), metres."""
        largest: Array = self.radius - self.slope * self.half
        return largest

    @cached_property
    def bounding_spheres(self) -> tuple[Array, Array]:
        """Smallest spheres around the solids: (3, n) and (n,), metres."""
        # along the axis from the middle: at the centre both rims are equally far, or only one is
        shift = np.maximum(self.slope * self.radius, -self.half)
        rims = np.hypot(self.half + shift, self.largest)
        return self.center + shift * self.axis, rims

    def native_solids(self, index: Ints | slice) -> Cones:
        """See `ShapeSet.native_solids`."""
        center, axis = columns(self.center, index), columns(self.axis, index)
        half, radius, slope = self.half[index], self.radius[index], self.slope[index]
        d = self.displacement
        radii = np.array([radius - slope * half, np.maximum(radius + slope * half, 0.0)])
        ends = np.array([center - half * axis, center + half * axis])
        return Cones(ends, radii, None if d is None else columns(d, index))

    @property
    def inner_radii(self) -> Array:
        """See `ShapeSet.inner_radii`."""
        shift = np.maximum(self.slope * self.radius, -self.half)
        level = (self.radius + self.slope * shift) / np.sqrt(1.0 + self.slope**2)
        within: Array = np.minimum(self.half + shift, level)
        return within

    @property
    def curvature(self) -> Array:
        """See `ShapeSet.curvature`: those at the smaller ends; none is known at an apex."""
        least = (self.radius + self.slope * self.half) * np.sqrt(1.0 + self.slope**2)
        pointed = least <= POINTED * self.largest
        return np.where(pointed, UNKNOWN_CURVATURE, 1.0 / np.where(pointed, 1.0, least))

    def curvature_at(self, index: Ints, point: Array, certain: bool) -> Array:
        """See `ShapeSet.curvature_at`: that across the generator through the point.

        With the radius R there, and m = sqrt(1 + k^2), it is 1 / (m R). Within R / 2 it is twice
        that at most, and no two normals of a cone differ by more than 2 / m, which is 4 / (m R)
        times R / 2.
        """
        slope = self.slope[index]
        size = np.sqrt(1.0 + slope * slope)
        axis = columns(self.axis, index)
        away = point - columns(self.center, index)
        radius = norm(away - dot(away, axis) * axis)
        if self.displacement is not None:
            # the time of the hit is not known
            moved = norm(columns(self.displacement, index))
            radius = np.where(moved > 0.0, 0.0 if certain else radius - 0.5 * moved, radius)
        if not certain:
            radius = np.maximum(radius, ESTIMATED_TIP * self.largest[index])
        with np.errstate(divide="ignore"):
            bend: Array = (4.0 if certain else 1.0) / (size * radius)
        return np.minimum(bend, UNKNOWN_CURVATURE)

    @property
    def min_cosine(self) -> Array:
        """`MIN_SIDE_COSINE` for each side, (n,)."""
        return np.full(self.radius.size, MIN_SIDE_COSINE)

    @property
    def bodies(self) -> Ints:
        """See `ShapeSet.bodies`: the solids have the numbers of their sides."""
        return np.arange(self.count)

    @cached_property
    def _near_camera(self) -> Mask:
        """Whether the camera may be in the bounding sphere of each solid (n,) at some time."""
        center, reach = self.bounding_spheres
        sweep = 0.0 if self.displacement is None else 0.5 * norm(self.displacement)
        near: Mask = norm(center) <= reach + sweep
        return near

    def moved(self, index: Ints, time: Array | float) -> Array:
        """Middles (3, ...) of cylinders `index` at shutter times that broadcast against it."""
        return self.at_time(self.center, index, time)

    def _sizes(self, index: Ints) -> tuple[Array, Array, Array, Array]:
        """Axes (3, ...), half lengths, radii in the middle and slopes (...) of solids."""
        return columns(self.axis, index), self.half[index], self.radius[index], self.slope[index]

    def view(self, index: Ints, point: Array, time: Array | float) -> SolidView:
        """Cylinders as seen from points (3, ...), metres."""
        return SolidView(self.moved(index, time) - point, *self._sizes(index))

    def coverage(self, index: Ints, w: Array, camera: PinholeCamera, order: int) -> PixelCoverage:
        """See `ShapeSet.coverage`."""
        return side_coverage(columns(self.center, index), *self._sizes(index), w, camera, order)

    def least_cosine(self, index: Ints, cosine: Array, turn: Array, point: Array) -> Array:
        """See `ShapeSet.least_cosine`.

        With R the radius at the hit and m = sqrt(1 + k^2), the cosine of a unit ray is sqrt(D) /
        (m R), D = |B|^2 - s^2 (see `kernels`). B and s are linear in the ray, and R changes by
        k / m of the distance over the surface, which a first bound on the cosine bounds.
        """
        axis, _, _, slope = self._sizes(index)
        reach = norm(point)
        w = point / np.maximum(reach, TINY)
        view = axial_view(columns(self.center, index), *self._axial_sizes(index))
        f = dot(w, axis)
        whole = norm(view.level * (w - f * axis) + slope * f * view.across)
        # the chord of the largest turn
        step = np.sqrt(2.0 - 2.0 * np.sqrt(np.maximum(1.0 - turn * turn, 0.0)))
        aside = norm(view.across)
        whole = np.maximum(whole - (np.abs(view.level) + np.abs(slope) * aside) * step, 0.0)
        lever = np.abs(dot(w, view.lever)) + aside * step
        root = np.sqrt(np.maximum((whole - lever) * (whole + lever), 0.0))
        size, largest = np.sqrt(1.0 + slope * slope), self.largest[index]
        own = np.abs(view.level + slope * f * reach)
        least: Array = root / (size * largest)
        for _ in range(REFINEMENTS):
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                moved = 2.0 * reach * step / least * np.abs(slope) / size
            bound = np.fmin(own + moved, largest)
            least = root / (size * np.maximum(bound, TINY))
        return np.minimum(least, cosine)

    def _axial_sizes(self, index: Ints) -> tuple[Array, Array, Array]:
        """Axes (3, ...), radii in the middle and slopes (...) of solids."""
        return columns(self.axis, index), self.radius[index], self.slope[index]

    def intersect(self, index: Ints, w: Array, time: Array | float) -> Array:
        """See `ShapeSet.intersect`."""
        return intersect_side(w, self.moved(index, time), *self._sizes(index))

    def surface(
        self, index: Ints, w: Array, point: Array, time: Array | float
    ) -> tuple[Array, Array, Mask]:
        """See `ShapeSet.surface`."""
        center, sizes = self.moved(index, time), self._sizes(index)
        axis, _, radius, slope = sizes
        away = point - center
        height = dot(away, axis)
        out = away - height * axis
        out = out / np.maximum(norm(out), TINY)
        within = SolidView(center, *sizes).inside(0.0)
        # the nearest point of the side, which is not that of the same height
        aside = norm(away - height * axis) - radius - slope * height
        height = height + slope * aside / (1.0 + slope * slope)
        size = (radius + slope * height) * np.where(within, 1.0 - INNER_HIT_OFFSET, 1.0)
        normal = (out - slope * axis) / np.sqrt(1.0 + slope * slope)
        found = center + height * axis + size * out
        return found, np.where(within, -normal, normal), within

    def blocks(self, index: Ints, start: Array, to: Array, time: Array | float) -> Mask:
        """See `ShapeSet.blocks`: the solid blocks them, also through its ends."""
        graze = surface_tolerance(start, self.largest[index])
        v = self.moved(index, time) - start
        return cylinder_blocks_segment(to, v, *self._sizes(index), graze)

    def line_forms(self, index: Ints, rows: Ints, rays: BoxRays) -> SideForms:
        """See `ShapeSet.line_forms`."""
        center, d = columns(self.center, index), self.displacements(index)
        return side_forms(rows, rays, center, d, self._sizes(index))

    def extent(self, index: Ints, direction: Array, time: Array | float) -> tuple[Array, Array]:
        """See `ShapeSet.extent`. From within a solid no plane of an end is behind its side."""
        axis, half, radius, slope = self._sizes(index)
        along = dot(axis, direction)
        side = np.sqrt(np.maximum(dot(direction, direction) - along * along, 0.0))
        middle = dot(self.moved(index, time), direction)
        first, last = -half * along, half * along
        wide, narrow = (radius - slope * half) * side, (radius + slope * half) * side
        low, high = np.minimum(first - wide, last - narrow), np.maximum(first + wide, last + narrow)
        near = self._near_camera[index]
        return middle + np.where(near, -UNBOUNDED, low), middle + np.where(near, UNBOUNDED, high)

    def occlusion(
        self,
        index: Ints,
        light: LightShape,
        receivers: Receivers,
        time: Array | float,
        order: int,
    ) -> tuple[Mask, Mask]:
        """See `ShapeSet.occlusion`; the ends answer for themselves."""
        del order
        point = receivers.point
        view = self.view(index, point, time)
        graze = surface_tolerance(point, view.largest)
        to = light.to_center(point, time)
        if not light.extended:
            block = cylinder_blocks_segment(to, view.center, *self._sizes(index), graze)
            return ~block, block
        gap = light.to_center(self.moved(index, time), time)
        return side_occlusion(view, light, to, gap, graze)

    def hides_from_patch(
        self, index: Ints, light: LightShape, receivers: Receivers, time: float
    ) -> Mask:
        """See `ShapeSet.hides_from_patch`."""
        view, gap = self._view_and_gap(index, light, receivers, time)
        return hides_from_patch(view, light, receivers, light.to_center(receivers.point, time), gap)

    def casts_sharp_edge(
        self, index: Ints, light: LightShape, receivers: Receivers, order: int
    ) -> Mask:
        """See `ShapeSet.casts_sharp_edge`."""
        del order
        view, gap = self._view_and_gap(index, light, receivers, None)
        return casts_sharp_edge(view, light, receivers, light.to_center(receivers.point), gap)

    def _view_and_gap(
        self, index: Ints, light: LightShape, receivers: Receivers, time: float | None
    ) -> tuple[SolidView, Array]:
        """The solids as seen from receivers, and vectors (3, m) from their middles to the light.

        time : shutter time; None for mid-shutter, where the light may be one point a receiver.
        """
        place = self.moved(index, time or 0.0)
        return self.view(index, receivers.point, time or 0.0), light.to_center(place, time)

    def shadow_edges(self, index: Ints, receivers: ShadedPatches, light: AreaLight) -> ShadowEdges:
        """See `ShapeSet.shadow_edges`; those of the trapezoid that is seen."""
        flat, _ = self.view(index, receivers.places, receivers.time).trapezoid()
        return polygon_shadow_edges(
            flat,
            self.displacements(index),
            receivers,
            light,
            distance_to_quad,
            ParallelogramSet.bounding_ball,
        )

    def outline_kind(
        self, index: Ints, point: Array, own: Mask, light: AreaLight, time: Array | float
    ) -> Ints:
        """See `ShapeSet.outline_kind`.

        No closed form is known from inside, and where the solid may reach into the light.
        """
        view = self.view(index, point, time)
        _, outside = tangent_trapezoid(view.center, *self._sizes(index))
        kind = np.where(outside, POLYGON, NOTHING)
        gap = light.to_center(self.moved(index, time), time)
        met = meets_light(gap, view.axis, view.half, view.largest, light)
        met |= own | view.inside(surface_tolerance(point, view.largest))
        return np.where(met, RAYS, kind)

    def polygonal_outline(
        self, index: Ints, point: Array, time: Array | float
    ) -> tuple[Array, ...]:
        """See `ShapeSet.polygonal_outline`."""
        view = self.view(index, point, time)
        vertices, _ = tangent_trapezoid(view.center, *self._sizes(index))
        return vertices

    def closest_points(self, index: Ints, w: Array, time: Array | float) -> Array:
        """See `ShapeSet.closest_points`: where rays are nearest to the axes between the ends."""
        center, (axis, half, *_) = self.moved(index, time), self._sizes(index)
        f = dot(w, axis)
        out = w - f * axis
        square = dot(out, out)
        t = np.where(square > 0.0, dot(out, center), 0.0) / np.where(square > 0.0, square, 1.0)
        height = np.clip(t * f - dot(center, axis), -half, half)
        nearest: Array = dot(w, center + height * axis) / dot(w, w)
        return nearest
