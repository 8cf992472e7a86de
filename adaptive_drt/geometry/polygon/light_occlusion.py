# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of a light convex polygons hide, from points and from patches of surface.

The edge functions of a polygon, products of a direction with the planes through a point and each
edge, are linear in the light's coordinates, in the point, and in time while the polygon moves. So
their ranges over a light, over a patch or over the shutter are exact up to rounding, whatever the
number k of edges. In addition, the light must lie behind the polygon's plane.

The functions take m pairs of receivers and polygons. Vectors are (3, m) metres: `to` from the
receivers' points to the light's centre; vertices, start points of edges and edges of the polygons
as seen from the points, edges in the order of the planes. `planes`, `normal` and `height` are
those of `PolygonSet.planes`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...numerics.arrays import Array, Mask
from ...numerics.floats import TINY, UNIT_ROUNDOFF
from ...numerics.taylor_range import clip_positive
from ...numerics.vector import cross, dot, norm
from ..light_protocol import LightShape, LinearSpan, ViewCone
from ..receivers import Receivers
from .kernels import EDGE_FUNCTION_OPERATIONS, PlaneNormals, edge_planes

__all__ = [
    "moving_polygon_may_shadow",
    "polygon_casts_sharp_edge",
    "polygon_hides_from_patch",
    "polygon_occlusion",
]


def polygon_occlusion(
    light: LightShape,
    to: Array,
    vertices: PlaneNormals,
    edges: tuple[PlaneNormals, PlaneNormals],
    planes: PlaneNormals,
    normal: Array,
    height: Array,
) -> tuple[Mask, Mask]:
    """`ShapeSet.occlusion` of an extended light.

    edges : start points and vectors of the k edges.  height : as `snapped_height` returns it.
    """
    over = dot(to, normal) - height
    reach = light.extent(normal)
    if light.span is not None:
        outside, within = _light_in_planes(light, to, planes)
        outside |= _separated_by_light_edges(light.span, to, vertices)
    else:
        outside, within = _cone_in_planes(light.view_cone(to), vertices, edges, planes)
    none = outside | (over + reach <= 0.0) | ~(height > 0.0)
    return none, within & (over - reach > 0.0) & ~none


def _light_in_planes(light: LightShape, to: Array, planes: PlaneNormals) -> tuple[Mask, Mask]:
    """Whether a light certainly lies outside one of a polygon's edge planes, or inside all."""
    outside = np.zeros(to.shape[1], dtype=np.bool_)
    within = np.ones(to.shape[1], dtype=np.bool_)
    size = np.sqrt(dot(to, to)) + light.radius
    for plane in planes:
        value = dot(to, plane)
        spread = light.extent(plane)
        rounding = EDGE_FUNCTION_OPERATIONS * UNIT_ROUNDOFF * size * np.sqrt(dot(plane, plane))
        outside |= value + spread < -rounding
        within &= value - spread > rounding
    return outside, within


def _separated_by_light_edges(span: LinearSpan, to: Array, vertices: PlaneNormals) -> Mask:
    """Whether one edge plane of a light has all vertices of a polygon on its outer side."""
    planes, _, height = edge_planes(
        to - span.half_u - span.half_v, 2.0 * span.half_u, 2.0 * span.half_v
    )
    outside = np.zeros(height.shape, dtype=np.bool_)
    for plane in planes:
        beyond = np.ones(height.shape, dtype=np.bool_)
        for vertex in vertices:
            beyond &= dot(vertex, plane) < 0.0
        outside |= beyond
    return outside & (height > 0.0)


def _cone_in_planes(
    cone: ViewCone,
    vertices: PlaneNormals,
    edges: tuple[PlaneNormals, PlaneNormals],
    planes: PlaneNormals,
) -> tuple[Mask, Mask]:
    """Whether a circular cone certainly misses a polygon, or certainly lies inside it."""
    within = np.ones(cone.distance.shape, dtype=np.bool_)
    beyond = np.zeros_like(within)
    reached = np.ones_like(within)
    slack = EDGE_FUNCTION_OPERATIONS * UNIT_ROUNDOFF
    for plane in planes:
        sine = dot(cone.axis, plane) / np.maximum(np.sqrt(dot(plane, plane)), TINY)
        within &= sine > cone.sine + slack
        beyond |= sine < -cone.sine - slack
        reached &= sine >= 0.0
    for plane, start, edge in zip(planes, *edges, strict=True):
        sine = np.abs(dot(cone.axis, plane)) / np.maximum(np.sqrt(dot(plane, plane)), TINY)
        # whether the axis projects between the ends of the edge
        end = start + edge
        turn = dot(cross(start, end), plane)
        first = dot(cross(plane, start), cone.axis) * np.sign(turn) >= 0.0
        last = dot(cross(end, plane), cone.axis) * np.sign(turn) >= 0.0
        reached |= (sine <= cone.sine + slack) & first & last
    for vertex in vertices:
        length = np.maximum(np.sqrt(dot(vertex, vertex)), TINY)
        reached |= dot(cone.axis, vertex) / length >= cone.cosine - slack
    return beyond | ~reached, within & (cone.cosine > 0.0)


