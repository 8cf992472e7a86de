# SPDX-License-Identifier: GPL-3.0-or-later
"""Ray parameters of hits, and of the closest point of an object where a ray misses it.

See `ShapeSet.closest_points`.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Ints
from ..numerics.floats import TINY
from ..numerics.gather import columns
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
    """Ray parameters (m,), > 0, of the points of rays (3, m) that are nearest to objects."""
    t = np.empty(item.size)
    for shapes, rows, index in plan.shapes.groups(item):
        t[rows] = shapes.closest_points(index, columns(w, rows), _times_at(time, rows))
    return np.maximum(t, TINY)


def _times_at(time: Array | float, rows: Ints) -> Array | float:
    return time[rows] if isinstance(time, np.ndarray) else time
