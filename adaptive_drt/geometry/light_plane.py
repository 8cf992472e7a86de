# SPDX-License-Identifier: GPL-3.0-or-later
"""The planes of lights: only the parts of occluders in front of them block light."""

from __future__ import annotations

from dataclasses import dataclass

from ..numerics.arrays import Array
from ..numerics.vector import dot

__all__ = ["LightPlane"]


@dataclass(frozen=True)
class LightPlane:
    """The plane of a light, seen from n points; occluders behind it block none of its light.

    It is a quad light's own plane; for a disk, the disk's plane; for a sphere, the plane of the
    circle that is its silhouette.

    Attributes
    ----------
    normal : (3, n) unit vectors towards the front.
    point : (3, n) metres, a point of the plane relative to the points that see it.
    radius : (n,) metres, radius around `point` that contains the light.
    """

    normal: Array
    point: Array
    radius: Array

    def height_of(self, place: Array) -> Array:
        """Signed distance (metres) of positions (3, n) in front of the plane."""
        height: Array = dot(self.normal, place - self.point)
        return height
