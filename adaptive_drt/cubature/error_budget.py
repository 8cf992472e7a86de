# SPDX-License-Identifier: GPL-3.0-or-later
"""The error that each pixel may have, so that the picture as a whole keeps its tolerance.

Pixels below the goal stay as they are, those above are refined to it. The greatest goal for which
the whole keeps its tolerance asks for the least work: where few pixels are hard, each of them may
be off by more than the picture may.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Mask

__all__ = ["GROWTH", "LEAST", "Goal", "Motion", "make_goal"]


REACHED = 0.575
"""Of what a pixel in which something moves may be off by with the cells that are foreseen of it:
what it ends with, RMS, where that is one ..."""
RISE = 0.02
"""... and how much more with each doubling of them. What is easy takes more cells than are foreseen
the lower the tolerance is, what is hard fewer (at 1, 0.1 and 0.01 % pixels of which one is foreseen
end with 0.55, 0.77 and 1.27 of that, those of 64 with 0.2 to 0.4). A picture has both. (116 random
scenes at these tolerances: estimates are 0.5 to 0.6 of the tolerance, median, and 5 of 348 above;
at 0.55 for all, and with steps in time not reckoned with, 7 of 43 were at 1 %.)"""
MOST_REACHED = 0.77
"""What it ends with at most."""
GROWTH = 0.3
"""Power of the number of its cells by which a refined pixel's goal grows. To bring the squares of
all errors to a given sum with the fewest cells, the next cell must gain the same everywhere: where
n cells leave an error of about c / n, its square gains 2 c^2 / n^3, so error^2 / n is the same: a
power of 0.5. But then few pixels have most of the error, and the whole hangs on how well theirs
are estimated (135 random scenes at 0.1 %, 0.5 and 0.3: 25 and 28 points a pixel, but 3 and 1
pictures beyond the tolerance)."""
POWER = GROWTH / (1.0 + GROWTH)
"""Of what a pixel's goal must fall to: by how much it grows on the way there."""
STILL_REACHED = 0.53
"""Of the goal, what pixels in which nothing moves end with, by how often what stars leave of them
is the goal, to the `POWER`: many are settled by their first star. (Still scenes of the benchmark
and 47 random ones, RMS: 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.2 and 1.5 of the goal where stars
leave 0.025, 0.1, 0.3, 0.7, 1.5, 6, 18, 48 and 100 of it.)"""
FIRST = 0.6
"""Of the error of a pixel in which something moves: c of that law, as its cells follow it."""
CUT = 0.05
"""Of the contrast: the error of pixels of which no more is known than that outlines cut them."""
CUT_CROWDED = 0.25
"""The same where many objects meet (median of 2 objects: 0.005 to 0.03 of the contrast, of 4: 0.1,
of 5 to 20: 0.15 to 0.5)."""
RESERVE = 0.72
"""Of the tolerance: what the goal is set for. The rest is for what estimates do not see, and for
pixels that end farther off than the law says. (210 random scenes: at 0.65, 0.72, 0.85 and 1 some 2,
4, 3 and 3 are beyond 0.01 %, none beyond 0.1 %; but from 0.85 on a tenth of the estimates of
pictures in which hard shadows move end above the tolerance.)"""
GRID = 1.01
"""Ratio of one goal to the next. What is left over the whole picture jumps where the goal passes a
pixel's own error, so the greatest goal is often just that, and whether the pixel is above it would
be for rounding to say. A goal on a grid lies on no pixel's error."""
GRID_START = 0.9
"""Of the tolerance: a goal of the grid; no number that errors and contrasts of round scenes are."""
WIDEST = 1e3
"""Of the tolerance: the greatest goal."""
LEAST = 2.0**-6
"""Of the tolerance: the least goal."""
DARK = 0.1
"""Of the error foreseen: the picture's mean where no sampled centre is lit."""


@dataclass(frozen=True)
class Motion:
    """Of n pixels, what is known of the shutter.

    Attributes
    ----------
    crowded : (n,) whether many objects may be seen in them.
    moves : (n,) whether anything moves in them: means over the shutter are taken at points.
    hard : (n,) what part of their errors points do not lessen, but cells across the picture.
    standing, steps : (n,) what means over the shutter leave of steps, and what of the errors only
        cells can lessen besides where that is more than the goal; inf where that is so in any case.
    """

    crowded: Mask
    moves: Mask
    hard: Array
    standing: Array
    steps: Array


