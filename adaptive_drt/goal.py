# SPDX-License-Identifier: GPL-3.0-or-later
"""The error that each pixel may have, so that the picture as a whole keeps its tolerance.

Pixels below the goal stay as they are, those above are refined to it. The greatest goal for which
the whole keeps its tolerance asks for the least work: where few pixels are hard, each of them may
be off by more than the picture may.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["Goal", "make_goal"]

Array: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]

REACHED = 0.6
"""Of the goal: the error that refined pixels end with, RMS; they stop at the first split below."""
GROWTH = 0.3
"""Power of the number of its cells by which a refined pixel's goal grows. To bring the squares of
all errors to a given sum with the fewest cells, the next cell must gain the same everywhere: where
n cells leave an error of about c / n, its square gains 2 c^2 / n^3, so error^2 / n is the same: a
power of 0.5. But then few pixels have most of the error, and the whole hangs on how well theirs
are estimated (135 random scenes at 0.1 %, 0.5 and 0.3: 25 and 28 points a pixel, but 3 and 1
pictures beyond the tolerance)."""
POWER = GROWTH / (1.0 + GROWTH)
"""Of what a pixel's goal must fall to: by how much it grows on the way there."""
FIRST = 0.4
"""Of a pixel's error as it is first foreseen: c of that law, as its cells come to follow it (0.27
of pixels in still scenes, RMS, over three decades; less where something moves)."""
CUT = 0.05
"""Of the contrast: the error of pixels of which no more is known than that outlines cut them."""
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
class Goal:
    """`error`: radiance a pixel may be off by, RMS over channels; `contrast`: that of regions."""

    error: float
    contrast: float


def make_goal(
    tolerance: float,
    color: Array,
    error: Array,
    hard: Array,
    cut: Mask,
    rest: tuple[float, int] = (0.0, 0),
    steps: tuple[Array, Array] | None = None,
) -> Goal:
    """The goal of a picture.

    Parameters
    ----------
    tolerance : RMS error of the picture relative to its mean.
    color : (3, ...) radiance of a sample of its pixels.
    error : (n,) estimated errors of those that may be refined.
    hard : (n,) what part of that only cells across the picture can lessen.
    cut : (n,) pixels whose errors are not known but by refining them.
    rest : of those that stay as they are, the sum of their errors' squares, and how many.
    steps : (n,) what means over the shutter leave of steps, and what of the error only cells can
        lessen besides where that is more than the goal; elsewhere points do.
    """
    # where no centre is lit, what may be lit besides sets the scale
    mean = _mean(color) or DARK * _mean(error)
    if not mean > 0.0:
        return Goal(np.inf, 1.0)
    contrast = max(float(np.sqrt((color * color).mean())), mean)
    known = np.where(cut, CUT * contrast, error)
    target = RESERVE * tolerance * mean
    scale = GRID_START * tolerance * mean
    # what is left over the picture grows with the goal
    low, high = int(np.log(LEAST) / np.log(GRID)), int(np.log(WIDEST) / np.log(GRID))
    small = known <= scale * GRID**low
    large = known[~small]
    budget = target * target * (known.size + rest[1]) - rest[0]
    budget -= float((known[small] ** 2).sum())
    standing, more = (hard, np.zeros_like(hard)) if steps is None else steps
    first, stepped = (
        (FIRST * np.where(cut, known, part)[~small]) ** POWER for part in (hard, hard + more)
    )
    standing = standing[~small]
    while high - low > 1:
        middle = (low + high) // 2
        level = scale * GRID**middle
        if _left(level, large, np.where(standing > level, stepped, first)) > budget:
            high = middle
        else:
            low = middle
    return Goal(float(scale * GRID**low), contrast)


def _mean(values: Array) -> float:
    return float(np.abs(values).mean()) if values.size else 0.0


def _left(level: float, large: Array, first: Array) -> float:
    """What a goal leaves of errors (m,): the sum of their squares.

    first : (m,) c of that law to the `POWER`; it ends where c / n, what n cells leave, is
        level n^GROWTH.
    """
    grown = np.maximum(first * level**-POWER, 1.0)
    left = np.where(large > level, REACHED * level * grown, large)
    return float((left * left).sum())
