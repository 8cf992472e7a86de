# SPDX-License-Identifier: GPL-3.0-or-later
"""Constants of float64, the type of all numbers in the core."""

from __future__ import annotations

import numpy as np

__all__ = ["TINY", "UNIT_ROUNDOFF"]

TINY = float(np.finfo(np.float64).tiny)
"""The smallest normal float64. Added to a divisor, it keeps the quotient of two zeros finite."""
UNIT_ROUNDOFF = 2.0**-53
"""The largest relative error of one rounded operation in float64."""
