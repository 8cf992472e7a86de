# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines of shadow on planes, as the pixel sees them: exact, since they are conics.

A ray w meets the plane n.P = k at p = k w / f, f = n.w. Times f, the vectors from p to a light L
and to a sphere's centre C are linear in w, and the discriminant of p -> L,

    Q(w) = r^2 |f L - k w|^2 - |f (L x C) + k w x (L - C)|^2      (f^2 taken out),

is a quadratic in the pixel's coordinates. The edge functions of a quad become linear. Where the
sign of one point of a light stays over the pixel, the light does not go from seen to hidden in it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from .bounds import rectangle_range
from .emitter import QUAD, Emitter
from .jet import Jet
from .light import CORNERS
from .plan import Plan
from .primary import Pairs, Surface
from .vector import cross, dot, squared_norm

__all__ = ["shadow_lines_cross"]

Array: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Mask: TypeAlias = NDArray[np.bool_]

LINE_ROUNDING = 64.0 * 2.0**-53
"""Relative to the sum of the terms' sizes: rounding of Q, counted generously."""


def shadow_lines_cross(
    plan: Plan, surface: Surface, light: Emitter, pairs: Pairs, w: Array
) -> Mask:
    """Whether every tested point of a light may go from seen to hidden within the pixel: (m,).

    Only such a light can be wholly seen in one place of the pixel and wholly hidden in another.
    Surfaces that are no planes are not decided here: True.

    Parameters
    ----------
    pairs : (m) points and occluders.  w : (3, n) directions of the points' centre rays.
    """
    cross_ = np.ones(pairs.item.size, dtype=np.bool_)
    receiver = surface.item[pairs.pixel]
    plane = receiver >= plan.sphere_count
    ball = pairs.item < plan.sphere_count
    for rows, test in (
        (np.flatnonzero(plane & ball), _sphere_line),
        (np.flatnonzero(plane & ~ball), _quad_line),
    ):
        ids = receiver[rows] - plan.sphere_count
        normal = cross(plan.quads.edge_u[:, ids], plan.quads.edge_v[:, ids])
        size = np.sqrt(dot(normal, normal))
        normal = normal / size
        k = dot(normal, plan.quads.corner[:, ids])
        for place in _points(light):
            if rows.size:
                ray = w[:, pairs.pixel[rows]]
                cross_[rows] &= test(plan, ray, normal, k, place, pairs.item[rows])
    return cross_


def _points(light: Emitter) -> Iterator[Array]:
    """Points (3, 1) of a light: its centre, and the corners of a quad."""
    yield light.center
    if light.kind == QUAD:
        for su, sv in CORNERS:
            yield light.center + su * light.half_u + sv * light.half_v


def _sphere_line(plan: Plan, w: Array, normal: Array, k: Array, place: Array, item: Ints) -> Mask:
    lens = plan.lens
    c, r = plan.spheres.center[:, item], plan.spheres.radius[item]
    ray = Jet.linear(w, (lens.right[:, None], lens.up[:, None]), 2)
    f = dot(ray, normal)
    toward = f * place - k * ray
    across = f * cross(place + np.zeros_like(c), c) + cross(ray, k * (place - c))
    q = squared_norm(toward) * (r * r) - squared_norm(across)
    low, high = rectangle_range(q, 0.5, 0.5)
    far, off = np.sqrt(dot(place, place)), np.sqrt(dot(c, c))
    scale = r * (far + np.abs(k)) + far * off + np.abs(k) * (far + off)
    rounding = LINE_ROUNDING * scale * scale * dot(w, w)
    may: Mask = (low <= rounding) & (high >= -rounding)
    return may


def _quad_line(plan: Plan, w: Array, normal: Array, k: Array, place: Array, item: Ints) -> Mask:
    """Some edge function may change its sign, or that of the quad's side does."""
    lens = plan.lens
    ids = item - plan.sphere_count
    u, v = plan.quads.edge_u[:, ids], plan.quads.edge_v[:, ids]
    q = plan.quads.corner[:, ids]
    steps = (lens.right[:, None], lens.up[:, None])
    may = np.zeros(ids.size, dtype=np.bool_)
    # (L - p).((q - p) x e) = (L - q) x e . p + L.(q x e), linear in p; and the side of the plane
    functions = [
        (cross(place - corner, edge), dot(place + np.zeros_like(q), cross(corner, edge)))
        for corner, edge in ((q, v), (q, u), (q + u, v), (q + v, u))
    ]
    across = cross(u, v)
    functions.append((-across, dot(q, across)))
    for slope, offset in functions:
        line = k * slope + offset * normal
        value = dot(w, line)
        spread = 0.5 * (np.abs(dot(steps[0], line)) + np.abs(dot(steps[1], line)))
        scale = np.abs(k) * np.sqrt(dot(slope, slope)) + np.abs(offset)
        rounding = LINE_ROUNDING * scale * np.sqrt(dot(w, w))
        may |= np.abs(value) <= spread + rounding
    return may
