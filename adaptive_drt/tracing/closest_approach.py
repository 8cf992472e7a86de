# SPDX-License-Identifier: GPL-3.0-or-later
"""Ray parameters of hits, and of the closest point of an object where a ray misses it.

For a sphere that is the point of the ray nearest to its centre; a quad is extended to its plane.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Ints
from ..numerics.gather import columns
from ..numerics.vector import cross, dot
from .compile import Plan
from .intersect import intersect_pairs

__all__ = ["hits_or_closest_points"]


def hits_or_closest_points(plan: Plan, w: Array, item: Ints, time: Array | float) -> Array:
    """Ray parameters of hits, or of the closest points where rays miss: (m,), always finite.

    Parameters
    ----------
    w : (3, m) directions of rays from the camera.  item : (m,) the object that each is tested with.
    time : shutter time, a number or (m,).
    """
    when = time[:, None] if isinstance(time, np.ndarray) else time
    t = intersect_pairs(plan, w[:, :, None], item, when)[:, 0]
    missed = (~np.isfinite(t)).nonzero()[0]
    if missed.size:
        t[missed] = _closest_points(plan, columns(w, missed), item[missed], _times_at(time, missed))
    return t


def _closest_points(plan: Plan, w: Array, item: Ints, time: Array | float) -> Array:
    """Ray parameters (m,), > 0, of the closest points to spheres or of hits on planes of quads."""
    t = np.empty(item.size)
    ball = (item < plan.sphere_count).nonzero()[0]
    v = plan.spheres.moved(item[ball], _times_at(time, ball))
    t[ball] = dot(columns(w, ball), v) / dot(columns(w, ball), columns(w, ball))
    flat = (item >= plan.sphere_count).nonzero()[0]
    ids = item[flat] - plan.sphere_count
    corner = plan.quads.moved(ids, _times_at(time, flat))
    u, v = columns(plan.quads.edge_u, ids), columns(plan.quads.edge_v, ids)
    t[flat] = _plane_hits(columns(w, flat), corner, u, v)
    return np.maximum(t, float(np.finfo(np.float64).tiny))


def _plane_hits(w: Array, corner: Array, u: Array, v: Array) -> Array:
    """Ray parameters (m,) of rays' intersections with the planes of quads.

    Quadrature nodes may lie outside the pixels that see the quad, so its plane is used beyond its
    edges. Where the plane is hit behind the camera, or beyond twice the distance of the farthest
    corner, the largest ray parameter of the corners' projections onto the ray is returned.
    """
    normal = cross(u, v)
    facing, height = dot(w, normal), dot(corner, normal)
    corners = (corner, corner + u, corner + v, corner + u + v)
    ww = dot(w, w)
    along = [dot(w, c) / ww for c in corners]
    limit = 2.0 * np.sqrt(np.maximum.reduce([dot(c, c) for c in corners]) / ww)
    ahead = np.abs(facing) * limit > np.abs(height)
    ahead &= facing * height > 0.0
    t = np.where(ahead, height, 0.0) / np.where(ahead, facing, 1.0)
    return np.where(ahead, t, np.maximum.reduce(along))


def _times_at(time: Array | float, rows: Ints) -> Array | float:
    return time[rows] if isinstance(time, np.ndarray) else time
