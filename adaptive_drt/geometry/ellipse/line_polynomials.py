# SPDX-License-Identifier: GPL-3.0-or-later
"""Flat ellipses seen through boxes, as polynomials.

With c the centre relative to the camera, u and v the half axes and w the direction, let

    f = w.(u x v),  a = w.(v x c),  b = w.(c x u).

The ray meets the ellipse's plane at t w = c + (a u + b v) / f (Cramer's rule), so it hits the
ellipse where f has the sign of the height c.(u x v) and the discriminant f^2 - a^2 - b^2 is not
negative. That has degree two in (x, y) and degree two in t, in which it is concave.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from ...numerics.arrays import Array, Ints, Mask
from ...numerics.axes import TIME
from ...numerics.box_polynomials import (
    absolute_slopes,
    linear_coefficients,
    linear_product,
    polynomial_range,
    signs_at_time_ends,
    unit_vectors,
    value_at_time,
)
from ...numerics.line_lattice import Lattice, restrict_to_lines
from ...numerics.vector import cross, dot
from ..line_forms import (
    TIME_NORMAL,
    BoxCoverage,
    BoxRays,
    DepthPolynomials,
    DepthSurface,
    LineForms,
)
from ..quadric_lines import cone_intervals

__all__ = ["EllipseForms", "disk_discriminant", "ellipse_forms"]


class EllipseForms(LineForms):
    """Ellipse candidates; the polynomials are the three properties, in their order here."""

    surface: ClassVar[DepthSurface] = DepthSurface.PLANE

    @property
    def discriminant(self) -> Array:
        """f^2 - a^2 - b^2, not negative where the line meets the ellipse."""
        return self.polynomials[0]

    @property
    def normal_dot(self) -> Array:
        """f, the product of w with the normal."""
        return self.polynomials[1]

    @property
    def height(self) -> Array:
        """Product of the centre with the normal."""
        return self.polynomials[2]

    def coverage(self, apparent_size: Array) -> BoxCoverage:
        """See `LineForms.coverage`."""
        height_low, height_high = polynomial_range(self.height)
        sure = (height_low > 0.0) | (height_high < 0.0)
        side = np.where(height_low > 0.0, 1.0, -1.0)
        low, high = polynomial_range(self.discriminant)
        dot_low, dot_high = polynomial_range(side * self.normal_dot)
        may_hit = ~sure | ((high >= 0.0) & (dot_high > 0.0))
        may_hit &= (height_low != 0.0) | (height_high != 0.0)
        all_hit = sure & (low > 0.0) & (dot_low > 0.0)
        first = np.where(sure, np.minimum(np.abs(height_low), np.abs(height_high)), 0.0)
        last = np.maximum(np.abs(height_low), np.abs(height_high))
        near = np.where(dot_high > 0.0, first, 0.0) / np.where(dot_high > 0.0, dot_high, 1.0)
        ahead = sure & (dot_low > 0.0)
        with np.errstate(over="ignore"):  # overflow where it is seen edge-on: no bound
            far = np.where(ahead, last, np.inf) / np.where(ahead, dot_low, 1.0)
        normal = np.where(all_hit, 1.0, unit_vectors(absolute_slopes(self.discriminant)))
        normal = np.where(sure, normal, TIME_NORMAL)
        wide = np.maximum(apparent_size.min(axis=0), 0.5)
        turn = np.where(all_hit, 0.0, np.where(sure, 0.5 / wide, 1.0))
        return BoxCoverage(may_hit, all_hit, near, far, normal, apparent_size, turn)

    def intervals(self, lattice: Lattice) -> tuple[Array, Array]:
        """See `LineForms.intervals`.

        Along t the side of the plane that the camera is on follows from the ray, as for polygons.
        """
        shape = (lattice.rows, lattice.columns, self.rows.size)
        height = restrict_to_lines(self.height, lattice)
        facing = restrict_to_lines(self.normal_dot, lattice)
        along_time = lattice.axis == TIME
        side = np.where((facing if along_time else height)[0] < 0.0, -1.0, 1.0)
        d = restrict_to_lines(self.discriminant, lattice)
        first, last = cone_intervals(d, [side * part for part in facing], shape)
        first, last = np.array(first), np.array(last)
        if not along_time:
            none = np.broadcast_to(height[0] == 0.0, shape)
            return np.where(none, 0.0, first), np.where(none, 0.0, last)
        start = side * height[0]
        if len(height) == 1:
            none = np.broadcast_to(start <= 0.0, shape)
            return np.where(none, 0.0, first), np.where(none, 0.0, last)
        slope = side * height[1] + 0.0  # turn -0 into +0, so that `end` has a definite sign
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # no slope: no end
            end = -start / slope
        rising = slope >= 0.0
        first = np.fmax(first, np.where(rising, end, -np.inf))
        return first, np.fmin(last, np.where(rising, np.inf, end))

    def smooth_events(self) -> tuple[Mask, Mask]:
        """See `LineForms.smooth_events`; only where the camera stays on one side of the plane."""
        above, below = signs_at_time_ends(self.discriminant)
        low, high = polynomial_range(self.normal_dot)
        side = np.where(low > 0.0, 1.0, -1.0)
        before = signs_at_time_ends(side * self.height)[0]
        plain = ((low > 0.0) | (high < 0.0)) & before[0] & before[1]
        within = polynomial_range(value_at_time(self.discriminant, 0.0))[0] > 0.0
        turns = (above[0] & below[1]) | (below[0] & above[1]) | (below[0] & below[1] & within)
        return plain & above[0] & above[1], plain & turns

    def depth_polynomials(self) -> DepthPolynomials:
        """See `LineForms.depth_polynomials`: the depth of a plane is height / w.normal."""
        return DepthPolynomials(self.height, self.normal_dot)


def ellipse_forms(
    rows: Ints, rays: BoxRays, center: Array, displacement: Array | None, u: Array, v: Array
) -> EllipseForms:
    """Polynomials of ellipses in boxes.

    Parameters
    ----------
    rows : (m,) positions among all candidates.
    center, displacement : (3, m) metres, at mid-shutter and over the shutter; None if none moves.
    u, v : (3, m) metres, the half axes.
    """
    place, change = rays.positions(center, displacement)
    normal, w = cross(u, v), rays.directions
    f = linear_coefficients(w, normal)
    d = disk_discriminant(linear_product(f, f), w, (u, v), place, change)
    height = [dot(place, normal)[None]]
    if change is not None:
        height.append(dot(change, normal)[None])
    return EllipseForms(rows, (d, f[None], np.array(height)))


def disk_discriminant(
    square: Array,
    w: tuple[Array, Array, Array],
    axes: tuple[Array, Array],
    place: Array,
    change: Array | None,
) -> Array:
    """Powers of t of the discriminant f^2 - a^2 - b^2: polynomials (1 or 3, 6, m).

    Parameters
    ----------
    square : (6, m) f^2.  w : directions, as `BoxRays` has them.
    axes : two of (3, m), half axes u and v, or what is as long as they are relative to f.
    place, change : (3, m) metres, the centres, and their changes with t; None if none moves.
    """
    u, v = axes
    a, b = linear_coefficients(w, cross(v, place)), linear_coefficients(w, cross(place, u))
    d = [square - linear_product(a, a) - linear_product(b, b)]
    if change is not None:
        p, q = linear_coefficients(w, cross(v, change)), linear_coefficients(w, cross(change, u))
        d += [
            -2.0 * (linear_product(a, p) + linear_product(b, q)),
            -linear_product(p, p) - linear_product(q, q),
        ]
    return np.array(d)
