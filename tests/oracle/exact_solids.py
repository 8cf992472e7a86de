# SPDX-License-Identifier: GPL-3.0-or-later
"""Masks of ellipsoids, cylinders, cones and ellipses, decided by planes in extended precision.

Each of them is the convex hull of one or two affine images of a ball or a disk, so that how far it
reaches in a direction, its support, is a sum of square roots. Seen from a point, two convex bodies
share no direction exactly where a plane through the point has them on its two sides, and such a
plane may be moved until it touches the one that is simpler: a ray, a round cap or a polygon. Then
one angle is left, and the least support over it is the margin: no outline, no root of a quadric.

All arrays are (3, n) or (n,) np.longdouble; margins are in units of the solid's `size`.
"""

import numpy as np

from adaptive_drt.scene.description import Cylinder, Ellipse, Ellipsoid

from .exact_mask import PI, cross, dot, real, unit

__all__ = [
    "Solid",
    "covers_not_all",
    "lowest",
    "meets_cap",
    "meets_corners",
    "meets_ray",
    "size_of",
]

STEPS = 96
"""Angles at which the least support is looked for first."""
SECTIONS = 80
"""Golden sections of the bracket about it: to 1e-17 of it."""
GOLDEN = (np.sqrt(real(5)) - 1) / 2


class Solid:
    """A solid as points (3, n) outside see it, moving by a displacement or not."""

    def __init__(self, record, points, move=(0.0, 0.0, 0.0)):
        self.size = real(size_of(record))
        self.move = real(move).reshape(3, 1)
        self.parts = [
            (real(center).reshape(3, 1) - points, [real(axis).reshape(3, 1) for axis in axes])
            for center, axes in parts_of(record)
        ]

    def support(self, n):
        """Largest n.x (n,) of the solid over its path, of its size."""
        most = [
            dot(n, center) + np.sqrt(sum(dot(n, axis) ** 2 for axis in axes))
            for center, axes in self.parts
        ]
        return (np.max(most, axis=0) + np.abs(dot(n, self.move)) / 2) / self.size


def parts_of(record):
    """Centres and half axes of the balls and disks of which a solid is the hull."""
    if isinstance(record, Ellipsoid):
        return [(record.center, (record.half_u, record.half_v, record.half_w))]
    if isinstance(record, Ellipse):
        return [(record.center, (record.half_u, record.half_v))]
    assert isinstance(record, Cylinder)
    u, v = _frame(real(record.end).reshape(3, 1) - real(record.start).reshape(3, 1))
    ends = zip((record.start, record.end), record.radii, strict=True)
    return [(end, (real(r) * u, real(r) * v)) for end, r in ends]


def size_of(record):
    """The smallest half axis, or the larger radius, metres."""
    if isinstance(record, Cylinder):
        return max(record.radii)
    axes = parts_of(record)[0][1]
    return float(np.linalg.svd(np.array(axes, dtype=float), compute_uv=False)[-1])


def lowest(record, direction):
    """The least of direction.x over a solid."""
    return -Solid(record, np.zeros((3, 1))).support(-real(direction).reshape(3, 1))[0] * size_of(
        record
    )


def _frame(axis):
    """Unit vectors (3, n) at right angles to an axis and to each other."""
    axis = unit(axis)
    other = np.where(np.abs(axis) == np.abs(axis).min(axis=0), real(1), real(0))
    u = unit(cross(axis, other))
    return u, cross(axis, u)


def _least(support, low, high):
    """Least of a function of angles (n,) between two bounds: sampled, then by golden sections."""
    shares = np.linspace(0, 1, STEPS + 1, dtype=np.longdouble)
    values = np.array([support(low + s * (high - low)) for s in shares])
    at = values.argmin(axis=0)
    a, b = (low + shares[np.clip(at + k, 0, STEPS)] * (high - low) for k in (-1, 1))
    p, q = b - GOLDEN * (b - a), a + GOLDEN * (b - a)
    left, right = support(p), support(q)
    for _ in range(SECTIONS):
        lower = left < right
        a, b = np.where(lower, a, p), np.where(lower, q, b)
        new = np.where(lower, b - GOLDEN * (b - a), a + GOLDEN * (b - a))
        value = support(new)
        p, q, left, right = (
            np.where(lower, new, q),
            np.where(lower, p, new),
            np.where(lower, value, right),
            np.where(lower, left, value),
        )
    return np.min([values.min(axis=0), left, right], axis=0)


def _about(solid, along, u, v):
    """Least support over the planes whose normals are `along` + cos u + sin v."""
    nil = 0 * dot(u, u)
    return _least(lambda t: solid.support(along + np.cos(t) * u + np.sin(t) * v), nil, nil + 2 * PI)


def meets_ray(solid, way):
    """Margin (n,) by which half-lines from the points meet a solid on one side of the horizon."""
    return _about(solid, 0 * way, *_frame(way))


def meets_cap(solid, cap):
    """Margin by which a solid and a round cap share some of the sphere."""
    u, v = _frame(cap.axis)
    s, c = np.sin(cap.half), np.cos(cap.half)
    return _about(solid, s * unit(cap.axis), c * u, c * v)


def _sides(corners):
    """Unit normals (3, n) of a polygon's sides that point to its inside."""
    middle = sum(unit(c) for c in corners)
    sides = [unit(cross(a, b)) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)]
    return [n * np.sign(dot(n, middle)) for n in sides]


def meets_corners(solid, corners):
    """Margin by which a solid and a polygon with corners (k, 3, n) in order share some of it."""
    sides = _sides(corners)
    least = []
    for k in range(len(corners)):
        # planes through a corner that have the polygon on one side lie between its two sides
        a, b = sides[k - 1], sides[k]
        axis = unit(cross(a, b))
        across = cross(axis, a)
        turn = np.arctan2(dot(across, b), dot(a, b))
        least.append(
            _least(
                lambda t, a=a, across=across: solid.support(np.cos(t) * a + np.sin(t) * across),
                0 * turn,
                turn,
            )
        )
    return np.min(least, axis=0)


def covers_not_all(solid, light):
    """Margin by which some of a cap, or of a polygon (k, 3, n), lies outside a solid.

    Of a cap that the solid is not wholly before (it reaches behind the point) it is not said: NaN.
    """
    if isinstance(light, list):
        return np.max([-meets_ray(solid, corner) for corner in light], axis=0)
    u, v = _frame(light.axis)
    axis = unit(light.axis)
    s, c = np.sin(light.half), np.cos(light.half)
    margin = -_about(solid, -s * axis, c * u, c * v)
    return np.where(solid.support(-axis) < 0, margin, np.nan)
