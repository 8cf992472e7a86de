# SPDX-License-Identifier: GPL-3.0-or-later
"""Predicted errors of those pixels of a picture that have any, by kind and axis.

They are twelve numbers a pixel. Most pixels of a smooth picture lie in smooth blocks and have none,
so that a place is only taken when errors are entered.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Ints
from ..numerics.gather import columns, place
from ..shading.variation import zero_variation

__all__ = ["TracedVariation"]


class TracedVariation:
    """Predicted errors (4, 3) of n pixels: see `variation`.

    Attributes
    ----------
    values : (4, 3, m) of the places. The first one holds the zeros of all pixels without one, and
        those that are not taken are never touched, so that the system gives them no memory.
    """

    def __init__(self, count: int) -> None:
        """All are zero."""
        self.values = zero_variation(count + 1)
        self._place, self._used = np.zeros(count, dtype=np.int32), 1

    def places(self, index: Ints) -> Ints:
        """Places (k,) in `values` of some pixels, each of which then has one of its own."""
        lacking = index[self._place[index] == 0]
        end = self._used + lacking.size
        self._place[lacking] = np.arange(self._used, end)
        self._used = end
        return self._place[index].astype(np.int64)

    def of(self, index: Ints) -> Array:
        """Predicted errors (4, 3, k) of some pixels."""
        return columns(self.values, self._place[index], -1)

    def enter(self, index: Ints, values: Array) -> None:
        """Enter the predicted errors (4, 3, k) of some pixels, of which none is given twice."""
        place(self.values, self.places(index), values)
