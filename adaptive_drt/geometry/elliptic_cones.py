# SPDX-License-Identifier: GPL-3.0-or-later
"""Elliptic cones of directions: outlines of ellipsoids and flat ellipses, and integrals along them.

A cone of the principal frame x, y, z with half tangents a >= b is bounded by the directions of
    r(phi) = a cos(phi) x + b sin(phi) y + z,
so that a direction w lies in it where (x.w / a)^2 + (y.w / b)^2 < (z.w)^2 and z.w > 0. With
A = 1 + b^2 and B = a^2 - b^2, |r|^2 = A + B cos^2(phi), and the boundary integral of n.(w x dw)
along it, with w = r / |r|, is elementary: see `boundary_values`.

The ellipse C + U cos(phi) + V sin(phi) has the dual form P = U U^T + V V^T - C C^T, of which z is
the only eigenvector with a negative eigenvalue. It is refined in vectors and not in the matrix, so
that neither narrow nor wide cones lose their half tangents. The outline of an ellipsoid with half
axes h1, h2, h3 about v, seen from the origin, is such an ellipse: with y the position v in units of
these axes, C = v sqrt(1 - 1 / |y|^2), and U and V are images of unit vectors perpendicular to y.

Source: Lambert 1760 for the integral along a boundary; Richter-Gebert 2011, Perspectives on
projective geometry, chapters 9 to 11, for conics and their duals.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.floats import TINY, UNIT_ROUNDOFF
from ..numerics.gather import columns
from ..numerics.vector import cross, dot, perpendicular_pair
from .spherical_curves import Circles, GreatCircleArcs, HalfSpaces, Intervals

__all__ = [
    "ConeAntiderivative",
    "EllipticCones",
    "arcs_inside_elliptic_cones",
    "cone_antiderivative",
    "cone_boundary_values",
    "cone_heights",
    "cones_of_circles",
    "cones_of_ellipses",
    "ellipsoid_outline",
    "elliptic_cones_outside_half_spaces",
    "map_cones",
    "unit_ball_position",
    "whole_cone_factor",
]


EDGE_ON = 16.0 * UNIT_ROUNDOFF
"""Volume of the unit vectors C, U, V up to which an ellipse counts as seen edge-on: rounding."""
NO_TANGENT = 2.0**-200
"""Half tangents of cones of no size, which are finite when squared and divided by."""
FRAME_STEPS = 2
"""Number of steps of a Rayleigh quotient iteration for a cone's axis. It converges cubically, from
what an eigenvalue of a matrix gives."""
ABOVE_ANY_HEIGHT = 4.0
"""Exceeds the height of every direction, so that a plane without a normal clips nothing."""


@dataclass(frozen=True)
class EllipticCones:
    """Elliptic cones of directions, half spaces at most.

    Attributes
    ----------
    x, y, z : (3, ...) right-handed orthonormal frames; z is the axis.
    a, b : (...) half tangents along x and y, a >= b > 0.
    """

    x: Array
    y: Array
    z: Array
    a: Array
    b: Array

    @property
    def empty(self) -> Mask:
        """Whether cones (...) have no size, as those of ellipses that are seen edge-on."""
        none: Mask = self.b <= NO_TANGENT
        return none

    def take(self, index: Ints | slice) -> EllipticCones:
        """Some of the points' cones, by the last axis."""
        return map_cones(lambda each: columns(each, index, -1), self)

    def take_pairs(self, index: Ints, point: Ints) -> EllipticCones:
        """Cones (m,) of cones (k, n), given by their indices and those of their points."""
        ring = index * self.a.shape[-1] + point

        def taken(values: Array) -> Array:
            return columns(values.reshape(*values.shape[:-2], -1), ring, -1)

        return map_cones(taken, self)

    def joined(self, others: EllipticCones) -> EllipticCones:
        """These cones (k, n) and other ones (l, n) of the same points."""
        return map_cones(lambda own, more: np.concatenate([own, more], axis=-2), self, others)

    def directions(self, phi: Array) -> Array:
        """Vectors r(phi) (3, ...), of any length."""
        place: Array = (self.a * np.cos(phi)) * self.x + (self.b * np.sin(phi)) * self.y + self.z
        return place


