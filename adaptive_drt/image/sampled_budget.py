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

__all__ = ["sampled_limits"]


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
