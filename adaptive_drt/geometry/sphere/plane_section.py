# SPDX-License-Identifier: GPL-3.0-or-later
"""Spheres that the plane of a light cuts, as polygons in that plane."""

from __future__ import annotations

import numpy as np

from ...numerics.arrays import Array
from ...numerics.floats import TINY
from ...numerics.vector import cross, dot
from ..light_plane import LightPlane

__all__ = ["clipped_sphere_polygons"]


UNBOUNDED_CUTOFF = 2.0
"""Distance from the centre of the circle in which sphere and plane intersect at which an unbounded
occluded part of the plane is cut off: this many times the distance to the far side of the light,
plus the circle's radius."""
SYMMETRY_TOLERANCE = 2.0**-20
"""Distance between the projections of a sphere's centre and of the point onto the light's plane, as
a fraction of the point's distance from the plane, up to which the image counts as rotationally
symmetric."""


def clipped_sphere_polygons(plane: LightPlane, v: Array, radius: Array, corners: int) -> Array:
    """Return the parts of a light's plane that clipped spheres occlude: (m, corners, 3, n) metres.

    Parameters
    ----------
    v : (m, 3, n) centres from the points.
    radius : (m, n), larger than the centres' distances from the plane.
    corners : number of corners of the polygons. Their areas are corrected to those of the smooth
        shapes, so the error that is left is of fourth order in 1 / corners.

    The part of a ball in front of the plane is convex, and so is its projection onto the plane from
    the point. In each direction from the centre of the circle in which ball and plane intersect,
    the projection ends on the circle or, farther out, where the ray from the point is tangent to
    the ball.
    """
    m, _, n = v.shape
    out = np.empty((m, corners, 3, n))
    normal = plane.normal
    for i in range(m):
        height = plane.height_of(v[i])
        foot = v[i] - height * normal
        disk = np.sqrt(np.maximum(radius[i] ** 2 - height * height, 0.0))
        first = _symmetry_axis(plane, foot)
        second = cross(normal, first)
        away = foot - plane.point
        limit = UNBOUNDED_CUTOFF * (np.sqrt(dot(away, away)) + plane.radius) + disk
        for k in range(corners):
            turn = 2.0 * np.pi * (k + 0.5) / corners
            u = np.cos(turn) * first + np.sin(turn) * second
            far = np.maximum(disk, _blocked_distance(foot, u, v[i], radius[i], limit))
            grown = far * (1.0 + np.pi**2 / (3.0 * corners**2))
            out[i, k] = foot + grown * u
    return out


def _symmetry_axis(plane: LightPlane, foot: Array) -> Array:
    """Unit vectors (3, n) in a light's plane along which the projections of spheres are symmetric.

    They point from the projection of the points to that of the spheres' centres, so that the
    polygon does not depend on the scene's orientation. For a sphere straight ahead any direction
    will do.
    """
    normal = plane.normal
    own = normal * dot(normal, plane.point)
    aside = foot - own
    size = np.sqrt(dot(aside, aside))
    low = np.abs(normal[0]) < 0.5
    helper = np.stack([np.where(low, 1.0, 0.0), np.where(low, 0.0, 1.0), np.zeros_like(size)])
    other = cross(normal, helper)
    other = other / np.sqrt(dot(other, other))
    off = size > SYMMETRY_TOLERANCE * np.sqrt(dot(own, own))
    symmetry: Array = np.where(off, aside, other) / np.where(off, np.maximum(size, TINY), 1.0)
    return symmetry


def _blocked_distance(foot: Array, u: Array, v: Array, r: Array, limit: Array) -> Array:
    """Distance (n,) from `foot` along unit u up to which a sphere blocks rays from the point.

    The discriminant r^2 w.w - |w x v|^2 of w = foot + s u is a quadratic in s, not negative at 0.
    The result is 0 where the tangent ray touches the sphere behind the plane, and at most `limit`.
    """
    side, base = cross(u, v), cross(foot, v)
    a = r * r - dot(side, side)
    b = r * r * dot(foot, u) - dot(base, side)
    c = np.maximum(r * r * dot(foot, foot) - dot(base, base), 0.0)
    root = np.sqrt(np.maximum(b * b - a * c, 0.0))
    # the greater root, without cancellation; there is none where the image is unbounded
    with np.errstate(over="ignore"):  # an image that ends far away is cut off in any case
        far, near = -(b + root) / np.where(a < 0.0, a, -1.0), c / np.maximum(root - b, TINY)
    s = np.where(b > 0.0, far, near)
    endless = (a >= 0.0) & (b >= 0.0)
    s = np.minimum(np.where(endless, limit, s), limit)
    w = foot + s * u
    before = dot(w, v) < dot(w, w)
    return np.where(before, s, 0.0)
