# SPDX-License-Identifier: GPL-3.0-or-later
"""Tubes of triangles around curves with a radius at each of their points, as hair has.

Between its points a curve is the Catmull-Rom spline through them, of positions and radii alike, as
in Cycles (`kernel/geom/curve_intersect.h`); before the first and after the last point stands that
point again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["CurveTubes", "curve_tubes"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FLATNESS = 1.0 / 16.0
"""Distance between a curve and the chords that stand for it, as a fraction of the radius; where it
turns sharply within a chord it may be twice that."""
BENDS_LOOKED_AT = np.linspace(0.0, 1.0, 5)
"""Places between two points at which the second derivative tells how many chords there are."""
TURNED_ALONG = 2.0**-10
"""Sine of the angle to the axis up to which a direction across the ring before is given up."""
UPWARD = np.array([[0.0], [0.0], [1.0]])
"""Direction of curves that have none."""


@dataclass(frozen=True)
class CurveTubes:
    """Triangles of tubes without ends, as those of Cycles' 3D curves.

    Attributes
    ----------
    points : (3, n) float64, in the curves' units.  corners : (3, t) int64, vertices of the
        triangles, anticlockwise from outside.
    normals : (3, 3, t) float64, corner and component, unit shading normals.
    """

    points: FloatArray
    corners: IntArray
    normals: FloatArray


@dataclass(frozen=True)
class _Rings:
    """Cross sections of tubes, curve after curve.

    Attributes
    ----------
    center : (3, n).  radius : (n,).  axis : (3, n) unit, along the curves.
    slope : (n,) change of the radius by length.
    place : (n,) number within its curve.  count : (k,) number of rings of each curve.
    """

    center: FloatArray
    radius: FloatArray
    axis: FloatArray
    slope: FloatArray
    place: IntArray
    count: IntArray


def curve_tubes(
    points: FloatArray,
    radii: FloatArray,
    offsets: IntArray,
    sides: int,
    most_chords: int,
    straight: bool = False,
) -> CurveTubes:
    """Return the tubes around curves; those of one point or of no radius have none.

    The cross sections are regular polygons whose mean width is that of the circles.

    Parameters
    ----------
    points : (3, n) finite.  radii : (n,) finite.
    offsets : (k + 1,) the first point of each curve, and n.
    sides : number of sides of a cross section.
    most_chords : number of chords between two points of a curve, at most.
    straight : whether the points are joined by straight lines.
    """
    radii = np.maximum(radii, 0.0)
    size = np.diff(offsets)
    thick = np.zeros(size.size)
    filled = size > 0
    thick[filled] = np.maximum.reduceat(radii, offsets[:-1][filled]) if filled.any() else 0.0
    kept = ((size > 1) & (thick > 0.0)).nonzero()[0]
    keys = np.vstack([points, radii])
    rings = _rings(keys, offsets[kept], size[kept], most_chords, straight)
    side, other = _frames(rings)
    # the mean width of a polygon is its perimeter over pi
    stretch = (np.pi / sides) / np.sin(np.pi / sides)
    angle = np.arange(sides) * (2.0 * np.pi / sides)
    out = side[:, :, None] * np.cos(angle) + other[:, :, None] * np.sin(angle)
    vertices = rings.center[:, :, None] + (stretch * rings.radius)[:, None] * out
    normal = out - (rings.slope * rings.axis)[:, :, None]
    normal /= np.sqrt(1.0 + rings.slope**2)[:, None]
    vertices, normal = vertices.reshape(3, -1), normal.reshape(3, -1)
    corners = _walls(rings, sides)
    normals = normal[:, corners].transpose(1, 0, 2)
    a, b, c = (vertices[:, each] for each in corners)
    wide = np.cross(b - a, c - a, axis=0).any(axis=0)
    return CurveTubes(vertices, corners[:, wide], np.ascontiguousarray(normals[:, :, wide]))


def _rings(
    points: FloatArray, first: IntArray, size: IntArray, most_chords: int, straight: bool
) -> _Rings:
    """Cross sections of curves.

    points : (4, n) positions and radii.  first, size : (k,) the points of each curve, 2 at least.
    """
    spans = size - 1
    owner = np.repeat(np.arange(size.size), spans)
    start = np.arange(owner.size) - np.repeat(np.cumsum(spans) - spans, spans) + first[owner]
    last = (first + size - 1)[owner]
    p1, p2 = points[:, start], points[:, start + 1]
    if straight:
        polynomial = [p1, p2 - p1, 0.0 * p1, 0.0 * p1]
    else:
        p0 = points[:, np.maximum(start - 1, first[owner])]
        p3 = points[:, np.minimum(start + 2, last)]
        polynomial = [
            p1,
            0.5 * (p2 - p0),
            p0 - 2.5 * p1 + 2.0 * p2 - 0.5 * p3,
            0.5 * (p3 - p0) + 1.5 * (p1 - p2),
        ]
    steps = _chords(polynomial, most_chords)
    closes = start + 1 == last
    count = steps + closes
    span = np.repeat(np.arange(count.size), count)
    step = np.arange(span.size) - np.repeat(np.cumsum(count) - count, count)
    u = step / steps[span]
    c0, c1, c2, c3 = (each[:, span] for each in polynomial)
    value = c0 + u * (c1 + u * (c2 + u * c3))
    rate = c1 + u * (2.0 * c2 + 3.0 * u * c3)
    each = np.bincount(owner, weights=count, minlength=size.size).astype(np.int64)
    place = np.arange(span.size) - np.repeat(np.cumsum(each) - each, each)
    # where the points of a span lie in one place the curve has no direction of its own
    speed = np.sqrt((rate[:3] ** 2).sum(axis=0))
    chord = (p2 - p1)[:3, span]
    axis = np.where(speed > 0.0, rate[:3], np.where(chord.any(axis=0), chord, UPWARD))
    axis = axis / np.sqrt((axis**2).sum(axis=0))
    slope = np.where(speed > 0.0, rate[3] / np.where(speed > 0.0, speed, 1.0), 0.0)
    return _Rings(value[:3], np.maximum(value[3], 0.0), axis, slope, place, each)


def _chords(polynomial: list[FloatArray], most: int) -> IntArray:
    """Number (s,) of chords of each span; polynomial : four coefficients (4, s), of u^0 first."""
    _, c1, c2, c3 = polynomial
    bend = np.zeros(c1.shape[1])
    for u in BENDS_LOOKED_AT:
        rate, second = c1 + u * (2.0 * c2 + 3.0 * u * c3), 2.0 * c2 + 6.0 * u * c3
        speed = np.maximum(np.sqrt((rate[:3] ** 2).sum(axis=0)), np.finfo(np.float64).tiny)
        # what is along the curve, as where points are unevenly far apart, bends nothing
        along = (rate[:3] * second[:3]).sum(axis=0) / speed
        bend = np.maximum(bend, (second**2).sum(axis=0) - along * along)
    bend = np.sqrt(np.maximum(bend, 0.0))
    radius = np.maximum(polynomial[0][3], polynomial[0][3] + polynomial[1][3])
    allowed = 8.0 * FLATNESS * radius
    ratio = bend / np.where(allowed > 0.0, allowed, 1.0)
    ratio = np.where((allowed > 0.0) | (bend == 0.0), ratio, float(most**2))
    steps: IntArray = np.ceil(np.sqrt(np.clip(ratio, 1.0, float(most**2)))).astype(np.int64)
    return steps


def _frames(rings: _Rings) -> tuple[FloatArray, FloatArray]:
    """Two directions (3, n) across the axis of each ring, which turn as little as they can."""
    side = np.empty_like(rings.center)
    first = np.cumsum(rings.count) - rings.count
    order = np.argsort(-rings.count, kind="stable")
    first, count = first[order], rings.count[order]
    before = np.zeros((3, first.size))
    for number in range(int(count.max(initial=0))):
        own = first[: int(np.searchsorted(-count, -number, side="left"))] + number
        axis, old = rings.axis[:, own], before[:, : own.size]
        across = old - (old * axis).sum(axis=0) * axis
        length = np.sqrt((across**2).sum(axis=0))
        lost = length < TURNED_ALONG
        if lost.any():
            # the axis across which it is most
            away = np.zeros((3, own.size))
            away[np.abs(axis).argmin(axis=0), np.arange(own.size)] = 1.0
            across = np.where(lost, np.cross(axis, away, axis=0), across)
            length = np.sqrt((across**2).sum(axis=0))
        before = side[:, own] = across / length
    return side, np.cross(rings.axis, side, axis=0)


def _walls(rings: _Rings, sides: int) -> IntArray:
    """Triangles (3, t) between rings that follow each other."""
    total = rings.place.size
    last = np.zeros(total, dtype=np.bool_)
    last[np.cumsum(rings.count) - 1] = True
    lower = (~last).nonzero()[0][:, None] * sides
    now = np.arange(sides)
    after = (now + 1) % sides
    a, b, c, d = lower + now, lower + after, lower + sides + after, lower + sides + now
    halves = (a, b, c), (a, c, d)
    return np.concatenate([np.stack([each.ravel() for each in half]) for half in halves], axis=1)
