# SPDX-License-Identifier: GPL-3.0-or-later
"""The patch of surface and the interval of time that a shaded point represents."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..numerics.arrays import Array
from ..numerics.vector import dot

__all__ = ["Patch"]


@dataclass(frozen=True)
class Patch:
    """Patches around n points: the projections of half the boxes in pixel x, y and shutter time.

    Attributes
    ----------
    steps : (3, 3, n) metres, motion of the hit from the middle of the box to its side: first index
        axis x, y, t, then components. On a moving object the hit moves along its ray.
    surface_steps : (3, n) metres, distance over the object's own surface by which the hit moves, by
        axis.
    view_steps : (3, n) metres, motion of the object relative to the ray and normal to it, by axis.
    half_time : (n,) half the box's extent in shutter times.
    curvature : (n,) curvature of the surface, 1 / m; 0 for planes.
    cosine : (n,) cosine between the surface's normal and the ray, at least `ShapeSet.min_cosine`.
    axes : axes along which any of the boxes extends; along others all steps are 0.
    margin : extent of the region in which shadow edges are searched, in units of the patch's
    extent.
    """

    steps: Array
    surface_steps: Array
    view_steps: Array
    half_time: Array
    curvature: Array
    cosine: Array
    axes: tuple[int, ...]
    margin: float = 1.0

    @cached_property
    def radius(self) -> Array:
        """Radii of the patches around their points in metres, (n,): the sum of the lengths of the
        steps."""
        total: Array = np.zeros_like(self.half_time)
        for axis in self.axes:
            step = self.steps[axis]
            total += np.sqrt(dot(step, step))
        return total
