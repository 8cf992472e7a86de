# SPDX-License-Identifier: GPL-3.0-or-later
"""Where rays meet objects that they may just miss: beside a sphere, or a quad on its plane."""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Ints
from ..numerics.gather import columns
from ..numerics.vector import cross, dot
from .compile import Plan
from .intersect import pair_hits

__all__ = ["hits_or_near"]


def hits_or_near(plan: Plan, w: Array, item: Ints, time: Array | float) -> Array:
    """Ray parameters (m,) of objects; where a ray just misses a sphere, of its nearest point."""
    when = time[:, None] if isinstance(time, np.ndarray) else time
    t = pair_hits(plan, w[:, :, None], item, when)[:, 0]
    missed = (~np.isfinite(t)).nonzero()[0]
    if missed.size:
        t[missed] = _nearest_point(plan, columns(w, missed), item[missed], _at(time, missed))
    return t


def _nearest_point(plan: Plan, w: Array, item: Ints, time: Array | float) -> Array:
    """Ray parameters where rays pass spheres, or cut the planes of quads."""
    t = np.empty(item.size)
    ball = (item < plan.sphere_count).nonzero()[0]
    v = plan.spheres.moved(item[ball], _at(time, ball))
    t[ball] = dot(columns(w, ball), v) / dot(columns(w, ball), columns(w, ball))
    flat = (item >= plan.sphere_count).nonzero()[0]
    ids = item[flat] - plan.sphere_count
    corner = plan.quads.moved(ids, _at(time, flat))
    u, v = columns(plan.quads.edge_u, ids), columns(plan.quads.edge_v, ids)
    t[flat] = _on_plane(columns(w, flat), corner, u, v)
    return np.maximum(t, float(np.finfo(np.float64).tiny))


def _on_plane(w: Array, corner: Array, u: Array, v: Array) -> Array:
    """Ray parameters (m,) of quads' planes, no farther than twice their farthest corner.

    An arm of a star may leave the region it stands for: the plane goes on where the quad ends.
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


def _at(time: Array | float, rows: Ints) -> Array | float:
    return time[rows] if isinstance(time, np.ndarray) else time