def map_cones(function: Callable[..., Array], *cones: EllipticCones) -> EllipticCones:
    """Return the cones whose attributes are a function of the same attributes of others."""
    parts = [(each.x, each.y, each.z, each.a, each.b) for each in cones]
    x, y, z, a, b = (function(*each) for each in zip(*parts, strict=True))
    return EllipticCones(x, y, z, a, b)


def cones_of_circles(circles: Circles) -> EllipticCones:
    """Circular cones (k, n) as elliptic ones, with angles from the same side."""
    tangent = circles.sine / np.maximum(circles.cosine, TINY)
    return EllipticCones(circles.u, circles.w, circles.axis, tangent, tangent)


def ellipsoid_outline(v: Array, half_axes: Array) -> tuple[Array, Array, Array]:
    """Flat ellipses of the same outlines as ellipsoids: centres, and two half axes (3, ...).

    Parameters
    ----------
    v : (3, ...) metres from the points, which lie outside, to the centres.
    half_axes : (3, 3, ...) metres, of which the first axis counts components: conjugate half axes,
        images of perpendicular radii of the unit ball.

    Only directions count: the ellipses are not where the outlines touch the ellipsoids.
    """
    h = [half_axes[:, i] for i in range(3)]
    y = np.array(unit_ball_position(v, half_axes))
    size = np.sqrt(dot(y, y))
    e1, e2 = perpendicular_pair(y / np.maximum(size, TINY))
    scale = np.sqrt(np.maximum((size - 1.0) * (size + 1.0), 0.0)) / np.maximum(size, TINY)
    u, w = (h[0] * e[0] + h[1] * e[1] + h[2] * e[2] for e in (e1, e2))
    return scale * v, u, w


def unit_ball_position(v: Array, half_axes: Array) -> Array:
    """Vectors (3, ...) in units of ellipsoids' half axes; parameters as `ellipsoid_outline`."""
    h1, h2, h3 = (half_axes[:, i] for i in range(3))
    volume = dot(h1, cross(h2, h3))
    faces = cross(h2, h3), cross(h3, h1), cross(h1, h2)
    position: Array = np.stack([dot(v, each) for each in faces]) / volume
    return position


def cones_of_ellipses(center: Array, half_u: Array, half_v: Array) -> EllipticCones:
    """Elliptic cones (...) of flat ellipses, seen from the origin.

    Parameters
    ----------
    center : (3, ...) metres.  half_u, half_v : (3, ...) metres, any two conjugate half axes.

    An ellipse that is seen edge-on has no cone: half tangents of 2^-200. Measured against 50
    digits: errors of the axis below 32 u rad, of a below 32 u (1 + a) a, and of b a / b times as
    much, since rounded half axes of a narrow ellipse turn its plane.
    """
    volume = dot(center, cross(half_u, half_v))
    sizes = [np.maximum(np.sqrt(dot(each, each)), TINY) for each in (center, half_u, half_v)]
    edge_on = np.abs(volume) <= EDGE_ON * sizes[0] * sizes[1] * sizes[2]
    most = np.maximum(np.maximum(sizes[0], sizes[1]), sizes[2])
    c, u, v = (each / most for each in (center, half_u, half_v))
    volume = volume / most / most / most
    z = _negative_axis(c, u, v)
    for _ in range(FRAME_STEPS):
        x, y = perpendicular_pair(z)
        xx, xy, yy, xz, yz, zz = _dual_form(c, u, v, x, y, z)
        # (S - zz) d = -(xz, yz), with S the part of P across the axis
        xx, yy = xx - zz, yy - zz
        det = xx * yy - xy * xy
        det = np.where(det == 0.0, 1.0, det)
        z = z + ((xy * yz - yy * xz) / det) * x + ((xy * xz - xx * yz) / det) * y
        z /= np.sqrt(dot(z, z))
    z = np.where(dot(z, c) < 0.0, -z, z)
    x, y = perpendicular_pair(z)
    xx, xy, yy, _, _, zz = _dual_form(c, u, v, x, y, z)
    turn = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    x = np.cos(turn) * x + np.sin(turn) * y
    depth = np.maximum(-zz, TINY)
    large = np.maximum(0.5 * (xx + yy + np.hypot(xx - yy, 2.0 * xy)), TINY)
    a = np.sqrt(large / depth)
    # the product of the eigenvalues is the negative square of the volume
    b = np.minimum(np.abs(volume) / (depth * np.sqrt(large)), a)
    a, b = (np.where(edge_on, NO_TANGENT, np.maximum(each, NO_TANGENT)) for each in (a, b))
    return EllipticCones(x, cross(z, x), z, a, b)


