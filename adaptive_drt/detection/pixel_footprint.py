# SPDX-License-Identifier: GPL-3.0-or-later
"""The footprint of a pixel on the surface that it shows, bounded by a parallelogram."""

from __future__ import annotations

import numpy as np

from ..geometry.footprint import Footprint
from ..numerics.arrays import Array
from ..numerics.gather import columns
from ..numerics.vector import cross, dot
from ..tracing.compile import Plan
from ..tracing.intersect import Surface, curvature

__all__ = ["make_footprint"]


MAX_FLAT_PATCH_WIDTH = 0.25
"""Largest width of a footprint on a sphere that is bounded by way of the tangent plane.

The unit is the sphere's radius times the cosine of the angle at which it is seen."""


def make_footprint(plan: Plan, surface: Surface, reach: Array) -> Footprint:
    """Bound the footprints of pixels by parallelograms.

    On a plane with normal n, the hits of the directions w + s and w differ by
    t (s - w tau) / (1 + tau), tau = n.s / n.w. At the silhouette of a sphere, where this is
    unbounded, a parallelogram along the ray bounds the footprint.

    Parameters
    ----------
    surface : hits of the centre rays.
    reach : (n,) bounds from `patch_reach` on the distance of a footprint's points from its centre.
    """
    lens = plan.lens
    across = cross(lens.right, lens.up)[:, None]
    point, normal = surface.point, surface.normal
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # edge-on: unbounded
        t = dot(point, across) / dot(lens.base[:, None], across)
        w = point / t
        facing = dot(normal, w)
        steps, spread = [], np.zeros(t.size)
        for step in (lens.right[:, None], lens.up[:, None]):
            tau = 0.5 * dot(normal, step) / facing
            spread = spread + np.abs(tau)
            steps.append(t * (0.5 * step - w * tau))
        grow = 1.0 / np.maximum(1.0 - spread, 0.0)
        wide = grow * sum(np.sqrt(dot(step, step)) for step in steps)
        # a sphere is wide^2 / 2 r away from its tangent plane, and more along an oblique ray
        room = np.abs(facing) / np.sqrt(dot(w, w))
        off = 2.0 * wide * wide * curvature(plan, surface) / room
        off = np.where(wide * curvature(plan, surface) < MAX_FLAT_PATCH_WIDTH * room, off, np.inf)
        held = np.isfinite(wide)
        off = np.where(held, off, np.inf)
        sides = [np.where(held, step * grow, 0.0) for step in steps]
    rim = (~np.isfinite(off)).nonzero()[0]
    if rim.size:
        off[rim], (sides[0][:, rim], sides[1][:, rim]) = _parallelograms_along_rays(
            plan, columns(point, rim), t[rim], reach[rim]
        )
    return Footprint((sides[0], sides[1]), off)


def _parallelograms_along_rays(
    plan: Plan, point: Array, t: Array, reach: Array
) -> tuple[Array, tuple[Array, Array]]:
    """`thickness` and `steps` of parallelograms along the ray and the pixel's x axis.

    For a hit t' (w + x right + y up) with |x|, |y| <= 1/2, the distance from the centre is at most
    the reach, so |(t' - t) w| is at most the reach plus the length of t' (x right + y up).
    """
    lens = plan.lens
    far = np.sqrt(dot(point, point))
    h = plan.lens.half_pixel
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # a hit at the camera
        length = far / t
        latest = (far + reach) / np.maximum(length - h, 0.5 * length)
        along = point * ((reach + latest * h) / far)
        off = 0.5 * latest * np.sqrt(dot(lens.up, lens.up))
        side = 0.5 * latest * lens.right[:, None]
        held = np.isfinite(off + along.sum(axis=0) + side.sum(axis=0))
    return np.where(held, off, np.inf), (np.where(held, along, 0.0), np.where(held, side, 0.0))
