# SPDX-License-Identifier: GPL-3.0-or-later
"""Cylinders as a kind of shape: their curved sides. The ends are ellipses, shapes of their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.gather import columns
from ...numerics.vector import dot, norm
from ...scene.description import Cylinder
from ..camera import PinholeCamera
from ..light_protocol import AreaLight, LightShape
from ..line_forms import BoxRays
from ..occluder_outline import NOTHING, POLYGON, RAYS
from ..pixel_coverage import PixelCoverage
from ..polygon.kernels import distance_to_quad
from ..polygon.shadow_edges import polygon_shadow_edges
from ..polygon.shape import ParallelogramSet
from ..receivers import Receivers
from ..shaded_patches import ShadedPatches
from ..shadow_edges import ShadowEdges
from ..shape import ShapeSet
from ..sphere.kernels import surface_tolerance
from .kernels import cylinder_blocks_segment, intersect_side, tangent_parallelogram
from .line_polynomials import SideForms, side_forms
from .outline import SolidView, casts_sharp_edge, hides_from_patch, meets_light, side_occlusion
from .pixel_coverage import side_coverage

__all__ = ["CylinderSet"]


MIN_SIDE_COSINE = 2.0**-16
"""Least cosine between the normal of a side and a ray: at the limb it is only rounding."""
INNER_HIT_OFFSET = 2.0**-37
"""Distance from the surface at which hits on the inner side are placed, in radii: more than the
tolerance by which points count as on the surface."""
UNBOUNDED = 2.0**256
"""Extent, in metres, of solids that may hold the camera: their depth order is then found by ray."""


@dataclass(frozen=True)
class CylinderSet(ShapeSet):
    """Curved sides of solid cylinders: see `ShapeSet`.

    Attributes
    ----------
    center : (3, n) metres, the middles.  axis : (3, n) unit.
    half, radius : (n,) metres, half the lengths and the radii.
    """

    center: Array
    axis: Array
    half: Array
    radius: Array
    displacement: Array | None

    @classmethod
    def from_records(
        cls, records: Sequence[Cylinder], origin: Array, displacement: Array | None
    ) -> CylinderSet:
        """Cylinders relative to the camera at `origin` (3, 1), metres."""
        start, end = (
            np.array([getattr(each, name) for each in records], dtype=np.float64).reshape(-1, 3).T
            for name in ("start", "end")
        )
        way = np.ascontiguousarray(end - start)
        length = norm(way)
        middle = np.ascontiguousarray(0.5 * (start + end)) - origin
        radius = np.array([each.radius for each in records], dtype=np.float64)
        return cls(middle, way / length, 0.5 * length, radius, displacement)

    @cached_property
    def bounding_spheres(self) -> tuple[Array, Array]:
        """Spheres around the middles: (3, n) and (n,), metres."""
        return self.center, np.hypot(self.half, self.radius)

    @property
    def inner_radii(self) -> Array:
        """See `ShapeSet.inner_radii`."""
        return np.minimum(self.half, self.radius)

    @property
    def curvature(self) -> Array:
        """Reciprocals (n,) of the radii."""
        return 1.0 / self.radius

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

    def _sizes(self, index: Ints) -> tuple[Array, Array, Array]:
        """Axes (3, ...), half lengths and radii (...) of cylinders."""
        return columns(self.axis, index), self.half[index], self.radius[index]

    def view(self, index: Ints, point: Array, time: Array | float) -> SolidView:
        """Cylinders as seen from points (3, ...), metres."""
        return SolidView(self.moved(index, time) - point, *self._sizes(index))

    def coverage(self, index: Ints, w: Array, camera: PinholeCamera, order: int) -> PixelCoverage:
        """See `ShapeSet.coverage`."""
        return side_coverage(columns(self.center, index), *self._sizes(index), w, camera, order)

    def least_cosine(self, index: Ints, cosine: Array, turn: Array) -> Array:
        """See `ShapeSet.least_cosine`.

        For unit rays cos^2 = |w'|^2 - (w.(v x axis) / r)^2, of what is across the axis. Both
        lengths change by no more than the ray times |v'| / r, and neither exceeds what a cosine of
        the centre ray leaves for it.
        """
        v, axis = columns(self.center, index), columns(self.axis, index)
        across = norm(v - dot(v, axis) * axis)
        shift = across * turn / self.radius[index]
        sine = np.sqrt(np.maximum(1.0 - cosine**2, 0.0))
        least: Array = np.sqrt(
            np.maximum(cosine**2 - 2.0 * turn - 2.0 * shift * sine - shift * shift, 0.0)
        )
        return least

    def intersect(self, index: Ints, w: Array, time: Array | float) -> Array:
        """See `ShapeSet.intersect`."""
        return intersect_side(w, self.moved(index, time), *self._sizes(index))

    def surface(
        self, index: Ints, w: Array, point: Array, time: Array | float
    ) -> tuple[Array, Array, Mask]:
        """See `ShapeSet.surface`."""
        center, (axis, half, radius) = self.moved(index, time), self._sizes(index)
        away = point - center
        along = dot(away, axis) * axis
        out = away - along
        out /= norm(out)
        within = SolidView(center, axis, half, radius).inside(0.0)
        size = radius * np.where(within, 1.0 - INNER_HIT_OFFSET, 1.0)
        return center + along + size * out, np.where(within, -out, out), within

    def blocks(self, index: Ints, start: Array, to: Array, time: Array | float) -> Mask:
        """See `ShapeSet.blocks`: the solid blocks them, also through its ends."""
        axis, half, radius = self._sizes(index)
        graze = surface_tolerance(start, radius)
        v = self.moved(index, time) - start
        return cylinder_blocks_segment(to, v, axis, half, radius, graze)

    def line_forms(self, index: Ints, rows: Ints, rays: BoxRays) -> SideForms:
        """See `ShapeSet.line_forms`."""
        center, d = columns(self.center, index), self.displacements(index)
        return side_forms(rows, rays, center, d, *self._sizes(index))

    def extent(self, index: Ints, direction: Array, time: Array | float) -> tuple[Array, Array]:
        """See `ShapeSet.extent`. From within a solid no plane of an end is behind its side."""
        axis, half, radius = self._sizes(index)
        along = dot(axis, direction)
        square = np.maximum(dot(direction, direction) - along * along, 0.0)
        reach = half * np.abs(along) + radius * np.sqrt(square)
        reach = np.where(self._near_camera[index], UNBOUNDED, reach)
        middle = dot(self.moved(index, time), direction)
        return middle - reach, middle + reach

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
        graze = surface_tolerance(point, view.radius)
        to = light.to_center(point, time)
        if not light.extended:
            block = cylinder_blocks_segment(
                to, view.center, view.axis, view.half, view.radius, graze
            )
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
        """See `ShapeSet.shadow_edges`; those of the parallelogram that is seen."""
        flat, _ = self.view(index, receivers.places, receivers.time).parallelogram()
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
        _, _, _, outside = tangent_parallelogram(view.center, view.axis, view.half, view.radius)
        kind = np.where(outside, POLYGON, NOTHING)
        gap = light.to_center(self.moved(index, time), time)
        met = meets_light(gap, view.axis, view.half, view.radius, light)
        met |= own | view.inside(surface_tolerance(point, view.radius))
        return np.where(met, RAYS, kind)

    def polygonal_outline(
        self, index: Ints, point: Array, time: Array | float
    ) -> tuple[Array, ...]:
        """See `ShapeSet.polygonal_outline`."""
        view = self.view(index, point, time)
        q, u, v, _ = tangent_parallelogram(view.center, view.axis, view.half, view.radius)
        return q, q + u, q + u + v, q + v

    def closest_points(self, index: Ints, w: Array, time: Array | float) -> Array:
        """See `ShapeSet.closest_points`: where rays are nearest to the axes between the ends."""
        center, (axis, half, _) = self.moved(index, time), self._sizes(index)
        f = dot(w, axis)
        out = w - f * axis
        square = dot(out, out)
        t = np.where(square > 0.0, dot(out, center), 0.0) / np.where(square > 0.0, square, 1.0)
        height = np.clip(t * f - dot(center, axis), -half, half)
        nearest: Array = dot(w, center + height * axis) / dot(w, w)
        return nearest
