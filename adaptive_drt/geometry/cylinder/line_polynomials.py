# SPDX-License-Identifier: GPL-3.0-or-later
"""Curved sides of cylinders seen through boxes, as polynomials.

The interval of a line is that in which it hits the solid, which is convex; the side is one of its
faces. Where the ray enters through an end, that end is nearer than any point of the side that lies
behind it: the side counts there with its inner hit (see `DepthPolynomials`), so that the depths
decide. The ends of the interval are on the outlines of the ends, which are ellipses, or on the two
lines in which planes through the camera touch the side.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.axes import TIME
from ...numerics.box_polynomials import (
    BOX_ENDS,
    absolute_slopes,
    linear_coefficients,
    linear_product,
    polynomial_range,
    product_coefficients,
    unit_vectors,
)
from ...numerics.line_lattice import Lattice, restrict_to_lines
from ...numerics.line_roots import NO_ROOT, LinePolynomial, polynomial_value, quadratic_roots
from ...numerics.vector import cross, dot, perpendicular_pair
from ..ellipse.line_polynomials import EllipseForms, disk_discriminant
from ..line_forms import (
    TIME_NORMAL,
    BoxCoverage,
    BoxRays,
    DepthPolynomials,
    DepthSurface,
    LineForms,
)
from ..quadric_lines import cone_intervals
from .pixel_coverage import hit_depths, product_range

__all__ = ["SideForms", "side_forms"]


EDGE_ON_TOLERANCE = 2.0**-24
"""Distance of the camera from the plane of an end, as a fraction of the cylinder's length, up to
which the end counts as seen edge-on: from nearer, rounding hides both sides of its outline."""


class SideForms(LineForms):
    """Sides of cylinders; the polynomials are the nine properties, in their order here."""

    surface: ClassVar[DepthSurface] = DepthSurface.QUADRIC

    @property
    def discriminant(self) -> Array:
        """D, positive where the line meets the infinite cylinder."""
        return self.polynomials[0]

    @property
    def ahead(self) -> Array:
        """p, positive where the axis is ahead of the camera."""
        return self.polynomials[1]

    @property
    def across_square(self) -> Array:
        """q, the square of what of w is across the axis."""
        return self.polynomials[2]

    @property
    def power(self) -> Array:
        """g, negative where the camera is inside the infinite cylinder."""
        return self.polynomials[3]

    @property
    def slope(self) -> Array:
        """w.axis."""
        return self.polynomials[4]

    @property
    def heights(self) -> tuple[Array, Array]:
        """Products of the axis with the centres of the ends, the lower one first."""
        return self.polynomials[5], self.polynomials[6]

    @property
    def ends(self) -> tuple[EllipseForms, EllipseForms]:
        """The ends, as candidates of their own."""
        first, last = (
            EllipseForms(self.rows, (disk, self.slope, height))
            for disk, height in zip(self.polynomials[7:], self.heights, strict=True)
        )
        return first, last

    def coverage(self, apparent_size: Array) -> BoxCoverage:
        """See `LineForms.coverage`."""
        d, p, g = (polynomial_range(part) for part in (self.discriminant, self.ahead, self.power))
        near, far = hit_depths(p, d, g)
        along = product_range((near, far), polynomial_range(self.slope))
        low, high = (polynomial_range(part) for part in self.heights)
        around = g[0] <= 0.0
        may_hit = (d[1] >= 0.0) & (p[1] > 0.0) & (along[0] <= high[1]) & (along[1] >= low[0])
        all_hit = (d[0] > 0.0) & (p[0] > 0.0) & ~around
        ends = ~((along[0] >= low[1]) & (along[1] <= high[0]))
        all_hit &= ~ends
        may_hit |= around
        sides = d[0] <= 0.0
        normal = np.ones((3, all_hit.size))
        for disk, seen in (
            (self.discriminant, sides),
            (self.polynomials[7], ends),
            (self.polynomials[8], ends),
        ):
            crossed = seen & (polynomial_range(disk)[0] <= 0.0) & (polynomial_range(disk)[1] >= 0.0)
            own = unit_vectors(absolute_slopes(disk))
            normal = np.where(crossed, np.minimum(normal, own), normal)
        normal = np.where(around & (g[1] >= 0.0), TIME_NORMAL, normal)
        # a rim turns anywhere by its ellipse's curvature, and by a corner where the sides begin
        turn = np.where(ends | around, 1.0, 0.0)
        near, far = np.where(around, 0.0, near), np.where(around, np.inf, far)
        return BoxCoverage(may_hit, all_hit, near, far, normal, apparent_size, turn)

    def intervals(self, lattice: Lattice) -> tuple[Array, Array]:
        """See `LineForms.intervals`."""
        parts = _LineParts.make(self, lattice)
        shape = (lattice.rows, lattice.columns, self.rows.size)
        low, high = np.full(shape, BOX_ENDS[1]), np.full(shape, BOX_ENDS[0])
        for first, last in (end.intervals(lattice) for end in self.ends):
            first, last = np.clip(first, *BOX_ENDS), np.clip(last, *BOX_ENDS)
            low = np.where(last > first, np.minimum(low, first), low)
            high = np.where(last > first, np.maximum(high, last), high)
        events = [*cone_intervals(parts.d, parts.p, shape)]
        tests = [parts.touches_side] * 2
        if len(parts.f) > 1:
            # an end that is seen edge-on has no interval
            events.append(_linear_root(parts.f))
            tests.append(parts.meets_level)
        if lattice.axis == TIME and len(parts.g) > 1:
            # the camera enters or leaves the solid
            events += [*quadratic_roots(parts.g[0], parts.g[1], parts.g[2])]
            events += [_linear_root(height) for height in (parts.low, parts.high)]
            tests += [parts.at_side] * 2 + [parts.at_end] * 2
        for event, test in zip(events, tests, strict=True):
            inner = np.abs(event) < NO_ROOT
            event = np.where(inner, event, 0.0)
            inner = inner & test(event)
            low = np.where(inner, np.minimum(low, event), low)
            high = np.where(inner, np.maximum(high, event), high)
        low = np.where(parts.meets_solid(BOX_ENDS[0]), BOX_ENDS[0], low)
        high = np.where(parts.meets_solid(BOX_ENDS[1]), BOX_ENDS[1], high)
        return low, np.maximum(low, high)

    def smooth_events(self) -> tuple[Mask, Mask]:
        """See `LineForms.smooth_events`: nothing is known of them."""
        always, once = np.zeros((2, self.rows.size), dtype=np.bool_)
        return always, once

    def depth_polynomials(self) -> DepthPolynomials:
        """See `LineForms.depth_polynomials`."""
        slab = (self.slope, *self.heights)
        return DepthPolynomials(self.ahead, self.across_square, self.discriminant, self.power, slab)


@dataclass(frozen=True)
class _LineParts:
    """The polynomials of sides along lines: lists of coefficients from that of s^0."""

    d: LinePolynomial
    p: LinePolynomial
    q: LinePolynomial
    g: LinePolynomial
    f: LinePolynomial
    low: LinePolynomial
    high: LinePolynomial

    @classmethod
    def make(cls, forms: SideForms, lattice: Lattice) -> _LineParts:
        """Restrict the polynomials to lines."""
        return cls(*(restrict_to_lines(each, lattice) for each in forms.polynomials[:7]))

    def touches_side(self, s: Array) -> Mask:
        """Whether lines at s, that touch the infinite cylinder, do so between its ends, ahead."""
        low, high = polynomial_value(self.low, s), polynomial_value(self.high, s)
        p, q = polynomial_value(self.p, s), polynomial_value(self.q, s)
        along = polynomial_value(self.f, s) * p
        between: Mask = (low * q <= along) & (along <= high * q) & (p > 0.0)
        return between

    def meets_level(self, s: Array) -> Mask:
        """Whether rays at s, parallel to the ends, are between their planes and hit the side."""
        low, high = polynomial_value(self.low, s), polynomial_value(self.high, s)
        slack = EDGE_ON_TOLERANCE * (high - low)
        meets: Mask = (low <= slack) & (high >= -slack) & (polynomial_value(self.d, s) >= 0.0)
        return meets & (polynomial_value(self.p, s) > 0.0)

    def at_side(self, s: Array) -> Mask:
        """Whether the camera, on the infinite cylinder at s, is between its ends."""
        low, high = polynomial_value(self.low, s), polynomial_value(self.high, s)
        between: Mask = (low <= 0.0) & (high >= 0.0)
        return between

    def at_end(self, s: Array) -> Mask:
        """Whether the camera, in the plane of an end at s, is inside the infinite cylinder."""
        inside: Mask = polynomial_value(self.g, s) <= 0.0
        return inside

    def meets_solid(self, s: float) -> Mask:
        """Whether rays at s hit the solid, ends included."""
        d, p, q, f = (polynomial_value(each, s) for each in (self.d, self.p, self.q, self.f))
        low, high = polynomial_value(self.low, s), polynomial_value(self.high, s)
        root = np.sqrt(np.maximum(d, 0.0))
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # along the axis
            near, far = (p - root) / q, (p + root) / q
            ends = low / f, high / f
        level, along = f == 0.0, q == 0.0
        inside, between = polynomial_value(self.g, s) < 0.0, (low < 0.0) & (high > 0.0)
        near = np.where(along, np.where(inside, -np.inf, np.inf), near)
        far = np.where(along, np.where(inside, np.inf, -np.inf), far)
        enter = np.where(level, np.where(between, -np.inf, np.inf), np.minimum(*ends))
        leave = np.where(level, np.where(between, np.inf, -np.inf), np.maximum(*ends))
        last = np.minimum(far, leave)
        meets: Mask = (d >= 0.0) & (np.maximum(near, enter) < last) & (last > 0.0)
        return meets


def _linear_root(height: LinePolynomial) -> Array:
    """Root of h0 + h1 s; `NO_ROOT` where there is none."""
    if len(height) == 1:
        return np.full(height[0].shape, NO_ROOT)
    slope = np.where(height[1] == 0.0, 1.0, height[1])
    with np.errstate(over="ignore"):
        root: Array = np.where(height[1] == 0.0, NO_ROOT, -height[0] / slope)
    return root


def side_forms(
    rows: Ints,
    rays: BoxRays,
    center: Array,
    displacement: Array | None,
    axis: Array,
    half: Array,
    radius: Array,
) -> SideForms:
    """Polynomials of the sides of cylinders in boxes.

    Parameters
    ----------
    rows : (m,) positions among all candidates.
    center, displacement : (3, m) metres, at mid-shutter and over the shutter; None if none moves.
    axis : (3, m) unit.  half, radius : (m,) metres, half the length and the radius.
    """
    v, change = rays.positions(center, displacement)
    w, rr = rays.directions, radius * radius
    out = _across(w[0], axis), _across(w[1], axis), _across(w[2], axis)
    q, f = product_coefficients(out, out), linear_coefficients(w, axis)
    across, along = _across(v, axis), dot(v, axis)
    lever = linear_coefficients(w, cross(v, axis))
    d = [rr * q - linear_product(lever, lever)]
    p = [linear_coefficients(out, across)]
    distance = np.sqrt(dot(across, across))
    g = [((distance - radius) * (distance + radius))[None]]
    low, high = [(along - half)[None]], [(along + half)[None]]
    if change is not None:
        turn, shift = linear_coefficients(w, cross(change, axis)), _across(change, axis)
        d += [-2.0 * linear_product(lever, turn), -linear_product(turn, turn)]
        p.append(linear_coefficients(out, shift))
        g += [2.0 * dot(across, shift)[None], dot(shift, shift)[None]]
        rise = dot(change, axis)[None]
        low.append(rise)
        high.append(rise)
    # half axes of unit length: all is over the square of the radius
    frame, square = perpendicular_pair(axis), rr * linear_product(f, f)
    disks = [
        disk_discriminant(square, w, frame, v + side * half * axis, change) for side in (-1.0, 1.0)
    ]
    parts = (np.array(d), np.array(p), q[None], np.array(g), f[None], np.array(low), np.array(high))
    return SideForms(rows, (*parts, *disks))


def _across(vector: Array, axis: Array) -> Array:
    """What of vectors (3, m) is across unit axes."""
    return vector - dot(vector, axis) * axis
