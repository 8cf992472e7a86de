# SPDX-License-Identifier: GPL-3.0-or-later
"""Spheres as a kind of shape."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.gather import columns
from ...numerics.vector import dot
from ...scene.description import Sphere
from ...scene.sphere_batch import Spheres
from ..camera import PinholeCamera
from ..implicit_surface import ImplicitSphere
from ..light_plane import LightPlane
from ..light_protocol import AreaLight, LightShape
from ..line_forms import BoxRays
from ..native_solids import Balls
from ..pixel_coverage import PixelCoverage
from ..receivers import Receivers
from ..shaded_patches import ShadedPatches
from ..shadow_edges import ShadowEdges
from ..shape import ShapeSet
from .kernels import intersect_sphere, sphere_blocks_segment, surface_tolerance
from .light_occlusion import (
    sphere_casts_sharp_edge,
    sphere_hides_from_footprint,
    sphere_hides_from_patch,
    sphere_occlusion,
)
from .line_polynomials import SphereForms, sphere_forms
from .outline import sphere_outline_kinds
from .pixel_coverage import moving_sphere_coverage, sphere_coverage
from .plane_section import clipped_sphere_polygons
from .shadow_edges import sphere_shadow_edges

__all__ = ["SphereSet"]


MIN_SPHERE_COSINE = 2.0**-16
"""Least cosine between the normal of a sphere and a ray. A ray that just misses a sphere stands for
its limb, where the cosine is only rounding, sign included; the steps are limited by a chord of the
sphere long before."""
INNER_HIT_OFFSET = 2.0**-37
"""Distance from the surface at which hits on the inner side of a sphere are placed, in radii.

