# SPDX-License-Identifier: GPL-3.0-or-later
"""A posteriori correction of predicted errors by the samples of the multi-node rule.

The difference between the rule's mean and the radiance at the centroid is about the error of the
centroid rule. If it is smaller than predicted, a predicted kink or step is probably absent; if it
is much larger, there is variation that was not predicted.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Ints
from ..numerics.error_coefficients import UNDETECTED_SHARE, UNPREDICTED_RATIO, UNPREDICTED_SHARE
from ..numerics.floats import TINY
from ..numerics.gather import columns
from ..numerics.vector import dot, rms
from ..shading.variation import KINK_KIND, ROOT_KIND, STEP_KIND
from .regions import grouped_sums

__all__ = ["correct_errors"]


CONFIRMING_DIFFERENCE = 0.5
"""Difference that confirms a prediction, as a fraction of the predicted error. A step with a
quarter of the nodes beyond it makes a difference equal to its predicted error; one with no nodes
beyond it makes none. Chosen, not fitted."""


def correct_errors(
    deviation: Array, foreseen: Array, off: Array, region: Ints, away: Array, offset: Array
) -> Array:
    """Correct the error estimates of the multi-node rule by its samples: (4, 3, m).

    Parameters
    ----------
    deviation : (4, 3, m) estimated errors of the means of m subdomains, by kind and axis.
    foreseen : (4, 3, m) predicted errors of the centroid rule.
    off : (3, m) radiance at the centroids less the means.
    region : (k,) subdomain of each node.  away : (3, k) radiance at the nodes less the means.
    offset : (3, k) of the nodes from the centroids, in half extents of the subdomains.
    """
    found, total = rms(off), foreseen.sum(axis=(0, 1))
    telling = CONFIRMING_DIFFERENCE * total
    share = np.clip(np.minimum(found, telling) / np.maximum(telling, TINY), UNDETECTED_SHARE, 1.0)
    deviation = deviation.copy()
    deviation[ROOT_KIND] *= share
    deviation[KINK_KIND] *= share
    deviation[STEP_KIND] *= share
    more = found - UNPREDICTED_RATIO * total
    odd = (more > 0.0).nonzero()[0]
    if odd.size:
        place = np.full(off.shape[1], -1)
        place[odd] = np.arange(odd.size)
        own = (place[region] >= 0).nonzero()[0]
        contrast = _axis_differences(
            place[region[own]], columns(away, own), columns(offset, own), odd.size
        )
        along = contrast.sum(axis=0)
        along = contrast / np.where(along > 0.0, along, 1.0)
        deviation[STEP_KIND][:, odd] += UNPREDICTED_SHARE * more[odd] * along
    return deviation


def _axis_differences(region: Ints, away: Array, offset: Array, count: int) -> Array:
    """Relative size of the samples' differences along each axis: (3, count), in arbitrary units."""
    contrast = np.zeros((3, count))
    for axis in range(3):
        for weight in (offset[axis], offset[axis] ** 2):
            part = np.array([grouped_sums(region, weight * row, count) for row in away])
            contrast[axis] += dot(part, part)
    return np.sqrt(contrast)
