# SPDX-License-Identifier: GPL-3.0-or-later
"""Where boundaries of elliptic cones cross each other: conics that meet in up to four points.

Along the boundary r(phi) of one cone, the form (x.r / a)^2 + (y.r / b)^2 - (z.r)^2 of another one
is f = a0 + a1 cos(phi) + b1 sin(phi) + a2 cos(2 phi) + b2 sin(2 phi). It is 0 where the unit circle
meets a conic, and those points lie on two lines, by a degenerate conic of the pencil of both. Of up
to three such conics that is taken which is farthest from the others: where two crossings come close
to each other it is a simple root. Each line is cut with the circle, and Newton steps follow.

Both cones are given the same crossings, so that the boundary of a union closes. Which parts lie
inside is then told by signs between the crossings and not by their number. Crossings are missed, or
found twice, only where cones touch to `TANGENCY`, and there the parts are of no size.

Source: Richter-Gebert 2011, Perspectives on projective geometry, section 11.4.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.floats import TINY, UNIT_ROUNDOFF
from ..numerics.vector import dot
from .crossing_circles import from_minus_pi, gaps_of_rings, split_at_pi
from .elliptic_cones import EllipticCones, map_cones
from .spherical_curves import Intervals, complement_intervals

__all__ = ["cones_inside_each_other", "near_cone_pairs", "open_cones", "sinusoid_zeros"]


TANGENCY = 2.0**-30
"""Largest |f| at a crossing, as a fraction of the sum of its positive terms. Cones whose boundaries
come as near to each other, but cross nowhere, may count as touching there."""
COINCIDENT = 64.0 * UNIT_ROUNDOFF
"""The same, of all coefficients of f, for cones that coincide."""
NEAR_MARGIN = 2.0**-40
"""Cosine by which bounding circular cones may miss each other and still count as meeting."""
NEWTON_STEPS = 3
"""Number of Newton steps for a crossing. The lines leave the error of a root of a cubic."""
LARGEST_STEP = 0.25
"""Largest Newton step as a fraction of the distance to the next crossing, to which longer ones may
lead."""
CUBIC_STEPS = 2
"""Number of Newton steps for the root of the cubic."""
LARGEST_CUBIC_STEP = 0.1
"""Largest of these steps, where the largest coefficient of f is 1."""
THIRD = 2.0 * np.pi / 3.0


def open_cones(
    cones: EllipticCones, light: bool, center: Array, half: Array, spans: Intervals | None
) -> tuple[Ints, Array, Array]:
    """Parts of the boundaries of cones (k, n) that lie in no other cone, and on a light.

    Of cones that coincide, only the first has such parts.

    Parameters
    ----------
    light : whether the last cone is that of a light: the others count inside of it only.
    center, half : (j, k, n) rad, intervals that do not count.
    spans : (i, k, n) further such intervals within [-pi, pi], or None.

    Returns
    -------
    ring : (m,) indices k n + point of their cones, ascending.  low, high : (m,) radians.
    """
    k, n = cones.a.shape
    rings = np.arange(k * n)
    hidden, parts = _behind_other_cones(cones, light)
    low, high = from_minus_pi(center.ravel(), half.ravel())
    parts.append(split_at_pi(np.tile(rings, center.shape[0]), low, high))
    if spans is not None:
        parts.append((np.tile(rings, spans[0].shape[0]), spans[0].ravel(), spans[1].ravel()))
    ring, low, high = (np.concatenate(each) for each in zip(*parts, strict=True))
    # a boundary of no visible part needs no intervals, and empty intervals hide nothing
    kept = ((high > low) & ~hidden.ravel()[ring]).nonzero()[0]
    ring, low, high = gaps_of_rings(ring[kept], low[kept], high[kept], k * n)
    live = ((high > low) & ~hidden.ravel()[ring]).nonzero()[0]
    return ring[live], low[live], high[live]


def _behind_other_cones(
    cones: EllipticCones, light: bool
) -> tuple[Mask, list[tuple[Ints, Array, Array]]]:
    """Which boundaries (k, n) do not count, and intervals of them that do not.

    Returns
    -------
    hidden : (k, n) bool.  Lists of rings, and of intervals' starts and ends, as `open_cones`.
    """
    k, n = cones.a.shape
    first, second, point = near_cone_pairs(cones)
    ring, other = first * n + point, second * n + point
    behind, there = cones_inside_each_other(
        cones.take_pairs(first, point), cones.take_pairs(second, point)
    )
    hidden, parts = cones.empty, [_flat_intervals(other, there)]
    if light:
        on_light = second == k - 1
        lit = np.zeros(k * n, dtype=np.bool_)
        lit[ring[on_light]] = True
        lit[(k - 1) * n :] = True
        hidden |= ~lit.reshape(k, n)
        around = np.full(int(on_light.sum()), np.pi)
        inside = behind[0][:, on_light], behind[1][:, on_light]
        off = complement_intervals(-around, around, inside)
        parts.append(_flat_intervals(ring[on_light], off))
        ring, behind = ring[~on_light], (behind[0][:, ~on_light], behind[1][:, ~on_light])
    parts.append(_flat_intervals(ring, behind))
    return hidden, parts


def _flat_intervals(ring: Ints, spans: Intervals) -> tuple[Ints, Array, Array]:
    """Rings, starts and ends (j m,) of intervals (j, m) of rings (m,)."""
    return np.tile(ring, spans[0].shape[0]), spans[0].ravel(), spans[1].ravel()


def near_cone_pairs(cones: EllipticCones) -> tuple[Ints, Ints, Ints]:
    """Pairs of cones (k, n) of the same points whose bounding circular cones meet.

    Returns
    -------
    first, second, point : (m,) indices, `first` below `second`; ordered.
    """
    size = np.sqrt(1.0 + cones.a * cones.a)
    cosine, sine = 1.0 / size, cones.a / size
    k, n = cones.a.shape
    near: Mask = np.zeros((k, k, n), dtype=np.bool_)
    for i in range(k - 1):
        apart = dot(cones.z[:, i, None], cones.z[:, i + 1 :])
        least = cosine[i] * cosine[i + 1 :] - sine[i] * sine[i + 1 :]
        near[i, i + 1 :] = apart > least - NEAR_MARGIN
    live = ~cones.empty
    near &= live[:, None] & live
    first, second, point = near.nonzero()
    return first, second, point


def cones_inside_each_other(
    cones: EllipticCones, others: EllipticCones
) -> tuple[Intervals, Intervals]:
    """Where boundaries of cones (m,) run inside the others, and those of the others inside them.

    Of cones that coincide, the others' boundaries count as inside.

    Returns
    -------
    Intervals (5, m) each, within [-pi, pi], radians; of no length where there are fewer.
    """
    # along the smaller or thinner cone the form of the other one varies less
    swap = cones.a * cones.b > others.a * others.b
    small, large = (
        map_cones(lambda one, other: np.where(swap, one, other), *pair)
        for pair in ((others, cones), (cones, others))
    )
    terms = _forms_along(small, large)
    zeros, found = _crossings(terms)
    reverse = _forms_along(large, small)
    there, known = _on_the_other(terms, zeros, found)
    same = _coincide(terms, small.a / large.b)
    inside_large = _intervals_inside(terms, zeros, found, same, swap)
    inside_small = _intervals_inside(reverse, there, known, same, ~swap)
    low, high = (np.where(swap, *pair) for pair in zip(inside_small, inside_large, strict=True))
    back_low, back_high = (
        np.where(swap, *pair) for pair in zip(inside_large, inside_small, strict=True)
    )
    return (low, high), (back_low, back_high)


def _forms_along(curve: EllipticCones, cone: EllipticCones) -> Array:
    """Coefficients (3, 3, m) of x.r / a, y.r / b and z.r of cones along the boundaries r of others.

    The first axis counts these three, the second one the coefficients of 1, cos and sin.
    """
    apart = curve.z - cone.z  # perpendicular to x and y to the first order, without cancellation
    rows = [
        [dot(axis, base), curve.a * dot(axis, curve.x), curve.b * dot(axis, curve.y)]
        for axis, base in ((cone.x, apart), (cone.y, apart), (cone.z, curve.z))
    ]
    terms = np.array(rows)
    terms[0] /= cone.a
    terms[1] /= cone.b
    return terms


def _values(terms: Array, phi: Array) -> tuple[Array, Array, Array]:
    """Values x.r / a, y.r / b and z.r (..., m) at angles (..., m)."""
    c, s = np.cos(phi), np.sin(phi)
    x, y, z = (each[0] + each[1] * c + each[2] * s for each in terms)
    return x, y, z


def _coefficients(terms: Array) -> Array:
    """Coefficients a0, a1, b1, a2, b2 (5, m) of f."""
    total = np.zeros((5, terms.shape[2]))
    for (p, q, r), sign in zip(terms, (1.0, 1.0, -1.0), strict=True):
        total[0] += sign * (p * p + 0.5 * (q * q + r * r))
        total[1] += sign * (2.0 * p * q)
        total[2] += sign * (2.0 * p * r)
        total[3] += sign * (0.5 * (q - r) * (q + r))
        total[4] += sign * (q * r)
    return total


def _coincide(terms: Array, stretch: Array) -> Mask:
    """Whether f is 0 everywhere, to rounding: (m,).

    stretch : (m,) factor by which the rounding of the frames is larger in the terms.
    """
    scale = (1.0 + stretch) * (terms * terms).sum(axis=(0, 1))
    same: Mask = (np.abs(_coefficients(terms)) <= COINCIDENT * scale).all(axis=0)
    return same


def _crossings(terms: Array) -> tuple[Array, Mask]:
    """Angles (4, m) of the zeros of f, and which of them there are."""
    phi, found = sinusoid_zeros(_coefficients(terms))
    most = LARGEST_STEP * _gaps(phi, found)
    for _ in range(NEWTON_STEPS):
        value, slope, _ = _form(terms, phi)
        step = value / np.where(slope == 0.0, 1.0, slope)
        phi = phi - np.where(np.abs(step) < most, step, 0.0)
    value, _, scale = _form(terms, phi)
    phi = np.remainder(phi + np.pi, 2.0 * np.pi) - np.pi
    return phi, found & (np.abs(value) <= TANGENCY * scale)


def _gaps(phi: Array, found: Mask) -> Array:
    """Distances (4, m) in radians from angles to the nearest other one that is found."""
    least = np.full(phi.shape, np.pi)
    for shift in range(1, 4):
        apart = np.abs(np.remainder(phi - np.roll(phi, shift, axis=0) + np.pi, 2.0 * np.pi) - np.pi)
        np.minimum(least, apart, out=least, where=np.roll(found, shift, axis=0))
    return least


def _form(terms: Array, phi: Array) -> tuple[Array, Array, Array]:
    """f, its derivative, and the sum of its positive terms, (..., m) at angles (..., m)."""
    c, s = np.cos(phi), np.sin(phi)
    x, y, z = (each[0] + each[1] * c + each[2] * s for each in terms)
    dx, dy, dz = (each[2] * c - each[1] * s for each in terms)
    scale = x * x + y * y
    return (scale - z * z, 2.0 * (x * dx + y * dy - z * dz), scale)


def _on_the_other(terms: Array, phi: Array, found: Mask) -> tuple[Array, Mask]:
    """Angles (4, m) of crossings on the boundaries of the other cones, and which there are."""
    x, y, z = _values(terms, phi)
    return np.arctan2(y, x), found & (z > 0.0)


def _intervals_inside(
    terms: Array, zeros: Array, found: Mask, same: Mask, inside_if_same: Mask
) -> Intervals:
    """Intervals (5, m) in which f < 0 on the side of the cone's axis, between zeros (4, m)."""
    ends = np.full((6, same.size), np.pi)
    ends[0] = -np.pi
    ends[1:5] = np.sort(np.where(found, zeros, np.pi), axis=0)
    middle = 0.5 * (ends[:-1] + ends[1:])
    x, y, z = _values(terms, middle)
    inside = (x * x + y * y < z * z) & (z > 0.0)
    inside = np.where(same, inside_if_same, inside)
    return ends[:-1], np.where(inside, ends[1:], ends[:-1])