def _negative_axis(c: Array, u: Array, v: Array) -> Array:
    """Unit eigenvectors (3, ...) of U U^T + V V^T - C C^T with negative eigenvalues."""
    form = np.empty((*c.shape[1:], 3, 3))
    for i in range(3):
        for j in range(i + 1):
            form[..., i, j] = u[i] * u[j] + v[i] * v[j] - c[i] * c[j]
            form[..., j, i] = form[..., i, j]
    axis: Array = np.linalg.eigh(form)[1][..., 0]
    return np.ascontiguousarray(np.moveaxis(axis, -1, 0))


def _dual_form(c: Array, u: Array, v: Array, x: Array, y: Array, z: Array) -> tuple[Array, ...]:
    """Elements xx, xy, yy, xz, yz, zz (...) of U U^T + V V^T - C C^T in a frame."""
    rows = [[dot(axis, each) for each in (u, v, c)] for axis in (x, y, z)]

    def element(i: int, j: int) -> Array:
        one, other = rows[i], rows[j]
        value: Array = one[0] * other[0] + one[1] * other[1] - one[2] * other[2]
        return value

    return tuple(element(*at) for at in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)))


def cone_heights(normal: Array, cones: EllipticCones) -> tuple[Array, Array]:
    """Least and greatest n.r (...) of the boundaries r of cones, for vectors n (3, ...)."""
    height = dot(normal, cones.z)
    width = np.hypot(cones.a * dot(normal, cones.x), cones.b * dot(normal, cones.y))
    return height - width, height + width


def whole_cone_factor(normal: Array, cones: EllipticCones) -> Array:
    """Integral of n.w over cones (...) that are wholly above the horizon, in sr."""
    sines = cones.a * cones.b / np.sqrt((1.0 + cones.a**2) * (1.0 + cones.b**2))
    factor: Array = np.pi * dot(normal, cones.z) * sines
    return factor


@dataclass(frozen=True)
class ConeAntiderivative:
    """What `cone_boundary_values` needs of cones (...) and of a centre c.

    a, b : (...) half tangents.  n, m : (3, ...) components of n and n x c in the cones' frames.
    """

    a: Array
    b: Array
    n: Array
    m: Array

    def take(self, ring: Ints) -> ConeAntiderivative:
        """Those of some of the cones, numbered through all of them."""
        n, m = (columns(each.reshape(3, -1), ring) for each in (self.n, self.m))
        return ConeAntiderivative(self.a.ravel()[ring], self.b.ravel()[ring], n, m)


def cone_antiderivative(normal: Array, center: Array, cones: EllipticCones) -> ConeAntiderivative:
    """Return the antiderivative along cones (k, n) about a centre, for `cone_boundary_values`.

    normal, center : (3, n) unit vectors n and c.
    """
    frame = cones.x, cones.y, cones.z
    lever = cross(normal, center)[:, None]
    return ConeAntiderivative(
        cones.a,
        cones.b,
        np.array([dot(normal[:, None], axis) for axis in frame]),
        np.array([dot(lever, axis) for axis in frame]),
    )


