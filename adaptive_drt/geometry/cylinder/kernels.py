# SPDX-License-Identifier: GPL-3.0-or-later
"""Solid circular cylinders and truncated cones: ray hits, occluded segments, and the trapezoids of
their outlines.

The radius is r + k h at the height h along the unit axis a, from the middle; k = 0 is a cylinder.
With v the vector from the origin to the middle, h0 = -v.a the origin's height and R = r + k h0, let
x' be what of a vector x is across the axis. A ray w meets the infinite double cone where

    |t w' - v'|^2 = (R + k f t)^2,  f = w.a,

a quadratic q t^2 - 2 p t + g = 0 with

    q = |w'|^2 - k^2 f^2,  p = w'.v' + k f R,  g = |v'|^2 - R^2,
    D = p^2 - q g = |R w' + k f v'|^2 - s^2,  s = w.(v x a).

D compares the radius with the distance of the line from the axis, so it stays accurate for a thin
solid far away. The root g / (p + sqrt(D)) is that at which a ray enters the half of the double cone
that holds the solid, from outside of both halves and from within the other one. The ends leave of
it the slab |t f - v.a| <= half length.

Vectors are (3, ...) and all other arguments (...), of any shapes that broadcast, in metres. The
slope k is never positive: the radius falls along the axis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...numerics.arrays import Array, Mask
from ...numerics.floats import TINY
from ...numerics.vector import cross, dot

__all__ = [
    "AxialView",
    "axial_view",
    "cone_interval",
    "cylinder_blocks_segment",
    "intersect_side",
    "segment_distance",
    "tangent_trapezoid",
]

SLAB_SLACK = 2.0**-48
"""Distance by which hits of the side may lie beyond the planes of the ends, as a fraction of the
solid's length and its distance: a ray through the apex of a cone must not miss it by rounding."""
BLUNTNESS = 2.0**-40
"""Least radius of an end in the outline of a solid, as a fraction of the largest one: it keeps the
four edges of the trapezoid of a cone apart, and changes nothing that a picture shows."""


@dataclass(frozen=True)
class AxialView:
    """Solids as seen from points.

    Attributes
    ----------
    across : (3, ...) metres, the vector v' from the point to the nearest point of the axis' line.
    along : (...) metres, v.a, by which the middle is ahead of the point along the axis.
    lever : (3, ...) v x a, metres.
    level : (...) metres, the radius R at the point's height; negative beyond a cone's apex.
    power : (...) square metres, |v'|^2 - R^2: negative from within the infinite double cone.
    """

    across: Array
    along: Array
    lever: Array
    level: Array
    power: Array

    @property
    def within(self) -> Mask:
        """Whether the points are within the half of the double cone that holds the solid."""
        within: Mask = (self.power < 0.0) & (self.level > 0.0)
        return within

    def inside(self, half: Array, graze: Array | float = 0.0) -> Mask:
        """Whether the points are in the solid, by more than `graze` metres from its ends."""
        inside: Mask = self.within & (np.abs(self.along) < half - graze)
        return inside


def axial_view(v: Array, axis: Array, radius: Array, slope: Array) -> AxialView:
    """Return how solids are seen; v (3, ...) leads from the points to their middles."""
    along = dot(v, axis)
    across = v - along * axis
    distance = np.sqrt(dot(across, across))
    level: Array = radius - slope * along
    power: Array = (distance - level) * (distance + level)
    return AxialView(across, along, cross(v, axis), level, power)


def intersect_side(
    w: Array, v: Array, axis: Array, half: Array, radius: Array, slope: Array
) -> Array:
    """Ray parameter of the first visible hit of the curved side, inf for a miss.

    From within the solid it is the hit of the inner side; else that of the outer one.
    """
    view = axial_view(v, axis, radius, slope)
    first, last, f = _line_hits(w, view, axis, slope)
    inside = view.inside(half)
    t = np.where(inside, last, np.where(view.within, np.nan, first))
    slack = SLAB_SLACK * (half + np.abs(view.along))
    with np.errstate(invalid="ignore"):  # misses are NaN
        found = (t > 0.0) & (np.abs(t * f - view.along) <= half + slack) & (t < np.inf)
    return np.where(found, t, np.inf)


