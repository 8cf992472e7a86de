# SPDX-License-Identifier: GPL-3.0-or-later
"""Clipping of convex polygons at the plane of a light."""

from __future__ import annotations

import numpy as np

from ...numerics.arrays import Array
from ...numerics.vector import dot
from ..light_plane import LightPlane

__all__ = ["clip_polygons", "concatenate_polygons"]


def clip_polygons(plane: LightPlane, polygons: Array) -> Array:
    """Clip convex polygons (m, k, 3, n) to the front of a light's plane.

    Returns
    -------
    (m, k + 1, 3, n), where polygons with fewer corners repeat the last one; or the polygons as they
    are, (m, k, 3, n), if none reaches behind the plane.
    """
    if not polygons.shape[0]:
        return polygons
    shift = dot(plane.normal, plane.point)
    heights = [
        dot(plane.normal[:, None], polygons[:, k].swapaxes(0, 1)) - shift
        for k in range(polygons.shape[1])
    ]
    if min(float(h.min(initial=0.0)) for h in heights) >= 0.0:
        return polygons
    return _clip(polygons, np.stack(heights, axis=1))


def concatenate_polygons(parts: list[Array], count: int) -> Array:
    """Concatenate polygons (m, k, 3, n) of different numbers k of corners for `count` points.

    The last corner is repeated where there are fewer than in others.
    """
    parts = [part for part in parts if part.shape[0]]
    if not parts:
        return np.zeros((0, 3, 3, count))
    most = max(part.shape[1] for part in parts)
    padded = [
        part
        if part.shape[1] == most
        else np.concatenate([part, np.repeat(part[:, -1:], most - part.shape[1], axis=1)], axis=1)
        for part in parts
    ]
    return padded[0] if len(padded) == 1 else np.concatenate(padded)


def _clip(polygons: Array, heights: Array) -> Array:
    """Clip polygons (m, k, 3, n) where `heights` (m, k, n) are negative.

    The algorithm is that of Sutherland and Hodgman (1974).
    """
    m, corners, _, n = polygons.shape
    out = np.zeros((m, corners + 1, 3, n))
    used = np.zeros((m, n), dtype=np.int64)
    rows, columns = np.indices((m, n))
    for k in range(corners):
        j = (k + 1) % corners
        h0, h1 = heights[:, k], heights[:, j]
        start, end = polygons[:, k], polygons[:, j]
        cut = (h0 >= 0.0) != (h1 >= 0.0)
        gap = np.where(cut, h0 - h1, 1.0)
        crossing = start + (h0 / gap)[:, None] * (end - start)
        for keep, corner in ((h0 >= 0.0, start), (cut, crossing)):
            i, c = rows[keep], columns[keep]
            out[i, np.minimum(used[i, c], corners), :, c] = corner.swapaxes(1, 2)[i, c]
            used[i, c] += 1
    # pad with the last corner
    last = np.maximum(used - 1, 0)
    for k in range(corners + 1):
        over = k > last
        i, c = rows[over], columns[over]
        out[i, k, :, c] = out[i, last[i, c], :, c]
    return out