def sinusoid_zeros(coefficients: Array) -> tuple[Array, Mask]:
    """Zeros of a0 + a1 cos(phi) + b1 sin(phi) + a2 cos(2 phi) + b2 sin(2 phi).

    Parameters
    ----------
    coefficients : (5, m).

    Returns
    -------
    Angles (4, m) in radians, and which of them are zeros; none is refined.
    """
    scale = np.abs(coefficients).max(axis=0)
    a0, a1, b1, a2, b2 = coefficients / np.maximum(scale, TINY)
    p, q = 0.5 * a1, 0.5 * b1
    root = _pencil_root(a0, p, q, a2, b2)
    conic = ((a2 + root, b2, p), (b2, root - a2, q), (p, q, a0 - root))
    angles, found = [], []
    for line in _split_lines(conic):
        size = np.hypot(line[0], line[1])
        base = np.arctan2(line[1], line[0])
        square = (size - line[2]) * (size + line[2])
        half = np.arctan2(np.sqrt(np.maximum(square, 0.0)), -line[2])
        angles += [base - half, base + half]
        found += 2 * [(square >= 0.0) & (size > 0.0)]
    return np.array(angles), np.array(found)


def _pencil_root(a0: Array, p: Array, q: Array, a2: Array, b2: Array) -> Array:
    """Roots (m,) of l^3 - a0 l^2 - B l - C, for which G + l diag(1, 1, -1) is two lines.

    Where these are real, |l| <= hypot(a2, b2); of several such roots the best separated is taken.
    """
    rr = a2 * a2 + b2 * b2
    b = rr - p * p - q * q
    c = (p - q) * (p + q) * a2 + 2.0 * b2 * p * q - a0 * rr
    h = a0 / 3.0
    lin = -b - 3.0 * h * h
    const = -2.0 * h**3 - b * h - c
    disc = 0.25 * const * const + (lin / 3.0) ** 3
    sq = np.sqrt(np.maximum(disc, 0.0))
    u = np.cbrt(-0.5 * const - np.copysign(sq, const))
    one = u - lin / (3.0 * np.where(u == 0.0, 1.0, u))
    m = 2.0 * np.sqrt(np.maximum(-lin / 3.0, 0.0))
    cosine = -4.0 * const / np.maximum(m**3, TINY)
    turn = np.arccos(np.clip(cosine, -1.0, 1.0)) / 3.0
    roots = (
        np.array([np.where(disc > 0.0, one, m * np.cos(turn - i * THIRD)) for i in range(3)]) + h
    )
    for _ in range(CUBIC_STEPS):
        slope = (3.0 * roots - 2.0 * a0) * roots - b
        value = ((roots - a0) * roots - b) * roots - c
        step = value / np.where(slope == 0.0, 1.0, slope)
        roots = roots - np.where(np.abs(step) < LARGEST_CUBIC_STEP, step, 0.0)
    slope = np.abs((3.0 * roots - 2.0 * a0) * roots - b)
    real = roots * roots <= rr * (1.0 + TANGENCY)
    # without one that gives real lines the nearest to it
    rank = np.where(real, slope, -1.0 - (roots * roots - rr))
    best = rank.argmax(axis=0)
    root: Array = np.take_along_axis(roots, best[None], axis=0)[0]
    return root


