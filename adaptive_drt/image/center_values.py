# SPDX-License-Identifier: GPL-3.0-or-later
"""Light at the centres of sampled pixels that one object fills, and what pixel means follow from.

The radiance of such a pixel is that of the unhidden light, which is known exactly at the centre,
times the fraction that is visible. The mean of the unhidden light over the pixel follows from
second differences of neighbouring centres.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns, place
from ..numerics.midpoint import (
    FALLBACK_ERROR_FRACTION,
    SECOND_DIFFERENCE_WEIGHT,
    left,
    second_differences,
)
from ..numerics.vector import rms, total
from ..shading.center_light import CenterLight

__all__ = ["CenterValues"]


NOISE_WEIGHT = 70.0**-0.5
"""Weight of the fourth difference in the error of a mean where light varies within pixels, as on
meshes finer than pixels: centres are then independent samples, whose fourth difference has 70 times
their variance, and the error of one sample as the mean is its standard deviation. The differences
along both axes are added, as a margin."""


class CenterValues:
    """Light at the centres of some of the n pixels of a frame.

    Attributes
    ----------
    item : (n,) the object that fills each pixel, -1 where light at the centre is not known.
    unhidden, taken, fraction : (3, n) see `CenterLight`.
    mean, taken_mean : (3, n) means over pixels of `unhidden` and `taken`.
    variation : (n,) errors of these means.
    error : (n,) error of the light at the centre.
    first_fraction : (n,) mean visible fraction by the first few rays.
    reached : (n,) whether the visible part of a light may change within the pixel.
    usable : (n,) pixels whose mean follows from centres.
    """

    def __init__(self, width: int, count: int) -> None:
        """Nothing is known of the pixels of a frame of some width yet."""
        self._width = width
        self.item = np.full(count, -1)
        self.unhidden, self.fraction, self.mean = np.zeros((3, 3, count))
        # the system gives no memory to arrays that nobody touches
        self.taken, self.taken_mean = np.zeros((3, count)), np.zeros((3, count))
        self._any_taken = False
        self.variation, self.error, self.first_fraction = np.zeros((3, count))
        self.usable, self.reached = np.zeros((2, count), dtype=np.bool_)

    def enter(self, rows: Ints, light: CenterLight) -> None:
        """Enter the light at the centres of pixels."""
        place(self.unhidden, rows, light.unhidden)
        place(self.fraction, rows, light.fraction)
        if light.taken.any():
            place(self.taken, rows, light.taken)
            self._any_taken = True
        self.error[rows] = np.maximum(light.spread, light.unseen)

    def enter_first(self, rows: Ints, item: Ints, reached: Mask) -> None:
        """Enter the objects (k,) that fill pixels whose light is by the first few rays, and whether
        the visible part of it may change within them."""
        self.item[rows], self.reached[rows] = item, reached
        whole = columns(self.unhidden, rows)
        lit = total(whole)
        seen = total(whole * columns(self.fraction, rows))
        self.first_fraction[rows] = np.where(lit > 0.0, seen, 1.0) / np.where(lit > 0.0, lit, 1.0)

    def correct(self) -> Ints:
        """Find the means of the unhidden light, and the pixels (k,) that have one."""
        rows = (self.item >= 0).nonzero()[0]
        rows = rows[self._alike(rows, 1)]
        mean, off, noise = self._means(self.unhidden, rows)
        place(self.mean, rows, mean)
        if self._any_taken:
            mean, *more = self._means(self.taken, rows)
            place(self.taken_mean, rows, mean)
            off, noise = off + more[0], noise + more[1]
        rough = np.zeros(self.item.size)
        rough[rows] = NOISE_WEIGHT * np.sqrt(noise)
        # a single fourth difference is small now and then where light varies within pixels
        rough = np.maximum(rough[rows], np.maximum(rough[rows - 1], rough[rows + 1]))
        self.variation[rows] = np.maximum(off, rough)
        self.usable[rows] = True
        return rows

    def _means(self, values: Array, rows: Ints) -> tuple[Array, Array, Array]:
        """Means (3, k) over pixels of light (3, n) at centres, their errors (k,), and the squares
        (k,) of its fourth differences."""
        mean = columns(values, rows)
        off, noise = np.zeros((2, rows.size))
        for step in (1, self._width):
            before, bend, after = second_differences(values, rows, step)
            mean = mean + SECOND_DIFFERENCE_WEIGHT * bend
            wide = self.alike_along(rows, 2 * step)
            bent = FALLBACK_ERROR_FRACTION * rms(bend)
            off += np.where(wide, left(rms, before, bend, after), bent)
            noise += np.where(wide, rms(before - 2.0 * bend + after) ** 2, 0.0)
        return np.maximum(mean, 0.0), off, noise

    @property
    def color(self) -> Array:
        """Radiance (3, n) at centres."""
        found: Array = self.unhidden * self.fraction
        return found - self.taken if self._any_taken else found

    def mean_color(self, rows: Ints) -> Array:
        """Radiance (3, ...) of pixels whose visible fraction is that at their centres."""
        mean = columns(self.mean, rows) * columns(self.fraction, rows)
        return self.without_taken(mean, rows)

    def without_taken(self, color: Array, rows: Ints) -> Array:
        """Radiance (3, ...) from fractions of the unhidden light (3, ...), as means over pixels."""
        return color - columns(self.taken_mean, rows) if self._any_taken else color

    def fill_blocks(self, side: int) -> Mask:
        """Whether usable pixels (n,) lie in blocks of a side that one object fills.

        Blocks begin at multiples of their side in the frame, which the frame's sides are as well.
        """
        items = self.item.reshape(-1, side, self._width // side, side)
        low, high = items.min(axis=(1, 3)), items.max(axis=(1, 3))
        same = (low == high) & (low >= 0)
        wide = np.repeat(np.repeat(same, side, axis=0), side, axis=1)
        found: Mask = wide.ravel() & self.usable
        return found

    def _alike(self, rows: Ints, reach: int) -> Mask:
        """Whether pixels show the same object as those at a distance on all four sides."""
        across = self.alike_along(rows, reach)
        return across & self.alike_along(rows, reach * self._width)

    def alike_along(self, rows: Ints, step: int) -> Mask:
        """Whether pixels show the same object as those a step before and after."""
        x, count = rows % self._width, self.item.size
        if step < self._width:
            inside = (x >= step) & (x < self._width - step)
        else:
            inside = (rows >= step) & (rows < count - step)
        before, after = np.maximum(rows - step, 0), np.minimum(rows + step, count - 1)
        own = self.item[rows]
        alike: Mask = inside & (self.item[before] == own) & (self.item[after] == own)
        return alike
