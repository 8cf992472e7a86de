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
    "SECTION_ERROR_FRACTION",
    "STILL_ACHIEVED_ERROR",
    "TIME_ERROR_FACTOR",
    "UNDETECTED_SHARE",
    "UNPREDICTED_RATIO",
    "UNPREDICTED_SHARE",
]


DIGEST = "c44aa0625357eb24"
"""Digest of the other lines of this file."""
MULTI_NODE_ERROR = np.array(
    [[0.016, 0.032, 0.088, 0.35], [0.0094, 0.064, 0.14, 0.33], [0.076, 0.13, 0.23, 0.39]]
)
"""Error of the multi-node rule as a fraction of the error of the centroid rule: (3, 4), by number
of axes along which the domain extends (rows) and by kind of error (columns: bends, roots, kinks,
steps). Criterion: the RMS error of the rule equals the estimate, for transitions of each kind along
a plane of random direction and place in a box (bends: within the penumbra of a straight edge before
a round light, and light that falls off from a point). Samples: 300,000. Measured over predicted:
1.00 (worst bin 2.11), 1.00 (worst bin 2.15) on other seeds."""
UNDETECTED_SHARE = 0.74
"""Fraction of the predicted error of roots, kinks and steps that is kept where the nodes of the
multi-node rule do not detect them: they may lie between the nodes. Criterion: the RMS error of the
rule equals the estimate where the centroid differs from the mean of the nodes by less than half of
`CONFIRMING_DIFFERENCE`. Samples: 66,310. Measured over predicted: 1.01 (worst bin 1.23), 0.99
(worst bin 1.22) on other seeds."""
UNPREDICTED_RATIO = 1.9
"""Difference between the multi-node mean and the radiance at the centroid, as a multiple of the
predicted error, above which it shows variation that was not predicted. Criterion: 95 % of the
differences caused by predicted roots, kinks and steps at random places are below it. Samples:
180,000. Measured over predicted: 0.99 (worst bin 1.20), 0.99 (worst bin 1.20) on other seeds."""
UNPREDICTED_SHARE = 0.36
"""Fraction of a difference that was not predicted which is added to the error of the multi-node
rule. Criterion: the RMS error of the rule equals this fraction of the RMS difference, for steps at
random places. Samples: 60,000. Measured over predicted: 0.99 (worst bin 1.06), 1.00 (worst bin
1.06) on other seeds."""
FOURTH_MOMENT_CORRECTION = 0.2
"""Coefficient of s^4 (1/3 - s^2), by which the mean of a root over a box with a corner at 0 is less
than that of a uniform density; s^2 is the relative variance of its argument. Criterion: least
squares over boxes of two and three axes. Samples: 40,000. Measured over predicted: 1.15 (worst bin
1.25), 1.15 (worst bin 1.24) on other seeds. Fitted value 0.23, not in use: boxes beside the limb,
which are more than those at it, are off by a fifth more with the fitted one."""
SECTION_ERROR_FRACTION = 0.32
"""Error of the light that is left by spheres which the light's plane cuts, as a fraction of the
difference between polygons of half as many corners and of all that stand for them. A polygon of N
corners is off by some N^-2 where another outline crosses it, which gives 1/3 on average. Criterion:
the RMS error equals the estimate, for random spheres in the planes of a parallelogram and of a
disk; bins by whether the light's outline crosses the circle in which sphere and plane meet.
Samples: 2,764. Measured over predicted: 1.00 (worst bin 1.02), 1.02 (worst bin 1.10) on other
seeds."""
FALLOFF_ROOT_RATIO = 0.19
"""Ratio of half a patch's extent and the distance to the light, from which the nodes of the
cubature leave as much of the deviation by falloff as of a power of 3/2. Criterion: the multi-node
rule leaves the fraction that `MULTI_NODE_ERROR` has for bends of a square. Samples: 20,000.
Measured over predicted: 1.00 (worst bin 1.00), 1.00 (worst bin 1.00) on other seeds."""
FALLOFF_KINK_RATIO = 0.87
"""Ratio of half a patch's extent and the distance to the light, from which the nodes of the
cubature leave as much of the deviation by falloff as of a kink. Criterion: the multi-node rule
leaves the fraction that `MULTI_NODE_ERROR` has for roots of a square. Samples: 20,000. Measured
over predicted: 1.01 (worst bin 1.01), 1.01 (worst bin 1.01) on other seeds."""
FALLBACK_ERROR_FRACTION = 0.043
"""Error estimate of a pixel mean by the midpoint rule, as a fraction of the second difference,
where neighbouring differences are missing. Criterion: the RMS error equals the estimate, for kinks
at random places within the pixel. Samples: 20,000. Measured over predicted: 1.00 (worst bin 1.33),
1.01 (worst bin 1.33) on other seeds."""
FOURTH_DIFFERENCE_WEIGHT = 0.025
"""Weight of the fourth difference in the error estimate of a pixel mean by the midpoint rule with a
second-difference correction. Criterion: the RMS error equals the estimate, for kinks at random
places within the pixel. Samples: 20,000. Measured over predicted: 1.00 (worst bin 1.19), 1.01
(worst bin 1.20) on other seeds."""
REMAINING_ERROR = 0.3
"""Error that remains after the correction of a pixel centre by second differences, as a fraction of
the largest correction of the pixel and its neighbours. Criterion: the RMS error equals the estimate
in the worst bin, for smooth peaks of 1 to 8 pixels. Samples: 20,000. Measured over predicted: 0.54
(worst bin 1.00), 0.53 (worst bin 0.96) on other seeds."""
COEFFICIENT_DECAY = 2.0
"""Factor by which the Chebyshev coefficients of a block of pixels may decay slower than the ratio
of the last two of them tells. Criterion: the RMS error of the bicubic equals the estimate in the
worst bin, for light that falls off from a point. Samples: 20,000. Measured over predicted: 0.16
(worst bin 0.18), 0.15 (worst bin 0.18) on other seeds. Fitted value 0.25, not in use: light may
also vary like sqrt(36 + s^2) at s pixels, or have a kink, and then the fitted one gives a fifth of
the error."""
TIME_ERROR_FACTOR = 0.0021
"""Relative error of the three-point Gauss rule in time, as a multiple of the third power of the
relative second difference of its samples. Criterion: the RMS error equals the estimate in the worst
bin, for lights that pass a point or come nearer. Samples: 20,000. Measured over predicted: 0.84
(worst bin 1.01), 0.84 (worst bin 1.02) on other seeds."""
RESIDUAL_FACTOR = 0.84
"""Error estimate of pixel means interpolated over a block, as a multiple of the residual after the
cubic correction. Criterion: the RMS error of the means equals the estimate, over blocks of random
moving scenes where this estimate is the larger of the two. Samples: 126. Measured over predicted:
1.00 (worst bin 1.06), 0.91 (worst bin 0.91) on other seeds."""
DIFFERENCE_FACTOR = 0.12
"""Smallest error estimate of interpolated pixel means, as a fraction of the difference before the
cubic correction: four check points do not resolve a kink. Criterion: the RMS error of the means
equals the estimate, over blocks of random moving scenes where this estimate is the larger of the
two. Samples: 53. Measured over predicted: 0.99 (worst bin 0.99), 0.67 (worst bin 0.67) on other
seeds."""
ACHIEVED_ERROR = 0.56
"""RMS error with which a pixel under motion ends, as a fraction of its own goal (the picture's
goal, grown with the number of its cells), if a single cell is predicted for it. Criterion: least
squares over bins of the predicted number of cells, of the estimates with which pixels of random
scenes end. Samples: 15,644. Measured over predicted: 0.98 (worst bin 1.25), 0.92 (worst bin 1.12)
on other seeds."""
ACHIEVED_RISE = -0.019
"""Increase of that fraction with each doubling of the predicted number of cells. Criterion: least
squares, together with `ACHIEVED_ERROR`. Samples: 15,644. Measured over predicted: 0.98 (worst bin
1.25), 0.92 (worst bin 1.12) on other seeds."""
MIN_ACHIEVED_ERROR = 0.063
"""Smallest fraction of its goal with which a pixel under motion is predicted to end. Criterion: the
smallest such fraction of any bin of the predicted number of cells. Samples: 15,644. Measured over
predicted: 0.98 (worst bin 1.25), 0.92 (worst bin 1.12) on other seeds."""
MAX_ACHIEVED_ERROR = 0.56
"""Largest fraction of its goal with which a pixel under motion is predicted to end. Criterion: the
largest such fraction of any bin of the predicted number of cells. Samples: 15,644. Measured over
predicted: 0.98 (worst bin 1.25), 0.92 (worst bin 1.12) on other seeds."""
STILL_ACHIEVED_ERROR = 0.42
"""Error with which a pixel without motion ends, as a fraction of the goal times (e /
goal)^`GOAL_POWER`, where e is its predicted error under the multi-node rule. Criterion: the RMS of
the estimates with which pixels of random still scenes end equals the prediction. Samples: 2,970.
Measured over predicted: 1.06 (worst bin 1.25), 1.38 (worst bin 1.63) on other seeds."""
MOTION_ERROR_SHARE = 0.6
"""Constant c of the law c / n by which the error of a pixel under motion falls with n cells, as a
fraction of its estimated error before refinement. Criterion: least squares, together with
`ACHIEVED_ERROR`. Samples: 15,644. Measured over predicted: 0.98 (worst bin 1.25), 0.92 (worst bin
1.12) on other seeds."""
CUT_PIXEL_ERROR = 0.076
"""Error assumed for a pixel of which nothing is known except that outlines cut it, as a fraction of
the contrast. Criterion: it is the RMS of the estimates after the first evaluation of such pixels.
Samples: 3,178. Measured over predicted: 1.00 (worst bin 1.00), 1.40 (worst bin 1.40) on other
seeds."""
CROWDED_PIXEL_ERROR = 0.18
"""Error assumed for such a pixel where many objects may be visible, as a fraction of the contrast.
Criterion: as `CUT_PIXEL_ERROR`. Samples: 183. Measured over predicted: 1.01 (worst bin 1.01), 1.13
(worst bin 1.13) on other seeds."""
BUDGETED_SHARE = 0.63
"""Fraction of the tolerance for which the goal is set. The rest is for errors that the estimates
miss, and for pixels that end with more than the model predicts. Criterion: the estimates of 95 % of
random pictures are at most the tolerance; the safety factor is for scenes harder than those of the
fit, and keeps the cost of pictures about as it was. Samples: 62. Measured over predicted: 0.85
(worst bin 1.21), 0.81 (worst bin 1.08) on other seeds. Includes a safety factor of 0.85."""
