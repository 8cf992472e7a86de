# SPDX-License-Identifier: GPL-3.0-or-later
"""Fitted coefficients of the error model.

`make fit` writes this file; edits by hand are found by a test. What the coefficients are for, how
they are fitted and how well they do on other scenes than those of the fit: docs/error-model.md.
"""

import numpy as np

__all__ = [
    "ACHIEVED_ERROR",
    "ACHIEVED_RISE",
    "BUDGETED_SHARE",
    "COEFFICIENT_DECAY",
    "CROWDED_PIXEL_ERROR",
    "CUT_PIXEL_ERROR",
    "DIFFERENCE_FACTOR",
    "DIGEST",
    "FALLBACK_ERROR_FRACTION",
    "FALLOFF_COEFFICIENT",
    "FALLOFF_KINK_RATIO",
    "FALLOFF_ROOT_RATIO",
    "FOURTH_DIFFERENCE_WEIGHT",
    "FOURTH_MOMENT_CORRECTION",
    "MAX_ACHIEVED_ERROR",
    "MIN_ACHIEVED_ERROR",
    "MOTION_ERROR_SHARE",
    "MULTI_NODE_ERROR",
    "REMAINING_ERROR",
    "RESIDUAL_FACTOR",
    "STILL_ACHIEVED_ERROR",
    "TIME_ERROR_FACTOR",
    "UNDETECTED_SHARE",
    "UNPREDICTED_RATIO",
    "UNPREDICTED_SHARE",
]


DIGEST = "eb9a681cea708dd5"
"""Digest of the other lines of this file."""
MULTI_NODE_ERROR = np.array(
    [[0.005, 0.05, 0.09, 0.35], [0.02, 0.09, 0.15, 0.5], [0.02, 0.13, 0.2, 0.5]]
)
"""Error of the multi-node rule as a fraction of the error of the centroid rule: (3, 4), by number
of axes along which the domain extends (rows) and by kind of error (columns: bends, roots, kinks,
steps). Fitted by hand."""
UNDETECTED_SHARE = 0.7
"""Fraction of the predicted error of roots, kinks and steps that is kept where the nodes of the
multi-node rule do not detect them: they may lie between the nodes. Fitted by hand."""
UNPREDICTED_RATIO = 2.0
"""Difference between the multi-node mean and the radiance at the centroid, as a multiple of the
predicted error, above which it shows variation that was not predicted. Fitted by hand."""
UNPREDICTED_SHARE = 0.5
"""Fraction of a difference that was not predicted which is added to the error of the multi-node
rule. Fitted by hand."""
FOURTH_MOMENT_CORRECTION = 0.2
"""Coefficient of s^4 (1/3 - s^2), by which the mean of a root over a box with a corner at 0 is less
than that of a uniform density; s^2 is the relative variance of its argument. Fitted by hand."""
FALLOFF_COEFFICIENT = 0.8
"""Deviation of the irradiance factor by falloff, as a fraction of the factor times the squared
ratio of half extent and distance to the light. Fitted by hand."""
FALLOFF_ROOT_RATIO = 0.3
"""Ratio of half a patch's extent and the distance to the light, from which the nodes of the
cubature leave as much of the deviation by falloff as of a power of 3/2. Fitted by hand."""
FALLOFF_KINK_RATIO = 1.0
"""Ratio of half a patch's extent and the distance to the light, from which the nodes of the
cubature leave as much of the deviation by falloff as of a kink. Fitted by hand."""
FALLBACK_ERROR_FRACTION = 0.0625
"""Error estimate of a pixel mean by the midpoint rule, as a fraction of the second difference,
where neighbouring differences are missing. Fitted by hand."""
FOURTH_DIFFERENCE_WEIGHT = 0.03125
"""Weight of the fourth difference in the error estimate of a pixel mean by the midpoint rule with a
second-difference correction. Fitted by hand."""
REMAINING_ERROR = 0.3
"""Error that remains after the correction of a pixel centre by second differences, as a fraction of
the largest correction of the pixel and its neighbours. Fitted by hand."""
COEFFICIENT_DECAY = 2.0
"""Factor by which the Chebyshev coefficients of a block of pixels may decay slower than the ratio
of the last two of them tells. Fitted by hand."""
TIME_ERROR_FACTOR = 0.1
"""Relative error of the three-point Gauss rule in time, as a multiple of the third power of the
relative second difference of its samples. Fitted by hand."""
RESIDUAL_FACTOR = 1.2
"""Error estimate of pixel means interpolated over a block, as a multiple of the residual after the
cubic correction. Fitted by hand."""
DIFFERENCE_FACTOR = 0.2
"""Smallest error estimate of interpolated pixel means, as a fraction of the difference before the
cubic correction: four check points do not resolve a kink. Fitted by hand."""
ACHIEVED_ERROR = 0.575
"""RMS error with which a pixel under motion ends, as a fraction of its own goal (the picture's
goal, grown with the number of its cells), if a single cell is predicted for it. Fitted by hand."""
ACHIEVED_RISE = 0.02
"""Increase of that fraction with each doubling of the predicted number of cells. Fitted by hand."""
MIN_ACHIEVED_ERROR = 0.0
"""Smallest fraction of its goal with which a pixel under motion is predicted to end. Fitted by
hand."""
MAX_ACHIEVED_ERROR = 0.77
"""Largest fraction of its goal with which a pixel under motion is predicted to end. Fitted by
hand."""
STILL_ACHIEVED_ERROR = 0.53
"""Error with which a pixel without motion ends, as a fraction of the goal times (e /
goal)^`GOAL_POWER`, where e is its predicted error under the multi-node rule. Fitted by hand."""
MOTION_ERROR_SHARE = 0.6
"""Constant c of the law c / n by which the error of a pixel under motion falls with n cells, as a
fraction of its estimated error before refinement. Fitted by hand."""
CUT_PIXEL_ERROR = 0.05
"""Error assumed for a pixel of which nothing is known except that outlines cut it, as a fraction of
the contrast. Fitted by hand."""
CROWDED_PIXEL_ERROR = 0.25
"""Error assumed for such a pixel where many objects may be visible, as a fraction of the contrast.
Fitted by hand."""
BUDGETED_SHARE = 0.72
"""Fraction of the tolerance for which the goal is set. The rest is for errors that the estimates
miss, and for pixels that end with more than the model predicts. Fitted by hand."""
