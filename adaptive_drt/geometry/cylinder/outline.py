# SPDX-License-Identifier: GPL-3.0-or-later
"""How solid cylinders hide lights: by the parallelogram that planes through a point touch.

A point outside the infinite cylinder sees the solid where it sees this parallelogram, which is
inside the solid, or one of the ends. All three are planar, so what hides a light that is outside
the solid is a union of planar shapes, also where the light's plane cuts them. The ends are shapes
of their own. From a point beyond an end and within the infinite cylinder, that end is all that is
seen.

The functions take m pairs of points and cylinders.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...numerics.arrays import Array, Mask
from ...numerics.vector import dot, norm
from ..light_protocol import AreaLight, LightShape
from ..polygon.kernels import edge_planes, quad_edges, snapped_height
from ..polygon.light_occlusion import polygon_hides_from_patch, polygon_occlusion
from ..polygon.view import PolygonView
from ..receivers import Receivers
from .kernels import axial_view, segment_distance, tangent_parallelogram

__all__ = ["SolidView", "casts_sharp_edge", "hides_from_patch", "meets_light", "side_occlusion"]


@dataclass(frozen=True)
class SolidView:
    """Solid cylinders as seen from points.

    Attributes
    ----------
    center : (3, m) metres, the middles from the points.
    axis : (3, m) unit.  half, radius : (m,) metres, half the length and the radius.
    """

    center: Array
    axis: Array
    half: Array
    radius: Array

    def inside(self, graze: Array | float) -> Mask:
        """Whether the points are inside the solids, by more than `graze` metres."""
        small = np.maximum(self.radius - graze, 0.0)
        return axial_view(self.center, self.axis, small).inside(self.half, graze)

    def distance(self) -> Array:
        """Distances (m,) of the points from the solids, metres; 0 from inside."""
        seen = axial_view(self.center, self.axis, self.radius)
        aside = np.maximum(norm(seen.across) - self.radius, 0.0)
        distance: Array = np.hypot(aside, np.maximum(np.abs(seen.along) - self.half, 0.0))
        return distance

    def parallelogram(self) -> tuple[PolygonView, Mask]:
        """The parallelograms, and whether there is one: (m,)."""
        q, u, v, outside = tangent_parallelogram(self.center, self.axis, self.half, self.radius)
        planes, normal, height = edge_planes(q, u, v)
        vertices = q, q + u, q + u + v, q + v
        return PolygonView(q, u, v, vertices, *quad_edges(q, u, v), planes, normal, height), outside


def meets_light(
    gap: Array, axis: Array, half: Array, radius: Array, light: AreaLight | LightShape
) -> Mask:
    """Whether a light may reach into solids: (m,). The answer is conservative.

    gap : (3, m) metres from the middles of the solids to the light's centre.
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
    """`ShapeSet.occlusion` of an extended light by the parallelograms.

    to, gap : (3, m) metres from the points, and from the middles, to the light's centre.
    graze : (m,) metres, the distance up to which points count as on the surface.
    """
    flat, outside = view.parallelogram()
    height = snapped_height(flat.height, flat.normal, graze)
    none, full = polygon_occlusion(
        light, to, flat.vertices, (flat.starts, flat.edges), flat.planes, flat.normal, height
    )
    unsure = view.inside(graze) | meets_light(gap, view.axis, view.half, view.radius, light)
    return (none | ~outside) & ~unsure, full & outside & ~unsure


def hides_from_patch(
    view: SolidView, light: LightShape, receivers: Receivers, to: Array, gap: Array
) -> Mask:
    """`ShapeSet.hides_from_patch` by the parallelograms that the patches' points see."""
    flat, outside = view.parallelogram()
    hides = polygon_hides_from_patch(
        light, to, receivers.reach, (flat.starts, flat.edges), flat.planes, flat.normal, flat.height
    )
    hides &= outside & ~meets_light(gap, view.axis, view.half, view.radius, light)
    return hides


def casts_sharp_edge(
    view: SolidView, light: LightShape, receivers: Receivers, to: Array, gap: Array
) -> Mask:
    """`ShapeSet.casts_sharp_edge` of solids at rest.

    A line from the patch to the light passes the axis at a distance of |s| / |w'|, where w' is what
    of it is across the axis and s = w.(v x axis). With points of the patch both change by no more
    than their reach allows.
    """
    near = view.distance() <= receivers.reach
    if light.surrounds:
        # from outside a convex solid is seen in less than the half of all directions
        return near
    along = axial_view(view.center, view.axis, view.radius)
    apart = to - view.center
    apart = apart - dot(apart, view.axis) * view.axis
    shift = receivers.reach * (norm(apart) + light.radius)
    s, spread = np.abs(dot(to, along.lever)), light.extent(along.lever)
    level = norm(to - dot(to, view.axis) * view.axis)
    longest = level + light.radius + receivers.reach
    may_touch = s - spread - shift <= view.radius * longest
    may_cover = s + spread - shift <= view.radius * longest
    may: Mask = may_touch & may_cover & ~hides_from_patch(view, light, receivers, to, gap)
    return may | near
