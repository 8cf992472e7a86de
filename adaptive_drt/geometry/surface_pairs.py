# SPDX-License-Identifier: GPL-3.0-or-later
"""Pairs of surfaces that cover a pixel: may their depth order change in it?

The ray of direction w hits the plane n.P = k at P = k w / f, f = n.w. This point lies outside a
sphere of centre v and radius r where

    Q(w) = k^2 (w.w) - 2 k f (w.v) + f^2 (v.v - r^2)  > 0,

a quadratic in the pixel's coordinates. Two spheres intersect in a plane, their radical plane, and
two planes where k1 f2 - k2 f1 = 0. The depth order does not change where the sign does not.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.jet import Jet
from ..numerics.taylor_range import rectangle_range
from ..numerics.vector import dot, squared_norm
from .camera import PinholeCamera
from .implicit_surface import ImplicitPlane, ImplicitSphere
from .shape_table import ShapeTable

__all__ = ["SURFACE_PAIRS", "depth_order_may_change"]


INTERSECTION_ROUNDING = 64.0 * 2.0**-53
"""Generous bound on the rounding error of Q, relative to the sum of the sizes of its terms."""


def depth_order_may_change(
    shapes: ShapeTable, first: Ints, second: Ints, w: Array, camera: PinholeCamera, order: int
) -> Mask:
    """Whether the depth order of two objects may change within a pixel: (m,) bool.

    It may where no test for their surfaces is known.

    Parameters
    ----------
    first, second : (m,) objects, given by number, that both cover their pixel.
    w : (3, m) directions through pixels' centres.  order : the order of jets.
    """
    a, b = np.minimum(first, second), np.maximum(first, second)
    may = np.ones(a.size, dtype=np.bool_)
    for one_set, rows, one_index in shapes.groups(a):
        for other_set, part, other_index in shapes.groups(b[rows]):
            one = one_set.implicit_surface(one_index[part])
            other = other_set.implicit_surface(other_index)
            chosen = rows[part]
            for x, y in ((one, other), (other, one)):
                test = SURFACE_PAIRS.get((type(x), type(y)))
                if test is not None:
                    may[chosen] = test(x, y, columns(w, chosen), camera, order)
                    break
    return may


def _spheres(
    one: ImplicitSphere, other: ImplicitSphere, w: Array, camera: PinholeCamera, order: int
) -> Mask:
    """Whether the order of two spheres may change: where the first meets their radical plane."""
    normal = other.center - one.center
    r0, r1 = one.radius, other.radius
    # (|c1|^2 - |c0|^2) / 2 without cancellation
    offset = 0.5 * (dot(normal, other.center + one.center) - (r1 - r0) * (r1 + r0))
    return _sphere_crosses_plane(one, normal, offset, w, camera, order)


def _sphere_and_plane(
    one: ImplicitSphere, other: ImplicitPlane, w: Array, camera: PinholeCamera, order: int
) -> Mask:
    """Whether the order of a sphere and a plane may change."""
    return _sphere_crosses_plane(one, other.normal, other.offset, w, camera, order)


def _sphere_crosses_plane(
    ball: ImplicitSphere, normal: Array, k: Array, w: Array, camera: PinholeCamera, order: int
) -> Mask:
    """Whether Q, for a sphere and a plane, may change its sign in the pixel: (m,) bool."""
    v, r = ball.center, ball.radius
    # the plane is scaled so that Q is at most a few (w.w) whatever the size of the scene
    reach = np.sqrt(dot(normal, normal)) * (np.sqrt(dot(v, v)) + r)
    unit = np.maximum(np.abs(k) + reach, TINY)
    normal, k = normal / unit, k / unit
    gap = dot(v, v) - r * r
    ray = Jet.linear(w, (camera.right[:, None], camera.up[:, None]), order)
    f = dot(ray, normal)
    q = squared_norm(ray) * (k * k) - f * dot(ray, v) * (2.0 * k) + f * f * gap
    size = np.sqrt(dot(normal, normal))
    scale = k * k + 2.0 * np.abs(k) * size * np.sqrt(dot(v, v)) + size * size * np.abs(gap)
    half = camera.half_pixel
    low, high = rectangle_range(q, 0.5, 0.5, half * half * scale)
    rounding = INTERSECTION_ROUNDING * scale * dot(w, w)
    may: Mask = (low <= rounding) & (high >= -rounding)
    return may


def _planes(
    one: ImplicitPlane, other: ImplicitPlane, w: Array, camera: PinholeCamera, order: int
) -> Mask:
    """Whether two planes may have equal depth in the pixel: (m,) bool."""
    del order
    n0, k0, n1, k1 = one.normal, one.offset, other.normal, other.offset
    value, spread = camera.linear_range(w, k0 * n1 - k1 * n0)
    scale = np.abs(k0) * np.sqrt(dot(n1, n1)) + np.abs(k1) * np.sqrt(dot(n0, n0))
    may: Mask = np.abs(value) <= spread + INTERSECTION_ROUNDING * scale * np.sqrt(dot(w, w))
    return may


PairTest: TypeAlias = Callable[[Any, Any, Array, PinholeCamera, int], Mask]
"""Test of m pairs of surfaces: (one, other, directions, camera, order of jets) to (m,) bool."""

SURFACE_PAIRS: dict[tuple[type, type], PairTest] = {
    (ImplicitSphere, ImplicitSphere): _spheres,
    (ImplicitSphere, ImplicitPlane): _sphere_and_plane,
    (ImplicitPlane, ImplicitPlane): _planes,
}
"""For each pair of kinds of surfaces, in one order, the test of their depth order in a pixel."""
