# SPDX-License-Identifier: GPL-3.0-or-later
"""Pilot pixels of heaps of spheres: those from which it is learnt how the errors of others end.

What errors a frame's pixels end at, and how far they are from what is foreseen or stated, differs
between heaps by a factor of two and more. So a few pixels are done twice, the second time far below
the goal: see `SamplingLaw`. They are the same whatever part of the picture is rendered.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..cubature.error_budget import Goal
from ..cubature.heap_limits import (
    CLOSED_PILOTS,
    LEAST_PILOT_STEP,
    PILOT_PIXELS,
    Pilots,
    SamplingErrors,
    first_limit,
)
from ..cubature.sampled_pixels import FIRST_POINTS
from ..numerics.arrays import Ints, Mask
from ..numerics.gather import columns
from ..shading.sample_light import NET_RAYS
from .first_pass import CENTER_RAYS

if TYPE_CHECKING:
    from .frame import Frame

__all__ = ["closed_pilots", "corrected_pilots", "sampled_pilots", "sampling_errors"]


BLOCK_SIDE = 8
"""Side in pixels of the blocks that are most likely to be interpolated between nodes."""


def sampling_errors(frame: Frame, index: Ints) -> SamplingErrors:
    """What the errors of some pixels (k,) of a frame follow from: see `SamplingErrors`."""
    few, blocks = frame.usable_centers[index], np.zeros_like(frame.sampled)
    if frame.centers is not None:
        side = BLOCK_SIDE
        grid = (frame.height // side, side, frame.width // side, side)
        items = frame.centers.item.reshape(grid)
        low, high = items.min(axis=(1, 3)), items.max(axis=(1, 3))
        same = np.repeat(np.repeat((low == high) & (low >= 0), side, axis=0), side, axis=1)
        blocks = same.ravel() & frame.usable_centers
    rays = np.where(few, CENTER_RAYS, FIRST_POINTS * NET_RAYS)
    return SamplingErrors(frame.sampled[index], frame.error[index], rays, blocks[index], frame.law)


def sampled_pilots(frame: Frame, rows: Mask, goal: Goal) -> Ints:
    """Some of the pixels that rays will sample by points. rows : (height,) those of the sample."""
    index = frame.region_pixels(rows)
    errors = sampling_errors(frame, index)
    wanted = errors.sampled & ~errors.interpolated
    wanted &= errors.expected(goal.error) > first_limit(goal.error)
    return _sparse(index[wanted], PILOT_PIXELS)


def closed_pilots(frame: Frame, rows: Mask, goal: Goal) -> Ints:
    """Some of the pixels in closed form that are above the goal. rows : as before."""
    wanted = frame.traced & ~(frame.sampled | frame.settled | frame.unknown)
    wanted &= frame.error > goal.error
    index = frame.region_pixels(rows)
    return _sparse(index[wanted[index]], CLOSED_PILOTS)


def _sparse(index: Ints, most: int) -> Ints:
    """About so many of some pixels, at equal distances in their order."""
    return index[:: max(LEAST_PILOT_STEP, -(-index.size // most))]


def corrected_pilots(frame: Frame, rows: Ints) -> Pilots:
    """Pixels (n,) as the first pass leaves them, with their means by second differences."""
    color = columns(frame.color, rows)
    if frame.corrected.size:
        place = np.full(frame.item.size, -1)
        place[frame.corrected] = np.arange(frame.corrected.size)
        at = place[rows]
        color = color + np.where(at >= 0, columns(frame.change, at), 0.0)
    return Pilots(np.maximum(color, 0.0), frame.error[rows])
