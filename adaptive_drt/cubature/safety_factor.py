# SPDX-License-Identifier: GPL-3.0-or-later
"""What refining a pixel tells of its estimated error.

An honest estimate is about how far the mean moves when cells are split. Where it moves farther, the
cells' errors are larger than foreseen, or have one sign: they are taken with a factor from then on.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array
from ..numerics.floats import TINY
from ..numerics.vector import rms

__all__ = ["learn"]


KEPT = 0.5
"""Of a factor: what is left of it after another round. (50 random scenes at 0.01 %: without any the
two worst are at 2.3 and 1.5 of the tolerance, with it at 1.8 and 1.2 for 4 % more points.)"""
MOST = 8.0
"""The factor at most: pixels that have hardly been looked into may move by any amount."""


def learn(factor: Array, change: Array, error: Array) -> Array:
    """Factors (n,) on the errors of pixels after a round of splits.

    Parameters
    ----------
    factor : (n,) before.  change : (3, n) of the mean radiance.  error : (n,) estimated before.
    """
    with np.errstate(over="ignore"):  # an error of next to nothing
        found = rms(change) / np.maximum(error, TINY)
    learnt: Array = np.clip(np.maximum(found, KEPT * factor), 1.0, MOST)
    return learnt
