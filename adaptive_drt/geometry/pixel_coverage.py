# SPDX-License-Identifier: GPL-3.0-or-later
"""Coverage of pixels by shapes: what the rays of a pixel may hit, and at which depths."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Mask

__all__ = ["PixelCoverage"]


@dataclass(frozen=True)
class PixelCoverage:
    """Coverage of m pixels by one shape each, at mid-shutter or during the shutter.

    Attributes
    ----------
    may_hit : (m,) whether some ray of the pixel may hit the shape (at some time).
    covers : (m,) whether all rays of the pixel certainly hit it (all the time).
    near, far : (m,) lower and upper bounds on the ray parameters of those hits.
    """

    may_hit: Mask
    covers: Mask
    near: Array
    far: Array

    def of_enclosed(self, inside: Mask) -> PixelCoverage:
        """Coverage by shapes that lie somewhere within those that have this coverage.

        inside : (m,) whether the camera is inside, so that `near` is where rays leave the shape.
        """
        near = np.where(inside, 0.0, self.near)
        never = np.zeros_like(self.may_hit)
        return PixelCoverage(self.may_hit, never, near, np.full_like(near, np.inf))
