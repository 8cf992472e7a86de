# SPDX-License-Identifier: GPL-3.0-or-later
"""Masks decided by angles in extended precision (np.longdouble): no sampling, no discriminant.

Seen from a point, a sphere is a round cap and a parallelogram a convex polygon on the unit sphere,
its sides great circles; so is a pixel, seen from the eye. Whether two such figures meet, or one
holds the other, is decided by their angles. Each answer is the margin, in radians, by which it
holds: positive "for sure", negative "not at all", near zero a tangency.

All arrays are (3, n) or (n,) np.longdouble.
"""

import numpy as np

Real = np.longdouble
PI = Real("3.14159265358979323846264338327950288")

__all__ = [
    "PI",
    "Cap",
    "angle",
    "cap_of",
    "directions",
    "floor_points",
    "hides_some",
    "leaves_some",
    "meets",
    "pixel_corners",
    "real",
    "sphere_hits",
    "sweep",
]


def real(values):
    """Extended precision of what is written in double."""
    return np.asarray(values, dtype=Real)


def dot(a, b):
    return (a * b).sum(axis=0)


def cross(a, b):
    return np.stack(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def norm(a):
    return np.sqrt(dot(a, a))


def unit(a):
    return a / norm(a)


def angle(a, b):
    """Angle between vectors, exact for small and for straight ones."""
    return np.arctan2(norm(cross(a, b)), dot(a, b))


class Cap:
    """A round cap: its axis (3, n) and half angle (n,)."""

    def __init__(self, axis, half):
        self.axis, self.half = axis, half


def cap_of(points, center, radius):
    """A sphere as points outside it see it."""
    v = real(center).reshape(3, 1) - points
    r = real(radius)
    return Cap(v, np.arctan2(r, np.sqrt(np.maximum(dot(v, v) - r * r, 0))))


def _to_edges(axis, corners):
    """Least angle (n,) from axes to the outline of a polygon with corners (k, 3, n) in order."""
    least = np.full(axis.shape[1], PI)
    for k in range(len(corners)):
        a, b = corners[k], corners[(k + 1) % len(corners)]
        plane = cross(a, b)
        foot = axis - plane * (dot(axis, plane) / dot(plane, plane))
        between = (dot(cross(a, foot), plane) > 0) & (dot(cross(foot, b), plane) > 0)
        straight = np.arctan2(np.abs(dot(axis, plane)), norm(cross(axis, plane)))
        ends = np.minimum(angle(axis, a), angle(axis, b))
        least = np.minimum(least, np.where(between, np.minimum(straight, ends), ends))
    return least


def _inside(axis, corners):
    """Whether axes (3, n) point into a polygon, whichever way round its corners go."""
    middle = sum(unit(c) for c in corners)
    within = np.ones(axis.shape[1], dtype=bool)
    for k in range(len(corners)):
        plane = cross(corners[k], corners[(k + 1) % len(corners)])
        within &= dot(axis, plane) * np.sign(dot(middle, plane)) > 0
    return within


def _nearest(cap, corners):
    """Signed angle from the cap's axis to a polygon: negative inside, the way out."""
    edge = _to_edges(cap.axis, corners)
    return np.where(_inside(cap.axis, corners), -edge, edge)


def meets(cap, corners):
    """Margin by which a cap and a polygon share some of the sphere."""
    return cap.half - _nearest(cap, corners)


def hides_some(cap, other):
    """Margin by which two caps share some of the sphere."""
    return cap.half + other.half - angle(cap.axis, other.axis)


def leaves_some(over, under):
    """Margin by which some of `under` lies outside `over`: cap over cap, over polygon, or under."""
    if isinstance(over, Cap) and isinstance(under, Cap):
        return angle(over.axis, under.axis) + under.half - over.half
    if isinstance(over, Cap):
        farthest = np.max([angle(over.axis, corner) for corner in under], axis=0)
        return farthest - over.half
    return under.half + _nearest(under, over)


def sphere_hits(eye, way, center, radius):
    """Where rays first meet a sphere from outside: points and normals (3, n).

    The third result is the angle (n,) by which they miss it, negative where they meet it.
    """
    v, r = real(center).reshape(3, 1) - eye, real(radius)
    cap = cap_of(eye + 0 * way, center, radius)
    w = unit(way)
    along = dot(w, v)
    foot = w * along - v
    depth = along - np.sqrt(np.maximum(r * r - dot(foot, foot), 0))
    point = eye + w * depth
    return point, unit(point - real(center).reshape(3, 1)), angle(w, v + 0 * w) - cap.half


def sweep(start, move, radius, way):
    """Margin, of the radius, by which a sphere somewhere on its path meets half-lines.

    Parameters
    ----------
    start : (3, n) its centre in the middle of the path, from the origins of the half-lines.
    move : its displacement.  way : (3, n) the half-lines' directions.
    """
    d, r = real(move).reshape(3, 1), real(radius)
    p, w = start - d / 2, unit(way)
    # least over s in [0, 1] of the distance of p + s d from the line of w
    across_p, across_d = p - w * dot(p, w), d - w * dot(d + 0 * w, w)
    square = dot(across_d, across_d)
    s = np.where(square > 0, -dot(across_p, across_d) / np.where(square > 0, square, 1), 0)
    s = np.clip(s, Real(0), Real(1))
    gap = norm(across_p + s * across_d)
    return np.where(dot(p + s * d, w) > 0, (r - gap) / r, Real(-1))


def _lens(camera):
    """Axes and the sizes of the picture's plane at depth 1, as Blender's camera has them."""
    rows = real(camera.matrix)[:3]
    x, y, z = (unit(rows[:, k].reshape(3, 1)) for k in range(3))
    width, height = camera.resolution
    pixel = real(camera.sensor_width) / (real(camera.focal_length) * Real(max(width, height)))
    return x, y, z, pixel


def directions(camera, columns, rows):
    """Directions (3, n) through picture coordinates (square pixels, no shift)."""
    x, y, z, pixel = _lens(camera)
    width, height = camera.resolution
    across = (real(columns) - Real(width) / 2) * pixel
    up = (real(rows) - Real(height) / 2) * pixel
    return x * across + y * up - z


def pixel_corners(camera, columns, rows):
    """The four corners of pixels whose lower left corners are given: (4, 3, n)."""
    columns, rows = real(columns), real(rows)
    return [directions(camera, columns + i, rows + j) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]


def floor_points(camera, way, height=0):
    """Where rays from the camera meet the plane z = height: (3, n), and their parameter (n,)."""
    eye = real(camera.matrix)[:3, 3].reshape(3, 1)
    t = (real(height) - eye[2]) / way[2]
    return eye + t * way, t