def polygon_hides_from_patch(
    light: LightShape,
    to: Array,
    reach: Array,
    edges: tuple[PlaneNormals, PlaneNormals],
    planes: PlaneNormals,
    normal: Array,
    height: Array,
) -> Mask:
    """`ShapeSet.hides_from_patch` for polygons at their positions at the time of `to`.

    For a fixed point of the light, each edge function is linear in the surface point. The light is
    hidden if the functions are larger than their change within the reach.
    """
    hides: Mask = height > reach * norm(normal)
    hides &= dot(to, normal) - height > light.extent(normal)
    for plane, start, edge in zip(planes, *edges, strict=True):
        shift = reach * (norm(cross(to - start, edge)) + light.radius * norm(edge))
        hides &= dot(to, plane) - light.extent(plane) > shift
    return hides


def moving_polygon_may_shadow(
    light: LightShape,
    to: Array,
    reach: Array,
    corners: Sequence[Array],
    edges: tuple[PlaneNormals, PlaneNormals],
    planes: Sequence[PlaneNormals],
    normal: Array,
) -> Mask:
    """`ShapeSet.may_shadow` for moving polygons.

    The maximum of an edge function over the light is convex in time, so its values at both ends of
    the shutter bound it between them. The times at which all may be positive must overlap.

    Parameters
    ----------
    corners, planes : first vertices, and planes through the edges, at both ends of the shutter.
    edges : start points, relative to the first vertex, and vectors of the k edges.
    normal : edge_u x edge_v, not turned away from the point.
    """
    size = norm(normal)
    sides = [dot(corner, normal) for corner in corners]
    # at some time the plane may cut the patch, or pass it
    nearest = np.minimum(np.abs(sides[0]), np.abs(sides[1]))
    crosses = (sides[0] * sides[1] <= 0.0) | (nearest <= reach * size)
    first, last = np.full(size.size, -0.5), np.full(size.size, 0.5)
    for k, (start, edge) in enumerate(zip(*edges, strict=True)):
        values = []
        for corner, own in zip(corners, planes, strict=True):
            widen = reach * (norm(cross(to - corner, edge)) + light.radius * norm(edge))
            # the edge function is that of the line through the first vertex plus a constant
            widen = widen + reach * norm(cross(start, edge))
            values.append(dot(to, own[k]) + light.extent(own[k]) + widen)
        first, last = clip_positive(first, last, values[0], values[1])
    side = np.where(sides[0] < 0.0, -1.0, 1.0)
    across = side * dot(to, normal) + light.radius * size + reach * size
    between = across > nearest
    touched: Mask = crosses | ((first <= last) & between)
    return touched


def polygon_casts_sharp_edge(
    light: LightShape,
    receivers: Receivers,
    edges: tuple[PlaneNormals, PlaneNormals],
    planes: PlaneNormals,
    normal: Array,
    height: Array,
) -> Mask:
    """`ShapeSet.casts_sharp_edge` for polygons at rest: edge functions decide."""
    reach, patch, at = receivers.reach, receivers.footprint, receivers.at
    to = light.to_center(receivers.point)
    may_miss = np.zeros(at.size, dtype=np.bool_)
    may_cover = np.ones(at.size, dtype=np.bool_)
    may_cover_behind = np.ones(at.size, dtype=np.bool_)
    for plane, start, edge in zip(planes, *edges, strict=True):
        away = cross(to - start, edge)
        shift = reach * (np.sqrt(dot(away, away)) + light.radius * np.sqrt(dot(edge, edge)))
        if patch is not None and not light.extended:
            shift = np.minimum(shift, patch.linear_variation(away, at))
        value, spread = dot(to, plane), light.extent(plane)
        may_miss |= value + spread - shift <= 0.0
        may_cover &= value - spread + shift >= 0.0
        may_cover_behind &= -value - spread + shift >= 0.0
    size = np.sqrt(dot(normal, normal))
    through = reach * size
    if patch is not None:
        through = np.minimum(through, patch.linear_variation(normal, at))
    across, slack = dot(to, normal), light.radius * size + through
    sharp: Mask = may_cover & may_miss & (across + slack > height)
    # the patch may cross the polygon's plane: on the other side all signs are reversed
    near = height <= through
    either = may_cover & (across + slack > -height)
    behind = may_cover_behind & (slack - across > -height)
    sharp |= near & (either | behind)
    return sharp