It keeps them inside by more than `kernels.SURFACE_TOLERANCE`: the camera is inside as well, so such
a hit is at most two radii away from it."""


@dataclass(frozen=True)
class SphereSet(ShapeSet):
    """Spheres: see `ShapeSet`.

    Attributes
    ----------
    center : (3, n) metres.  radius : (n,) metres.
    """

    center: Array
    radius: Array
    displacement: Array | None
    fills_bounding_sphere: ClassVar[bool] = True
    traced_natively: ClassVar[bool] = True

    @classmethod
    def from_records(
        cls, records: Sequence[Sphere | Spheres], origin: Array, displacement: Array | None
    ) -> SphereSet:
        """Spheres relative to the camera at `origin` (3, 1), metres."""
        center, radius = [np.zeros((3, 0))], [np.zeros(0)]
        for are_many, run in itertools.groupby(records, lambda each: isinstance(each, Spheres)):
            if are_many:
                own = list(run)
                center += [np.asarray(each.center, dtype=np.float64) for each in own]
                radius += [np.asarray(each.radius, dtype=np.float64) for each in own]
            else:
                places, sizes = zip(*((each.center, each.radius) for each in run), strict=True)
                center.append(np.array(places, dtype=np.float64).reshape(-1, 3).T)
                radius.append(np.array(sizes, dtype=np.float64))
        place = np.ascontiguousarray(np.concatenate(center, axis=1))
        return cls(place - origin, np.concatenate(radius), displacement)

    def moved(self, index: Ints, time: Array | float) -> Array:
        """Centres (3, ...) of spheres `index` at shutter times that broadcast against it."""
        return self.at_time(self.center, index, time)

    @property
    def bounding_spheres(self) -> tuple[Array, Array]:
        """The spheres themselves."""
        return self.center, self.radius

    def native_solids(self, index: Ints | slice) -> Balls:
        """See `ShapeSet.native_solids`."""
        d = self.displacement
        moved = None if d is None else columns(d, index)
        return Balls(columns(self.center, index), self.radius[index], moved)

    @property
    def inner_radii(self) -> Array:
        """The radii: spheres are balls themselves."""
        return self.radius

    @property
    def curvature(self) -> Array:
        """Reciprocals (n,) of the radii."""
        return 1.0 / self.radius

    @property
    def min_cosine(self) -> Array:
        """`MIN_SPHERE_COSINE` for each sphere, (n,)."""
        return np.full(self.radius.size, MIN_SPHERE_COSINE)

    def implicit_surface(self, index: Ints) -> ImplicitSphere:
        """See `ShapeSet.implicit_surface`."""
        return ImplicitSphere(columns(self.center, index), self.radius[index])

    def coverage(self, index: Ints, w: Array, camera: PinholeCamera, order: int) -> PixelCoverage:
        """See `ShapeSet.coverage`."""
        return sphere_coverage(columns(self.center, index), self.radius[index], w, camera, order)

    def moving_coverage(
        self, index: Ints, w: Array, camera: PinholeCamera, order: int, whole_pixel: bool
    ) -> PixelCoverage:
        """See `ShapeSet.moving_coverage`."""
        assert self.displacement is not None
        v, d = columns(self.center, index), columns(self.displacement, index)
        return moving_sphere_coverage(v, d, self.radius[index], w, camera, order, whole_pixel)

    def least_cosine(self, index: Ints, cosine: Array, turn: Array, point: Array) -> Array:
        """See `ShapeSet.least_cosine`: cos^2 = 1 - (distance of the line from the centre / r)^2."""
        del point
        v, r = columns(self.center, index), self.radius[index]
        shift = np.sqrt(dot(v, v)) * turn / r
        sine = np.sqrt(np.maximum(1.0 - cosine**2, 0.0)) + shift
        least: Array = np.sqrt(np.maximum(1.0 - sine * sine, 0.0))
        return least

    def intersect(self, index: Ints, w: Array, time: Array | float) -> Array:
        """See `ShapeSet.intersect`."""
        return intersect_sphere(w, self.moved(index, time), self.radius[index])

    def surface(
        self, index: Ints, w: Array, point: Array, time: Array | float
    ) -> tuple[Array, Array, Mask]:
        """See `ShapeSet.surface`. Projection leaves an error of a few roundoffs of the radius."""
        center = self.moved(index, time)
        out = point - center
        out /= np.sqrt(dot(out, out))
        within = dot(center, center) < self.radius[index] ** 2
        radius = self.radius[index] * np.where(within, 1.0 - INNER_HIT_OFFSET, 1.0)
        return center + radius * out, np.where(within, -out, out), within

    def blocks(self, index: Ints, start: Array, to: Array, time: Array | float) -> Mask:
        """See `ShapeSet.blocks`."""
        center, radius = self.moved(index, time), self.radius[index]
        graze = surface_tolerance(start, radius)
        return sphere_blocks_segment(to, center - start, radius, graze)

    def line_forms(self, index: Ints, rows: Ints, rays: BoxRays) -> SphereForms:
        """See `ShapeSet.line_forms`."""
        d = None if self.displacement is None else columns(self.displacement, index)
        return sphere_forms(rows, rays, columns(self.center, index), d, self.radius[index])

    def occlusion(
        self,
        index: Ints,
        light: LightShape,
        receivers: Receivers,
        time: Array | float,
        order: int,
    ) -> tuple[Mask, Mask]:
        """See `ShapeSet.occlusion`."""
        center = self.moved(index, time)
        return sphere_occlusion(light, receivers, center, self.radius[index], time, order)

    def hides_from_patch(
        self, index: Ints, light: LightShape, receivers: Receivers, time: float
    ) -> Mask:
        """See `ShapeSet.hides_from_patch`."""
        center = self.moved(index, time)
        return sphere_hides_from_patch(light, receivers, center, self.radius[index], time)

    def casts_sharp_edge(
        self, index: Ints, light: LightShape, receivers: Receivers, order: int
    ) -> Mask:
        """See `ShapeSet.casts_sharp_edge`."""
        center = columns(self.center, index)
        return sphere_casts_sharp_edge(light, receivers, center, self.radius[index], order)

    def hides_from_footprint(self, index: Ints, light: LightShape, receivers: Receivers) -> Mask:
        """See `ShapeSet.hides_from_footprint`."""
        center = columns(self.center, index)
        return sphere_hides_from_footprint(light, receivers, center, self.radius[index])

    def shadow_edges(self, index: Ints, receivers: ShadedPatches, light: AreaLight) -> ShadowEdges:
        """See `ShapeSet.shadow_edges`."""
        place, motion = self.moved(index, receivers.time), self.displacements(index)
        return sphere_shadow_edges(place, self.radius[index], motion, receivers, light)

    def outline_kind(
        self, index: Ints, point: Array, own: Mask, light: AreaLight, time: Array | float
    ) -> Ints:
        """See `ShapeSet.outline_kind`."""
        place, r = self.moved(index, time), self.radius[index]
        return sphere_outline_kinds(place, r, point, own, light, time)

    def circular_outline(
        self, index: Ints, point: Array, time: Array | float
    ) -> tuple[Array, Array]:
        """See `ShapeSet.circular_outline`."""
        return self.moved(index, time) - point, self.radius[index]

    def outline_in_plane(
        self, index: Ints, point: Array, time: Array | float, plane: LightPlane, corners: int
    ) -> Array:
        """See `ShapeSet.outline_in_plane`."""
        v, radius = self.circular_outline(index, point, time)
        return clipped_sphere_polygons(plane, v.swapaxes(0, 1), radius, corners)