def _split_lines(conic: tuple[tuple[Array, ...], ...]) -> tuple[Array, Array]:
    """Two lines (3, m), homogeneous, whose product is a degenerate conic."""
    matrix = np.array(conic)
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = matrix
    adjugate = np.array(
        [
            [yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy],
            [xz * yz - xy * zz, xx * zz - xz * xz, xy * xz - xx * yz],
            [xy * yz - xz * yy, xy * xz - xx * yz, xx * yy - xy * xy],
        ]
    )
    diagonal = np.array([adjugate[i, i] for i in range(3)])
    best, each = diagonal.argmin(axis=0), np.arange(xx.size)
    least = diagonal[best, each]
    scale = np.sqrt(np.maximum(-least, 0.0))
    point = adjugate[:, best, each] / np.where(scale > 0.0, scale, np.inf)
    matrix[0, 1] += point[2]
    matrix[0, 2] -= point[1]
    matrix[1, 0] -= point[2]
    matrix[1, 2] += point[0]
    matrix[2, 0] += point[1]
    matrix[2, 1] -= point[0]
    # a matrix of rank one: its largest element tells the row and the column
    largest = np.abs(matrix).reshape(9, -1).argmax(axis=0)
    row, column = largest // 3, largest % 3
    # of strided arrays, arctan2 depends in its last bit on where in memory its result comes to lie
    first, second = matrix[row, :, each].T, matrix[:, column, each]
    return np.ascontiguousarray(first), np.ascontiguousarray(second)
