# SPDX-License-Identifier: GPL-3.0-or-later
"""A light as it is seen from surface points, for the culling of occluders."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..geometry.light_protocol import ViewCone
from ..lights.bounds import LightBounds
from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from .intersect import Surface

__all__ = ["LightView"]


@dataclass(frozen=True)
class LightView:
    """A light and n points, with bounds that hold during the whole shutter.

    `bounds` enclose the light and its path, `cone` is the cone of directions to them from each
    point. `reach` (n,) metres and `curvature` (n,) 1 / m are the extent and the curvature of
    the surfaces around the points; `any_reach` is whether any reach is larger than 0.
    """

    light: Emitter
    bounds: LightBounds
    cone: ViewCone
    surface: Surface
    reach: Array
    curvature: Array
    any_reach: bool

    @classmethod
    def make(cls, light: Emitter, surface: Surface, reach: Array, bend: Array) -> LightView:
        bounds = light.swept_bounds()
        cone = bounds.view_cone(bounds.to_center(surface.point))
        return cls(light, bounds, cone, surface, reach, bend, bool((reach > 0.0).any()))

    def take(self, rows: Ints) -> LightView:
        """The view from some of the points."""
        cone = ViewCone(
            *(columns(each, rows, -1) for each in (
                self.cone.axis, self.cone.distance, self.cone.cosine, self.cone.sine,
                self.cone.near, self.cone.far,
            ))
        )  # fmt: skip
        return replace(
            self,
            cone=cone,
            surface=self.surface.take(rows),
            reach=self.reach[rows],
            curvature=self.curvature[rows],
        )

    def before_light_plane(self, center: Array, radius: Array) -> Mask | np.bool_:
        """Whether spheres reach before a light that emits to one side."""
        behind = self.light.is_behind(self.light.to_center(center), radius, path=True)
        return np.logical_not(behind)
