# SPDX-License-Identifier: GPL-3.0-or-later
"""Detection over the pixel where two objects cover it: may their surfaces intersect in it?

The ray of direction w hits the plane n.P = k at P = k w / f, f = n.w. This point lies outside a
sphere of centre v and radius r where

    Q(w) = k^2 (w.w) - 2 k f (w.v) + f^2 (v.v - r^2)  > 0,

a quadratic in the pixel's coordinates. Two spheres intersect in a plane, their radical plane, and
two planes where k1 f2 - k2 f1 = 0. The depth order does not change where the sign does not.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.jet import Jet
from ..numerics.taylor_range import rectangle_range
from ..numerics.vector import cross, dot, squared_norm
from ..tracing.compile import Plan

__all__ = ["detect_intersections"]


INTERSECTION_ROUNDING = 64.0 * 2.0**-53
"""Generous bound on the rounding error of Q, relative to the sum of the sizes of its terms."""


def detect_intersections(plan: Plan, w: Array, first: Ints, second: Ints, half: float) -> Mask:
    """Whether the depth order of two objects may change within a pixel: (m,) bool.

    Parameters
    ----------
    w : (3, m) directions through pixels' centres.
    first, second : (m,) objects that both cover their pixel.
    half : bound on |w' - w| for the directions w' of a pixel, from `half_pixel`.
    """
    a, b = np.minimum(first, second), np.maximum(first, second)
    ball, other_ball = a < plan.sphere_count, b < plan.sphere_count
    seam = np.ones(a.size, dtype=np.bool_)
    # spheres come first, so `a` is a sphere wherever one of the two is
    for rows, plane in (
        ((ball & other_ball).nonzero()[0], _radical_plane),
        ((ball & ~other_ball).nonzero()[0], _second_quad_plane),
    ):
        if rows.size:
            normal, k = _normalised_plane(plan, a[rows], *plane(plan, a[rows], b[rows]))
            seam[rows] = _order_may_change_on_sphere(
                plan, columns(w, rows), a[rows], normal, k, half
            )
    rows = (~ball).nonzero()[0]
    if rows.size:
        seam[rows] = _order_may_change_between_planes(plan, columns(w, rows), a[rows], b[rows])
    return seam


def _radical_plane(plan: Plan, a: Ints, b: Ints) -> tuple[Array, Array]:
    """The radical plane of two spheres: normal (3, m), not of unit length, and k (m,)."""
    c0, c1 = columns(plan.spheres.center, a), columns(plan.spheres.center, b)
    r0, r1 = plan.spheres.radius[a], plan.spheres.radius[b]
    normal = c1 - c0
    # (|c1|^2 - |c0|^2) / 2 without cancellation
    k = 0.5 * (dot(normal, c1 + c0) - (r1 - r0) * (r1 + r0))
    return normal, k


def _second_quad_plane(plan: Plan, a: Ints, b: Ints) -> tuple[Array, Array]:
    """The plane of the second object, a quad; the arguments are those of `_radical_plane`."""
    del a
    return _quad_plane(plan, b)


def _quad_plane(plan: Plan, item: Ints) -> tuple[Array, Array]:
    """Normals (3, m), not of unit length, and k (m,) of the planes of quads."""
    ids = item - plan.sphere_count
    normal = cross(columns(plan.quads.edge_u, ids), columns(plan.quads.edge_v, ids))
    return normal, dot(normal, columns(plan.quads.corner, ids))


def _normalised_plane(plan: Plan, ball: Ints, normal: Array, k: Array) -> tuple[Array, Array]:
    """The planes, scaled so that Q is at most a few (w.w) whatever the size of the scene."""
    v, r = columns(plan.spheres.center, ball), plan.spheres.radius[ball]
    reach = np.sqrt(dot(normal, normal)) * (np.sqrt(dot(v, v)) + r)
    unit = np.maximum(np.abs(k) + reach, TINY)
    return normal / unit, k / unit


def _order_may_change_on_sphere(
    plan: Plan, w: Array, ball: Ints, normal: Array, k: Array, half: float
) -> Mask:
    """Whether Q, for a sphere and a plane, may change its sign in the pixel: (m,) bool."""
    lens = plan.lens
    v, r = columns(plan.spheres.center, ball), plan.spheres.radius[ball]
    gap = dot(v, v) - r * r
    ray = Jet.linear(w, (lens.right[:, None], lens.up[:, None]), plan.settings.order)
    f = dot(ray, normal)
    q = squared_norm(ray) * (k * k) - f * dot(ray, v) * (2.0 * k) + f * f * gap
    size = np.sqrt(dot(normal, normal))
    scale = k * k + 2.0 * np.abs(k) * size * np.sqrt(dot(v, v)) + size * size * np.abs(gap)
    low, high = rectangle_range(q, 0.5, 0.5, half * half * scale)
    rounding = INTERSECTION_ROUNDING * scale * dot(w, w)
    may: Mask = (low <= rounding) & (high >= -rounding)
    return may


def _order_may_change_between_planes(plan: Plan, w: Array, a: Ints, b: Ints) -> Mask:
    """Whether the planes of two quads may have equal depth in the pixel: (m,) bool."""
    lens = plan.lens
    (n0, k0), (n1, k1) = _quad_plane(plan, a), _quad_plane(plan, b)
    turn = k0 * n1 - k1 * n0
    steps = (lens.right[:, None], lens.up[:, None])
    spread = 0.5 * (np.abs(dot(steps[0], turn)) + np.abs(dot(steps[1], turn)))
    scale = np.abs(k0) * np.sqrt(dot(n1, n1)) + np.abs(k1) * np.sqrt(dot(n0, n0))
    may: Mask = np.abs(dot(w, turn)) <= spread + INTERSECTION_ROUNDING * scale * np.sqrt(dot(w, w))
    return may
