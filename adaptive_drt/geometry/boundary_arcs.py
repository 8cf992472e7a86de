# SPDX-License-Identifier: GPL-3.0-or-later
"""The arcs that bound visible regions of directions, of many points, one after the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..numerics.arrays import Array, Ints
from ..numerics.gather import columns
from .spherical_curves import Circles, GreatCircleArcs

__all__ = ["BoundaryArcs", "arcs_of_curve"]


@dataclass(frozen=True)
class BoundaryArcs:
    """m arcs w(phi) = origin + first cos phi + second sin phi on the unit sphere.

    Attributes
    ----------
    origin, first, second : (3, m).  low, high : (m,) radians, the ends of the arcs.
    radius : (m,) length of `first` and `second`, which is 1 on great circles.
    point : (m,) index of the shaded point that sees the arc.
    sign : (m,) 1 where the region lies to the left of the arc, -1 where it lies to the right.
    """

    origin: Array
    first: Array
    second: Array
    low: Array
    high: Array
    radius: Array
    point: Ints
    sign: Array

    @staticmethod
    def join(parts: Sequence[BoundaryArcs]) -> BoundaryArcs:
        """Return all arcs of several parts, in this order."""
        if len(parts) == 1:
            return parts[0]
        names = BoundaryArcs.__dataclass_fields__
        joined: list[Any] = [
            np.concatenate([getattr(part, name) for part in parts], axis=-1) for name in names
        ]
        return BoundaryArcs(*joined)

    def take(self, index: Ints) -> BoundaryArcs:
        """Return some of the arcs."""
        origin, first, second = (columns(v, index) for v in (self.origin, self.first, self.second))
        low, high, radius = self.low[index], self.high[index], self.radius[index]
        point, sign = self.point[index], self.sign[index]
        return BoundaryArcs(origin, first, second, low, high, radius, point, sign)


def arcs_of_curve(
    curve: Circles | GreatCircleArcs, ring: Ints, low: Array, high: Array, sign: float
) -> BoundaryArcs:
    """Return arcs of curves (k, n), which are given by the index k n + point.

    ring : (m,) indices.  low, high : (m,) ends, radians.  sign : see `BoundaryArcs`.
    """
    count = curve.axis.shape[2] if isinstance(curve, Circles) else curve.half_angle.shape[1]

    def taken(values: Array) -> Array:
        return columns(values.reshape(3, -1), ring)

    if isinstance(curve, Circles):
        cosine, radius = curve.cosine.ravel()[ring], curve.sine.ravel()[ring]
        origin = cosine * taken(curve.axis)
        first, second = radius * taken(curve.u), radius * taken(curve.w)
    else:
        first, second = taken(curve.middle), taken(curve.along)
        origin, radius = np.zeros_like(first), np.ones(ring.size)
    return BoundaryArcs(
        origin, first, second, low, high, radius, ring % count, np.full(ring.size, sign)
    )
