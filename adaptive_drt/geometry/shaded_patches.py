# SPDX-License-Identifier: GPL-3.0-or-later
"""Patches of surfaces on which occluders may cast shadows."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from .patch import Patch

__all__ = ["ShadedPatches"]


@dataclass(frozen=True)
class ShadedPatches:
    """For each of m occluders, one of n patches of surfaces on which it may cast a shadow.

    Attributes
    ----------
    point : (3, n) metres, the middles of the patches, relative to the camera.
    normal : (3, n) unit normals there, on the viewer's side.
    inside : (n,) whether the patch is on the inner side of a closed surface.
    patch : the n patches.
    row : (m,) which patch each occluder is paired with.
    own : (m,) whether the patch lies on the occluder itself.
    time : shutter times of the patches' middles, a number or (m,).
    """

    point: Array
    normal: Array
    inside: Mask
    patch: Patch
    row: Ints
    own: Mask
    time: Array | float

    @property
    def places(self) -> Array:
        """Middles (3, m) of the patches, one for each occluder."""
        return columns(self.point, self.row)

    @property
    def half_time(self) -> Array:
        """Half the extents (m,) of the patches in shutter times."""
        half: Array = self.patch.half_time[self.row]
        return half

    @property
    def reach(self) -> Array:
        """Radii (m,) of the patches, metres."""
        reach: Array = self.patch.radius[self.row]
        return reach

    def step(self, axis: int) -> Array:
        """Motion (3, m) metres of the hits from the middles of the boxes to their sides."""
        return columns(self.patch.steps[axis], self.row)

    def take(self, rows: Ints) -> ShadedPatches:
        """The patches of the occluders selected by an index."""
        time = self.time[rows] if isinstance(self.time, np.ndarray) else self.time
        return replace(self, row=self.row[rows], own=self.own[rows], time=time)
