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
RESERVE = 0.7
"""Of the tolerance: what the goal is set for. The rest is for what estimates do not see."""
GRID = 1.01
"""Ratio of one goal to the next. What is left over the whole picture jumps where the goal passes a
pixel's own error, so the greatest goal is often just that, and whether the pixel is above it would
be for rounding to say. A goal on a grid lies on no pixel's error."""
GRID_START = 0.9
"""Of the tolerance: a goal of the grid; no number that errors and contrasts of round scenes are."""
WIDEST = 1e3
"""Of the tolerance: the greatest goal."""
DARK = 0.1
"""Of the error foreseen: the picture's mean where no sampled centre is lit."""


@dataclass(frozen=True)
class Goal:
    """`error`: radiance a pixel may be off by, RMS over channels; `contrast`: that of regions."""

    error: float
    contrast: float


def make_goal(tolerance: float, color: Array, error: Array, cut: Mask) -> Goal:
    """The goal of a picture.

    Parameters
    ----------
    tolerance : RMS error of the picture relative to its mean.
    color : (3, n) radiance of a sample of its pixels.  error : (n,) estimated errors.
    cut : (n,) pixels whose errors are not known but by refining them.
    """
    mean = float(np.abs(color).mean()) if color.size else 0.0
    known = np.where(cut, np.inf, error)
    if not mean > 0.0:
        # no centre is lit: what may be lit besides sets the scale
        mean = DARK * (float(error.mean()) if error.size else 0.0)
    if not mean > 0.0:
        return Goal(np.inf, 1.0)
    contrast = float(np.sqrt((color * color).mean()))
    target = RESERVE * tolerance * mean
    scale = GRID_START * tolerance * mean
    # what is left over the picture grows with the goal; below the target it is never too much
    low = int(np.log(RESERVE / GRID_START) / np.log(GRID)) - 1
    high = int(np.log(WIDEST) / np.log(GRID))
    large = known[known > target]
    budget = target * target * known.size - float((known[known <= target] ** 2).sum())
    while high - low > 1:
        middle = (low + high) // 2
        level = scale * GRID**middle
        left = np.where(large > level, REACHED * level, large)
        if float((left * left).sum()) > budget:
            high = middle
        else:
            low = middle
    return Goal(float(scale * GRID**low), max(contrast, mean))
