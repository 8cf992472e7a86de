# SPDX-License-Identifier: GPL-3.0-or-later
"""Midpoint rule with a second-difference correction: pixel means from values at pixel centres.

The mean over a square is the value at its centre plus 1/24 of the second differences there. The
error is estimated from how these differences change from pixel to pixel.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .arrays import Array, Ints
from .error_coefficients import FALLBACK_ERROR_FRACTION, FOURTH_DIFFERENCE_WEIGHT

__all__ = ["FALLBACK_ERROR_FRACTION", "SECOND_DIFFERENCE_WEIGHT", "left", "second_differences"]


SECOND_DIFFERENCE_WEIGHT = 1.0 / 24.0
"""Weight of a second difference in the mean over a pixel, by Taylor expansion about its centre."""
THIRD_DIFFERENCE_WEIGHT = 1.0 / 96.0
"""Weight, in the error estimate of a mean, of the larger of the two third differences beside it;
the fourth difference has `FOURTH_DIFFERENCE_WEIGHT`. A kink causes an error of at most 1/24 of the
fourth difference, except where it lies outside the pixel and the fourth difference is 0; there the
error is at most 1/24 of the third difference. Chosen, not fitted: a quarter of that bound, as few
kinks lie just there."""


def second_differences(values: Array, index: Ints, step: int) -> tuple[Array, Array, Array]:
    """Return second differences (k, m) along one axis at the previous, given and next pixels.

    Parameters
    ----------
    values : (k, n) k channels of n pixels.
    index : (m,) the given pixels.
    step : offset in `values` from one pixel to the next along the axis.

    The first and last result are meaningless where the pixels two steps away do not exist.
    """
    row = [values.take(index + k * step, axis=1, mode="clip") for k in (-2, -1, 0, 1, 2)]
    before, bend, after = (a + b - 2.0 * c for a, c, b in zip(row, row[1:], row[2:], strict=False))
    return before, bend, after


def left(size: Callable[[Array], Array], before: Array, bend: Array, after: Array) -> Array:
    """Return the error estimate (m,) of means from the differences along one axis.

    Parameters
    ----------
    size : norm of changes (k, m), returns (m,).
    before, bend, after : (k, m) second differences along the axis, from `second_differences`.
    """
    third = np.maximum(size(bend - before), size(after - bend))
    off: Array = np.maximum(
        FOURTH_DIFFERENCE_WEIGHT * size(before - 2.0 * bend + after),
        THIRD_DIFFERENCE_WEIGHT * third,
    )
    return off
