# SPDX-License-Identifier: GPL-3.0-or-later
"""What error sampled pixels may have where a law foresees it: limits, and part of the budget.

In heaps of spheres and fields of instances (`Plan.foresees_errors`) the number of points that a
pixel takes is chosen such that the whole picture needs the fewest, and what its errors end at is
foreseen by the law that they fall by.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..numerics.arrays import Array, Ints, Mask
from ..numerics.error_coefficients import BUDGETED_SHARE
from ..numerics.floats import TINY
from ..shading.sample_light import NET_RAYS
from ..shading.sampled_occlusion import BATCHES

__all__ = [
    "CLOSED_PILOTS",
    "CLOSED_RATIO",
    "END_ROUNDS",
    "ERROR_DECAY",
    "LEAST_CLOSED",
    "LEAST_PILOTS",
    "LEAST_PILOT_STEP",
    "LIMIT_GROWTH",
    "PILOT_PIXELS",
    "PILOT_RATIO",
    "PILOT_ROUNDS",
    "Pilots",
]
__all__ += ["SamplingErrors", "SamplingLaw", "first_limit"]


SAMPLED_BUDGET = 0.82
"""Part of the tolerance that the stated errors of pixels may add up to where rays sample all.

These errors are measured by the spread of the rays, so that less has to be held back for what
estimates do not see than `error_budget` holds back of the errors of other pixels."""
ERROR_DECAY = 0.6
"""Power of the inverse of the number of points by which the error of a pixel in a heap of spheres
falls (1,000 packed and sparse ones, 8 to 4,096 points)."""
LIMIT_GROWTH = 0.5
"""Power of its number of points by which the limit of a pixel grows in heaps of spheres.

Derived: a point more lowers the square of an error by a multiple of error^2 / points, and the
picture needs the fewest points where that is the same in all pixels."""
LEVEL_POINTS = 64
"""Number of points of a pixel whose limit is the picture's goal. So many take about as long as a
point in closed form."""
HEAP_END = 0.75
"""Error at which the sampling of a pixel in a heap ends, as a fraction of its limit at the number
of points with which the error would fall to it exactly: root mean square. It is corrected by
pilot pixels."""
NET_SPREAD = 0.85
"""Error of the mean of all points of a net, as a fraction of what the spread of its batches gives
as if they were independent, before pilot pixels tell it.

