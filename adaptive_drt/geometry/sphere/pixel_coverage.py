# SPDX-License-Identifier: GPL-3.0-or-later
"""Coverage of pixels by spheres, at rest and in motion.

The discriminant of a sphere is a quadratic in the pixel's coordinates, and for a fixed ray one in
time if the sphere moves linearly. A jet of order 2 gives its exact range, up to rounding. Over the
shutter, the pixel's square is taken into account by enlarging the sphere.

All functions take m pairs of pixels and spheres. Centres v and displacements d (3, m) and radii r
(m,), in metres relative to the camera, may have one element that stands for all pairs. w (3, m) are
the directions of the centre rays, and `order` is the order of jets.
"""

from __future__ import annotations

import numpy as np

from ...numerics.arrays import Array, Mask
from ...numerics.gather import columns
from ...numerics.jet import Jet
from ...numerics.taylor_range import interval_range, rectangle_range
from ...numerics.vector import cross, dot
from ..camera import PinholeCamera
from ..pixel_coverage import PixelCoverage
from .kernels import discriminant, discriminant_rounding

__all__ = [
    "coverage_from_ranges",
    "moving_ball_coverage",
    "moving_sphere_coverage",
    "sphere_coverage",
]


def sphere_coverage(
    v: Array, r: Array, w: Array, camera: PinholeCamera, order: int
) -> PixelCoverage:
    """Coverage of pixels by spheres at rest."""
    h = camera.half_pixel
    ww, vv = dot(w, w), dot(v, v)
    along, slope = camera.linear_range(w, v)
    length = np.sqrt(ww)
    closest = cross(w, v)
    square = dot(closest, closest)
    d = r * r * ww - square
    # |w - w0| <= h changes D by no more than this
    change = 2.0 * h * (r * r * length + np.sqrt(square * vv)) + h * h * (r * r + vv)
    low, high = d - change, d + change
    unsure = ((low <= 0.0) & (high >= 0.0)).nonzero()[0]
    if unsure.size:
        which = unsure if r.size > 1 else np.zeros_like(unsure)
        low[unsure], high[unsure] = _discriminant_range(
            columns(w, unsure), columns(v, which), r[which], camera, order
        )
    # over the pixel w x v grows by no more than h |v|
    rounding = discriminant_rounding(ww, vv, r, np.sqrt(square) + h * np.sqrt(vv))
    lengths = camera.least_length(length), length + h
    return coverage_from_ranges((low, high), rounding, (along, slope), lengths, vv < r * r)


def coverage_from_ranges(
    discriminant: tuple[Array, Array],
    rounding: Array,
    center_dot: tuple[Array, Array],
    lengths: tuple[Array, Array],
    inside: Mask,
) -> PixelCoverage:
    """Coverage of pixels, from what is known of their directions w and of spheres' centres v.

    Parameters
    ----------
    discriminant : least and greatest D (m,), but for its `rounding` (m,).
    center_dot : w.v of the centre rays, and its largest change in the pixel: (m,) each.
    lengths : least and greatest length (m,) of w.  inside : (m,) whether the camera is inside.
    """
    low, high = discriminant
    along, slope = center_dot
    small, large = lengths
    may_hit, covers = high >= -rounding, low > rounding
    may_hit &= inside | (along + slope >= 0.0)
    covers &= inside | (along - slope > 0.0)
    root_low, root_high = np.sqrt(np.maximum(low, 0.0)), np.sqrt(np.maximum(high, 0.0))
    sign = np.where(inside, 1.0, -1.0)
    first = along - slope + np.where(inside, root_low, -root_high)
    last = along + slope + sign * np.where(inside, root_high, root_low)
    near = np.maximum(first, 0.0) / (large * large)
    far = np.maximum(last, 0.0) / (small * small)
    return PixelCoverage(may_hit, covers, near, far)


def _discriminant_range(
    w: Array, v: Array, r: Array, camera: PinholeCamera, order: int
) -> tuple[Array, Array]:
    """Range of the discriminant D over the pixel, by its jet in the pixel's x and y."""
    ray = Jet.linear(w, (camera.right[:, None], camera.up[:, None]), order)
    h = camera.half_pixel
    # the remainder of order 1 is r^2 |o|^2 - |o x v|^2 for an offset |o| <= h
    remainder = h * h * np.maximum(r * r, dot(v, v))
    return rectangle_range(discriminant(ray, v, r), 0.5, 0.5, remainder)


def moving_sphere_coverage(
    v: Array, d: Array, r: Array, w: Array, camera: PinholeCamera, order: int, whole_pixel: bool
) -> PixelCoverage:
    """Coverage of pixels during the shutter by spheres with displacements d.

    whole_pixel : whether all rays of a pixel count, or only its centre's.
    """
    return moving_ball_coverage(v, d, r, w, camera.half_pixel if whole_pixel else 0.0, order)


def moving_ball_coverage(
    v: Array, d: Array, r: Array, w: Array, h: Array | float, order: int
) -> PixelCoverage:
    """`moving_sphere_coverage` of the rays whose directions are within h of w."""
    ww = dot(w, w)
    length = np.sqrt(ww)
    v0, v1 = v - 0.5 * d, v + 0.5 * d
    farthest = np.maximum(dot(v0, v0), dot(v1, v1))
    # a ray of the pixel passes the sphere no farther than `widen` from where the centre ray does
    widen = np.sqrt(farthest) * (h / np.maximum(length - h, 0.5 * length))
    place = Jet.linear(v, (d,), order)
    remainder = 0.25 * ww * dot(d, d)
    sides = [cross(w, end) for end in (v0, v1)]
    miss = np.maximum(*(np.sqrt(dot(side, side)) for side in sides))
    rounding = discriminant_rounding(ww, farthest, r + widen, miss)
    outer = discriminant(w, place, r + widen)
    high = interval_range(outer, 0.5, remainder)[1]
    inner = discriminant(w, place, np.maximum(r - widen, 0.0))
    low = interval_range(inner, 0.5, remainder)[0]
    a0, a1 = dot(w, v0), dot(w, v1)
    reach = (r + 2.0 * widen) * length
    ahead = np.maximum(a0, a1) + reach > 0.0
    holds = np.minimum(dot(v0, v0), dot(v1, v1)) < (r + widen) ** 2
    covers = (low > rounding) & (np.minimum(a0, a1) > reach) & ~holds
    near = np.maximum(np.minimum(a0, a1) - np.sqrt(np.maximum(high, 0.0)) - widen * length, 0.0)
    near = near / (length + h) ** 2
    shortest = np.maximum(length - h, 0.5 * length)
    far = np.maximum(a0, a1) - np.sqrt(np.maximum(low, 0.0)) + widen * length
    far = np.where(covers, far / (shortest * shortest), np.inf)
    return PixelCoverage((high > -rounding) & ahead, covers, near, far)
