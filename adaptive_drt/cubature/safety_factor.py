# SPDX-License-Identifier: GPL-3.0-or-later
"""Safety factors on the error estimates of pixels, learnt from how far refinement changes them.

If an error estimate is right, the mean changes by about as much when cells are split. Where it
changes more, the errors of cells are larger than estimated, or have one sign: from then on the
pixel's estimate is multiplied by a factor.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array
from ..numerics.floats import TINY
from ..numerics.vector import rms

__all__ = ["update_factors"]


DECAY = 0.5
"""Decay of a factor from one round to the next. Chosen, not fitted (50 random scenes at 0.01 %:
without safety factors the two worst are at 2.3 and 1.5 of the tolerance, with them at 1.8 and 1.2
for 4 % more points)."""
MAX_FACTOR = 8.0
"""Largest factor: while a pixel has few cells, its mean may change by any amount. Chosen, not
fitted."""


def update_factors(factor: Array, change: Array, error: Array) -> Array:
    """Update the safety factors (n,) of pixels after a round of splits.

    Parameters
    ----------
    factor : (n,) factors before the round.
    change : (3, n) change of the mean radiance.
    error : (n,) error estimated before the round.
    """
    with np.errstate(over="ignore"):  # the estimate may be next to 0
        found = rms(change) / np.maximum(error, TINY)
    learnt: Array = np.clip(np.maximum(found, DECAY * factor), 1.0, MAX_FACTOR)
    return learnt
