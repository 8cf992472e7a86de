# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of a light spheres hide, from points and from patches of surface.

A sphere's discriminant for rays from a point p to points L of a light is a quadratic in the light's
coordinates: over a light of a linear span its jet gives the range; for a round light the problem is
rotationally symmetric, and two cones are compared. In addition, the hit must lie between p and the
light. For one sphere the answers are exact at order 2.

The functions take m pairs of receivers and spheres. Vectors are (3, m) metres: `to` from the
receivers' points to the light's centre, v to the spheres' centres, `gap` from the spheres' centres
to the light's; r (m,) are the radii, metres.
"""

from __future__ import annotations

import numpy as np

from ...numerics.arrays import Array, Mask
from ...numerics.axes import SHUTTER_ENDS
from ...numerics.floats import TINY
from ...numerics.gather import columns
from ...numerics.jet import Jet
from ...numerics.taylor_range import rectangle_range
from ...numerics.vector import cross, dot, norm, squared_norm
from ..light_protocol import LightBall, LightShape, LinearSpan
from ..receivers import Receivers
from .kernels import (
    cone_overlap,
    cone_touches,
    discriminant,
    discriminant_and_terms,
    discriminant_rounding,
    origin_inside,
    sphere_blocks_segment,
    surface_tolerance,
)

__all__ = [
    "ball_occlusion",
    "enclosed_may_cast_sharp_edge",
    "moving_sphere_may_shadow",
    "range_to_point",
    "span_occlusion",
    "sphere_casts_sharp_edge",
    "sphere_hides_from_footprint",
    "sphere_hides_from_patch",
    "sphere_occlusion",
]


SEGMENT_DISTANCE_ROUNDING = 2.0**-44
"""Generous bound on the relative rounding error of a distance between segments."""


def sphere_occlusion(
    light: LightShape,
    receivers: Receivers,
    center: Array,
    r: Array,
    time: Array | float,
    order: int,
) -> tuple[Mask, Mask]:
    """`ShapeSet.occlusion` for spheres with given centres (3, m), at their positions at `time`."""
    point = receivers.point
    v = center - point
    graze = surface_tolerance(point, r)
    to = light.to_center(point, time)
    if not light.extended:
        block = sphere_blocks_segment(to, v, r, graze)
        return ~block, block
    vv = dot(v, v)
    enclosed = receivers.own | origin_inside(vv, r, graze)
    gap = light.to_center(center, time)
    none, full = ball_occlusion(light, to, gap, v, r, enclosed, order, vv)
    rows = enclosed.nonzero()[0]
    if rows.size:
        away, size = norm(columns(gap, rows)), r[rows]
        none[rows] = away + light.radius <= size
        full[rows] = light.surrounds | (away - light.radius >= size)
    none &= ~full
    return none, full


def ball_occlusion(
    light: LightBall,
    to: Array,
    gap: Array,
    v: Array,
    r: Array,
    enclosed: Mask,
    order: int,
    vv: Array | None = None,
) -> tuple[Mask, Mask]:
    """Whether balls certainly hide nothing of an extended light, or certainly all of it: (m,) each.

    enclosed : (m,) whether the point is inside its ball; both answers are then undefined.
    vv : (m,) v.v, where it is known already.
    """
    cone, vv = light.view_cone(to), dot(v, v) if vv is None else vv
    touch, cover, tangent = cone_overlap(cone.axis, cone.cosine, cone.sine, v, r, vv)
    none: Mask = ~touch | (np.sqrt(vv) - r >= cone.far)
    full: Mask = cover & (tangent <= cone.near)
    # a light inside the ball is hidden from outside
    full |= norm(gap) + light.radius <= r
    none |= light.is_behind(gap, r)
    if light.span is not None:
        unsure = (~none & ~full & ~enclosed).nonzero()[0]
        if unsure.size:
            some = span_occlusion(
                order,
                light.span,
                light.radius,
                columns(to, unsure),
                columns(v, unsure),
                r[unsure],
                tangent[unsure],
            )
            none[unsure], full[unsure] = some
    return none, full


def span_occlusion(
    order: int,
    span: LinearSpan,
    radius: Array | float,
    to: Array,
    v: Array,
    r: Array,
    tangent: Array,
) -> tuple[Mask, Mask]:
    """`ball_occlusion` for a light of a linear span, by jets of an order in its two coordinates.

    Parameters
    ----------
    span : of one light, or (3, m).  radius : metres, of the light, or (m,).
    tangent : (m,) metres, of `cone_overlap`.
    """
    w = Jet.linear(to, (span.half_u, span.half_v), order)
    d, ww, side = discriminant_and_terms(w, v, r)
    vv = dot(v, v)
    square = radius * radius
    # the remainder of order 1 is r^2 |o|^2 - |o x v|^2 for an offset |o| <= radius
    low, high = rectangle_range(d, 1.0, 1.0, square * np.maximum(r * r, vv))
    far = np.sqrt(ww) + radius
    miss = np.sqrt(side) + radius * np.sqrt(vv)
    rounding = discriminant_rounding(far * far, vv, r, miss)
    along = dot(to, v)
    spread = np.abs(dot(span.half_u, v)) + np.abs(dot(span.half_v, v))
    none = (high < -rounding) | (along + spread <= 0.0)
    full = (low > rounding) & (along - spread > 0.0)
    # the ball is certainly in front: the light is beyond any hit, or beyond the foot of its centre
    plane = np.abs(dot(span.normal, to))
    unsure = (full & (tangent > plane)).nonzero()[0]
    if unsure.size:
        one, other = (
            each if each.shape[1] == 1 else columns(each, unsure)
            for each in (span.half_u, span.half_v)
        )
        near = Jet.linear(columns(to, unsure), (one, other), order)
        foot = dot(near, columns(v, unsure)) - squared_norm(near)
        rest = square[unsure] if isinstance(square, np.ndarray) else square
        full[unsure] = rectangle_range(foot, 1.0, 1.0, rest)[1] < 0.0
    return none, full


def sphere_hides_from_patch(
    light: LightShape, receivers: Receivers, center: Array, r: Array, time: float
) -> Mask:
    """`ShapeSet.hides_from_patch` for spheres with given centres (3, m), at their positions.

    All points within reach are covered if a sphere smaller by the reach hides the light.
    """
    point, reach = receivers.point, receivers.reach
    small = r - reach
    cone = light.view_cone(light.to_center(point, time))
    _, cover, tangent = cone_overlap(cone.axis, cone.cosine, cone.sine, center - point, small)
    hides: Mask = cover & (small > 0.0) & (tangent + reach <= cone.near)
    return hides


def moving_sphere_may_shadow(
    light: LightShape, receivers: Receivers, center: Array, d: Array, r: Array
) -> Mask:
    """`ShapeSet.may_shadow` for spheres with given centres and displacements (3, m).

    A segment from a point a of the patch to a point o of the light, both relative to their centres,
    is at the fraction s of its length (1 - s) a + s o off the segment w between the centres. So the
    sphere is enlarged by the reach and by s times the light's radius, and its sweep is tested as a
    capsule. Along w the point at s has advanced by at least s (|w| - radius) - (1 - s) reach: where
    that is beyond the sphere it touches no such segment, which bounds s.
    """
    v = center - receivers.point
    w = light.to_center(receivers.point)
    ww = np.maximum(dot(w, w), TINY)
    at = [dot(v + t * d, w) for t in SHUTTER_ENDS]
    length, size = np.sqrt(ww), r + receivers.reach
    pace = ww + (receivers.reach - light.radius) * length
    ends = np.maximum(at[0], at[1]) + size * length
    latest = np.where(pace > ends, np.clip(ends, 0.0, None) / np.where(pace > ends, pace, 1.0), 1.0)
    wide = r + receivers.reach + latest * light.radius
    gap = _segment_distance(v - 0.5 * d, d, w)
    scale = light.distance_or(length, norm(v) + norm(d))
    slack = SEGMENT_DISTANCE_ROUNDING * (wide + scale)
    touched: Mask = gap <= wide + slack
    return touched


def _segment_distance(start: Array, along: Array, w: Array) -> Array:
    """Distance of the segments start + t along and s w, 0 <= s, t <= 1 (Ericson 2005, 5.1.9)."""
    a, e, f = dot(along, along), dot(w, w), dot(w, start)
    c, b = dot(along, start), dot(along, w)
    denominator = a * e - b * b
    parallel = denominator <= SEGMENT_DISTANCE_ROUNDING * a * e
    t = np.where(
        parallel, 0.0, np.clip((b * f - c * e) / np.where(parallel, 1.0, denominator), 0, 1)
    )
    s = (b * t + f) / np.maximum(e, TINY)
    clipped = np.clip(s, 0.0, 1.0)
    # where s was clipped, t is that of the closest point to that end
    t = np.where(s != clipped, np.clip((b * clipped - c) / np.maximum(a, TINY), 0.0, 1.0), t)
    best: Array = norm(start + t * along - clipped * w)
    # for nearly parallel segments, an end of one is among the closest points
    for fixed in (0.0, 1.0):
        s = np.clip(dot(w, start + fixed * along) / np.maximum(e, TINY), 0.0, 1.0)
        best = np.minimum(best, norm(start + fixed * along - s * w))
        t = np.clip((fixed * b - c) / np.maximum(a, TINY), 0.0, 1.0)
        best = np.minimum(best, norm(start + t * along - fixed * w))
    return best


def sphere_casts_sharp_edge(
    light: LightShape, receivers: Receivers, center: Array, r: Array, order: int
) -> Mask:
    """`ShapeSet.casts_sharp_edge` for spheres at rest with given centres (3, m).

    The sphere smaller by the reach must hide nothing of the light's centre or cone, and the one
    larger by the reach all of it. A point light's shadow line is a conic and is decided exactly.
    """
    patch, at = receivers.footprint, receivers.at
    v = center - receivers.point
    small, large = np.maximum(r - receivers.reach, 0.0), r + receivers.reach
    vv = dot(v, v)
    to = light.to_center(receivers.point)
    cone, line = light.view_cone(to), light.as_point().view_cone(to)
    sharp = np.ones(r.size, dtype=np.bool_)
    for test in (line, cone) if light.fills_cone else (line,):
        touch = cone_touches(test.axis, test.cosine, test.sine, v, small, vv)
        _, cover, _ = cone_overlap(test.axis, test.cosine, test.sine, v, large, vv)
        # within reach of the surface itself anything may be hidden
        sharp &= (~touch | (small == 0.0)) & (cover | (vv <= large * large))
        if order == 1:
            break
    sharp &= np.sqrt(vv) - large < cone.far
    # the inner side of a sphere that holds point and light casts no shadow between them
    gap = light.to_center(center)
    sharp &= ~((vv < small * small) & (np.sqrt(dot(gap, gap)) + light.radius <= r))
    sharp &= ~receivers.own
    if patch is not None and not light.extended:
        rows = (sharp & np.isfinite(patch.thickness[at])).nonzero()[0]
        rows = rows[patch.is_clear_of(columns(v, rows), r[rows], at[rows])]
        if rows.size:
            some = at[rows]
            steps = columns(patch.steps[0], some), columns(patch.steps[1], some)
            low, high, rounding = range_to_point(
                columns(to, rows), columns(v, rows), r[rows], steps, patch.thickness[some]
            )
            sharp[rows] = (high >= -rounding) & (low <= rounding)
    if light.span is not None and order == 2:
        rows = (sharp & (vv > large * large)).nonzero()[0]
        if rows.size:
            seen = light.span, light.radius, columns(to, rows), columns(v, rows)
            high = _discriminant_range(*seen, small[rows])[1]
            low = _discriminant_range(*seen, large[rows])[0]
            sharp[rows] = ((high <= 0.0) | (small[rows] == 0.0)) & (low >= 0.0)
    return sharp


def enclosed_may_cast_sharp_edge(
    light: LightShape, receivers: Receivers, center: Array, r: Array
) -> Mask:
    """`ShapeSet.casts_sharp_edge` for shapes of which only bounding spheres are known: (m,).

    Those of the spheres, larger by the reach, must hide all of the light or hold the point.
    """
    v, large = center - receivers.point, r + receivers.reach
    cone = light.view_cone(light.to_center(receivers.point))
    vv = dot(v, v)
    _, cover, _ = cone_overlap(cone.axis, cone.cosine, cone.sine, v, large, vv)
    may: Mask = (cover | (vv <= large * large)) & (np.sqrt(vv) - large < cone.far)
    return may


def sphere_hides_from_footprint(
    light: LightBall, receivers: Receivers, center: Array, r: Array
) -> Mask:
    """`ShapeSet.hides_from_footprint` for spheres at rest with given centres (3, m).

    All lines from the patch to the light meet the sphere, which contains neither the light nor a
    point of the patch. So its position on those lines relative to both ends cannot change: if it is
    between them at the patch's centre, it is everywhere.
    """
    patch, point = receivers.footprint, receivers.point
    if patch is None:
        return np.zeros(r.shape, dtype=np.bool_)
    v, to, gap = center - point, light.to_center(point), light.to_center(center)
    at = receivers.at
    steps = columns(patch.steps[0], at), columns(patch.steps[1], at)
    low, _, rounding = range_to_point(to, v, r, steps, patch.thickness[at])
    along = dot(to, v)
    hidden: Mask = patch.is_clear_of(v, r, receivers.at) & (low > rounding)
    hidden &= (dot(gap, gap) > r * r) & (along > 0.0) & (along < dot(to, to))
    return hidden


def range_to_point(
    to: Array, v: Array, r: Array, sides: tuple[Array, Array], thickness: Array
) -> tuple[Array, Array, Array]:
    """Bounds of D(L - p, C - p), a quadratic in p, for p in patches, and its rounding: (m,) each.

    D is the discriminant of the line from p to a point light L and a sphere of centre C. `to` and v
    (3, m) lead from the patches' centres to L and C.

    sides : (3, m) each, and thickness (m,), of the patches: see `Footprint`.
    """
    steps = tuple(-step for step in sides)
    wide = sum(np.sqrt(dot(step, step)) for step in steps) + thickness
    far, away = np.sqrt(dot(to, to)) + wide, np.sqrt(dot(v, v)) + wide
    rounding = discriminant_rounding(far * far, away * away, r, far * away)
    ray, ball = Jet.linear(to, steps, 2), Jet.linear(v, steps, 2)
    high = rectangle_range(discriminant(ray, ball, r + thickness), 1.0, 1.0)[1]
    low = rectangle_range(discriminant(ray, ball, np.maximum(r - thickness, 0.0)), 1.0, 1.0)[0]
    return low, high, rounding


def _discriminant_range(
    span: LinearSpan, radius: float, to: Array, v: Array, r: Array
) -> tuple[Array, Array]:
    """Range (m,) of the discriminant over a light of a linear span and of a given radius.

    It is narrowed by its rounding at both ends.
    """
    d = discriminant(Jet.linear(to, (span.half_u, span.half_v), 2), v, r)
    low, high = rectangle_range(d, 1.0, 1.0)
    far, away, side = np.sqrt(dot(to, to)) + radius, np.sqrt(dot(v, v)), cross(to, v)
    miss = np.sqrt(dot(side, side)) + radius * away
    rounding = discriminant_rounding(far * far, away * away, r, miss)
    return low + rounding, high - rounding
