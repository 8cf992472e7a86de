# SPDX-License-Identifier: GPL-3.0-or-later
"""Radiance that depends on the angle from an axis, as that of a spot light, and its integrals.

Seen from a point, such a light has the radiance L f(c) in the direction w, with c = z.w and z
against the direction in which the light shines. The integral of f(c) n.w over a region of
directions is, by Stokes' theorem, the sum along its boundary, anticlockwise, of

    (n.z) G(c) / (1 - c^2)  z.(w x dw)  +  F(c) (n x z).dw,    F' = f,  G' = -c f,

since d(G dpsi) = f c dA for the angle psi about z, and d(F m.dw) = f (z x m).w dA with m = n x z.
The constants of F and G are free as long as the region does not hold the axis z; if it does,
G(1) = 0, and G / (1 - c^2) stays finite there.

To keep the digits of small regions, f is split into its value at their middle, whose integral has
a closed form, and the rest, which is integrated by Gauss-Legendre quadrature along the arcs. The
rest is piecewise a cubic of c, so the arcs are cut where they cross the cones between the pieces.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.vector import cross, dot
from .spherical_curves import Circles, GreatCircleArcs, Intervals

__all__ = ["AxialProfile", "ProfileAtPoints"]


UNIFORM_TOLERANCE = 2.0**-44
"""Largest change of a profile over a light, as a fraction of its radiance, that counts as none."""
AXIS_RATIO = 4.0
"""Angle between the axis of the profile and the middle of the light, in half angles of the light,
from which the integrand may have its singularity at the axis: it is so smooth within the light."""
PIECES = 3
"""Number of equal pieces into which each smooth part of an arc is cut."""
NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)  # type: ignore[no-untyped-call]
"""Rule for each piece. A whole turn is cut at two places at least, or in three pieces: a piece has
120 degrees at most, over which trigonometric polynomials of degree 6 are integrated to 1e-7 of
their sixth harmonics, which are small: see `tests/geometry/test_axial_profile.py`."""


@dataclass(frozen=True)
class AxialProfile:
    """Radiance of a spot light: 0 outside of a cone, 1 inside another one, a smoothstep between.

    Attributes
    ----------
    axis : (3, 1) unit vector z, against the direction in which the light shines.
    outer, inner : cosines of the half angles of both cones, outer < inner.
    peaked : whether the radiance is not smooth at the axis.
    """

    axis: Array
    outer: float
    inner: float
    peaked: ClassVar[bool] = False

    @property
    def stretch(self) -> float:
        """By how much the angles that the profile depends on may exceed those of directions."""
        return 1.0

    def cosine_along(self, vector: Array) -> Array:
        """Length of vectors (3, ...) times the cosine that the profile depends on: (...)."""
        cosine: Array = dot(self.axis.reshape((3,) + (1,) * (vector.ndim - 1)), vector)
        return cosine

    def value(self, cosine: Array) -> Array:
        """Relative radiance (...), from 0 to 1, at cosines (...) of the angle from the axis."""
        x = np.clip((cosine - self.outer) / (self.inner - self.outer), 0.0, 1.0)
        value: Array = x * x * (3.0 - 2.0 * x)
        return value

    def integrals(self, cosine: Array) -> tuple[Array, Array]:
        """Integrals (...) of f and of f c over the cosine c, from `outer` on."""
        width = self.inner - self.outer
        x = np.clip((cosine - self.outer) / width, 0.0, 1.0)
        cube = x * x * x
        plain, first = cube * (1.0 - 0.5 * x), cube * x * (0.75 - 0.4 * x)
        over = np.maximum(cosine - self.inner, 0.0)
        return (
            width * plain + over,
            width * (self.outer * plain + width * first) + over * (self.inner + 0.5 * over),
        )

    def range(self, cosine: Array, half: Array) -> tuple[Array, Array]:
        """Least and largest relative radiance (n,) over cones of directions.

        cosine : (n,) between the axis and the cones' axes.  half : (n,) half angles of the cones.
        """
        angle = np.arccos(np.clip(cosine, -1.0, 1.0))
        low = self.value(np.cos(np.minimum(angle + half, np.pi)))
        return low, self.value(np.cos(np.maximum(angle - half, 0.0)))

    def at(self, axis: Array, half: Array) -> tuple[Array, Mask]:
        """Relative radiance (n,) in the middle of round lights, and where it varies over them.

        axis : (3, n) unit vectors to their middles.  half : (n,) radians, their half angles.
        """
        cosine = self.cosine_along(axis)
        low, high = self.range(cosine, self.stretch * half)
        return self.value(cosine), high - low > UNIFORM_TOLERANCE


@dataclass(frozen=True)
class ProfileAtPoints:
    """A profile over round lights as n points see them.

    Attributes
    ----------
    profile : of all of them.
    normal : (3, n) unit normals at the points.
    middle, level : (n,) cosines between the axis and the lights' middles, and f there.
    base : (n,) cosine at which G is 0.
    plain_middle, first_base : (n,) integral of f at the middle, and of f c at the base.
    """

    profile: AxialProfile
    normal: Array
    middle: Array
    level: Array
    base: Array
    plain_middle: Array
    first_base: Array

    @classmethod
    def make(
        cls, profile: AxialProfile, axis: Array, half: Array, normal: Array
    ) -> ProfileAtPoints:
        """Return the profile as seen from n points; parameters as for `AxialProfile.at`."""
        middle = dot(profile.axis, axis)
        aside = np.sqrt(np.maximum(1.0 - middle * middle, 0.0))
        holds_axis = (middle > 0.0) & (np.arctan2(aside, middle) < AXIS_RATIO * half)
        base = np.where(holds_axis, 1.0, middle)
        ends = profile.integrals(middle)[0], profile.integrals(base)[1]
        return cls(profile, normal, middle, profile.value(middle), base, *ends)

    def take(self, rows: slice | Ints) -> ProfileAtPoints:
        """Return the profile as some of the points see it."""
        own = (self.middle, self.level, self.base, self.plain_middle, self.first_base)
        parts = (each[rows] for each in own)
        return ProfileAtPoints(self.profile, columns(self.normal, rows), *parts)

    def integral_along(self, curve: Circles | GreatCircleArcs, spans: Intervals) -> Array:
        """Sum (n,) of the boundary integrals of f - `level` along intervals of curves (k, n).

        spans : (j, k, n) each, radians.
        """
        low, high = np.broadcast_arrays(*spans)
        arc, k, point = (high > low).nonzero()
        low, high = low[arc, k, point], high[arc, k, point]
        origin, first, second = _frame(curve, k, point)
        z, n = self.profile.axis, columns(self.normal, point)
        part = self.take(point)
        total = np.zeros(point.size)
        constant, cosine, sine = (dot(z, each) for each in (origin, first, second))
        ends = self._cuts(low, high, (constant, cosine, sine))
        m, nz = cross(n, np.broadcast_to(z, n.shape)), dot(n, z)
        slopes = dot(m, first), dot(m, second)
        # z . (w x dw), of which the constant, cosine and sine follow from the frame
        turn = (
            dot(z, cross(first, second)),
            dot(z, cross(origin, second)),
            -dot(z, cross(origin, first)),
        )
        # most arcs are not cut: parts of no length are left out
        number, row = (ends[1:] > ends[:-1]).nonzero()
        start, step = ends[number, row], (ends[number + 1, row] - ends[number, row]) / PIECES
        terms = constant[row], cosine[row], sine[row]
        turn, slopes, nz = tuple(x[row] for x in turn), tuple(x[row] for x in slopes), nz[row]
        own = part.take(row)
        for piece in range(PIECES):
            begin = start + piece * step
            for node, weight in zip(NODES, WEIGHTS, strict=True):
                phi = begin + (0.5 + 0.5 * node) * step
                a, b = np.cos(phi), np.sin(phi)
                f, g = own.antiderivatives(terms[0] + a * terms[1] + b * terms[2])
                ring = nz * g * (turn[0] + a * turn[1] + b * turn[2])
                value = ring + f * (a * slopes[1] - b * slopes[0])
                found = np.bincount(row, weights=0.5 * weight * step * value, minlength=total.size)
                total += found
        sums: Array = np.zeros(self.level.size)
        sums += np.bincount(point, weights=total, minlength=self.level.size)
        return sums

    def _cuts(self, low: Array, high: Array, terms: tuple[Array, Array, Array]) -> Array:
        """Angles (6 or 7, m), in order, between which c = p + q cos phi + r sin phi is smooth in f.

        terms : p, q, r, (m,) each.
        """
        constant, cosine, sine = terms
        size, middle = np.hypot(cosine, sine), np.arctan2(sine, cosine)
        cuts = [low]
        for level in (self.profile.outer, self.profile.inner):
            share = (level - constant) / np.maximum(size, np.finfo(float).tiny)
            aside = np.arccos(np.clip(share, -1.0, 1.0))
            for angle in (middle - aside, middle + aside):
                turned = low + np.mod(angle - low, 2.0 * np.pi)
                cuts.append(np.minimum(turned, high))
        if self.profile.peaked:  # where the curve is nearest to the axis
            cuts.append(np.minimum(low + np.mod(middle - low, 2.0 * np.pi), high))
        cuts.append(high)
        return np.sort(np.array(cuts), axis=0)

    def antiderivatives(self, cosine: Array) -> tuple[Array, Array]:
        """F and G / (1 - c^2) of f - `level`, at cosines (..., n)."""
        plain, first = self.profile.integrals(cosine)
        f = plain - self.plain_middle - self.level * (cosine - self.middle)
        g = self.first_base - first - 0.5 * self.level * (self.base - cosine) * (self.base + cosine)
        square = (1.0 - cosine) * (1.0 + cosine)
        return f, g / np.maximum(square, UNIFORM_TOLERANCE**2)


def _frame(curve: Circles | GreatCircleArcs, k: Ints, point: Ints) -> tuple[Array, Array, Array]:
    """Vectors (3, m) of points o + u cos phi + v sin phi on curves, given by indices."""
    if isinstance(curve, Circles):
        part = curve.take_pairs(k, point)
        return part.cosine * part.axis, part.sine * part.u, part.sine * part.w
    first, second = curve.middle[:, k, point], curve.along[:, k, point]
    return np.zeros_like(first), first, second
