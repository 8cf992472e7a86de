# SPDX-License-Identifier: GPL-3.0-or-later
"""What a star's samples say of what was foreseen from its centroid.

Their mean differs from the centroid's radiance by about what the centroid is off by. Where they
differ by less than foreseen, a kink or a step is likely not there; by more, something is that was
not foreseen.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Ints
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import dot, rms
from ..shading.variation import KINKS, ROOTS, STEPS
from .regions import sums

__all__ = ["weigh"]


TELLING = 0.5
"""Of what was foreseen: a difference that bears it out. A step with a quarter of the samples beyond
it makes one of its deviation; with none there is no difference."""
UNMET = 0.7
"""Of kinks and steps: what is left of them where no sample met them. They may lie between the
samples, and then cut off less than a quarter. (135 random scenes at 0.1 %: 0.5, 0.7 and 1 leave the
worst at 0.93, 0.80 and 0.79 of the tolerance, with 33, 37 and 41 points a pixel; 50 at 0.01 %, 0.5
and 0.7: at 1.8 and 1.6, with 292 and 315.)"""
SURPRISE = 2.0
"""Times what was foreseen: differences from there on show what was not."""
LEFT = 0.5
"""Of what was not foreseen: what the star may be off by, along the axes that its samples differ
along."""


def weigh(
    deviation: Array, foreseen: Array, off: Array, region: Ints, away: Array, offset: Array
) -> Array:
    """Deviations of stars, corrected by what their samples show: (4, 3, m).

    Parameters
    ----------
    deviation : (4, 3, m) of the means of m stars, by kind and axis.
    foreseen : (4, 3, m) of their centroids' samples.
    off : (3, m) radiance at the centroids less the means.
    region : (k,) which star each sample belongs to.  away : (3, k) their radiance, less the means.
    offset : (3, k) from their centroids, in half the extents of their parts.
    """
    found, total = rms(off), foreseen.sum(axis=(0, 1))
    telling = TELLING * total
    share = np.clip(np.minimum(found, telling) / np.maximum(telling, TINY), UNMET, 1.0)
    deviation = deviation.copy()
    deviation[ROOTS] *= share
    deviation[KINKS] *= share
    deviation[STEPS] *= share
    more = found - SURPRISE * total
    odd = (more > 0.0).nonzero()[0]
    if odd.size:
        place = np.full(off.shape[1], -1)
        place[odd] = np.arange(odd.size)
        own = (place[region] >= 0).nonzero()[0]
        contrast = _contrast(place[region[own]], columns(away, own), columns(offset, own), odd.size)
        along = contrast.sum(axis=0)
        along = contrast / np.where(along > 0.0, along, 1.0)
        deviation[STEPS][:, odd] += LEFT * more[odd] * along
    return deviation


def _contrast(region: Ints, away: Array, offset: Array, count: int) -> Array:
    """How much samples of stars differ along each axis: (3, count), in no unit in particular."""
    contrast = np.zeros((3, count))
    for axis in range(3):
        for weight in (offset[axis], offset[axis] ** 2):
            part = np.array([sums(region, weight * row, count) for row in away])
            contrast[axis] += dot(part, part)
    return np.sqrt(contrast)
