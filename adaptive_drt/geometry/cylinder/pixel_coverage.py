# SPDX-License-Identifier: GPL-3.0-or-later
"""Coverage of pixels by the curved sides of cylinders and truncated cones at rest.

The discriminant is a quadratic in the pixel's coordinates, of which a jet of order 2 gives the
exact range up to rounding. From outside, and from beyond the apex of a cone within the other half
of the double cone, the hit is at t = g / (p + sqrt(D)), g the power of the camera, so its bounds
follow from those of p and D; they bound how far along the axis the hit is, and so whether it is
between the ends. Where an end may be seen in the pixel the side covers a part of it only: creases
at the rims are outlines of the side.
"""

from __future__ import annotations

import numpy as np

from ...numerics.arrays import Array, Mask
from ...numerics.floats import UNIT_ROUNDOFF
from ...numerics.jet import Jet
from ...numerics.taylor_range import rectangle_range
from ...numerics.vector import dot, squared_norm
from ..camera import PinholeCamera
from ..pixel_coverage import PixelCoverage
from ..sphere.kernels import discriminant_rounding
from .kernels import axial_view

__all__ = ["hit_depths", "product_range", "side_coverage"]


HIT_OPERATIONS = 64
"""Number of rounded operations in the place of a hit along the axis, counted generously: its error
bound in roundoffs of the distance and of the cylinder's size."""


def side_coverage(
    v: Array,
    axis: Array,
    half: Array,
    radius: Array,
    slope: Array,
    w: Array,
    camera: PinholeCamera,
    order: int,
) -> PixelCoverage:
    """Coverage of m pixels by sides of solids; the middles v (3, m) are from the camera."""
    view = axial_view(v, axis, radius, slope)
    ray = Jet.linear(w, (camera.right[:, None], camera.up[:, None]), order)
    f, s = dot(ray, axis), dot(ray, view.lever)
    h, level = camera.half_pixel, view.level
    aside = np.sqrt(dot(view.across, view.across))
    # the discriminant is |R w' + k f v'|^2 - s^2, both at most as long as these times w
    large, vv = np.abs(level) + np.abs(slope) * aside, dot(v, v)
    d = (squared_norm(ray) - f * f) * (level * level) - s * s
    if slope.any():
        d = d + f * dot(ray, 2.0 * level * view.across + slope * aside * aside * axis) * slope
    # the remainder of order 1 is the discriminant for an offset |o| <= h instead of w
    low, high = rectangle_range(d, 0.5, 0.5, h * h * np.maximum(large * large, vv))
    ww = dot(w, w)
    side = np.abs(dot(w, view.lever)) + h * np.sqrt(vv)
    rounding = discriminant_rounding(ww, vv, large, side)
    # beyond the apex the cone is seen from within the other half, by all rays that it opens along
    size = np.sqrt(vv) + half + np.abs(radius) + np.abs(level)
    tiny = HIT_OPERATIONS * UNIT_ROUNDOFF * size * size
    mirrored = (view.power < -tiny) & (level < 0.0)
    ahead, spread = camera.linear_range(w, view.across + slope * level * axis)
    p = ahead - spread, ahead + spread
    near, far, certain = hit_depths(p, (low, high), (view.power, view.power), mirrored)
    slant, change = camera.linear_range(w, axis)
    first, last = product_range((near, far), (slant - change, slant + change))
    slack = HIT_OPERATIONS * UNIT_ROUNDOFF * size
    first, last = first - view.along - slack, last - view.along + slack
    may_hit = ((high >= -rounding) | mirrored) & (far > 0.0) & (first <= half) & (last >= -half)
    covers = ((low > rounding) | mirrored) & certain & (first >= -half) & (last <= half)
    # from within the infinite cone the outer side is not seen, and the inner one from within
    around = (view.power <= tiny) & ~mirrored
    beyond = around & (np.abs(view.along) > half + slack) & (view.power < 0.0) & (level > 0.0)
    may_hit = np.where(around, ~beyond, may_hit)
    covers &= ~around
    near = np.where(around, 0.0, near)
    # the solid is within its bounding sphere
    reach = np.hypot(half, radius - slope * half)
    nearest = np.maximum(np.sqrt(vv) - reach, 0.0) / (np.sqrt(ww) + h)
    farthest = (np.sqrt(vv) + reach) / camera.least_length(np.sqrt(ww))
    return PixelCoverage(may_hit, covers, np.maximum(near, nearest), np.minimum(far, farthest))


def hit_depths(
    p: tuple[Array, Array],
    d: tuple[Array, Array],
    power: tuple[Array, Array],
    mirrored: Mask | None = None,
) -> tuple[Array, Array, Mask]:
    """Bounds (m,) on the ray parameters t = g / (p + sqrt(D)) of outer hits, from those of p, D, g.

    A ray that only touches counts as a hit. Bounds are 0 and inf where nothing better is known, and
    0 and 0 where no ray hits. The last mask tells where p + sqrt(D) has one sign and all rays hit,
    as far as they meet the double cone at all.

    mirrored : (m,) whether the camera is within the other half of the double cone.
    """
    root_low, root_high = (np.sqrt(np.maximum(each, 0.0)) for each in d)
    most, least = p[1] + root_high, p[0] + root_low
    outside = power[0] > 0.0
    low, high = power
    if mirrored is not None:
        most, least = np.where(mirrored, -least, most), np.where(mirrored, -most, least)
        low, high = np.where(mirrored, -power[1], low), np.where(mirrored, -power[0], high)
        outside = outside | mirrored
    certain = least > 0.0
    with np.errstate(over="ignore"):
        near = np.where(outside & (most > 0.0), low, 0.0) / np.where(most > 0.0, most, 1.0)
        far = np.where(outside & certain, high, np.inf) / np.where(certain, least, 1.0)
    return near, np.where(outside & (most <= 0.0), 0.0, far), certain


def product_range(t: tuple[Array, Array], slope: tuple[Array, Array]) -> tuple[Array, Array]:
    """Bounds (m,) on products of numbers t >= 0 and slopes, from those of both."""
    with np.errstate(invalid="ignore"):  # inf times 0 stands for any product
        low = np.where(slope[0] < 0.0, t[1], t[0]) * slope[0]
        high = np.where(slope[1] > 0.0, t[1], t[0]) * slope[1]
    return np.where(np.isnan(low), -np.inf, low), np.where(np.isnan(high), np.inf, high)
