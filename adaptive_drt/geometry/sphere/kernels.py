# SPDX-License-Identifier: GPL-3.0-or-later
"""Spheres: discriminants, ray hits, occluded segments and overlap with cones of directions.

For a ray of direction w (any length) and the vector v from its origin to the centre of a sphere
of radius r,

    D(w, v) = r^2 (w.w) - |w x v|^2          > 0 where the line meets the sphere.

It equals (w.v)^2 - (w.w)(v.v - r^2) by Lagrange's identity, but compares r with the distance of
the closest approach, so it stays accurate for a small sphere far away. All functions take
components first, of any shape that broadcasts: w, v (3, ...), r (...).
"""

from __future__ import annotations

from typing import overload

import numpy as np

from ...numerics.arrays import Array, Mask
from ...numerics.floats import TINY, UNIT_ROUNDOFF
from ...numerics.jet import Jet
from ...numerics.vector import cross, dot, squared_norm

__all__ = [
    "cone_overlap",
    "cone_touches",
    "discriminant",
    "discriminant_and_terms",
    "discriminant_rounding",
    "intersect_sphere",
    "origin_inside",
    "sphere_blocks_segment",
    "surface_tolerance",
]


DISCRIMINANT_OPERATIONS = 32
"""Number of rounded operations in one discriminant, counted generously: its error bound in
roundoffs."""
SURFACE_TOLERANCE = 2.0**-40
"""Distance from a surface at which a point counts as on it, as a fraction of the point's distance
from the tracer's origin plus the radius. The error of hits is about 2^-50 of that, and a gap of
2^-40 is invisible."""
CONE_OPERATIONS = 16
"""Number of rounded operations in one comparison of cones, counted generously."""


@overload
def discriminant(w: Jet, v: Jet | Array, radius: Array | float) -> Jet: ...
@overload
def discriminant(w: Array, v: Jet, radius: Array | float) -> Jet: ...
@overload
def discriminant(w: Array, v: Array, radius: Array | float) -> Array: ...
def discriminant(w: Array | Jet, v: Array | Jet, radius: Array | float) -> Array | Jet:
    """D(w, v) (...), for arrays or jets, in the unit of w squared times metres squared."""
    return (radius * radius) * squared_norm(w) - squared_norm(cross(w, v))


def discriminant_and_terms(w: Jet, v: Array, radius: Array) -> tuple[Jet, Array, Array]:
    """Return D(w, v) as a jet, and of its terms the values of w.w and |w x v|^2: (...) each."""
    square, side = squared_norm(w), squared_norm(cross(w, v))
    return (radius * radius) * square - side, square.value, side.value


def surface_tolerance(point: Array, size: Array | float) -> Array:
    """Distance (metres) from a surface within which points (3, ...) count as lying on it.

    size : metres, a sphere's radius, or the distance of a quad's corner from the point.
    """
    graze: Array = SURFACE_TOLERANCE * (np.sqrt(dot(point, point)) + size)
    return graze


def discriminant_rounding(
    ww: Array, vv: Array, radius: Array | float, miss: Array | float = 0.0
) -> Array:
    """Bound on the rounding error of D, in D's unit: 32 u (r^2 w.w + max(r |w|, |w x v|) |w||v|).

    Each component of the cross product has an error of a few roundoffs of |w||v|, and D has
    twice that times the product's length.

    Parameters
    ----------
    ww, vv : (...) w.w and v.v, the greatest in the domain.
    miss : (...) the greatest |w x v| of a domain over which a jet of D is used; 0 for D near its
        zero, where |w x v| is near r |w|.
    """
    unit = DISCRIMINANT_OPERATIONS * UNIT_ROUNDOFF
    length = np.sqrt(ww)
    side = np.maximum(radius * length, miss)
    bound: Array = unit * (radius * radius * ww + side * (length * np.sqrt(vv)))
    return bound


def intersect_sphere(w: Array, v: Array, radius: Array | float) -> Array:
    """Ray parameter of the first hit in front of the origin, inf for a miss.

    From inside, it is where the ray leaves the sphere. NaN anywhere gives a miss. With u = 2^-53
    and h half the chord, the error of t |w| is at most 8 u (|v| + r) + 16 u r (r + |v|) / h
    metres; whether it is a hit is certain where |D| exceeds `discriminant_rounding`.
    """
    ww = dot(w, w)
    along = dot(w, v)
    d = (radius * radius) * ww - squared_norm(cross(w, v))
    found = d >= 0.0
    root = np.sqrt(np.where(found, d, 0.0))
    near = along - root
    t = np.where(near > 0.0, near, along + root) / ww
    return np.where(found & (t > 0.0), t, np.inf)


