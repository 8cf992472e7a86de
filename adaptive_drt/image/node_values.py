# SPDX-License-Identifier: GPL-3.0-or-later
"""Means over the shutter at pixel centres, from which pixel means are interpolated.

A moving object is visible, and lit, for some fraction of the shutter, and that fraction varies
slowly across the picture: the mean over the shutter at a point of the picture is a smooth function
even where the picture at each instant has edges. So the integral over time is computed at points,
and pixel means follow from those in the neighbourhood.
"""

from __future__ import annotations

import numpy as np

from ..cubature.adaptive import RefinedPixels
from ..cubature.error_budget import Goal
from ..numerics.arrays import Array, Ints
from ..numerics.gather import columns, place
from ..shading.variation import KINK_KIND, ROOT_KIND, STEP_KIND, steps_after_shutter
from .frame import Frame

__all__ = ["NodeValues"]


INTERPOLATION_ERROR_SHARE = 0.6
"""Largest interpolation error allowed, as a fraction of the goal; the error of the node values
comes on top. Chosen for cost, not fitted."""


class NodeValues:
    """Node values: the pixels of a frame in which something moves, and shutter means at their
    centres.

    Attributes
    ----------
    wanted : (n,) pixels that are still to be resolved.
    value : (4, n) radiance and coverage at pixel centres, means over the shutter.
    known : (n,) whether `value` is known.  error : (n,) its estimated error.
    sampling : (n,) the part of that due to light that is not exact: see `Cells`.
    remaining_steps : (n,) error due to steps across the picture that remains in means over the
        shutter.
    """

    def __init__(self, frame: Frame, goal: Goal) -> None:
        """Values are known only where nothing moves, or where pixels are settled."""
        self.frame, self.goal = frame, goal
        moving = frame.mask[1]
        self.wanted = frame.chosen(goal) & moving
        self.known = (~moving & ~frame.outline) | frame.settled
        self.value = np.concatenate([frame.color, frame.alpha[None]])
        # where nothing moves, the light at the centre may still be an estimate
        self.sampling = np.where(self.known, frame.sampling, 0.0)
        self.error = self.sampling.copy()
        if self.wanted.any():
            # predicted errors are 0 in pixels that the first pass did not trace
            self._rows = frame.traced.nonzero()[0]
            deviation = frame.variation.of(self._rows)
            roots, kinks, steps = (deviation[kind] for kind in (ROOT_KIND, KINK_KIND, STEP_KIND))
            self._across = [kind[0] + kind[1] for kind in (roots, kinks, steps)]
            self.remaining_steps = self._everywhere(steps_after_shutter(steps))

    def predicted_deviation(self, spacing: int) -> Array:
        """Predicted deviation of the radiance at mid-shutter from a quadratic polynomial: (n,).

        spacing : pixels between nodes.
        """
        root, kink, step = self._across
        return self._everywhere(spacing**1.5 * root + spacing * kink + step)

    def _everywhere(self, values: Array) -> Array:
        """Expand values of the traced pixels to all pixels (n,), with 0 elsewhere."""
        every = np.zeros(self.known.size)
        every[self._rows] = values
        return every

    @property
    def allowed(self) -> float:
        """Largest interpolation error allowed of a pixel mean, in radiance."""
        return INTERPOLATION_ERROR_SHARE * self.goal.error

    def unknown(self, *rows: Ints) -> Ints:
        """Pixels, among those given, whose values are not known: ascending indices."""
        every = np.zeros(self.known.size, dtype=np.bool_)
        for some in rows:
            every[some] = True
        unknown: Ints = (every & ~self.known).nonzero()[0]
        return unknown

    def enter(self, rows: Ints, refined: RefinedPixels) -> None:
        """Enter computed means over the shutter."""
        place(self.value[:3], rows, refined.color)
        self.value[3, rows] = refined.alpha
        self.error[rows], self.sampling[rows] = refined.error, refined.sampling
        self.known[rows] = True
        # the point shaded by the first pass is one of the samples
        self.frame.count_samples(rows, refined.samples)

    def settle(self, rows: Ints, mean: Array, error: Array, sampling: Array) -> None:
        """Enter means (4, m) of pixels that need no refinement."""
        color = np.maximum(mean[:3], self.frame.plan.least_radiance)
        alpha = np.clip(mean[3], 0.0, 1.0)
        self.frame.settle(rows, color, alpha, error, sampling)
        self.wanted[rows] = False

    def size(self, change: Array) -> Array:
        """Sizes (...) of differences (4, ...) of radiance and coverage, RMS over channels."""
        square: Array = (change[:3] ** 2).sum(axis=0) / 3.0
        if self.frame.plan.transparent:
            square = np.maximum(square, (self.goal.contrast * change[3]) ** 2)
        return np.sqrt(square)

    def values(self, rows: Ints) -> Array:
        """Values (4, ...) at pixel indices (...)."""
        return columns(self.value, rows)
