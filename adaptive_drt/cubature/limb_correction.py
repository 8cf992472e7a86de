# SPDX-License-Identifier: GPL-3.0-or-later
"""What stars miss at the rims of spheres, where the normal turns as a root does.

Towards its rim a sphere's slant v, the cosine between normal and ray, falls as the root of the
distance u to the rim. Three or four samples do not see how fast; but its square is all but linear
in pixel and shutter, so its mean and spread over a part follow from the samples, and the mean of v
from those.
"""

from __future__ import annotations

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from .regions import sums

__all__ = ["rim_gains"]


FLAT = 2.0**-20
"""Of the slant: less than that between samples and centroid says nothing."""
GRAZING = 2.0**-100
"""Square of a slant: less is nothing but rounding."""
SMALL = 1e-6
"""Relative variance of a root's argument: below, its eighth is all that is left to tell."""
PEAKED = 0.2
"""Of s^4 (1/3 - s^2): what the mean of a root is less than that of an even density. From 0 at a
corner of a box of n equal axes on, s^2 = 1 / (3 n), the fourth moment is s^4 (9/5 + 18/5 (1/3 -
s^2)), and the mean root falls by 5/128 of it; the powers above add two fifths."""
LEAST, MOST = 0.5, 2.0
"""Of what samples show: bounds of what is made of it."""


def rim_gains(
    slant: Array, center: Array, weight: Array, kept: Array, region: Ints, axes: Ints
) -> Array:
    """Times which to take what the means of stars differ by from the radiance at their centroids.

    Parameters
    ----------
    slant : (k,) of the samples of m stars.  center : (m,) at their centroids.
    weight : (k,) of the samples in the means; what is missing to 1 is the centroid's.
    kept : (k,) part of their arms that is left of them, more than 0.
    region : (k,) which star each belongs to.  axes : (m,) how many axes stars extend along.
    """
    count = center.size
    square = center * center
    away = slant - center[region]
    more = slant * slant - square[region]
    shown = sums(region, weight * away, count)
    mean = sums(region, weight * more / (kept * kept), count)
    spread = sums(region, weight * (more / kept) ** 2, count) - mean * mean
    mean = np.maximum(square + mean, GRAZING)
    true = np.sqrt(mean) * _mean_root(spread / (mean * mean), axes > 1) - center
    telling = np.abs(shown) > FLAT * center
    gain = np.where(telling, true, 1.0) / np.where(telling, shown, 1.0)
    bounded: Array = np.clip(gain, LEAST, MOST)
    return bounded


def _mean_root(spread: Array, peaked: Mask) -> Array:
    """The mean of u^(1/2) over the root of the mean of u, by the relative variance of u: (m,).

    Of an even density around the mean where none of it is below 0, or one that is `peaked` as in
    boxes of which a corner is at 0; where the variance is too large for that, of a density u^p from
    0 on, whose relative variance is 1 / ((p + 1) (p + 3)).
    """
    half = np.sqrt(3.0 * np.clip(spread, SMALL, 1.0 / 3.0))
    even = ((1.0 + half) ** 1.5 - np.maximum(1.0 - half, 0.0) ** 1.5) / (3.0 * half)
    bulge = np.where(peaked, PEAKED * np.maximum(1.0 / 3.0 - spread, 0.0), 0.0)
    even -= bulge * spread * spread
    power = np.sqrt(1.0 + 1.0 / np.maximum(spread, 1.0 / 3.0)) - 0.5
    root: Array = np.where(spread < 1.0 / 3.0, even, np.sqrt(1.0 - 0.25 / (power * power)))
    return root
