# SPDX-License-Identifier: GPL-3.0-or-later
"""Curved sides of cylinders and truncated cones seen through boxes, as polynomials.

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
from ...numerics.line_roots import (
    NO_ROOT,
    LinePolynomial,
    coefficient,
    polynomial_value,
    quadratic_roots,
)
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
from .kernels import cone_interval
from .pixel_coverage import hit_depths, product_range

__all__ = ["SideForms", "side_forms"]


EDGE_ON_TOLERANCE = 2.0**-24
"""Distance of the camera from the plane of an end, as a fraction of the cylinder's length, up to
which the end counts as seen edge-on: from nearer, rounding hides both sides of its outline."""


class SideForms(LineForms):
    """Sides of solids; the polynomials are the properties, in their order here."""

    surface: ClassVar[DepthSurface] = DepthSurface.QUADRIC

    @property
    def discriminant(self) -> Array:
        """D, positive where the line meets the infinite double cone."""
        return self.polynomials[0]

    @property
    def ahead(self) -> Array:
        """p: of a cylinder, positive where the axis is ahead of the camera."""
        return self.polynomials[1]

    @property
    def direction_square(self) -> Array:
        """q, negative along lines that the double cone opens along."""
        return self.polynomials[2]

    @property
    def power(self) -> Array:
        """g, negative where the camera is inside the infinite double cone."""
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
    def level(self) -> Array:
        """R, the radius at the camera's height; negative beyond a cone's apex."""
        return self.polynomials[7]

    @property
    def opening(self) -> Array:
        """k f, by which the radius grows along rays."""
        return self.polynomials[8]

    @property
    def ends(self) -> tuple[EllipseForms, EllipseForms]:
        """The ends, as candidates of their own."""
        first, last = (
            EllipseForms(self.rows, (disk, self.slope, height))
            for disk, height in zip(self.polynomials[9:], self.heights, strict=True)
        )
        return first, last

    def coverage(self, apparent_size: Array) -> BoxCoverage:
        """See `LineForms.coverage`."""
        d, p, g, level = (
            polynomial_range(part)
            for part in (self.discriminant, self.ahead, self.power, self.level)
        )
        # beyond the apex the cone is seen from within the other half of the double cone
        mirrored = (g[1] < 0.0) & (level[1] < 0.0)
        near, far, certain = hit_depths(p, d, g, mirrored)
        along = product_range((near, far), polynomial_range(self.slope))
        low, high = (polynomial_range(part) for part in self.heights)
        around = (g[0] <= 0.0) & ~mirrored
        may_hit = (d[1] >= 0.0) & (far > 0.0) & (along[0] <= high[1]) & (along[1] >= low[0])
        all_hit = ((d[0] > 0.0) | mirrored) & certain & ~around
        ends = ~((along[0] >= low[1]) & (along[1] <= high[0]))
        all_hit &= ~ends
        may_hit |= around
        sides = d[0] <= 0.0
        normal = np.ones((3, all_hit.size))
        for disk, seen in (
            (self.discriminant, sides),
            (self.polynomials[9], ends),
            (self.polynomials[10], ends),
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
        events: list[Array] = []
        if len(parts.d) > 1:
            events += quadratic_roots(*(coefficient(parts.d, power) for power in range(3)))
        tests = [parts.touches_side] * len(events)
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
        slab = (self.slope, *self.heights, self.level)
        return DepthPolynomials(
            self.ahead, self.direction_square, self.discriminant, self.power, slab
        )


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
    level: LinePolynomial
    opening: LinePolynomial

    @classmethod
    def make(cls, forms: SideForms, lattice: Lattice) -> _LineParts:
        """Restrict the polynomials to lines."""
        return cls(*(restrict_to_lines(each, lattice) for each in forms.polynomials[:9]))

    def touches_side(self, s: Array) -> Mask:
        """Whether lines at s, that touch the double cone, do so between the ends, ahead."""
        low, high = polynomial_value(self.low, s), polynomial_value(self.high, s)
        p, q = polynomial_value(self.p, s), polynomial_value(self.q, s)
        along = polynomial_value(self.f, s) * p
        between: Mask = (low * q <= along) & (along <= high * q) & (p > 0.0) & (q > 0.0)
        return between

    def meets_level(self, s: Array) -> Mask:
        """Whether rays at s, parallel to the ends, are between their planes and hit the side."""
        low, high = polynomial_value(self.low, s), polynomial_value(self.high, s)
        slack = EDGE_ON_TOLERANCE * (high - low)
        meets: Mask = (low <= slack) & (high >= -slack) & (polynomial_value(self.d, s) >= 0.0)
        return meets & (polynomial_value(self.p, s) > 0.0)

    def at_side(self, s: Array) -> Mask:
        """Whether the camera, on the infinite cone at s, is between the ends."""
        low, high = polynomial_value(self.low, s), polynomial_value(self.high, s)
        between: Mask = (low <= 0.0) & (high >= 0.0)
        return between

    def at_end(self, s: Array) -> Mask:
        """Whether the camera, in the plane of an end at s, is inside the infinite cone."""
        inside: Mask = polynomial_value(self.g, s) <= 0.0
        return inside

    def meets_solid(self, s: float) -> Mask:
        """Whether rays at s hit the solid, ends included."""
        d, p, q, f, g, radius, opening = (
            polynomial_value(each, s)
            for each in (self.d, self.p, self.q, self.f, self.g, self.level, self.opening)
        )
        low, high = polynomial_value(self.low, s), polynomial_value(self.high, s)
        near, far = cone_interval(p, q, d, g, radius, opening)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # along the ends
            ends = low / f, high / f
        level, between = f == 0.0, (low < 0.0) & (high > 0.0)
        enter = np.where(level, np.where(between, -np.inf, np.inf), np.minimum(*ends))
        leave = np.where(level, np.where(between, np.inf, -np.inf), np.maximum(*ends))
        last = np.minimum(far, leave)
        meets: Mask = (np.maximum(near, enter) < last) & (last > 0.0)
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
    sizes: tuple[Array, Array, Array, Array],
) -> SideForms:
    """Polynomials of the sides of solids in boxes.

    Parameters
    ----------
    rows : (m,) positions among all candidates.
    center, displacement : (3, m) metres, at mid-shutter and over the shutter; None if none moves.
    sizes : axes (3, m), unit; half lengths and radii in the middle (m,), metres; slopes (m,).
    """
    axis, half, radius, slope = sizes
    v, change = rays.positions(center, displacement)
    w = rays.directions
    out = _across(w[0], axis), _across(w[1], axis), _across(w[2], axis)
    f = linear_coefficients(w, axis)
    across, along = _across(v, axis), dot(v, axis)
    level: Array = radius - slope * along
    q = product_coefficients(out, out) - slope * slope * linear_product(f, f)
    # R w' + k f v', of which a cylinder has the first term alone
    reach = _reach(out, f, level, slope * across)
    lever = linear_coefficients(w, cross(v, axis))
    d = [product_coefficients(reach, reach) - linear_product(lever, lever)]
    p = [linear_coefficients(out, across) + slope * level * f]
    distance = np.sqrt(dot(across, across))
    g, levels = [((distance - level) * (distance + level))[None]], [level[None]]
    low, high = [(along - half)[None]], [(along + half)[None]]
    if change is not None:
        turn, shift = linear_coefficients(w, cross(change, axis)), _across(change, axis)
        rise = dot(change, axis)
        growth: Array = -slope * rise
        moved = _reach(out, f, growth, slope * shift)
        d += [
            2.0 * (product_coefficients(reach, moved) - linear_product(lever, turn)),
            product_coefficients(moved, moved) - linear_product(turn, turn),
        ]
        p.append(linear_coefficients(out, shift) + slope * growth * f)
        g += [
            2.0 * (dot(across, shift) - level * growth)[None],
            (dot(shift, shift) - growth * growth)[None],
        ]
        for each, part in ((low, rise), (high, rise), (levels, growth)):
            each.append(part[None])
    lists = d, p, [q], g, [f], low, high, levels, [slope * f]
    return SideForms(rows, (*map(np.array, lists), *_disks(w, f, v, change, sizes)))


def _disks(
    w: tuple[Array, Array, Array],
    f: Array,
    v: Array,
    change: Array | None,
    sizes: tuple[Array, Array, Array, Array],
) -> list[Array]:
    """Discriminants of both ends, as `disk_discriminant` has them; arguments as in `side_forms`."""
    axis, half, radius, slope = sizes
    # half axes of unit length: all is over the square of the radius
    frame, square = perpendicular_pair(axis), linear_product(f, f)
    return [
        disk_discriminant(
            (radius + side * slope * half) ** 2 * square, w, frame, v + side * half * axis, change
        )
        for side in (-1.0, 1.0)
    ]


def _reach(
    out: tuple[Array, Array, Array], f: Array, level: Array, aside: Array
) -> tuple[Array, Array, Array]:
    """R w' + f x for linear functions w' of three coefficients (3, m) and f (3, m), with a number R
    (m,) and a vector x (3, m)."""
    one, two, three = (level * own + part * aside for own, part in zip(out, f, strict=True))
    return one, two, three


def _across(vector: Array, axis: Array) -> Array:
    """What of vectors (3, m) is across unit axes."""
    return vector - dot(vector, axis) * axis
