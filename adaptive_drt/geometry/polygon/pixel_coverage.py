# SPDX-License-Identifier: GPL-3.0-or-later
"""Coverage of pixels by convex polygons of any number of edges, at rest and in motion.

The edge functions of a polygon are linear in the pixel's coordinates, and for a fixed ray linear in
time while the camera stays on one side of a moving polygon's plane. So their ranges over a pixel,
or over the shutter, are exact up to rounding.

All functions take m pairs of pixels and polygons. Vectors (3, m), in metres relative to the camera,
may have one column that stands for all pairs. w (3, m) are the directions of the centre rays.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...numerics.arrays import Array
from ...numerics.floats import TINY, UNIT_ROUNDOFF
from ...numerics.taylor_range import clip_positive
from ...numerics.vector import dot
from ..camera import PinholeCamera
from ..pixel_coverage import PixelCoverage
from .kernels import EDGE_FUNCTION_OPERATIONS, PlaneNormals

__all__ = ["moving_polygon_coverage", "polygon_coverage"]


def polygon_coverage(
    vertices: PlaneNormals,
    planes: PlaneNormals,
    normal: Array,
    height: Array,
    w: Array,
    camera: PinholeCamera,
) -> PixelCoverage:
    """Coverage of pixels by polygons at rest.

    Parameters
    ----------
    vertices : the k vertices.  planes, normal, height : as `edge_planes` returns them.
    """
    may_hit = (height > 0.0) & np.ones(w.shape[1], dtype=np.bool_)
    covers = may_hit.copy()
    length = np.sqrt(dot(w, w))
    for plane in planes:
        value, spread = camera.linear_range(w, plane)
        rounding = EDGE_FUNCTION_OPERATIONS * UNIT_ROUNDOFF * length * np.sqrt(dot(plane, plane))
        may_hit &= value + spread >= -rounding
        covers &= value - spread > rounding
    facing, spread = camera.linear_range(w, normal)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # edge-on: unbounded
        near = np.where(may_hit, height / np.maximum(facing + spread, 0.0), 0.0)
        least = facing - spread
        far = np.where(least > 0.0, height / least, np.inf)
    # `far` is also bounded by the farthest vertex
    farthest = np.max([dot(vertex, vertex) for vertex in vertices], axis=0)
    far = np.minimum(far, np.sqrt(farthest) / camera.least_length(length))
    return PixelCoverage(may_hit, covers, np.where(np.isnan(near), 0.0, near), far)


def moving_polygon_coverage(
    planes: Sequence[PlaneNormals],
    height: Sequence[Array],
    normal: Array,
    w: Array,
    camera: PinholeCamera,
    whole_pixel: bool,
) -> PixelCoverage:
    """Coverage of pixels during the shutter by polygons in linear motion.

    Parameters
    ----------
    planes : for both ends of the shutter, the k planes of `edge_planes`.
    height : for both ends, (m,) products of a vertex with `normal`, of either sign.
    normal : (3, m) of any length, the same at both ends.
    whole_pixel : whether all rays of a pixel count, or only its centre's.
    """
    crosses = height[0] * height[1] <= 0.0
    first, last = np.full(w.shape[1], -0.5), np.full(w.shape[1], 0.5)
    covers = ~crosses
    for ends in zip(*planes, strict=True):
        values = []
        for plane in ends:
            value, spread = camera.linear_range(w, plane)
            spread = spread if whole_pixel else np.zeros_like(spread)
            covers = covers & (value - spread > 0.0)
            values.append(value + spread)
        first, last = clip_positive(first, last, values[0], values[1])
    facing, spread = camera.linear_range(w, normal)
    spread = spread if whole_pixel else np.zeros_like(spread)
    facing = np.abs(facing) + spread
    sides = [np.abs(each) for each in height]
    least = np.maximum(facing - 2.0 * spread, 0.0)
    near = np.where(crosses, 0.0, np.minimum(*sides) / np.maximum(facing, TINY))
    with np.errstate(over="ignore"):  # unbounded where seen edge-on
        far = np.maximum(*sides) / np.maximum(least, TINY)
    return PixelCoverage(crosses | (first <= last), covers, near, far)