def cone_boundary_values(potential: ConeAntiderivative, phi: Array) -> Array:
    """Antiderivatives (...) of n.((w - c) x dw) at angles phi, as `spherical_curves` has them.

    With s, c = sin, cos(phi), k = sqrt(B), |r| = sqrt(A + B c^2) and g = sqrt(A / (A + B)),
        n.(w x dw) = -b n1 asinh(k s / |r|) / (k sqrt(A + B)) + a n2 atan(k c / sqrt(A)) /
                     (k sqrt(A)) + a b n3 (phi + atan2((g - 1) s c, c^2 + g s^2)) / sqrt(A (A + B)),
    and -(n x c).w is added. Error: some 16 u (1 + phi).
    """
    a, b = potential.a, potential.b
    s, c = np.sin(phi), np.cos(phi)
    big_a, big_b = 1.0 + b * b, (a - b) * (a + b)
    both = 1.0 + a * a
    length = np.sqrt(big_a + big_b * (c * c))
    k = np.sqrt(big_b)
    along = s * _ratio(k * s / length, np.arcsinh) / length / np.sqrt(both)
    across = c * _ratio(k * c / np.sqrt(big_a), np.arctan) / big_a
    g = np.sqrt(big_a / both)
    # g - 1 without cancellation
    less = -big_b / (both * (1.0 + g))
    turn = (phi + np.arctan2(less * (s * c), c * c + g * (s * s))) / np.sqrt(big_a * both)
    n, m = potential.n, potential.m
    value: Array = a * n[1] * across - b * n[0] * along + a * b * n[2] * turn
    value -= (a * c * m[0] + b * s * m[1] + m[2]) / length
    return value


def _ratio(x: Array, function: np.ufunc) -> Array:
    """f(x) / x of odd functions f with slope 1 at 0, where it is 1."""
    small = np.abs(x) < TINY
    safe = np.where(small, 1.0, x)
    ratio: Array = np.where(small, 1.0, function(safe) / safe)
    return ratio


def arcs_inside_elliptic_cones(segments: GreatCircleArcs, cones: EllipticCones) -> Intervals:
    """Return where great-circle arcs run inside cones: one interval (k, j, n) each, maybe empty.

    The ends are not clipped to the arcs. As in `arcs_inside_cones` no interval wraps around: half
    an arc and half a chord of a cone are less than 90 degrees each.
    """
    x, y, z = (each[:, :, None] for each in (cones.x, cones.y, cones.z))
    a, b = cones.a[:, None], cones.b[:, None]
    normal = segments.planes.normal[:, None]
    nx, ny, nz = (dot(normal, axis) for axis in (x, y, z))
    width = np.hypot(a * nx, b * ny)
    q = np.sqrt(np.maximum((width - np.abs(nz)) * (width + np.abs(nz)), 0.0))
    middle, along = segments.middle[:, None], segments.along[:, None]
    mx, my, mz = (dot(middle, axis) for axis in (x, y, z))
    lx, ly, lz = (dot(along, axis) for axis in (x, y, z))
    # the form in cos and sin of phi: mm cos^2 + 2 ml cos sin + ll sin^2 < 0 inside, times (a b)^2
    ab = a * b
    mm = (b * mx) ** 2 + (a * my) ** 2 - (ab * mz) ** 2
    ll = (b * lx) ** 2 + (a * ly) ** 2 - (ab * lz) ** 2
    ml = b * b * mx * lx + a * a * my * ly - ab * ab * mz * lz
    center = 0.5 * np.arctan2(-2.0 * ml, ll - mm)
    half = 0.5 * np.arctan2(2.0 * ab * q, mm + ll)
    behind = mz * np.cos(center) + lz * np.sin(center) < 0.0
    center = np.where(behind, center - np.copysign(np.pi, center), center)
    half = np.where((q > 0.0) & ~cones.empty[:, None], half, 0.0)
    return center - half, center + half


def elliptic_cones_outside_half_spaces(cones: EllipticCones, planes: HalfSpaces) -> Intervals:
    """Where the boundaries of cones run outside half-spaces: centres and half widths (j, k, n)."""
    x, y, z = (each[:, None] for each in (cones.x, cones.y, cones.z))
    normal = planes.normal[:, :, None]
    height, p, q = dot(normal, z), cones.a * dot(normal, x), cones.b * dot(normal, y)
    nothing = dot(planes.normal, planes.normal) == 0.0
    if nothing.any():
        height = height + ABOVE_ANY_HEIGHT * nothing[:, None]
    width = np.hypot(p, q)
    root = np.sqrt(np.maximum((width - height) * (width + height), 0.0))
    center = np.arctan2(-q, -p)
    if nothing.any():
        center[np.broadcast_to(nothing[:, None], center.shape)] = -np.pi  # splits no interval
    return center, np.arctan2(root, height)
