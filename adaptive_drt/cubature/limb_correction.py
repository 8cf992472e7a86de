# SPDX-License-Identifier: GPL-3.0-or-later
"""Correction of the multi-node rule near the limb of a sphere, where the normal varies as a root.

Towards the limb, the cosine v between a sphere's normal and the ray falls as the square root of the
distance u to the limb. Three or four nodes do not resolve that; but the square of v is nearly
linear in pixel and shutter time. So its mean and variance over a region are taken from the nodes,
and the mean of v is derived from those.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.error_coefficients import FOURTH_MOMENT_CORRECTION
from .regions import grouped_sums

__all__ = ["limb_gains"]


MIN_COSINE_DIFFERENCE = 2.0**-20
"""Smallest difference between the mean cosine of the nodes and that of the centroid, as a fraction
of the latter, that is used. A smaller one carries no information."""
MIN_SQUARED_COSINE = 2.0**-100
"""Smallest squared cosine that is not only rounding."""
MIN_RELATIVE_VARIANCE = 1e-6
"""Smallest relative variance of a root's argument that is used. Below it, the mean root differs
from the root of the mean by an eighth of the variance, as at this value."""
MIN_GAIN, MAX_GAIN = 0.5, 2.0
"""Bounds of the gain. Chosen, not fitted: they are met only where rounding makes the ratio of two
small differences meaningless."""


def limb_gains(
    cosine: Array, center: Array, weight: Array, kept: Array, region: Ints, axes: Ints
) -> Array:
    """Factors (m,) on the difference between the multi-node mean and the radiance at the centroid.

    Parameters
    ----------
    slant : (k,) cosines between normal and ray at the nodes of m subdomains.
    center : (m,) cosines at the centroids.
    weight : (k,) of the nodes in the means; the centroid has the rest to 1.
    kept : (k,) scale factors of the nodes' offsets, greater than 0.
    region : (k,) subdomain of each node.
    axes : (m,) along how many axes the subdomains have an extent.
    """
    count = center.size
    square = center * center
    away = cosine - center[region]
    more = cosine * cosine - square[region]
    shown = grouped_sums(region, weight * away, count)
    mean = grouped_sums(region, weight * more / (kept * kept), count)
    spread = grouped_sums(region, weight * (more / kept) ** 2, count) - mean * mean
    mean = np.maximum(square + mean, MIN_SQUARED_COSINE)
    true = np.sqrt(mean) * _mean_root(spread / (mean * mean), axes > 1) - center
    telling = np.abs(shown) > MIN_COSINE_DIFFERENCE * center
    gain = np.where(telling, true, 1.0) / np.where(telling, shown, 1.0)
    bounded: Array = np.clip(gain, MIN_GAIN, MAX_GAIN)
    return bounded


def _mean_root(spread: Array, peaked: Mask) -> Array:
    """Mean of u^(1/2) over the root of the mean of u, given the relative variance of u: (m,).

    Where u stays above 0, its density is taken to be uniform around the mean, with a correction
    where it is `peaked`, as in boxes of several axes that have a corner at 0. Where the variance is
    too large for that, it is taken to be u^p from 0 on, whose relative variance is 1 / ((p + 1) (p
    + 3)).
    """
    half = np.sqrt(3.0 * np.clip(spread, MIN_RELATIVE_VARIANCE, 1.0 / 3.0))
    even = ((1.0 + half) ** 1.5 - np.maximum(1.0 - half, 0.0) ** 1.5) / (3.0 * half)
    bulge = np.where(peaked, FOURTH_MOMENT_CORRECTION * np.maximum(1.0 / 3.0 - spread, 0.0), 0.0)
    even -= bulge * spread * spread
    power = np.sqrt(1.0 + 1.0 / np.maximum(spread, 1.0 / 3.0)) - 0.5
    root: Array = np.where(spread < 1.0 / 3.0, even, np.sqrt(1.0 - 0.25 / (power * power)))
    return root
