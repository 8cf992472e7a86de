# SPDX-License-Identifier: GPL-3.0-or-later
"""Constants of float64, the floating-point type of the core, and of float32, that of embree."""

from __future__ import annotations

import numpy as np

__all__ = ["FLOAT32_ROUNDOFF", "TINY", "UNIT_ROUNDOFF"]

TINY = float(np.finfo(np.float64).tiny)
"""Smallest normal float64. As a lower bound of a divisor, or added to it, it makes 0 / 0 finite."""
UNIT_ROUNDOFF = 2.0**-53
"""Largest relative error of one correctly rounded float64 operation, written u elsewhere."""
FLOAT32_ROUNDOFF = 2.0**-24
"""Largest relative rounding error of a float32 operation."""
