# SPDX-License-Identifier: GPL-3.0-or-later
"""Circular arcs on the unit sphere of directions: intersection, clipping and boundary integrals.

The integral of n.w over a region of directions is n . (1/2) of the integral of w x dw along its
boundary: the vector area of that closed curve. A boundary of arcs of circles is a polygon of
chords plus a planar segment under each arc. With all vectors taken from a centre c near the
region, every term is as small as the region itself: tiny regions do not cancel, and a rounding
error along the boundary is multiplied by its distance from c.

On a circle of axis a, half angle alpha, and u, w that complete a right-handed frame (a, u, w),
    w(phi) = cos(alpha) a + sin(alpha) (cos(phi) u + sin(phi) w),   g = w(0) - c,
that sum is separable. An arc from phi0 to phi1 adds (F(phi1) - F(phi0)) / 2, with
    F(phi) = -A (1 - cos phi) + B sin phi + C (phi - sin phi),
    A = sin(alpha) n.(g x u),  B = sin(alpha) n.(g x w),  C = sin(alpha)^2 n.a.
With u towards c, phi is small near the region. A great circle has alpha = 90 degrees.
Where two circles cross, both compute the crossing from the same rounded numbers (mu and the root
q below), so the boundary closes to rounding even where they are tangent. The error of interval ends
is at most 8 u / |n x a| rad on a great circle (24 u / cos(g / 2) on a cone's, g between the axes).

Source: Lambert 1760; Arvo 1995, Analytic methods for simulated light transport, chapter 3;
Snyder 1996, MSR-TR-96-11. The chord form is our own.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import cross, dot, total

__all__ = [
    "BoundaryAntiderivative",
    "Circles",
    "GreatCircleArcs",
    "HalfSpaces",
    "Intervals",
    "arcs_inside_cones",
    "arcs_inside_outline",
    "boundary_integral",
    "boundary_values",
    "circles_inside_cones",
    "circles_outside_half_spaces",
    "complement_intervals",
    "complement_on_circle",
    "make_antiderivative",
    "make_circles",
    "make_great_circle_arcs",
]

Intervals: TypeAlias = tuple[Array, Array]
"""Starts and ends of intervals of phi, radians, (j, ..., n) each."""

PI = float(np.pi)
TWO_PI = 2.0 * PI
HUGE = 1.0 / TINY
COPLANARITY_TOLERANCE = 32.0 * 2.0**-53
"""Largest angle, radians, between a direction and a plane through it that rounding may cause."""
COINCIDENCE_TOLERANCE = 2.0**-64
"""Angle, radians, below which circles coincide: nonzero differences of float64 vectors are
larger."""
TINY_CONE_VERSINE = 2.0**-8
"""Versine below which a cone counts as tiny: about 5 degrees."""
SORTING_NETWORK_ROWS = 16
"""Largest number of rows for which a sorting network is used; measured: np.sort is equal at 16."""
MANY_SPANS, FEW_SPANS = 1_024, 0.6
"""Least number of spans, and largest fraction of them that are not empty, for which these are
gathered before they are integrated."""
ABOVE_ANY_COSINE = 4.0
"""Exceeds every cosine, so that a plane without a normal (an edge of no length) clips nothing."""


@dataclass(frozen=True)
class HalfSpaces:
    """Half-spaces of directions, w.normal >= 0: edges of lights and occluders, the horizon.

    Attributes
    ----------
    normal : (3, j, n) inward unit vectors, or 0 for an edge of no length, which bounds nothing.
    angle_error : (j, n) rad, bound on the rounding error of each normal's direction.
    """

    normal: Array
    angle_error: Array


@dataclass(frozen=True)
class GreatCircleArcs:
    """Arcs of great circles below 180 degrees, w(phi) = cos(phi) middle + sin(phi) along.

    Attributes
    ----------
    planes : the planes they lie in, j of them; along = normal x middle.
    middle, along : (3, j, n) unit vectors.
    half_angle : (j, n) rad; phi runs from -half to half, anticlockwise about the plane's normal.
    u, w : (3, j, n) another such pair, u towards the centre of the region that is integrated.
    middle_angle : (j, n) rad, the angle of `middle` from u; None where they are the same.
    """

    planes: HalfSpaces
    middle: Array
    along: Array
    half_angle: Array
    u: Array
    w: Array
    middle_angle: Array | None

    def take(self, rows: slice) -> GreatCircleArcs:
        """Return the arcs selected by `rows`."""
        planes = HalfSpaces(self.planes.normal[:, rows], self.planes.angle_error[rows])
        middle, along, u, w = (x[:, rows] for x in (self.middle, self.along, self.u, self.w))
        shift = None if self.middle_angle is None else self.middle_angle[rows]
        return GreatCircleArcs(planes, middle, along, self.half_angle[rows], u, w, shift)

    def at_points(self, rows: Ints) -> GreatCircleArcs:
        """Return the arcs of some of the points."""
        planes = HalfSpaces(
            *(columns(x, rows, -1) for x in (self.planes.normal, self.planes.angle_error))
        )
        middle, along, half, u, w = (
            columns(x, rows, -1) for x in (self.middle, self.along, self.half_angle, self.u, self.w)
        )
        shift = None if self.middle_angle is None else columns(self.middle_angle, rows)
        return GreatCircleArcs(planes, middle, along, half, u, w, shift)


@dataclass(frozen=True)
class Circles:
    """Circular cones of directions: occluding spheres, round lights.

    Attributes
    ----------
    axis, u, w : (3, k, n) right-handed orthonormal frames.
    sine, cosine, versine : (k, n) of the half angles; versine is 1 - cosine without cancellation.
    """

    axis: Array
    u: Array
    w: Array
    sine: Array
    cosine: Array
    versine: Array

    def take_pairs(self, index: Ints, point: Ints) -> Circles:
        """Return circles (m,), given by their indices and those of their points."""
        axis, u, w = (x[:, index, point] for x in (self.axis, self.u, self.w))
        sine, cosine, versine = (x[index, point] for x in (self.sine, self.cosine, self.versine))
        return Circles(axis, u, w, sine, cosine, versine)


@dataclass(frozen=True)
class BoundaryAntiderivative:
    """Coefficients A, B, C of F for curves (k, n); `phase`, if given, is added to their phi."""

    a: Array
    b: Array
    c: Array
    phase: Array | None


def make_circles(axis: Array, sine: Array, cosine: Array, center: Array) -> Circles:
    """Return cones with frames in which angles are measured from the side towards `center`.

    Parameters
    ----------
    axis : (3, k, n) unit vectors.  sine, cosine : (k, n).  center : (3, n) unit vectors.
    """
    u, w = _frames(axis, center)
    return Circles(axis, u, w, sine, cosine, sine * sine / (1.0 + cosine))


def make_great_circle_arcs(
    start: Array, end: Array, planes: HalfSpaces, center: Array | None = None
) -> GreatCircleArcs:
    """Return the arcs between unit vectors (3, j, n) that lie in `planes`, anticlockwise.

    Parameters
    ----------
    center : (3, n) unit vectors to the region's centre; None for edges of the region itself,
        whose own middles are close enough to it.
    """
    both, apart = start + end, end - start
    length = np.sqrt(dot(both, both))
    middle = both / np.maximum(length, TINY)
    along = cross(planes.normal, middle)
    half = np.arctan2(np.sqrt(dot(apart, apart)), length)
    if center is None:
        return GreatCircleArcs(planes, middle, along, half, middle, along, None)
    u, w = _frames(planes.normal, center)
    shift = np.arctan2(dot(middle, w), dot(middle, u))
    return GreatCircleArcs(planes, middle, along, half, u, w, shift)


def make_antiderivative(
    normal: Array, center: Array, curve: Circles | GreatCircleArcs
) -> BoundaryAntiderivative:
    """Return the antiderivative F along circles, or the great circles of arcs, about a centre.

    Parameters
    ----------
    normal : (3, n) unit vectors n.  center : (3, n) unit vectors c.
    """
    n, c, u, w = normal[:, None], center[:, None], curve.u, curve.w
    if isinstance(curve, GreatCircleArcs):
        lever = cross(n, u - c)
        return BoundaryAntiderivative(
            dot(lever, u), dot(lever, w), dot(n, curve.planes.normal), curve.middle_angle
        )
    s = curve.sine
    # cos(alpha) a - c, without cancellation for small cones near c
    lever = cross(n, (curve.axis - c) - curve.versine * curve.axis + s * u)
    return BoundaryAntiderivative(
        s * dot(lever, u), s * dot(lever, w), s * s * dot(n, curve.axis), None
    )


def boundary_integral(potential: BoundaryAntiderivative, spans: Intervals) -> Array:
    """Integral of n.(w x dw) along arcs: (n,), twice their part of the integral of n.w.

    spans : (j, k, n) the arcs, as intervals of curves (k, n).
    """
    low, high = spans
    rows = _spans_integral(potential, low, high)
    # curve by curve: another empty span, which shifts the others, adds a zero and changes no bit
    return total(total(rows))


def _spans_integral(potential: BoundaryAntiderivative, low: Array, high: Array) -> Array:
    """Integrals (j, k, n) along spans of curves (k, n); those of empty spans are 0."""
    if low.size >= MANY_SPANS:
        index = (low != high).ravel().nonzero()[0]
        if index.size < FEW_SPANS * low.size:
            curve = index % potential.a.size
            shift = None if potential.phase is None else potential.phase.take(curve)
            own = BoundaryAntiderivative(
                potential.a.take(curve), potential.b.take(curve), potential.c.take(curve), shift
            )
            rows = np.zeros(low.size)
            rows[index] = boundary_values(own, high.take(index)) - boundary_values(
                own, low.take(index)
            )
            return rows.reshape(low.shape)
    return boundary_values(potential, high) - boundary_values(potential, low)


def boundary_values(potential: BoundaryAntiderivative, phi: Array) -> Array:
    """Values F (...) at angles phi (...) on the curves, radians."""
    if potential.phase is not None:
        phi = phi + potential.phase
    t = np.tan(0.5 * phi)
    sine = t * (2.0 / (1.0 + t * t))
    value: Array = sine * (potential.b - potential.c - potential.a * t) + potential.c * phi
    return value


def complement_intervals(low: Array, high: Array, spans: Intervals) -> Intervals:
    """Return the parts of the intervals from low to high that no span covers.

    Parameters
    ----------
    low, high : (...).  spans : (j, ...) starts and ends, in any order, overlapping or empty.

    Returns
    -------
    (j + 1, ...) starts and ends; an empty gap ends where it starts. A point is uncovered if as many
    spans have ended as have started before it: so, with starts and ends sorted separately, the
    gaps run from the i-th end to the next start.
    """
    begin = np.concatenate([low[None], _sorted(spans[1])])
    finish = np.concatenate([_sorted(spans[0]), high[None]])
    np.minimum(np.maximum(begin, low, out=begin), high, out=begin)
    return begin, np.maximum(np.minimum(finish, high, out=finish), begin, out=finish)


def _sorted(rows: Array) -> Array:
    """Sort numbers (j, ...) along the first axis."""
    if (count := rows.shape[0]) < 2:
        return rows
    if count > SORTING_NETWORK_ROWS:
        return np.sort(rows, axis=0)
    # a sorting network: compares whole rows, many times faster than sorting short columns
    row = list(rows)
    for last in range(count - 1, 0, -1):
        for i in range(last):
            row[i], row[i + 1] = np.minimum(row[i], row[i + 1]), np.maximum(row[i], row[i + 1])
    return np.array(row)


def complement_on_circle(center: Array, half: Array, spans: Intervals | None = None) -> Intervals:
    """Return the parts of whole circles, from -pi to pi, that no interval covers.

    Parameters
    ----------
    center, half : (j, k, n) rad, centres in [-pi, 2 pi], half widths in [0, pi].
    spans : (i, k, n) further intervals within [-pi, pi].  Error: 8 u rad for each.
    """
    starts = center - half
    starts += TWO_PI * (starts < -PI)
    starts -= TWO_PI * (starts >= PI)
    ends = starts + 2.0 * half
    # an interval that passes pi continues from -pi
    low = np.maximum(ends.max(axis=0) - TWO_PI, -PI)
    if spans is not None:
        starts, ends = np.concatenate([starts, spans[0]]), np.concatenate([ends, spans[1]])
    return complement_intervals(low, np.full_like(low, PI), (starts, ends))


def arcs_inside_cones(segments: GreatCircleArcs, circles: Circles) -> Intervals:
    """Return where great-circle arcs run inside cones: one interval (k, j, n) each, maybe empty.

    The ends are not clipped to the arcs. Half an arc and half a chord of a cone below 90
    degrees are less than 90 degrees each, so no interval wraps around.
    """
    axis, normal = circles.axis[:, :, None], segments.planes.normal[:, None]
    mu = dot(normal, axis)
    sine = circles.sine[:, None]
    q = np.sqrt(np.maximum((sine - mu) * (sine + mu), 0.0))
    center = np.arctan2(dot(axis, segments.along[:, None]), dot(axis, segments.middle[:, None]))
    half = np.arctan2(q, circles.cosine[:, None] + np.zeros_like(q))
    return center - half, center + half


def circles_outside_half_spaces(circles: Circles, planes: HalfSpaces) -> Intervals:
    """Where circles run outside half-spaces: centres and half widths (j, k, n) of the intervals."""
    axis, normal = circles.axis[:, None], planes.normal[:, :, None]
    mu = dot(normal, axis)
    sine = circles.sine
    nothing = dot(planes.normal, planes.normal) == 0.0
    if nothing.any():
        mu = mu + ABOVE_ANY_COSINE * nothing[:, None]
    q = np.sqrt(np.maximum((sine - mu) * (sine + mu), 0.0))
    center = np.arctan2(-dot(normal, circles.w[:, None]), -dot(normal, circles.u[:, None]))
    if nothing.any():
        center[np.broadcast_to(nothing[:, None], center.shape)] = -PI  # splits no interval
    return center, np.arctan2(q, circles.cosine * mu)


def circles_inside_cones(
    circles: Circles, others: Circles, wins: Array
) -> tuple[Array, Array, Array]:
    """Return where circles run inside other cones, one cone for each circle.

    Parameters
    ----------
    circles, others : (..., n) alike.
    wins : (..., 1) +1 where a circle that coincides with the other counts as inside, else -1.

    Returns
    -------
    centre, half width inside, half width outside (about the centre + pi): (..., n).
    """
    apart, both = others.axis - circles.axis, others.axis + circles.axis
    # the vectors have unit length to rounding only: remove the difference of their lengths
    apart = apart - (dot(apart, both) / np.maximum(dot(both, both), TINY)) * both
    v, va, vb = 0.5 * dot(apart, apart), circles.versine, others.versine
    d = vb - va
    same = (v <= 0.5 * COINCIDENCE_TOLERANCE * COINCIDENCE_TOLERANCE) & (
        np.abs(d) <= COINCIDENCE_TOLERANCE * (circles.sine + others.sine)
    )
    if same.any():
        v, d = np.where(same, 0.0, v), np.where(same, 0.0, d)
    # symmetric to the last bit, so that both circles find the same crossings
    square = v * (2.0 * (va + vb - va * vb) - v) - d * d
    most = np.maximum(va, vb)
    lost = (np.minimum(va, vb) < TINY_CONE_VERSINE) & (v > 0.25 * most)
    if lost.any():
        rows = ... if lost.all() else np.nonzero(lost)
        sine, cosine = (
            np.maximum(circles.sine, others.sine),
            np.minimum(circles.cosine, others.cosine),
        )
        least = np.minimum(va, vb)[rows]
        square[rows] = _tiny_cone_crossing(v[rows], most[rows], sine[rows], cosine[rows], least)
    q = np.sqrt(np.maximum(square, 0.0))
    c = d - v * circles.cosine + wins * TINY
    center = np.arctan2(dot(apart, circles.w), dot(apart, circles.u))
    return center, np.arctan2(q, -c), np.arctan2(q, c)


def _tiny_cone_crossing(
    v: Array, versine: Array, sine: Array, cosine: Array, least: Array
) -> Array:
    """The square of q in `circles_inside_cones` where one cone is tiny, without cancellation:
    (cos(a - g) - cos b) (cos b - cos(a + g)), a the half angle of the wide cone, b of the tiny one
    and g between the axes; both factors are sums of terms of their own size.

    Parameters
    ----------
    v : versine of g.  versine, sine, cosine : of the wide cone.  least : versine of the tiny one.
    """
    side = np.sqrt(v * (2.0 - v))
    apart = sine * (1.0 - v) - cosine * side
    along = cosine * (1.0 - v) + sine * side
    versine_apart = np.where(along > 0.0, apart * apart / (1.0 + np.abs(along)), 1.0 - along)
    square: Array = (least - versine_apart) * (
        (versine - least) + v * (1.0 - versine) + sine * side
    )
    return square


def arcs_inside_outline(
    segments: GreatCircleArcs, edges: GreatCircleArcs, alike: Mask, reach: Array
) -> Intervals:
    """Where great-circle arcs run inside a convex outline: an interval (j, n), empty if reversed.

    Parameters
    ----------
    edges : (i, n) edges of one convex outline, whose inside is to their left.
    alike : (j, 1) bool. An arc in the plane of an edge counts as inside if it runs against that
        edge; if it runs along the edge, `alike` decides.
    reach : (n,) approximate sine of the angular radius of the region around its centre. Planes
        that agree to rounding within that radius are the same; both arcs decide so equally.
    """
    low = np.full_like(segments.half_angle, -PI)
    high = np.full_like(segments.half_angle, PI)
    for i in range(edges.half_angle.shape[0]):
        normal = edges.planes.normal[:, i, None]
        crossing = cross(segments.planes.normal, normal)
        x = dot(crossing, segments.along)
        y = dot(crossing, segments.middle) - TINY  # inside from the crossing on where y < 0
        fuzz = segments.planes.angle_error + edges.planes.angle_error[i]
        same = np.sqrt(dot(crossing, crossing)) <= fuzz
        if same.any():
            limit = COPLANARITY_TOLERANCE + 2.0 * fuzz * reach
            same &= np.abs(dot(segments.u, normal)) <= limit
            same &= np.abs(dot(edges.u[:, i, None], segments.planes.normal)) <= limit
            inside = (dot(segments.planes.normal, normal) <= 0.0) | alike
            x = np.where(same, np.where(inside, HUGE, -HUGE), x)
            y = np.where(same, -1.0, y)
        with np.errstate(over="ignore"):  # a crossing a quarter turn away
            phi = np.arctan(x / y)
        aside = TWO_PI * (y >= 0.0)  # arithmetic: np.where costs ten times as much
        np.maximum(low, phi - aside, out=low)
        np.minimum(high, phi + (TWO_PI - aside), out=high)
    return low, high


def _frames(axis: Array, center: Array) -> tuple[Array, Array]:
    """Unit vectors u, w (3, k, n) completing frames (axis, u, w), u towards the centre (3, n)."""
    w = cross(axis, center[:, None] - axis)
    square = dot(w, w)
    lost = square < TINY
    if lost.any():
        w, square = w.copy(), square.copy()
        found = np.ascontiguousarray(_perpendiculars(axis[:, lost]))
        w[:, lost], square[lost] = found, dot(found, found)
    w /= np.sqrt(np.maximum(square, TINY))
    return cross(w, axis), w


def _perpendiculars(axis: Array) -> Array:
    """Vectors perpendicular to unit vectors (3, n), with lengths well above 0."""
    x, y, z = axis
    flat = np.abs(z) < np.maximum(np.abs(x), np.abs(y))
    zero = np.zeros_like(x)
    return np.where(flat, np.array([y, -x, zero]), np.array([zero, z, -y]))
