# SPDX-License-Identifier: GPL-3.0-or-later
"""Irradiance of partly hidden lights by distributed rays, to a stated error.

Where no closed form of the visible part of a light is known, shadow rays to low-discrepancy points
of the light estimate the visible fraction, and the closed form of the whole light scales it: a
ratio estimator (Heitz, Hill and McGuire 2018, "Combining analytic direct illumination and
stochastic shadows"). All surface points use the same points of the light, which form one sequence:
the estimate is then smooth between neighbours and can be extended. The sequence is cut into
consecutive batches, and the spread of their estimates gives the error (batch means: Owen 2013,
"Monte Carlo theory, methods and examples", chapter 17). Consecutive batches of a Kronecker sequence
complement each other, so the error of the whole is less than that of as many independent batches.
"""

from __future__ import annotations

import numpy as np

from ..lights.emitter import Emitter
from ..numerics.arrays import Array
from ..numerics.floats import TINY
from ..numerics.low_discrepancy import sequence_points
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface
from .ratio_estimator import LightSums, gather_light, ratio_estimate

__all__ = ["BATCHES", "SAMPLING_ERROR_SHARE", "UNSEEN_SHARE", "sampled_factors"]


SAMPLING_ERROR_SHARE = 0.25
"""Fraction of an error goal that the error by distributed rays may reach before more rays are used:
as much as a picture's goal leaves of its tolerance (see `error_budget.BUDGETED_SHARE`)."""
FIRST_RAYS, LAST_RAYS = 1_024, 16_384
"""Number of rays that every point takes, and the number up to which it is doubled while the
estimated error is larger than allowed. With that many a point takes about a millisecond."""
BATCHES = 8
"""Number of batches of equal size of the rays of a point, or of the points of a pixel; the spread
of eight estimates of one error is known to a quarter, one standard deviation."""
UNSEEN_SHARE = 0.5
"""Least error of an estimate, as a fraction of the whole light divided by the number of rays: a
visible or hidden part as small as one ray's share may contain no point of the light."""


def sampled_factors(
    plan: Plan,
    surface: Surface,
    light: Emitter,
    pairs: Pairs,
    time: Array | float,
    allowed: Array,
) -> tuple[Array, Array]:
    """Irradiance factors of a light at n points by distributed rays, and their errors.

    Parameters
    ----------
    pairs : candidate occluders, sorted by point.  time : shutter times, a number or (n,).
    allowed : (n,) error up to which no more rays are taken, in the unit of the factor.

    Returns
    -------
    factor, error : (n,) each; the error is one standard deviation, estimated.
    """
    count = surface.item.size
    factor, error = np.zeros((2, count))
    rows, batches = np.arange(count), None
    rays = FIRST_RAYS
    while rows.size:
        own = pairs.for_pixels(rows, count) if rows.size < count else pairs
        when = time[rows] if isinstance(time, np.ndarray) else time
        first = 0 if batches is None else rays // 2
        new = _batch_sums(plan, surface.take(rows), light, own, when, (first, rays))
        batches = new if batches is None else batches.joined(new)
        factor[rows], error[rows] = _mean_and_error(batches, rays)
        more = (error[rows] > allowed[rows]).nonzero()[0]
        rays *= 2
        if rays > LAST_RAYS:
            break
        rows = rows[more]
        batches = batches.take(more)
    return factor, error


def _batch_sums(
    plan: Plan,
    surface: Surface,
    light: Emitter,
    pairs: Pairs,
    time: Array | float,
    span: tuple[int, int],
) -> LightSums:
    """Sums (n, `BATCHES`) over rays to the points of a light numbered from span[0] to span[1]."""
    count = surface.item.size
    spots = sequence_points(plan.settings.seed, *span, 2)
    a, b = (np.broadcast_to(part, (count, part.size)) for part in spots)
    when = time[:, None] if isinstance(time, np.ndarray) else np.full((1, 1), time)
    times = np.broadcast_to(when, (count, BATCHES))
    return gather_light(plan, surface, light, pairs, (a, b), times)


def _mean_and_error(sums: LightSums, rays: int) -> tuple[Array, Array]:
    """Ratio estimates (n,) and their standard errors, by the residuals of the batches' ratios."""
    closed = sums.closed.mean(axis=1)
    every, visible = sums.total.mean(axis=1), sums.visible.mean(axis=1)
    ratio = visible / np.maximum(every, TINY)
    residual = sums.visible - ratio[:, None] * sums.total
    spread = np.sqrt((residual * residual).sum(axis=1) / (BATCHES * (BATCHES - 1)))
    error = closed * np.maximum(spread / np.maximum(every, TINY), UNSEEN_SHARE / rays)
    return ratio_estimate(closed, every, visible), error
