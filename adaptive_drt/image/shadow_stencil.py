# SPDX-License-Identifier: GPL-3.0-or-later
"""Means of sampled pixels by a stencil: second differences of the light at neighbouring centres.

For pixels that no block of `shadow_blocks` has resolved, such as those near outlines and where
shadows begin. The change of the differences from pixel to pixel gives the error: see `midpoint`.
What lies between centres is not seen by these: see `shadow_corners`.
"""

from __future__ import annotations

import numpy as np

from ..cubature.error_budget import Goal
from ..cubature.sampled_centers import SampledCenters
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.midpoint import (
    FALLBACK_ERROR_FRACTION,
    SECOND_DIFFERENCE_WEIGHT,
    left,
    second_differences,
)
from ..numerics.vector import rms
from .frame import Frame
from .shadow_blocks import INTERPOLATION_ERROR_SHARE
from .shadow_corners import STENCIL_ERROR_SHARE, StencilEstimates

__all__ = ["ShadowStencil"]


class ShadowStencil:
    """The pixels whose light is still to be found from centres, one by one."""

    def __init__(self, frame: Frame, goal: Goal) -> None:
        """Find the candidate pixels; no values are requested yet."""
        assert frame.centers is not None
        self._frame, self._goal, self._centers = frame, goal, frame.centers
        wanted = frame.unsettled_centers(goal) & frame.interpolates_shadows
        self._pixels: Ints = wanted.nonzero()[0]

    @property
    def node_limit(self) -> float:
        """Error of the light at centres that is small enough, as a radiance."""
        return STENCIL_ERROR_SHARE * self._goal.error

    def missing_pixels(self) -> Ints:
        """Pixels whose light these pixels need and that is not yet known: ascending indices."""
        every = np.zeros(self._centers.item.size, dtype=np.bool_)
        every[self._pixels] = True
        for step in (1, self._frame.width):
            for reach in (step, 2 * step):
                some = self._pixels[self._centers.alike_along(self._pixels, reach)]
                every[some - reach] = True
                every[some + reach] = True
        unknown: Ints = (every & ~self._known).nonzero()[0]
        return unknown

    @property
    def _known(self) -> Mask:
        known: Mask = self._centers.error <= self.node_limit
        return known

    def enter(self, rows: Ints, found: SampledCenters) -> None:
        """Enter the light at centres."""
        self._centers.enter(rows, found.light)

    def estimates(self) -> StencilEstimates:
        """Means of the pixels whose estimated error is small enough."""
        rows, centers = self._pixels, self._centers
        color = centers.color
        mean, off = columns(color, rows), np.zeros(rows.size)
        for step in (1, self._frame.width):
            before, bend, after = second_differences(color, rows, step)
            mean = mean + SECOND_DIFFERENCE_WEIGHT * bend
            off = np.maximum(off, self._off(rows, step, before, bend, after))
        off = np.maximum(off, centers.variation[rows])
        sure = (off <= INTERPOLATION_ERROR_SHARE * self._goal.error).nonzero()[0]
        rows = rows[sure]
        mean = np.maximum(columns(mean, sure), self._frame.plan.least_radiance)
        return StencilEstimates(rows, columns(color, rows), mean, centers.error[rows], off[sure])

    def _off(self, rows: Ints, step: int, before: Array, bend: Array, after: Array) -> Array:
        """Estimated error of the means due to the variation along one axis: (m,)."""
        some = self._centers.alike_along(rows, 2 * step)
        off: Array = FALLBACK_ERROR_FRACTION * rms(bend)
        return np.where(some, left(rms, before, bend, after), off)
