# SPDX-License-Identifier: GPL-3.0-or-later
"""Cost model of adaptive distribution from section 2.2 of the paper, and the times it needs.

a : distributed pixels / all pixels.
b : time of a pixel traced with derivatives and detection / time of a plainly traced pixel.
c : rays of a distributed pixel.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .detection.detect import detect, trace_center_rays
from .distributed import Resolver
from .tracing.compile import Plan
from .tracing.intersect import Tile, find_candidates, screen_bounds
from .tracing.occluder_culling import Occluders

__all__ = [
    "PixelCosts",
    "adaptive_is_faster",
    "affordable_pixels",
    "measure_pixel_costs",
    "predicted_ratio",
]

MAX_SAMPLE_PIXELS = 32_768
"""Largest number of pixels in the sample that is timed, as many as a usual tile of a render has."""
MIN_SAMPLE_PIXELS = 4_096
"""Smallest number of pixels in the sample: with fewer, the time of both passes is that of calling
NumPy rather than of its work, and their ratio is not that of a render."""
REPETITIONS = 5
"""Number of timed repetitions, the fewest of which quartiles are five different values."""
MEASURING_SHARE = 0.02
"""Largest fraction of a render's time that measuring its pixel costs may add."""
THREAD_SECONDS = time.perf_counter if sys.platform == "win32" else time.thread_time
"""Clock of the measurement: the processor time of the calling thread, in seconds, which leaves out
the time for which other programs interrupt it. Windows counts that in steps of 15.6 ms, which is
too coarse, so there it is the elapsed time."""


@dataclass(frozen=True)
class PixelCosts:
    """Times of single pixels of a scene in which nothing is distributed, measured alike.

    The repetitions of both passes alternate, on one thread and on the same pixels. Times are
    those of the processor (see `THREAD_SECONDS`).

    Attributes
    ----------
    plain : (k,) seconds a pixel of the plain pass (t'_n of the paper) in each repetition: camera
        ray, shadow rays to the centres of the lights, shading.
    detecting : (k,) seconds a pixel of the same pass with derivatives and detection (t_n).
    pixels : number of pixels in the sample.
    """

    plain: NDArray[np.float64]
    detecting: NDArray[np.float64]
    pixels: int

    @property
    def b(self) -> float:
        """Median over the repetitions of t_n / t'_n."""
        return float(np.median(self.detecting / self.plain))

    @property
    def spread(self) -> float:
        """Interquartile range of t_n / t'_n over the repetitions."""
        low, high = np.percentile(self.detecting / self.plain, (25.0, 75.0))
        return float(high - low)

    def summary(self) -> dict[str, Any]:
        """The medians in seconds and the size of the sample, for the statistics."""
        return {
            "plain": float(np.median(self.plain)),
            "detecting": float(np.median(self.detecting)),
            "pixels": self.pixels,
            "repetitions": self.plain.size,
        }


def measure_pixel_costs(
    plan: Plan,
    occluders: Occluders,
    pixels: int = MAX_SAMPLE_PIXELS,
    repetitions: int = REPETITIONS,
) -> PixelCosts:
    """Measure the times of a pixel with and without derivatives, on rows of the picture.

    Both passes run the same code: the plain one for the scene without penumbrae, motion blur and
    edges, where detection is nothing but a shadow ray to the centre of each light.

    Parameters
    ----------
    plan, occluders : the compiled scene; each pass runs in one call on the calling thread.
    pixels : largest number of pixels in the sample.
    repetitions : number of timed repetitions of each pass, after one that is not counted.
    """
    plain = replace(plan, penumbra=False, motion=False, edges=False)
    left, bottom, right, top = plan.region
    rows = max(1, min(top - bottom, pixels // (right - left)))
    tile = Tile.make(plan, 0, -(-(top - bottom) // rows))
    bounds = screen_bounds(plan)
    seconds = np.zeros((2, repetitions + 1))
    for repetition in range(repetitions + 1):
        for row, each in enumerate((plain, plan)):
            plan.raise_if_cancelled()
            began = THREAD_SECONDS()
            _trace_undistributed(each, occluders, bounds, tile)
            seconds[row, repetition] = THREAD_SECONDS() - began
    # the first repetition fills caches
    plain_seconds, detecting_seconds = seconds[:, 1:] / tile.index.size
    return PixelCosts(plain_seconds, detecting_seconds, tile.index.size)


def affordable_pixels(plan: Plan, seconds: float, pixel_seconds: float) -> int:
    """Number of pixels whose measurement takes at most `MEASURING_SHARE` of a render's time.

    Returns 0 where these would be too few for a sound measurement.

    Parameters
    ----------
    seconds : time of the render so far.
    pixel_seconds : time of a pixel with detection, about; a plain one takes no longer.
    """
    left, bottom, right, top = plan.region
    passes = 2 * (REPETITIONS + 1)
    pixels = min(MAX_SAMPLE_PIXELS, (right - left) * (top - bottom))
    if pixel_seconds > 0.0:
        pixels = min(pixels, int(MEASURING_SHARE * seconds / (passes * pixel_seconds)))
    return pixels if pixels >= MIN_SAMPLE_PIXELS else 0


def _trace_undistributed(
    plan: Plan, occluders: Occluders, bounds: NDArray[np.int64], tile: Tile
) -> None:
    """Trace, detect and shade the centre rays of a tile; no rays are distributed."""
    center = trace_center_rays(plan, tile.x, tile.y, find_candidates(plan, bounds, tile))
    flags = detect(plan, occluders, center, lambda _: None)
    none = np.zeros(center.rows.size, dtype=np.bool_)
    shadows = tuple(replace(shadow, partial=none) for shadow in flags.visibilities)
    flags = replace(flags, mask=np.zeros_like(flags.mask), visibilities=shadows)
    Resolver(plan, occluders, tile, center, flags).resolve_single_ray()


def predicted_ratio(a: float, b: float, c: float) -> float:
    """Predicted time of adaptive distribution over that of distributing everywhere: equation 10."""
    return (a * c + b - a) / c


def adaptive_is_faster(a: float, b: float, c: float) -> bool:
    """Whether adaptive distribution is predicted to be faster: equation 11."""
    return b < c - a * (c - 1.0)