def origin_inside(vv: Array, radius: Array | float, graze: Array | float) -> Mask:
    """Whether the origin lies inside a sphere, by more than `graze` metres from its surface.

    vv : (...) squared distance from the origin to the centre.
    """
    least = np.maximum(radius - graze, 0.0)
    inside: Mask = vv < least * least
    return inside


def sphere_blocks_segment(
    w: Array, v: Array, radius: Array | float, graze: Array | float = 0.0
) -> Mask:
    """Whether the surface of a sphere cuts the open segment from the origin to w.

    A segment from outside is cut if its line meets the sphere (D > 0), the centre lies ahead, and
    the segment ends inside the sphere or beyond the projection of the centre. One from inside is
    cut if it ends outside. An origin within `graze` metres of the surface counts as outside: a
    sphere that coincides with the lit surface does not shadow it. With `graze` 0 the answer is
    right if the nearest and farthest point are off the surface by more than 16 u (r + |v|) metres.
    """
    ww = dot(w, w)
    along = dot(w, v)
    rr = radius * radius
    end = v - w
    ends_inside = dot(end, end) < rr
    starts_inside = origin_inside(dot(v, v), radius, graze)
    line = (rr * ww > squared_norm(cross(w, v))) & (along > 0.0)
    outside = line & (ends_inside | (along < ww))
    return np.where(starts_inside, ~ends_inside, outside)


def cone_overlap(
    axis: Array,
    cosine: Array | float,
    sine: Array | float,
    v: Array,
    radius: Array | float,
    vv: Array | None = None,
) -> tuple[Mask, Mask, Array]:
    """Whether a sphere, seen from the origin, touches or covers a circular cone of directions.

    Parameters
    ----------
    axis : (3, ...) unit axis of the cone.
    cosine, sine : of the cone's half angle; (-1, 1) stands for all directions, a cone that every
        sphere touches and none covers.
    v, radius : the sphere; the origin must lie outside it.  vv : v.v, where it is known already.

    Returns
    -------
    touch, cover : masks (...): whether some direction of the cone may meet the sphere, and whether
        all certainly do. Both are conservative by the rounding bound, 16 u |v|^2 / max(tangent,
        u^1/2 |v|) metres of |v| cos(...), and change no later than twice that.
    tangent : (...) length of the tangents from the origin to the sphere.

    With alpha the sphere's half angle, |v| cos(alpha -+ lambda) = tangent cos -+ r sin, lambda the
    cone's half angle, so no trigonometric function is needed.
    """
    vv = dot(v, v) if vv is None else vv
    square = radius * radius
    tangent, slack = _tangent_and_slack(vv, square)
    along, spread, edge = dot(axis, v), radius * sine, tangent * cosine
    touch = along > edge - spread - slack
    edge += spread
    edge += slack
    cover = (along >= edge) & (square >= vv * sine * sine)
    return touch, cover, tangent


def cone_touches(
    axis: Array,
    cosine: Array | float,
    sine: Array | float,
    v: Array,
    radius: Array | float,
    vv: Array | None = None,
) -> Mask:
    """Return the mask `touch` of `cone_overlap` alone."""
    tangent, slack = _tangent_and_slack(dot(v, v) if vv is None else vv, radius * radius)
    tangent *= cosine
    tangent -= radius * sine
    tangent -= slack
    touch: Mask = dot(axis, v) > tangent
    return touch


def _tangent_and_slack(vv: Array, square: Array | float) -> tuple[Array, Array]:
    """Lengths (...) of tangents to spheres, and rounding bounds of comparisons with cones.

    vv, square : (...) squared distances of the spheres' centres and squared radii.
    """
    tangent = np.maximum(vv - square, 0.0)
    np.sqrt(tangent, out=tangent)
    # the square root loses half the digits where the origin is next to the surface
    floor = UNIT_ROUNDOFF * vv
    np.sqrt(floor, out=floor)
    np.maximum(tangent, floor, out=floor)
    np.maximum(floor, TINY, out=floor)
    slack = (CONE_OPERATIONS * UNIT_ROUNDOFF) * vv
    slack /= floor
    return tangent, slack
