# SPDX-License-Identifier: GPL-3.0-or-later
"""What error sampled pixels may have."""

from __future__ import annotations

import numpy as np

from ..cubature.error_budget import GOAL_POWER
from ..numerics.arrays import Array
from ..numerics.error_coefficients import (
    ACHIEVED_ERROR,
    MOTION_ERROR_SHARE,
    STILL_ACHIEVED_ERROR,
)
from ..numerics.floats import TINY

__all__ = ["sampled_limits", "sampled_rise"]


SAMPLED_RISE, FULL_RISE, NO_RISE = 1.7, 1e-2, 1e-3
"""Factor of the goal for pixels that show meshes or are shaded by them, the tolerance from which it
is taken, and that up to which there is none. The law behind the goal counts on larger errors than
such pixels end at. At 1 %, 28 random scenes (`benchmarks/mesh_tolerance.py`, seeds 55 to 82) state
errors of 0.71 to 0.89 of the tolerance with it, and have up to 0.65; without it they state 0.5 to
0.6, and have up to 0.5. At 0.1 % all of the tolerance may be stated without it."""
SAMPLED_END = 0.75
"""Error at which the sampling of a pixel ends on average, as a fraction of its limit: the number of
points is doubled, and the error then falls to about half."""


def sampled_limits(error: Array, goal: float, motion: bool) -> Array:
    """Limits (n,) of the errors of pixels, from the errors (n,) by their first points.

    They are such that the errors end where `make_goal` expects those of cells to end, which grow
    with the number of cells.
    """
    share, end = (MOTION_ERROR_SHARE, ACHIEVED_ERROR) if motion else (1.0, STILL_ACHIEVED_ERROR)
    grown = np.maximum(share * error / max(goal, TINY), 1.0) ** GOAL_POWER
    limits: Array = end / SAMPLED_END * goal * grown
    return limits


def sampled_rise(tolerance: float, motion: bool) -> float:
    """Factor of the goal of a picture for pixels that show meshes or are shaded by them."""
    steps = np.log(tolerance / NO_RISE) / np.log(FULL_RISE / NO_RISE)
    # the law for motion expects more to be left, and so do the limits of pixels
    full = SAMPLED_RISE * (STILL_ACHIEVED_ERROR / ACHIEVED_ERROR if motion else 1.0)
    return 1.0 + (full - 1.0) * float(np.clip(steps, 0.0, 1.0))
