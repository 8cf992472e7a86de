# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of a light ellipsoids hide, from points and from patches of surface.

An ellipsoid lies between two balls about its centre: what the inner one hides it hides, and what
the outer one does not hide it does not. For point lights, and lights of a linear span, the problem
is that of a unit sphere in the ellipsoid's own space. All functions take m pairs; vectors are
(3, m) metres, as in `sphere.light_occlusion`.
"""

from __future__ import annotations

import numpy as np

from ...numerics.arrays import Array, Mask
from ...numerics.gather import columns
from ...numerics.vector import dot, norm
from ..light_protocol import LightShape
from ..receivers import Receivers
from ..sphere.kernels import (
    cone_overlap,
    cone_touches,
    origin_inside,
    sphere_blocks_segment,
    surface_tolerance,
)
from ..sphere.light_occlusion import ball_occlusion, range_to_point, span_occlusion
from .unit_space import UnitSpace

__all__ = [
    "ellipsoid_casts_sharp_edge",
    "ellipsoid_hides_from_footprint",
    "ellipsoid_occlusion",
]


def ellipsoid_occlusion(
    light: LightShape,
    receivers: Receivers,
    center: Array,
    space: UnitSpace,
    time: Array | float,
    order: int,
) -> tuple[Mask, Mask]:
    """`ShapeSet.occlusion` for ellipsoids with given centres, at their positions at `time`."""
    point = receivers.point
    v, to = center - point, light.to_center(point, time)
    inner = space.coordinates(v)
    graze = surface_tolerance(point, space.longest) / space.shortest
    if not light.extended:
        block = sphere_blocks_segment(space.coordinates(to), inner, 1.0, graze)
        return ~block, block
    gap = light.to_center(center, time)
    enclosed = receivers.own | origin_inside(dot(inner, inner), 1.0, graze)
    none, _ = ball_occlusion(light, to, gap, v, space.longest, enclosed, order)
    _, full = ball_occlusion(light, to, gap, v, space.shortest, enclosed, order)
    # from within a ball nothing is known of what it hides
    none &= dot(v, v) > space.longest**2
    full &= dot(v, v) > space.shortest**2
    if light.span is not None:
        _add_span_occlusion(light, space, to, inner, ~enclosed, order, none, full)
    away = norm(gap)
    none = np.where(enclosed, away + light.radius <= space.shortest, none)
    full = np.where(enclosed, light.surrounds | (away - light.radius >= space.longest), full)
    return none & ~full, full


def _add_span_occlusion(
    light: LightShape,
    space: UnitSpace,
    to: Array,
    v: Array,
    outside: Mask,
    order: int,
    none: Mask,
    full: Mask,
) -> None:
    """Add, in place, what is known of a light of a linear span; v (3, m) are coordinates."""
    assert light.span is not None
    rows = (~none & ~full & outside).nonzero()[0]
    if not rows.size:
        return
    some, place = space.take(rows), columns(v, rows)
    tangent = np.sqrt(np.maximum(dot(place, place) - 1.0, 0.0))
    none[rows], full[rows] = span_occlusion(
        order,
        some.span(light.span),
        light.radius / some.shortest,
        some.coordinates(columns(to, rows)),
        place,
        np.ones(rows.size),
        tangent,
    )


def ellipsoid_casts_sharp_edge(
    light: LightShape, receivers: Receivers, center: Array, space: UnitSpace
) -> Mask:
    """`ShapeSet.casts_sharp_edge` for ellipsoids at rest with given centres (3, m).

    The inner ball, smaller by the reach, must hide nothing of the light's centre or cone, and the
    outer one, larger by the reach, all of it.
    """
    patch, at, reach = receivers.footprint, receivers.at, receivers.reach
    v, to = center - receivers.point, light.to_center(receivers.point)
    small, large = np.maximum(space.shortest - reach, 0.0), space.longest + reach
    vv = dot(v, v)
    cone, line = light.view_cone(to), light.as_point().view_cone(to)
    sharp = np.ones(vv.size, dtype=np.bool_)
    for test in (line, cone) if light.fills_cone else (line,):
        touch = cone_touches(test.axis, test.cosine, test.sine, v, small, vv)
        _, cover, _ = cone_overlap(test.axis, test.cosine, test.sine, v, large, vv)
        sharp &= (~touch | (small == 0.0)) & (cover | (vv <= large * large))
    sharp &= np.sqrt(vv) - large < cone.far
    sharp &= ~receivers.own
    if patch is not None and not light.extended:
        rows = (sharp & np.isfinite(patch.thickness[at])).nonzero()[0]
        rows = rows[patch.is_clear_of(columns(v, rows), space.longest[rows], at[rows])]
        if rows.size:
            low, high, rounding = _range_over_patches(
                receivers.take(rows), space.take(rows), columns(to, rows), columns(v, rows)
            )
            sharp[rows] = (high >= -rounding) & (low <= rounding)
    return sharp


def ellipsoid_hides_from_footprint(
    light: LightShape, receivers: Receivers, center: Array, space: UnitSpace
) -> Mask:
    """`ShapeSet.hides_from_footprint` for ellipsoids at rest with given centres (3, m).

    As for spheres, in the ellipsoids' own spaces.
    """
    patch, point = receivers.footprint, receivers.point
    if patch is None:
        return np.zeros(receivers.own.shape, dtype=np.bool_)
    v, to = center - point, light.to_center(point)
    clear = patch.is_clear_of(v, space.longest, receivers.at)
    low, _, rounding = _range_over_patches(receivers, space, to, v)
    place, way = space.coordinates(v), space.coordinates(to)
    gap, along = way - place, dot(way, place)
    hidden: Mask = clear & (low > rounding) & (dot(gap, gap) > 1.0)
    hidden &= (along > 0.0) & (along < dot(way, way))
    return hidden


def _range_over_patches(
    receivers: Receivers, space: UnitSpace, to: Array, v: Array
) -> tuple[Array, Array, Array]:
    """Bounds of the discriminant over patches, and its rounding: see `range_to_point`."""
    patch, at = receivers.footprint, receivers.at
    assert patch is not None
    one, other = (space.coordinates(columns(step, at)) for step in patch.steps)
    place, way = space.coordinates(v), space.coordinates(to)
    thick = patch.thickness[at] / space.shortest
    return range_to_point(way, place, np.ones(at.size), (one, other), thick)
