# SPDX-License-Identifier: GPL-3.0-or-later
"""Solid circular cylinders: ray hits, occluded segments, and the parallelogram of their outlines.

With v the vector from the origin to the middle of the cylinder, a the unit axis and r the radius, a
ray w meets the infinite cylinder where |(t w - v) - ((t w - v).a) a| = r. Without what is parallel
to the axis that is the circle of a sphere, so

    D = r^2 q - s^2,   q = |w - (w.a) a|^2,   s = w.(v x a),   t = (p -+ sqrt(D)) / q,   p = w.v',

with v' = v - (v.a) a. D compares the radius with the distance of the line from the axis, so it
stays accurate for a thin cylinder far away. The ends leave of it the slab |t w.a - v.a| <= half
length.

Vectors are (3, ...) and all other arguments (...), of any shapes that broadcast, in metres.
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
    "cylinder_blocks_segment",
    "intersect_side",
    "segment_distance",
    "tangent_parallelogram",
]


@dataclass(frozen=True)
class AxialView:
    """Cylinders as seen from points.

    Attributes
    ----------
    across : (3, ...) metres, the vector v' from the point to the nearest point of the axis' line.
    along : (...) metres, v.a, by which the middle is ahead of the point along the axis.
    lever : (3, ...) v x a, metres.
    power : (...) square metres, |v'|^2 - r^2: negative from within the infinite cylinder.
    """

    across: Array
    along: Array
    lever: Array
    power: Array

    def inside(self, half: Array, graze: Array | float = 0.0) -> Mask:
        """Whether the points are in the solid, by more than `graze` metres from its ends."""
        inside: Mask = (self.power < 0.0) & (np.abs(self.along) < half - graze)
        return inside


def axial_view(v: Array, axis: Array, radius: Array) -> AxialView:
    """Return how cylinders are seen; v (3, ...) leads from the points to their middles."""
    along = dot(v, axis)
    across = v - along * axis
    distance = np.sqrt(dot(across, across))
    return AxialView(across, along, cross(v, axis), (distance - radius) * (distance + radius))


def intersect_side(w: Array, v: Array, axis: Array, half: Array, radius: Array) -> Array:
    """Ray parameter of the first visible hit of the curved side, inf for a miss.

    From within the solid it is the hit of the inner side; else that of the outer one.
    """
    view = axial_view(v, axis, radius)
    near, far, f = _line_hits(w, view, axis, radius)
    inside = view.inside(half)
    t = np.where(inside, far, np.where(view.power < 0.0, np.nan, near))
    with np.errstate(invalid="ignore"):  # misses are NaN
        found = (t > 0.0) & (np.abs(t * f - view.along) <= half)
    return np.where(found, t, np.inf)


def cylinder_blocks_segment(
    w: Array, v: Array, axis: Array, half: Array, radius: Array, graze: Array | float = 0.0
) -> Mask:
    """Whether the surface of a solid cylinder, ends included, cuts the open segment to w.

    The solid is smaller by `graze` metres, so that it does not shadow the points on its surface.
    """
    radius, half = np.maximum(radius - graze, 0.0), np.maximum(half - graze, 0.0)
    view = axial_view(v, axis, radius)
    near, far, f = _line_hits(w, view, axis, radius)
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


def _line_hits(w: Array, view: AxialView, axis: Array, radius: Array) -> tuple[Array, Array, Array]:
    """Ray parameters of both hits of infinite cylinders, NaN for a miss, and w.a.

    A line parallel to the axis is within the cylinder from -inf to inf, or misses it.
    """
    f = dot(w, axis)
    out = w - f * axis
    q = dot(out, out)
    p, s = dot(out, view.across), dot(w, view.lever)
    d = radius * radius * q - s * s
    crosses = (d >= 0.0) & (q > 0.0)
    root = np.sqrt(np.where(crosses, d, 0.0))
    safe = np.where(crosses, q, 1.0)
    within = (q == 0.0) & (view.power < 0.0)
    near = np.where(crosses, (p - root) / safe, np.where(within, -np.inf, np.nan))
    far = np.where(crosses, (p + root) / safe, np.where(within, np.inf, np.nan))
    return near, far, f


def tangent_parallelogram(
    v: Array, axis: Array, half: Array, radius: Array
) -> tuple[Array, Array, Array, Mask]:
    """The parallelogram between the two lines in which planes through a point touch the side.

    From a point outside the infinite cylinder, the solid is seen where this parallelogram or one of
    the ends is, and no farther than it.

    Returns
    -------
    q : (3, ...) its corner from the point.  u, c : (3, ...) its edges, along the axis and across.
    outside : (...) whether the point is outside the infinite cylinder; from elsewhere the edge
        across is 0.
    """
    view = axial_view(v, axis, radius)
    distance = np.sqrt(dot(view.across, view.across))
    outside = view.power > 0.0
    toward = view.across / np.maximum(distance, TINY)
    cosine = np.minimum(radius / np.maximum(distance, TINY), 1.0)
    sine = np.sqrt(np.maximum(view.power, 0.0)) / np.maximum(distance, TINY)
    # from the axis the point is in the direction -toward
    middle = v - (radius * cosine) * toward
    aside = (radius * sine) * cross(axis, toward)
    u = 2.0 * half * axis
    return middle - aside - 0.5 * u, u, 2.0 * aside, outside


def segment_distance(v: Array, axis: Array, half: Array) -> Array:
    """Distance (...) from the origin to the axes between the ends."""
    along = dot(v, axis)
    nearest = v - np.clip(along, -half, half) * axis
    distance: Array = np.sqrt(dot(nearest, nearest))
    return distance
