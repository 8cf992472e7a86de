# SPDX-License-Identifier: GPL-3.0-or-later
"""Closed convex surfaces of degree two seen through boxes: where lines hit them, and how deep.

With v the center relative to the camera, w the direction and A a matrix without negative
eigenvalues, the surface is (t w - v).A(t w - v) = r^2. Its discriminant

    d = (w.Av)^2 - (w.Aw) (v.Av - r^2)

is positive where the line meets the surface; it has degree two in (x, y) and degree two in t, in
which it is concave. A line through a box meets the solid in a single interval: the directions that
hit it form a convex cone, and a point in linear motion is within the solid swept along the ray for
a single interval of time. A kind of shape makes the four polynomials; for spheres, A is 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from ..numerics.arrays import Array, Mask
from ..numerics.box_polynomials import (
    absolute_slopes,
    polynomial_range,
    signs_at_time_ends,
    unit_vectors,
    value_at_time,
)
from ..numerics.line_lattice import Lattice, restrict_to_lines
from ..numerics.line_roots import TINY_COEFFICIENT
from .line_forms import TIME_NORMAL, BoxCoverage, DepthPolynomials, DepthSurface, LineForms

__all__ = ["QuadricForms", "cone_intervals"]


class QuadricForms(LineForms):
    """Candidates of degree two; the polynomials are the four properties, in their order here."""

    surface: ClassVar[DepthSurface] = DepthSurface.QUADRIC

    @property
    def discriminant(self) -> Array:
        """d, positive where the line meets the surface."""
        return self.polynomials[0]

    @property
    def center_dot(self) -> Array:
        """w.Av, positive where the center is ahead of the camera."""
        return self.polynomials[1]

    @property
    def direction_square(self) -> Array:
        """w.Aw."""
        return self.polynomials[2]

    @property
    def power(self) -> Array:
        """v.Av - r^2, negative where the camera is inside."""
        return self.polynomials[3]

    def coverage(self, apparent_size: Array) -> BoxCoverage:
        """See `LineForms.coverage`."""
        low, high = polynomial_range(self.discriminant)
        dot_low, dot_high = polynomial_range(self.center_dot)
        square_low, square_high = polynomial_range(self.direction_square)
        power_low, power_high = polynomial_range(self.power)
        may_hit = ((high >= 0.0) & (dot_high > 0.0)) | (power_low < 0.0)
        all_hit = ((low > 0.0) & (dot_low > 0.0)) | (power_high < 0.0)
        outside = power_low > 0.0
        root_low, root_high = np.sqrt(np.maximum(low, 0.0)), np.sqrt(np.maximum(high, 0.0))
        last = np.maximum(dot_high + np.where(outside, -root_low, root_high), 0.0)
        near = np.where(outside, np.maximum(dot_low - root_high, 0.0), 0.0) / square_high
        ahead = square_low > 0.0
        far = np.where(ahead, last, np.inf) / np.where(ahead, square_low, 1.0)
        normal = np.where(all_hit, 1.0, unit_vectors(absolute_slopes(self.discriminant)))
        normal = np.where((power_low < 0.0) & (power_high >= 0.0), TIME_NORMAL, normal)
        wide = np.maximum(apparent_size.min(axis=0), 0.5)
        turn = np.where(all_hit, 0.0, 0.5 / wide)
        return BoxCoverage(may_hit, all_hit, near, far, normal, apparent_size, turn)

    def intervals(self, lattice: Lattice) -> tuple[Array, Array]:
        """See `LineForms.intervals`."""
        first, last = self._intervals_from_outside(lattice)
        # a moving solid may contain the camera for a part of the time
        low = self.power[0, 0].copy()
        if self.power.shape[0] > 1:
            low -= 0.5 * np.abs(self.power[1, 0])
        around = (low < 0.0).nonzero()[0]
        if around.size:
            self.take(around, around)._extend_inside(lattice, first, last)
        return first, last

    def _intervals_from_outside(self, lattice: Lattice) -> tuple[Array, Array]:
        """Intervals where the discriminant is >= 0 and the solid is ahead, from outside it."""
        shape = (lattice.rows, lattice.columns, self.rows.size)
        d = restrict_to_lines(self.discriminant, lattice)
        p = restrict_to_lines(self.center_dot, lattice)
        return cone_intervals(d, p, shape)

    def _extend_inside(self, lattice: Lattice, first: Array, last: Array) -> None:
        """Extend intervals by those in which the camera is inside the solid, in place.

        first, last : (rows, columns, m), whose columns are these candidates' `rows`.
        """
        rows = self.rows
        g = restrict_to_lines(self.power, lattice)
        shape = (lattice.rows, lattice.columns, rows.size)
        if len(g) == 1:
            inside = np.broadcast_to(g[0] < 0.0, shape)
            first[:, :, rows] = np.where(inside, -np.inf, first[:, :, rows])
            last[:, :, rows] = np.where(inside, np.inf, last[:, :, rows])
            return
        a, b, c = g[2], 0.5 * g[1], g[0]
        still = a <= 0.0
        root = np.sqrt(np.maximum(b * b - a * c, 0.0))
        safe = np.where(still, 1.0, a)
        enter = np.where(still, np.where(c < 0.0, -np.inf, np.inf), (-b - root) / safe)
        leave = np.where(still, np.where(c < 0.0, np.inf, -np.inf), (-b + root) / safe)
        held = np.broadcast_to(leave > enter, shape)
        low, high = self._part_ahead(lattice)
        first[:, :, rows] = np.where(held, np.minimum(low, enter), first[:, :, rows])
        last[:, :, rows] = np.where(held, np.maximum(high, leave), last[:, :, rows])

    def _part_ahead(self, lattice: Lattice) -> tuple[Array, Array]:
        """Parts along t of the intervals in which lines that enter the solid hit it ahead.

        They end where the center passes the camera; a line without such a part has (inf, -inf).
        """
        p0, p1 = restrict_to_lines(self.center_dot, lattice)
        d0, d1, d2 = restrict_to_lines(self.discriminant, lattice)
        half = -0.5 * d1
        lead = np.where(d2 < 0.0, d2, -TINY_COEFFICIENT)
        root = np.sqrt(np.maximum(half * half - lead * d0, 0.0))
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):  # zero p1 or d2: no end
            cut = -p0 / p1
            low, high = (half + root) / lead, (half - root) / lead
        low = np.where(p1 > 0.0, np.fmax(low, cut), low)
        high = np.where(p1 < 0.0, np.fmin(high, cut), high)
        ahead = (high > low) & ((p1 != 0.0) | (p0 > 0.0))
        return np.where(ahead, low, np.inf), np.where(ahead, high, -np.inf)

    def smooth_events(self) -> tuple[Mask, Mask]:
        """See `LineForms.smooth_events`.

        A solid is in `once` where its discriminant has simple roots in time for all rays: either a
        single one, or two where it is negative at both ends.
        """
        above, below = signs_at_time_ends(self.discriminant)
        ahead = signs_at_time_ends(self.center_dot)[0]
        plain = ahead[0] & ahead[1] & (polynomial_range(self.power)[0] > 0.0)
        # the discriminant is concave in t: positive at both ends it is so between, and it changes
        # sign once from negative to positive
        within = polynomial_range(value_at_time(self.discriminant, 0.0))[0] > 0.0
        turns = (above[0] & below[1]) | (below[0] & above[1]) | (below[0] & below[1] & within)
        return plain & above[0] & above[1], plain & turns

    def depth_polynomials(self) -> DepthPolynomials:
        """See `LineForms.depth_polynomials`."""
        return DepthPolynomials(
            self.center_dot, self.direction_square, self.discriminant, self.power
        )


def cone_intervals(
    d: Sequence[Array], p: Sequence[Array], shape: tuple[int, int, int]
) -> tuple[Array, Array]:
    """Intervals (rows, columns, m) of lines within one half of a cone of degree two.

    Parameters
    ----------
    d : coefficients along the lines of a discriminant, which is >= 0 in both halves.
    p : those of a function of degree one that is positive in the half that counts.
    shape : (rows, columns, m).
    """
    c = d[0]
    if len(d) == 1:
        ahead = np.broadcast_to((c >= 0.0) & (p[0] > 0.0), shape)
        return np.where(ahead, -np.inf, 0.0), np.where(ahead, np.inf, 0.0)
    b, a = 0.5 * d[1], np.where(d[2] == 0.0, -TINY_COEFFICIENT, d[2])
    square = b * b - a * c
    root = np.sqrt(np.maximum(square, 0.0))
    q = np.where(b < 0.0, root - b, -b - root)
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):  # see TINY_COEFFICIENT
        r0 = q / a
        r1 = np.where(q == 0.0, r0, c / q)
        first, last = np.minimum(r0, r1), np.maximum(r0, r1)
        middle = np.clip(-b / a, -0.5, 0.5)
    hollow = a > 0.0
    p1 = p[1] if len(p) > 1 else np.zeros(())
    keep = (square >= 0.0) & (p[0] + np.clip(middle, first, last) * p1 > 0.0) | hollow
    first, last = np.where(keep, first, 0.0), np.where(keep, last, 0.0)
    if hollow.any():
        # a branch of a hyperbola: the picture's plane cuts the cone on both sides
        right = hollow & (p1 > 0.0)
        first, last = (
            np.where(right, last, np.where(hollow, -np.inf, first)),
            np.where(right, np.inf, np.where(hollow, first, last)),
        )
    return first, last
