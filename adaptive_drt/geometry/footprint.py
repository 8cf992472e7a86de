# SPDX-License-Identifier: GPL-3.0-or-later
"""Footprints of pixels on surfaces, bounded by parallelograms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.vector import cross, dot

__all__ = ["Footprint"]


DISTANCE_ROUNDING = 2.0**-40
"""Generous bound on the relative rounding error of a distance from a parallelogram."""


@dataclass(frozen=True)
class Footprint:
    """Footprints of n pixels, bounded by parallelograms around the hits of the centre rays.

    Attributes
    ----------
    steps : two arrays (3, n), metres: from the centre to the midpoints of two adjacent sides.
    thickness : (n,) metres, bound on the distance of the surface from the parallelogram; inf where
        no parallelogram bounds it.
    """

    steps: tuple[Array, Array]
    thickness: Array

    def linear_variation(self, slope: Array, at: Ints) -> Array:
        """Largest change from the centre of linear functions of gradients `slope` (3, m): (m,)."""
        along = np.abs(dot(columns(self.steps[0], at), slope)) + np.abs(
            dot(columns(self.steps[1], at), slope)
        )
        with np.errstate(invalid="ignore"):  # a gradient of 0 over an unbounded footprint
            wide: Array = along + self.thickness[at] * np.sqrt(dot(slope, slope))
        return np.where(np.isnan(wide), np.inf, wide)

    def is_clear_of(self, v: Array, r: Array, at: Ints) -> Mask:
        """Whether balls certainly do not intersect footprints: (m,) bool.

        Parameters
        ----------
        v : (3, m) the balls' centres, relative to the footprints'.  r : (m,) their radii, metres.

        In its plane, the distance from a parallelogram is at least that from the line through a
        side: the coordinate along a step less 1, times the height over the other side.
        """
        a, b = columns(self.steps[0], at), columns(self.steps[1], at)
        with np.errstate(over="ignore", invalid="ignore"):  # out of float64's range: not clear
            normal = cross(a, b)
            square = dot(normal, normal)
            flat = square > 0.0
            safe = np.where(flat, square, 1.0)
            beyond = np.zeros_like(r)
            for along, side in ((dot(cross(v, b), normal), b), (dot(cross(a, v), normal), a)):
                height = np.sqrt(safe / np.where(flat, dot(side, side), 1.0))
                beyond = np.maximum(beyond, (np.abs(along) / safe - 1.0) * height)
            away = np.hypot(dot(v, normal) / np.sqrt(safe), beyond)
        clear: Mask = flat & (away * (1.0 - DISTANCE_ROUNDING) > r + self.thickness[at])
        return clear
