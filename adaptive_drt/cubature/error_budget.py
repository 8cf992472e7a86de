# SPDX-License-Identifier: GPL-3.0-or-later
"""The error goal of pixels, such that the picture as a whole keeps its tolerance.

Pixels whose estimated error is below the goal stay as they are, the others are refined to it. The
largest goal for which the whole picture keeps its tolerance needs the least work: where few pixels
are hard, the error of each of them may exceed the tolerance of the picture.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..numerics.arrays import Array, Mask
from ..numerics.error_coefficients import (
    ACHIEVED_ERROR,
    ACHIEVED_RISE,
    BUDGETED_SHARE,
    CROWDED_PIXEL_ERROR,
    CUT_PIXEL_ERROR,
    MAX_ACHIEVED_ERROR,
    MIN_ACHIEVED_ERROR,
    MOTION_ERROR_SHARE,
    STILL_ACHIEVED_ERROR,
)
from .heap_limits import SamplingErrors

__all__ = ["GOAL_GROWTH", "GOAL_POWER", "MIN_GOAL", "Goal", "MotionErrors", "make_goal"]


GOAL_GROWTH = 0.3
"""Exponent of the number of its cells with which a refined pixel's goal grows. It is chosen, not
fitted. To bring the sum of squares of all errors to a given value with the fewest cells, the next
cell must gain the same everywhere: where n cells leave an error of about c / n, the square gains 2
c^2 / n^3, so error^2 / n is the same everywhere: an exponent of 0.5. But then few pixels have most
of the error, and the result depends on how well their errors are estimated (135 random scenes at
0.1 %, exponents 0.5 and 0.3: 25 and 28 points a pixel, but 3 and 1 pictures beyond the
tolerance)."""
GOAL_POWER = GOAL_GROWTH / (1.0 + GOAL_GROWTH)
"""Exponent by which a pixel's own goal follows from its error c as one cell: n cells leave c / n,
and c / n = goal n^`GOAL_GROWTH` where (c / goal)^`GOAL_POWER` = n^`GOAL_GROWTH`."""
GOAL_RATIO = 1.01
"""Ratio of successive goals in the discrete grid of goals. The error of the picture jumps where the
goal passes a pixel's own error, so the largest admissible goal is often equal to such an error, and
rounding would decide whether the pixel is above it. A goal on the grid coincides with no pixel's
error."""
GOAL_GRID_ORIGIN = 0.9
"""One goal of the grid, as a fraction of the tolerance. It is no ratio of errors and contrasts that
scenes made of round numbers have."""
MAX_GOAL = 1e3
"""Largest goal of the grid, as a multiple of the tolerance."""
MIN_GOAL = 2.0**-6
"""Smallest goal of the grid, as a fraction of the tolerance."""
LEAST_STEP = int(np.log(MIN_GOAL) / np.log(GOAL_RATIO))
"""Number of the smallest goal in the grid."""
UNLIT_MEAN_SHARE = 0.1
"""Mean radiance assumed for a picture of which no sampled pixel centre is lit, as a fraction of the
mean estimated error. Chosen, not fitted: it only has to set a scale."""


@dataclass(frozen=True)
class MotionErrors:
    """Error terms of n pixels that depend on motion during the shutter.

    Attributes
    ----------
    crowded : (n,) whether many objects may be visible in the pixel.
    moves : (n,) whether anything moves in it; its mean over the shutter is then taken at points.
    across : (n,) predicted errors across the picture. Integration over the shutter at a point does
        not reduce them, cells across the picture do.
    remaining_steps : (n,) error due to steps across the picture that remains in means over the
        shutter; inf if lights without extent may cast shadows.
    time_steps : (n,) error due to steps in time. Where `remaining_steps` exceeds the goal, only
        cells reduce it, and it is added to `across`.
    """

    crowded: Mask
    moves: Mask
    across: Array
    remaining_steps: Array
    time_steps: Array


@dataclass(frozen=True)
class Goal:
    """Error goal of a picture.

    `error` is the radiance error allowed for a pixel, RMS over channels; `contrast` the size of
    radiance differences between visible regions.
    """

    error: float
    contrast: float


def make_goal(
    tolerance: float,
    color: Array,
    error: Array,
    starred: Array,
    cut: Mask,
    rest: tuple[float, int] = (0.0, 0),
    motion: MotionErrors | None = None,
    by_rays: SamplingErrors | None = None,
) -> Goal:
    """Find the error goal of a picture.

    Parameters
    ----------
    tolerance : RMS error allowed in the picture, relative to its mean.
    color : (3, ...) radiance of a sample of its pixels.
    error : (n,) estimated errors of the pixels that may be refined.
    starred : (n,) the same under the multi-node rule, where nothing moves.
    cut : (n,) pixels cut by outlines, whose errors are unknown before refinement.
    rest : sum of the squared errors of all other pixels, and their number.
    motion : error terms due to motion, if anything moves.
    by_rays : of pixels that rays sample in heaps of spheres, which have a law of their own; None in
        other scenes.
    """
    # where no pixel centre is lit, the estimated errors set the scale
    mean = _mean(color) or UNLIT_MEAN_SHARE * _mean(error)
    if not mean > 0.0:
        return Goal(np.inf, 1.0)
    contrast = max(float(np.sqrt((color * color).mean())), mean)
    known = np.where(cut, CUT_PIXEL_ERROR * contrast, error)
    if motion is not None:
        known[cut & motion.crowded] = CROWDED_PIXEL_ERROR * contrast
    target = BUDGETED_SHARE * tolerance * mean
    scale = GOAL_GRID_ORIGIN * tolerance * mean
    small = known <= scale * GOAL_RATIO**LEAST_STEP
    budget = target * target * (known.size + rest[1]) - rest[0]
    budget -= float((known[small] ** 2).sum())
    left = _ErrorModel.make(known, starred, cut, motion, ~small)
    if by_rays is not None:
        left = replace(left, by_rays=by_rays.take(~small))
    return Goal(_largest_goal(left, scale, budget), contrast)


def _largest_goal(left: _ErrorModel, scale: float, budget: float) -> float:
    """The largest goal of the grid at which the remaining error keeps to a budget."""
    # bisection: the remaining error of the picture grows with the goal
    low, high = LEAST_STEP, int(np.log(MAX_GOAL) / np.log(GOAL_RATIO))
    if left(scale * GOAL_RATIO ** (high - 1)) <= budget:
        low = high - 1  # nothing has to be refined, as in many still pictures
    while high - low > 1:
        middle = (low + high) // 2
        if left(scale * GOAL_RATIO**middle) > budget:
            high = middle
        else:
            low = middle
    return float(scale * GOAL_RATIO**low)


def _mean(values: Array) -> float:
    return float(np.abs(values).mean()) if values.size else 0.0


@dataclass(frozen=True)
class _ErrorModel:
    """Model of the errors of m pixels after refinement to a given goal.

    Attributes
    ----------
    error : (m,) estimated errors before refinement.
    uses_motion_law : (m,) whether something moves in the pixel, or it is cut and its error unknown.
    first : (m,) c^`GOAL_POWER`, where n cells leave an error of c / n; refinement ends where that
        is goal n^`GOAL_GROWTH`.
    steps : None where nothing moves; else the remaining step errors (m,), and the values that
        replace `first` where those exceed the goal.
    by_rays : (m,) see `make_goal`.
    """

    error: Array
    uses_motion_law: Mask
    first: Array
    steps: tuple[Array, Array] | None
    by_rays: SamplingErrors | None = None

    @classmethod
    def make(
        cls, known: Array, starred: Array, cut: Mask, motion: MotionErrors | None, some: Mask
    ) -> _ErrorModel:
        """Make the model for the pixels at `some`; the other arguments as those of `make_goal`."""
        known, starred, cut = known[some], starred[some], cut[some]
        if motion is None:
            slow, steps = cut, None
            first = np.where(cut, MOTION_ERROR_SHARE * known, starred) ** GOAL_POWER
        else:
            slow, hard = cut | motion.moves[some], motion.across[some]
            first, stepped = (
                np.where(
                    cut, MOTION_ERROR_SHARE * known, np.where(slow, MOTION_ERROR_SHARE * c, starred)
                )
                ** GOAL_POWER
                for c in (hard, hard + motion.time_steps[some])
            )
            steps = motion.remaining_steps[some], stepped
        return cls(known, slow, first, steps)

    def __call__(self, level: float) -> float:
        """Sum of the squared errors that remain at a goal of `level`."""
        first = self.first
        if self.steps is not None:
            standing, stepped = self.steps
            first = np.where(standing > level, stepped, first)
        grown = first * level**-GOAL_POWER
        limit = np.maximum(grown, 1.0)
        reached = np.clip(
            ACHIEVED_ERROR + ACHIEVED_RISE * np.log2(limit) / GOAL_GROWTH,
            MIN_ACHIEVED_ERROR,
            MAX_ACHIEVED_ERROR,
        )
        after = level * np.where(
            self.uses_motion_law, reached * limit, STILL_ACHIEVED_ERROR * grown
        )
        left = np.where(self.error > level, after, self.error)
        if self.by_rays is not None:
            left = np.where(self.by_rays.sampled, self.by_rays.budgeted(level), left)
        return float((left * left).sum())
