# SPDX-License-Identifier: GPL-3.0-or-later
"""Means over the shutter at the middles of pixels, which the pixels' own means are made of.

What moves is seen, and lit, for some part of the shutter, and that part changes slowly across the
picture: the mean over the shutter at a point of the picture is a smooth function even where each
moment's picture has edges. So the integral over time is taken at points, and the means of pixels
follow from those around them.
"""

from __future__ import annotations

import numpy as np

from ..cubature.adaptive import Refined
from ..cubature.error_budget import Goal
from ..numerics.arrays import Array, Ints
from ..numerics.gather import columns, place
from ..shading.variation import KINKS, ROOTS, STEPS, standing
from .buffers import Frame

__all__ = ["Points"]


ALLOWED = 0.6
"""Of the goal: what may come to what the points are off by."""


class Points:
    """The pixels of a frame in which something moves, and what has been found out about them.

    Attributes
    ----------
    wanted : (n,) pixels that are to be resolved.
    value : (4, n) radiance and coverage at the middles of pixels, means over the shutter.
    known : (n,) whether `value` is there.  error : (n,) how far it may be off.
    left : (n,) what the mean over the shutter leaves of steps across the picture.
    """

    def __init__(self, frame: Frame, goal: Goal) -> None:
        """No point is known but where nothing moves."""
        self.frame, self.goal = frame, goal
        moving = frame.mask[1]
        self.wanted = frame.chosen(goal) & moving
        self.known = (~moving & ~frame.outline) | frame.settled
        self.value = np.concatenate([frame.color, frame.alpha[None]])
        self.error = np.zeros(self.known.size)
        if self.wanted.any():
            # deviations are 0 where no ray of the first pass went
            self._rows = frame.traced.nonzero()[0]
            roots, kinks, steps = (
                columns(frame.deviation[kind], self._rows) for kind in (ROOTS, KINKS, STEPS)
            )
            self._across = [kind[0] + kind[1] for kind in (roots, kinks, steps)]
            self.left = self._everywhere(standing(steps))

    def rough(self, spacing: int) -> Array:
        """How far the light at the middle of the shutter may be off a quadratic: (n,).

        spacing : pixels from one point to the next.
        """
        root, kink, step = self._across
        return self._everywhere(spacing**1.5 * root + spacing * kink + step)

    def _everywhere(self, values: Array) -> Array:
        """Values (n,) of all pixels, given those that are not 0 for sure."""
        every = np.zeros(self.known.size)
        every[self._rows] = values
        return every

    @property
    def allowed(self) -> float:
        """How far pixels' means may be off beside what the points are off by."""
        return ALLOWED * self.goal.error

    def unknown(self, *rows: Ints) -> Ints:
        """Of some pixels those that are not known: ascending."""
        every = np.zeros(self.known.size, dtype=np.bool_)
        for some in rows:
            every[some] = True
        unknown: Ints = (every & ~self.known).nonzero()[0]
        return unknown

    def enter(self, rows: Ints, refined: Refined) -> None:
        """Enter the means over the shutter of some."""
        place(self.value[:3], rows, refined.color)
        self.value[3, rows] = refined.alpha
        self.error[rows] = refined.error
        self.known[rows] = True
        # what the first pass shaded is one of the points
        self.frame.count(rows, refined)

    def settle(self, rows: Ints, mean: Array, error: Array) -> None:
        """Enter means (4, m) of pixels that need no refining."""
        self.frame.settle(rows, np.maximum(mean[:3], 0.0), np.clip(mean[3], 0.0, 1.0), error)
        self.wanted[rows] = False

    def size(self, change: Array) -> Array:
        """Size (...) of changes (4, ...) of radiance and coverage, RMS over channels."""
        square: Array = (change[:3] ** 2).sum(axis=0) / 3.0
        if self.frame.plan.transparent:
            square = np.maximum(square, (self.goal.contrast * change[3]) ** 2)
        return np.sqrt(square)

    def values(self, rows: Ints) -> Array:
        """Values (4, ...) at pixels (...)."""
        return columns(self.value, rows)