Batches of 1 / 8 of the points have errors 8^0.6 times as large (`ERROR_DECAY`), and the mean of
eight independent ones has a part of 8^-0.5 of that, so that 0.81 is expected."""
PILOT_PIXELS, LEAST_PILOTS = 400, 50
"""Number of pixels that are sampled to tell how the errors of a picture end, and the least number
of them that are believed: the errors of 400 are known to some 5 %."""
LEAST_PILOT_STEP = 20
"""Least number of pixels to each pilot: with their reference they take six times the points."""
PILOT_RATIO = 2.5
"""Ratio of the limits of pilot pixels to those of their reference."""
PILOT_ROUNDS, END_ROUNDS, END_AGREEMENT = 2, 2, 0.08
"""Number of times that the law is corrected: how errors end depends on the number of points. After
that, the largest number of times that only its end is corrected, and the relative difference of the
errors of pilot pixels from those expected up to which it need not be: where all pixels take about
the same number of points, which is doubled, the end moves by steps."""
PRIOR_PILOTS, PILOT_DEVIATION = 100.0, 0.7
"""Number of pilots that count as much as what is expected without any, and relative deviation of
what one pilot tells."""
PILOT_RANGE = 0.4, 1.3
"""Least and greatest factors that pilot pixels may change expectations by."""
CLOSED_PILOTS, LEAST_CLOSED, CLOSED_RATIO = 64, 48, 3.0
"""Number of pixels in closed form that are refined to tell how their errors end, the least number
of them that are, and the ratio of their goals to that of their reference. In smaller pictures they
take as long as all pixels do without them: 400 balls at 30 x 30 pixels 0.73 s with 45 of them and
0.56 s with none (1 %), at errors of 0.47 and 0.21 %."""
CLOSED_MARGIN, LEAST_FACTOR = 1.5, 0.1
"""Margin on what these pixels tell, which are few and refined in the same way as their reference;
and the least factor of errors that follows from them."""
BLOCK_END, FAILED_SHARE = 0.3, 0.1
"""Error of pixels in blocks that are interpolated, as a fraction of the goal; and the share of
blocks that one object fills and that are not interpolated."""
FIRST_RAYS = BATCHES * NET_RAYS
"""Number of rays to each light of the first points of a pixel."""


def first_limit(goal: float) -> float:
    """The limit of pixels in heaps after their first points; it grows with `LIMIT_GROWTH`."""
    return float(goal * (BATCHES / LEVEL_POINTS) ** LIMIT_GROWTH)


@dataclass(frozen=True)
class Pilots:
    """n pixels that are sampled to learn from.

    Attributes
    ----------
    color : (3, n).  error : (n,) stated errors by the spread of rays.
    whole : (n,) stated errors with what no ray may have met; None for `error`.
    """

    color: Array
    error: Array
    whole: Array | None = None

    @property
    def mean_square(self) -> float:
        """Mean square of the stated errors by the spread of rays."""
        return float((self.error**2).mean()) if self.error.size else 0.0

    def end(self, expected: Array) -> float:
        """Root mean square of the whole stated errors over that of expected ones (n,), not 0."""
        whole = self.error if self.whole is None else self.whole
        return float(np.sqrt((whole**2).mean() / (expected**2).mean()))

    def end_as(self, expected: Array) -> bool:
        """Whether the stated errors are as expected (n,), or there are too few to tell."""
        if expected.size < LEAST_PILOTS or not expected.any():
            return True
        return abs(self.end(expected) - 1.0) <= END_AGREEMENT


@dataclass(frozen=True)
class SamplingLaw:
    """What pilot pixels tell of the errors of a picture.

    Attributes
    ----------
    end : error at which sampling ends, as a fraction of what `HEAP_END` lets expect.
    spread : see `SamplingTask.spread`.
    closed : errors of pixels in closed form, as a fraction of what is foreseen. Most of what moves
        over a sky in a heap is hidden by other spheres, which `shading.variation` does not know.
    """

    end: float = 1.0
    spread: float = NET_SPREAD
    closed: float = 1.0

    def corrected(self, expected: Array, pilots: Pilots, reference: Pilots) -> SamplingLaw:
        """The law by n pilot pixels.

        Parameters
        ----------
        expected : (n,) errors that this law lets expect of the pilots.
        pilots : by this law.  reference : the same pixels by other and more points.
        """
        stated = pilots.mean_square
        if expected.size < LEAST_PILOTS or not expected.any() or not stated > 0.0:
            return self
        # the reference has an error as well
        square = ((pilots.color - reference.color) ** 2).mean()
        square /= 1.0 + reference.mean_square / stated
        count = expected.size
        true = np.sqrt(square / stated) * (1.0 + PILOT_DEVIATION / np.sqrt(count))
        # a few pilots count as much as what is expected without any
        true = np.clip(true, *PILOT_RANGE) ** (count / (count + PRIOR_PILOTS))
        end = np.clip(pilots.end(expected), *PILOT_RANGE)
        return replace(self, end=float(end) * self.end, spread=float(true) * self.spread)

    def with_closed(self, found: list[Pilots], reference: Pilots) -> SamplingLaw:
        """The law by pilot pixels in closed form.

        Parameters
        ----------
        found : the pixels as they are found at several stages.  reference : refined far below.
        """
        if reference.error.size < LEAST_CLOSED:
            return self
        ratios = [
            np.sqrt(((each.color - reference.color) ** 2).mean() / each.mean_square)
            for each in found
            if each.mean_square > 0.0
        ]
        closed = np.clip(CLOSED_MARGIN * max(ratios, default=1.0), LEAST_FACTOR, 1.0)
        return replace(self, closed=float(closed))


@dataclass(frozen=True)
class SamplingErrors:
    """What the errors of n pixels in heaps of spheres follow from, as far as rays sample them.

    Attributes
    ----------
    sampled : (n,) whether rays sample the pixel; the rest holds for such pixels.
    error : (n,) errors by the first rays.  rays : (n,) number of these to each light.
    interpolated : (n,) whether the pixel lies in a block that one object fills: most of these
        are interpolated between nodes.
    law : of the picture's errors.
    """

    sampled: Mask
    error: Array
    rays: Ints
    interpolated: Mask
    law: SamplingLaw

    def take(self, rows: Mask) -> SamplingErrors:
        """Those of some pixels."""
        return SamplingErrors(
            self.sampled[rows], self.error[rows], self.rays[rows], self.interpolated[rows], self.law
        )

    def expected(self, goal: float) -> Array:
        """Stated errors (n,) at the end of sampling by points to a goal."""
        limit = first_limit(goal)
        error = self.error * (self.rays / FIRST_RAYS) ** ERROR_DECAY
        error *= self.law.spread / NET_SPREAD
        power = LIMIT_GROWTH / (LIMIT_GROWTH + ERROR_DECAY)
        end = HEAP_END * limit * (np.maximum(error, limit) / max(limit, TINY)) ** power
        left: Array = np.where(error > limit, self.law.end * end, error)
        return left

    def budgeted(self, goal: float) -> Array:
        """Errors (n,) at the end of sampling to a goal, as parts of the budget of `make_goal`.

        They are stated errors, times the ratio of what the errors of other pixels and of these may
        add up to.
        """
        left = self.expected(goal)
        smooth = (1.0 - FAILED_SHARE) * (BLOCK_END * goal) ** 2 + FAILED_SHARE * left**2
        left = np.where(self.interpolated, np.minimum(np.sqrt(smooth), left), left)
        budgeted: Array = left * (BUDGETED_SHARE / SAMPLED_BUDGET)
        return budgeted