def cylinder_blocks_segment(
    w: Array,
    v: Array,
    axis: Array,
    half: Array,
    radius: Array,
    slope: Array,
    graze: Array | float = 0.0,
) -> Mask:
    """Whether the surface of a solid, ends included, cuts the open segment to w.

    The solid is smaller by `graze` metres, so that it does not shadow the points on its surface.
    """
    radius = radius - graze * np.sqrt(1.0 + slope * slope)
    radius, half = np.where(slope < 0.0, radius, np.maximum(radius, 0.0)), half - graze
    half = np.maximum(half, 0.0)
    view = axial_view(v, axis, radius, slope)
    near, far, f = _line_hits(w, view, axis, slope)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # parallel to the ends
        ends = (view.along - half) / f, (view.along + half) / f
        first, last = np.minimum(*ends), np.maximum(*ends)
    level = f == 0.0
    between = np.abs(view.along) < half
    first = np.where(level, np.where(between, -np.inf, np.inf), first)
    last = np.where(level, np.where(between, np.inf, -np.inf), last)
    # NaN, of lines that miss, makes all comparisons false
    first, last = np.maximum(near, first), np.minimum(far, last)
    starts_inside = (first < 0.0) & (last > 0.0)
    meets = (np.maximum(first, 0.0) < np.minimum(last, 1.0)) & (last > 0.0)
    return np.where(starts_inside, last < 1.0, meets)


def _line_hits(w: Array, view: AxialView, axis: Array, slope: Array) -> tuple[Array, Array, Array]:
    """Ray parameters at which lines enter and leave the infinite cone, NaN for a miss, and w.a."""
    f = dot(w, axis)
    out = w - f * axis
    s, opening = dot(w, view.lever), slope * f
    q, inner = dot(out, out), dot(out, view.across)
    across = dot(view.across, view.across)
    # |R w' + k f v'|^2, of which a cylinder has the first term alone
    reach = view.level * view.level * q
    reach = reach + opening * (2.0 * view.level * inner + opening * across)
    p = inner + opening * view.level
    q = q - opening * opening
    return *cone_interval(p, q, reach - s * s, view.power, view.level, opening), f


def cone_interval(
    p: Array, q: Array, d: Array, power: Array, level: Array, opening: Array
) -> tuple[Array, Array]:
    """Ray parameters between which lines are in the half of a double cone that holds the solid.

    They are NaN for lines that miss it. The half is convex; lines that the cone opens along (q < 0)
    never leave it, so one of them is infinite, and so are both for lines along a cylinder's axis.

    Parameters
    ----------
    p, q, d, power : of the quadratic of the module, the last one g.
    level, opening : the radius at the origin's height, and by how much it grows with t.
    """
    steep = q < 0.0
    # a line along which a double cone opens meets it, but for rounding
    meets = (d >= 0.0) | (steep & (power <= 0.0))
    root = np.sqrt(np.maximum(d, 0.0))
    larger = p + np.where(p < 0.0, -root, root)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        one, other = larger / q, power / larger
        other = np.where(larger == 0.0, one, other)
        # (p - sqrt(d)) / q and (p + sqrt(d)) / q
        near, far = np.where(p < 0.0, one, other), np.where(p < 0.0, other, one)
        holds = steep | (level + opening * (p / q) > 0.0) | (q == 0.0)
    first = np.where(steep & (opening <= 0.0), -np.inf, near)
    last = np.where(steep & (opening > 0.0), np.inf, far)
    along = (q == 0.0) & (larger == 0.0)
    within = (power < 0.0) & (level > 0.0)
    first = np.where(along, np.where(within, -np.inf, np.nan), first)
    last = np.where(along, np.where(within, np.inf, np.nan), last)
    keep = (meets & holds) | (along & within)
    return np.where(keep, first, np.nan), np.where(keep, last, np.nan)


def tangent_trapezoid(
    v: Array, axis: Array, half: Array, radius: Array, slope: Array
) -> tuple[tuple[Array, Array, Array, Array], Mask]:
    """The trapezoid between the two lines in which planes through a point touch the side.

    From a point outside the infinite double cone, the solid is seen where this trapezoid or one of
    the ends is, and no farther than it.

    Returns
    -------
    vertices : four (3, ...) from the point: at one side of the first end, of the last end, then at
        the other side of the last and of the first end.
    outside : (...) whether the point is outside the infinite double cone; from elsewhere the
        trapezoid has no width.
    """
    view = axial_view(v, axis, radius, slope)
    distance = np.maximum(np.sqrt(dot(view.across, view.across)), TINY)
    outside = view.power > 0.0
    toward = view.across / distance
    cosine = np.clip(view.level / distance, -1.0, 1.0)
    sine = np.sqrt(np.maximum(view.power, 0.0)) / distance
    # from the axis the point is in the direction -toward
    back, side = cosine * toward, sine * cross(axis, toward)
    first, last = radius - slope * half, radius + slope * half
    last = np.maximum(last, BLUNTNESS * first)
    low, high = v - half * axis - first * back, v + half * axis - last * back
    return (low - first * side, high - last * side, high + last * side, low + first * side), outside


def segment_distance(v: Array, axis: Array, half: Array) -> Array:
    """Distance (...) from the origin to the axes between the ends."""
    along = dot(v, axis)
    nearest = v - np.clip(along, -half, half) * axis
    distance: Array = np.sqrt(dot(nearest, nearest))
    return distance
