# SPDX-License-Identifier: GPL-3.0-or-later
"""Pilot pixels of heaps of spheres: those from which it is learnt how the errors of others end.

What errors a frame's pixels end at, and how far they are from what is foreseen or stated, differs
between heaps by a factor of two and more. So a few pixels are done twice, the second time far below
the goal: see `SamplingLaw`. They are the same whatever part of the picture is rendered.
"""

from __future__ import annotations

import numpy as np

from ..cubature.error_budget import Goal
from ..cubature.heap_limits import (
    CLOSED_PILOTS,
    LEAST_CLOSED,
    LEAST_PILOT_STEP,
    LEAST_PILOTS,
    PILOT_PIXELS,
    Pilots,
    first_limit,
)
from ..numerics.arrays import Ints, Mask
from ..numerics.gather import columns
from .frame import Frame

__all__ = ["closed_pilots", "corrected_pilots", "sampled_pilots"]


def sampled_pilots(frame: Frame, rows: Mask, goal: Goal) -> Ints:
    """Some of the pixels that rays will sample by points. rows : (height,) those of the sample."""
    index = frame.region_pixels(rows)
    errors = frame.sampling_errors(index)
    wanted = errors.sampled & ~errors.interpolated
    wanted &= errors.expected(goal.error) > first_limit(goal.error)
    return _sparse(index[wanted], PILOT_PIXELS, LEAST_PILOTS)


def closed_pilots(frame: Frame, rows: Mask, goal: Goal) -> Ints:
    """Some of the pixels in closed form that are above the goal. rows : as before."""
    wanted = frame.traced & ~(frame.sampled | frame.settled | frame.unknown)
    wanted &= frame.error > goal.error
    index = frame.region_pixels(rows)
    return _sparse(index[wanted[index]], CLOSED_PILOTS, LEAST_CLOSED)


def _sparse(index: Ints, most: int, least: int) -> Ints:
    """About `most` of some pixels, at equal distances in their order.

    There are none where they are fewer than `least`, which nothing is learnt from.
    """
    found = index[:: max(LEAST_PILOT_STEP, -(-index.size // most))]
    return found if found.size >= least else found[:0]


def corrected_pilots(frame: Frame, rows: Ints) -> Pilots:
    """Pixels (n,) as the first pass leaves them, with their means by second differences."""
    color = columns(frame.color, rows)
    if frame.corrected.size:
        place = np.full(frame.item.size, -1)
        place[frame.corrected] = np.arange(frame.corrected.size)
        at = place[rows]
        color = color + np.where(at >= 0, columns(frame.change, at), 0.0)
    return Pilots(np.maximum(color, frame.plan.least_radiance), frame.error[rows])
