# SPDX-License-Identifier: GPL-3.0-or-later
"""How solid cylinders and truncated cones hide lights: by the trapezoid that planes through a point
touch.

A point outside the infinite double cone sees the solid where it sees this trapezoid, which is
inside the solid, or one of the ends. All three are planar, so what hides a light that is outside
the solid is a union of planar shapes, also where the light's plane cuts them. The ends are shapes
of their own. From a point beyond an end and within the double cone, an end hides all that the solid
does: the only one that is seen, or from beyond a cone's apex the larger one.

The functions take m pairs of points and solids.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...numerics.arrays import Array, Mask
from ...numerics.vector import cross, dot, norm
from ..light_protocol import AreaLight, LightShape
from ..polygon.kernels import snapped_height
from ..polygon.light_occlusion import polygon_hides_from_patch, polygon_occlusion
from ..polygon.view import PolygonView
from ..receivers import Receivers
from .kernels import axial_view, segment_distance, tangent_trapezoid

__all__ = ["SolidView", "casts_sharp_edge", "hides_from_patch", "meets_light", "side_occlusion"]


@dataclass(frozen=True)
class SolidView:
    """Solids as seen from points.

    Attributes
    ----------
    center : (3, m) metres, the middles from the points.
    axis : (3, m) unit.  half, radius : (m,) metres, half the length and the radius in the middle.
    slope : (m,) change of the radius by length along the axis, never positive.
    """

    center: Array
    axis: Array
    half: Array
    radius: Array
    slope: Array

    @property
    def largest(self) -> Array:
        """The largest radius (m,), metres."""
        largest: Array = self.radius - self.slope * self.half
        return largest

    def inside(self, graze: Array | float) -> Mask:
        """Whether the points are inside the solids, by more than `graze` metres."""
        small = self.radius - graze * np.sqrt(1.0 + self.slope * self.slope)
        return axial_view(self.center, self.axis, small, self.slope).inside(self.half, graze)

    def distance(self) -> Array:
        """Lower bounds (m,) on the distances of the points from the solids, metres; 0 from inside.

        They are those from the cylinder around the solid, or from its cone.
        """
        seen = axial_view(self.center, self.axis, self.radius, self.slope)
        away = norm(seen.across)
        aside = np.maximum(away - self.largest, 0.0)
        beside: Array = np.hypot(aside, np.maximum(np.abs(seen.along) - self.half, 0.0))
        above = (away - seen.level) / np.sqrt(1.0 + self.slope * self.slope)
        return np.maximum(beside, above)

    def trapezoid(self) -> tuple[PolygonView, Mask]:
        """The trapezoids, and whether there is one: (m,).

        The view's corner and edges are those of the parallelogram around the trapezoid.
        """
        sizes = self.axis, self.half, self.radius, self.slope
        vertices, outside = tangent_trapezoid(self.center, *sizes)
        q, top, far_top, far = vertices
        wide, narrow = far - q, far_top - top
        left, right = top - q, far_top - far
        along = 0.5 * (left + right)
        normal = cross(along, wide)
        height = dot(q, normal)
        side = np.where(height < 0.0, -1.0, 1.0)
        starts, edges = (q, q, top, far), (wide, left, narrow, right)
        planes = (
            side * cross(wide, q),
            side * cross(q, left),
            side * cross(top, narrow),
            side * cross(right, far),
        )
        turned = side * normal, side * height
        return PolygonView(q, along, wide, vertices, starts, edges, planes, *turned), outside


def meets_light(
    gap: Array, axis: Array, half: Array, radius: Array, light: AreaLight | LightShape
) -> Mask:
    """Whether a light may reach into solids: (m,). The answer is conservative.

    gap : (3, m) metres from the middles of the solids to the light's centre.
    radius : (m,) metres, the largest radii.
    """
    if light.surrounds:
        return np.zeros(half.shape, dtype=np.bool_)
    near: Mask = segment_distance(gap, axis, half) <= radius + light.radius
    if light.span is not None:
        along = dot(axis, light.span.normal)
        thick = half * np.abs(along) + radius * np.sqrt(np.maximum(1.0 - along * along, 0.0))
        near &= np.abs(dot(gap, light.span.normal)) <= thick
    return near


def side_occlusion(
    view: SolidView, light: LightShape, to: Array, gap: Array, graze: Array
) -> tuple[Mask, Mask]:
    """`ShapeSet.occlusion` of an extended light by the trapezoids.

    to, gap : (3, m) metres from the points, and from the middles, to the light's centre.
    graze : (m,) metres, the distance up to which points count as on the surface.
    """
    flat, outside = view.trapezoid()
    height = snapped_height(flat.height, flat.normal, graze)
    none, full = polygon_occlusion(
        light, to, flat.vertices, (flat.starts, flat.edges), flat.planes, flat.normal, height
    )
    unsure = view.inside(graze) | meets_light(gap, view.axis, view.half, view.largest, light)
    return (none | ~outside) & ~unsure, full & outside & ~unsure


def hides_from_patch(
    view: SolidView, light: LightShape, receivers: Receivers, to: Array, gap: Array
) -> Mask:
    """`ShapeSet.hides_from_patch` by the trapezoids that the patches' points see."""
    flat, outside = view.trapezoid()
    hides = polygon_hides_from_patch(
        light, to, receivers.reach, (flat.starts, flat.edges), flat.planes, flat.normal, flat.height
    )
    hides &= outside & ~meets_light(gap, view.axis, view.half, view.largest, light)
    return hides


def casts_sharp_edge(
    view: SolidView, light: LightShape, receivers: Receivers, to: Array, gap: Array
) -> Mask:
    """`ShapeSet.casts_sharp_edge` of solids at rest.

    A line from the patch to the light passes the axis at a distance of |s| / |w'|, where w' is what
    of it is across the axis and s = w.(v x axis), and meets no solid farther from the axis than its
    largest radius. With points of the patch both change by no more than their reach allows.
    """
    near = view.distance() <= receivers.reach
    if light.surrounds:
        # from outside a convex solid is seen in less than the half of all directions
        return near
    lever = cross(view.center, view.axis)
    apart = to - view.center
    apart = apart - dot(apart, view.axis) * view.axis
    shift = receivers.reach * (norm(apart) + light.radius)
    s, spread = np.abs(dot(to, lever)), light.extent(lever)
    level = norm(to - dot(to, view.axis) * view.axis)
    longest = level + light.radius + receivers.reach
    may_touch = s - spread - shift <= view.largest * longest
    may_cover = s + spread - shift <= view.largest * longest
    may: Mask = may_touch & may_cover & ~hides_from_patch(view, light, receivers, to, gap)
    return may | near