@dataclass(frozen=True)
class Goal:
    """`error`: radiance a pixel may be off by, RMS over channels; `contrast`: that of regions."""

    error: float
    contrast: float


def make_goal(
    tolerance: float,
    color: Array,
    error: Array,
    starred: Array,
    cut: Mask,
    rest: tuple[float, int] = (0.0, 0),
    motion: Motion | None = None,
) -> Goal:
    """The goal of a picture.

    Parameters
    ----------
    tolerance : RMS error of the picture relative to its mean.
    color : (3, ...) radiance of a sample of its pixels.
    error : (n,) estimated errors of those that may be refined.
    starred : (n,) what stars leave of them where nothing moves.
    cut : (n,) pixels whose errors are not known but by refining them.
    rest : of those that stay as they are, the sum of their errors' squares, and how many.
    motion : where anything moves.
    """
    # where no centre is lit, what may be lit besides sets the scale
    mean = _mean(color) or DARK * _mean(error)
    if not mean > 0.0:
        return Goal(np.inf, 1.0)
    contrast = max(float(np.sqrt((color * color).mean())), mean)
    known = np.where(cut, CUT * contrast, error)
    if motion is not None:
        known[cut & motion.crowded] = CUT_CROWDED * contrast
    target = RESERVE * tolerance * mean
    scale = GRID_START * tolerance * mean
    # what is left over the picture grows with the goal
    low, high = int(np.log(LEAST) / np.log(GRID)), int(np.log(WIDEST) / np.log(GRID))
    small = known <= scale * GRID**low
    budget = target * target * (known.size + rest[1]) - rest[0]
    budget -= float((known[small] ** 2).sum())
    left = _Law.make(known, starred, cut, motion, ~small)
    if left(scale * GRID ** (high - 1)) <= budget:
        low = high - 1  # nothing need be refined: so it is with many a still picture
    while high - low > 1:
        middle = (low + high) // 2
        if left(scale * GRID**middle) > budget:
            high = middle
        else:
            low = middle
    return Goal(float(scale * GRID**low), contrast)


def _mean(values: Array) -> float:
    return float(np.abs(values).mean()) if values.size else 0.0


@dataclass(frozen=True)
class _Law:
    """What goals leave of the errors of m pixels.

    Attributes
    ----------
    error : (m,) before.
    slow : (m,) whether something moves in them, or outlines are all that is known.
    first : (m,) c to the `POWER`: they end where c / n, what n cells leave, is level n^GROWTH.
    steps : None where nothing moves; else (m,) steps, and c instead of `first` where those are
        more than the goal.
    """

    error: Array
    slow: Mask
    first: Array
    steps: tuple[Array, Array] | None

    @classmethod
    def make(
        cls, known: Array, starred: Array, cut: Mask, motion: Motion | None, some: Mask
    ) -> _Law:
        """The law of some pixels; arguments as in `make_goal`."""
        known, starred, cut = known[some], starred[some], cut[some]
        if motion is None:
            slow, steps = cut, None
            first = np.where(cut, FIRST * known, starred) ** POWER
        else:
            slow, hard = cut | motion.moves[some], motion.hard[some]
            first, stepped = (
                np.where(cut, FIRST * known, np.where(slow, FIRST * c, starred)) ** POWER
                for c in (hard, hard + motion.steps[some])
            )
            steps = motion.standing[some], stepped
        return cls(known, slow, first, steps)

    def __call__(self, level: float) -> float:
        """The sum of the squares of what a goal leaves."""
        first = self.first
        if self.steps is not None:
            standing, stepped = self.steps
            first = np.where(standing > level, stepped, first)
        grown = first * level**-POWER
        limit = np.maximum(grown, 1.0)
        reached = np.minimum(REACHED + RISE * np.log2(limit) / GROWTH, MOST_REACHED)
        after = level * np.where(self.slow, reached * limit, STILL_REACHED * grown)
        left = np.where(self.error > level, after, self.error)
        return float((left * left).sum())
