# SPDX-License-Identifier: GPL-3.0-or-later
"""Corrections from pixel centres to pixel means by second differences, and the errors left by them.

Errors are predicted at each pixel's centre alone. Neighbouring centres tell more: where the same
object is visible in all of them, second differences give the mean, and their variation the
remaining error. In shadows, and near a light whose highlight is hardly wider than a pixel, that
overrides the prediction in either direction; elsewhere it may only reduce it, since a neighbour in
a penumbra says nothing of a pixel outside it.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.error_coefficients import REMAINING_ERROR
from ..numerics.gather import place
from ..numerics.midpoint import (
    FALLBACK_ERROR_FRACTION,
    SECOND_DIFFERENCE_WEIGHT,
    left,
    second_differences,
)
from ..numerics.vector import rms
from ..shading.variation import KINK_KIND, SMOOTH_KIND, STEP_KIND

__all__ = ["PixelCenters"]


MAX_CORRECTION = 2.0
"""Largest correction that is applied outside shadows, as a multiple of the predicted error. Chosen,
not fitted: a larger one means that the neighbours see something else."""
MIN_REMAINING_ERROR = 0.05
"""Smallest fraction of the predicted error due to bends that remains after a correction. Chosen,
not fitted: it keeps an estimate above 0 where all neighbours are alike by chance."""
KINK_LEFT = 0.62
"""Error that a correction by second differences leaves of a kink at a random place in a pixel, as a
fraction of the predicted one. Derived: of a kink of slope 1 at p pixels from the centre a midpoint
is off by (1/2 - p)^2 / 2 and corrected by (1 - p) / 24: the difference is 0.033 RMS, of 0.056,
which is 0.59; 5 % more is taken."""
KINK_SEEN = 1.0 / 12.0
"""Largest error so left, as a fraction of the second difference 1 - p."""
TWO_THREADS_PIXELS = 32_768
"""Number of pixels from which a second thread handles one of the axes; with fewer the two threads
wait for each other."""


@dataclass(frozen=True)
class PixelCenters:
    """Shaded centres of n pixels of an image, row by row.

    Attributes
    ----------
    width : of the image in pixels.  color : (3, n).  item : (n,) the visible object.
    steep : (n,) whether a shadow edge may reach the pixel, or light varies steeply there.
    deviation : (4, 3, m) predicted errors, by kind and axis, at places of their own: see
        `TracedVariation`. Updated in place.
    """

    width: int
    color: Array
    item: Ints
    steep: Mask
    deviation: Array

    def correct(self, index: Ints, places: Ints, threads: int = 1) -> Array:
        """Differences (3, m) between the means and the centres of some pixels.

        Their predicted errors, at `places` (m,), are replaced by the errors that remain after
        correction. Each pixel must have a neighbour on every side.
        """
        if threads == 1 or index.size < TWO_THREADS_PIXELS:
            return self._along(index, places, 0, 1) + self._along(index, places, 1, self.width)
        with ThreadPoolExecutor(1, "Render") as pool:
            other = pool.submit(self._along, index, places, 1, self.width)
            return self._along(index, places, 0, 1) + other.result()

    def _along(self, index: Ints, places: Ints, axis: int, step: int) -> Array:
        """Contribution of one axis, along which neighbouring pixels are `step` apart."""
        kinds = [kind[axis] for kind in self.deviation[:STEP_KIND]]
        deviation = np.array([kind.take(places) for kind in kinds])
        foreseen, sharp = deviation.sum(axis=0), self.steep[index]
        near = self._alike(index, step).nonzero()[0]
        before, beside, after = second_differences(self.color, index[near], step)
        off = left(rms, before, beside, after)
        bend = np.zeros((3, index.size))
        place(bend, near, beside)
        own = rms(bend)
        known = foreseen.copy()
        bent, widest = deviation[SMOOTH_KIND, near], self._widest(index, step, own)[near]
        known[near] += np.minimum(
            REMAINING_ERROR * widest - (1.0 - MIN_REMAINING_ERROR) * bent, 0.0
        )
        known = np.where(sharp, np.maximum(known, FALLBACK_ERROR_FRACTION * own), known)
        beyond = self._alike_beyond(index[near], step)
        far, off = near[beyond], off[beyond]
        known[far] = np.where(sharp[far], off, np.minimum(off, foreseen[far]))
        # a parabola leaves that of a kink within the pixel
        known = np.maximum(known, np.minimum(KINK_LEFT * deviation[KINK_KIND], KINK_SEEN * own))
        deviation *= np.minimum(known, foreseen) / np.where(foreseen > 0.0, foreseen, 1.0)
        deviation[KINK_KIND] += np.maximum(known - foreseen, 0.0)
        for kind, changed in zip(kinds, deviation, strict=True):
            kind[places] = changed
        likely = np.where(sharp, np.inf, MAX_CORRECTION * foreseen)
        too_large = SECOND_DIFFERENCE_WEIGHT * own > likely
        change: Array = (
            bend
            * np.where(too_large, likely, SECOND_DIFFERENCE_WEIGHT)
            / np.where(too_large, own, 1.0)
        )
        return change

    def _widest(self, index: Ints, step: int, own: Array) -> Array:
        """Largest correction of each pixel and its neighbours along an axis, given the sizes `own`
        (m,) of their second differences: (m,).
        """
        size = np.zeros(self.item.size)
        size[index] = own
        widest: Array = SECOND_DIFFERENCE_WEIGHT * np.maximum(
            own, np.maximum(size[index - step], size[index + step])
        )
        return widest

    def _alike(self, index: Ints, step: int) -> Mask:
        """Whether pixels show the same object as those a step before and after."""
        item = self.item[index]
        alike: Mask = (item == self.item[index - step]) & (item == self.item[index + step])
        return alike

    def _alike_beyond(self, index: Ints, step: int) -> Mask:
        """Whether pixels show the same object as those two steps before and after, if any."""
        y, x = np.divmod(index, self.width)
        place, count = (x, self.width) if step == 1 else (y, self.item.size // self.width)
        alike: Mask = (place >= 2) & (place < count - 2)
        rows = alike.nonzero()[0]
        alike[rows] = self._alike(index[rows], 2 * step)
        return alike
