# SPDX-License-Identifier: GPL-3.0-or-later
"""Coverage of pixels by flat ellipses; see `line_polynomials` for the formulas.

All functions take m pairs of pixels and ellipses. Vectors (3, m), in metres relative to the camera.
w (3, m) are the directions of the centre rays, and `order` is the order of jets.
"""

from __future__ import annotations

import numpy as np

from ...numerics.arrays import Array
from ...numerics.floats import UNIT_ROUNDOFF
from ...numerics.jet import Jet
from ...numerics.taylor_range import rectangle_range
from ...numerics.vector import cross, dot, norm
from ..camera import PinholeCamera
from ..pixel_coverage import PixelCoverage

__all__ = ["ellipse_coverage"]

DISCRIMINANT_OPERATIONS = 64
"""Number of rounded operations in one discriminant, counted generously: its error bound in
roundoffs."""


def ellipse_coverage(
    center: Array, u: Array, v: Array, w: Array, camera: PinholeCamera, order: int
) -> PixelCoverage:
    """Coverage of pixels by ellipses at rest with half axes u and v."""
    normal = cross(u, v)
    height = dot(center, normal)
    side = np.where(height < 0.0, -1.0, 1.0)
    planes = side * normal, cross(v, center), cross(center, u)
    ray = Jet.linear(w, (camera.right[:, None], camera.up[:, None]), order)
    f, a, b = (dot(ray, plane) for plane in planes)
    sizes = [norm(plane) for plane in planes]
    h = camera.half_pixel
    remainder = h * h * np.maximum(sizes[0] ** 2, sizes[1] ** 2 + sizes[2] ** 2)
    low, high = rectangle_range(f * f - a * a - b * b, 0.5, 0.5, remainder)
    ranges = [camera.linear_range(w, plane) for plane in planes]
    largest = sum(np.abs(value) + spread for value, spread in ranges)
    length = np.sqrt(dot(w, w)) + h
    rounding = DISCRIMINANT_OPERATIONS * UNIT_ROUNDOFF * length * largest * sum(sizes)
    facing, spread = ranges[0]
    ahead = height != 0.0
    may_hit = (high >= -rounding) & (facing + spread >= 0.0) & ahead
    covers = (low > rounding) & (facing - spread > 0.0) & ahead
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # edge-on: unbounded
        near = np.where(may_hit, np.abs(height) / np.maximum(facing + spread, 0.0), 0.0)
        least = facing - spread
        far = np.where(least > 0.0, np.abs(height) / least, np.inf)
    # `far` is also bounded by the corners of the parallelogram around the ellipse
    farthest = (norm(center) + norm(u) + norm(v)) / camera.least_length(np.sqrt(dot(w, w)))
    return PixelCoverage(
        may_hit, covers, np.where(np.isnan(near), 0.0, near), np.minimum(far, farthest)
    )
