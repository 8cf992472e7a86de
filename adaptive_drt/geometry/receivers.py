# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces on which shapes may cast the shadow of a light."""

from __future__ import annotations

from dataclasses import dataclass

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from .footprint import Footprint

__all__ = ["Receivers"]


@dataclass(frozen=True)
class Receivers:
    """Patches of surface, one for each of m shapes that may hide a light from it.

    Attributes
    ----------
    point : (3, m) metres, a point of each patch.
    own : (m,) whether the shape itself is the patch's surface.
    reach : (m,) metres, bound on the distance of the patch's points from `point`; 0 for points.
    footprint : footprints of pixels that bound patches more closely, or None.
    at : (m,) number of each patch's footprint.
    """

    point: Array
    own: Mask
    reach: Array
    footprint: Footprint | None
    at: Ints

    def take(self, rows: Ints) -> Receivers:
        """The patches selected by an index."""
        return Receivers(
            columns(self.point, rows),
            self.own[rows],
            self.reach[rows],
            self.footprint,
            self.at[rows],
        )
