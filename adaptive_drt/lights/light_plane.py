# SPDX-License-Identifier: GPL-3.0-or-later
"""Clipping of occluders at the plane of a light: only their parts in front of it block light."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array
from ..numerics.floats import TINY
from ..numerics.vector import cross, dot

__all__ = ["LightPlane", "clip_quads", "clipped_sphere_polygons"]


UNBOUNDED_CUTOFF = 2.0
"""Distance from the centre of the circle in which sphere and plane intersect at which an unbounded
occluded part of the plane is cut off: this many times the distance to the far side of the light,
plus the circle's radius."""


@dataclass(frozen=True)
class LightPlane:
    """The plane of a light, seen from n points; occluders behind it block none of its light.

    It is a quad light's own plane; for a disk, the disk's plane; for a sphere, the plane of the
    circle that is its silhouette.

    Attributes
    ----------
    normal : (3, n) unit vectors towards the front.
    point : (3, n) metres, a point of the plane relative to the points that see it.
    radius : (n,) metres, radius around `point` that contains the light.
    """

    normal: Array
    point: Array
    radius: Array

    def height_of(self, place: Array) -> Array:
        """Signed distance (metres) of positions (3, n) in front of the plane."""
        height: Array = dot(self.normal, place - self.point)
        return height


def clip_quads(plane: LightPlane, quads: Array) -> Array:
    """Clip quads (m, 4, 3, n) to the front of a light's plane.

    Returns
    -------
    (m, 5, 3, n), where polygons with fewer than 5 corners repeat the last one; or the quads as
    they are, (m, 4, 3, n), if none reaches behind the plane.
    """
    if not quads.shape[0]:
        return quads
    shift = dot(plane.normal, plane.point)
    heights = [dot(plane.normal[:, None], quads[:, k].swapaxes(0, 1)) - shift for k in range(4)]
    if min(float(h.min(initial=0.0)) for h in heights) >= 0.0:
        return quads
    return _clip(quads, np.stack(heights, axis=1))


def clipped_sphere_polygons(plane: LightPlane, v: Array, radius: Array, corners: int) -> Array:
    """Return the parts of a light's plane that clipped spheres occlude: (m, j, 3, n) metres.

    Parameters
    ----------
    v : (m, 3, n) centres from the points.
    radius : (m, n), larger than the centres' distances from the plane.
    corners : number j of corners of the polygons, whose area is that of the smooth shapes.

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


SYMMETRY_TOLERANCE = 2.0**-20
"""Distance between the projections of a sphere's centre and of the point onto the light's plane, as
a fraction of the point's distance from the plane, up to which the image counts as rotationally
symmetric."""


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


def _clip(quads: Array, heights: Array) -> Array:
    """Clip quads (m, 4, 3, n) where `heights` (m, 4, n) are negative (Sutherland and Hodgman)."""
    m, _, _, n = quads.shape
    out = np.zeros((m, 5, 3, n))
    used = np.zeros((m, n), dtype=np.int64)
    rows, columns = np.indices((m, n))
    for k in range(4):
        j = (k + 1) % 4
        h0, h1 = heights[:, k], heights[:, j]
        start, end = quads[:, k], quads[:, j]
        cut = (h0 >= 0.0) != (h1 >= 0.0)
        gap = np.where(cut, h0 - h1, 1.0)
        crossing = start + (h0 / gap)[:, None] * (end - start)
        for keep, corner in ((h0 >= 0.0, start), (cut, crossing)):
            i, c = rows[keep], columns[keep]
            out[i, np.minimum(used[i, c], 4), :, c] = corner.swapaxes(1, 2)[i, c]
            used[i, c] += 1
    # pad with the last corner
    last = np.maximum(used - 1, 0)
    for k in range(5):
        over = k > last
        i, c = rows[over], columns[over]
        out[i, k, :, c] = out[i, last[i, c], :, c]
    return out
