# SPDX-License-Identifier: GPL-3.0-or-later
"""What pixels' means differ from their middles by, and how far they may still be off then.

Deviations are foreseen from a pixel's middle alone. Middles around it tell more: where the same
object is seen in all of them, second differences give the mean, and how those change tells what is
left. In shadows, and by a light so near that its peak is hardly wider than a pixel, that counts for
more than what was foreseen, in either direction; elsewhere a neighbour in a penumbra says nothing
of a pixel that none reaches.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import place
from ..numerics.midpoint import MEAN, NEAR, bends, left
from ..numerics.vector import rms
from ..shading.variation import BENDS, KINKS, STEPS

__all__ = ["Middles"]


LIKELY = 2.0
"""Of the error foreseen: the largest correction that is believed."""
CORRECTED = 0.3
"""Of a second difference's term: how far a pixel may be off once it has been added, about."""
TRUSTED = 0.05
"""Of the error foreseen: how far second differences are trusted beyond it."""
SHARED = 32_768
"""Pixels from which a second thread takes one of the axes; with fewer the two wait for each
other."""


@dataclass(frozen=True)
class Middles:
    """n pixels of a table, row by row, as their middles were shaded.

    Attributes
    ----------
    width : of the table.  color : (3, n).  item : (n,) the object that is seen.
    sharp : (n,) whether a shadow's edge may be on it, or light that changes steeply.
    deviation : (4, 3, n) foreseen, by kind and axis: see `variation`.
    """

    width: int
    color: Array
    item: Ints
    sharp: Mask
    deviation: Array

    def correct(self, index: Ints, threads: int = 1) -> Array:
        """What the means of some pixels differ from their middles by: (3, m).

        Their deviations become what they may be off by then. They have a pixel on each side.
        """
        if threads == 1 or index.size < SHARED:
            return self._along(index, 0, 1) + self._along(index, 1, self.width)
        with ThreadPoolExecutor(1, "Render") as pool:
            other = pool.submit(self._along, index, 1, self.width)
            return self._along(index, 0, 1) + other.result()

    def _along(self, index: Ints, axis: int, step: int) -> Array:
        """The same of what is along one axis, whose pixels are a step apart."""
        kinds = [kind[axis] for kind in self.deviation[:STEPS]]
        deviation = np.array([kind.take(index) for kind in kinds])
        foreseen, sharp = deviation.sum(axis=0), self.sharp[index]
        near = self._alike(index, step).nonzero()[0]
        before, beside, after = bends(self.color, index[near], step)
        off = left(rms, before, beside, after)
        bend = np.zeros((3, index.size))
        place(bend, near, beside)
        own = rms(bend)
        known = foreseen.copy()
        bent, widest = deviation[BENDS, near], self._widest(index, step, own)[near]
        known[near] += np.minimum(CORRECTED * widest - (1.0 - TRUSTED) * bent, 0.0)
        known = np.where(sharp, np.maximum(known, NEAR * own), known)
        beyond = self._alike_beyond(index[near], step)
        far, off = near[beyond], off[beyond]
        known[far] = np.where(sharp[far], off, np.minimum(off, foreseen[far]))
        deviation *= np.minimum(known, foreseen) / np.where(foreseen > 0.0, foreseen, 1.0)
        deviation[KINKS] += np.maximum(known - foreseen, 0.0)
        for kind, changed in zip(kinds, deviation, strict=True):
            kind[index] = changed
        likely = np.where(sharp, np.inf, LIKELY * foreseen)
        too_large = MEAN * own > likely
        change: Array = bend * np.where(too_large, likely, MEAN) / np.where(too_large, own, 1.0)
        return change

    def _widest(self, index: Ints, step: int, own: Array) -> Array:
        """Of what second differences `own` (m,) add, the largest of a pixel's and its neighbours'
        along an axis: (m,)."""
        size = np.zeros(self.item.size)
        size[index] = own
        widest: Array = MEAN * np.maximum(own, np.maximum(size[index - step], size[index + step]))
        return widest

    def _alike(self, index: Ints, step: int) -> Mask:
        """Whether pixels show what those a step before and after show."""
        item = self.item[index]
        alike: Mask = (item == self.item[index - step]) & (item == self.item[index + step])
        return alike

    def _alike_beyond(self, index: Ints, step: int) -> Mask:
        """Whether they show what those two steps before and after show, if those are there."""
        y, x = np.divmod(index, self.width)
        place, count = (x, self.width) if step == 1 else (y, self.item.size // self.width)
        alike: Mask = (place >= 2) & (place < count - 2)
        rows = alike.nonzero()[0]
        alike[rows] = self._alike(index[rows], 2 * step)
        return alike
