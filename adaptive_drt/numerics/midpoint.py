# SPDX-License-Identifier: GPL-3.0-or-later
"""The mean over a pixel, from the values at its own middle and those of pixels around it.

The mean over a square is its middle's value and 1/24 of the second differences there. How far that
may be off is told by how those change from pixel to pixel.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .arrays import Array, Ints

__all__ = ["MEAN", "NEAR", "bends", "left"]


MEAN = 1.0 / 24.0
"""Of second differences: what they add to a middle for its square's mean."""
NEAR = 1.0 / 16.0
"""Of a second difference: how far it may be off where no more is known. A kink at a random place
within the pixel's breadth of it is off by 0.04 of it, RMS, and by 0.083 at most."""
FOURTH, THIRD = 1.0 / 32.0, 1.0 / 96.0
"""Of fourth differences, and of the third beside them: how far a mean may be off. Of fourths a kink
is off by 1/24 at most but where it lies beyond the pixel and leaves none; of the thirds by that."""


def bends(values: Array, index: Ints, step: int) -> tuple[Array, Array, Array]:
    """Second differences (k, m) of values (k, n) along an axis: at the pixels before some (m,), at
    those, and after them.

    step : from one pixel to the next along it. The first and the last say nothing where the pixels
        two steps away are not there.
    """
    row = [values.take(index + k * step, axis=1, mode="clip") for k in (-2, -1, 0, 1, 2)]
    before, bend, after = (a + b - 2.0 * c for a, c, b in zip(row, row[1:], row[2:], strict=False))
    return before, bend, after


def left(size: Callable[[Array], Array], before: Array, bend: Array, after: Array) -> Array:
    """How far means may be off by what is along one axis: (m,).

    Parameters
    ----------
    size : of changes (k, m), one number each.
    before, bend, after : (k, m) second differences along it at pixels, and at those beside them.
    """
    third = np.maximum(size(bend - before), size(after - bend))
    off: Array = np.maximum(FOURTH * size(before - 2.0 * bend + after), THIRD * third)
    return off
