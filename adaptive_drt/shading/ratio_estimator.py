# SPDX-License-Identifier: GPL-3.0-or-later
"""Distributed light: equation 3 of the paper as a ratio estimator (Heitz and others 2018).

The mean over n points of light, I = (1/n) sum I_i, is replaced by the closed form of the unoccluded
light, times the sum over the visible points divided by the sum over all points. The result is exact
where all points are visible, or none, so that distributed rays cause no error where nothing is
hidden. The sums go over all samples that a pixel takes of one light.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Ints
from ..numerics.low_discrepancy import low_discrepancy_points
from ..numerics.vector import dot
from ..parallel.call_progress import report_progress
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface
from ..tracing.shadow_rays import blocked_segments
from ..tracing.solid_rays import SolidTracer

__all__ = ["LightSums", "gather_light", "light_points", "ratio_estimate", "unoccluded_factor"]


CHUNK = 1 << 17
"""Number of rays in a batch: their arrays fit the caches that batches of 65,536 pixels do."""


@dataclass(frozen=True)
class LightSums:
    """Sums over samples, each (n, k): closed form, all points of light, visible points of light."""

    closed: Array
    total: Array
    visible: Array

    def estimate(self) -> Array:
        """Ratio estimates (n,) of the irradiance factor, summed over the k samples."""
        closed, total = self.closed.sum(axis=1), self.total.sum(axis=1)
        return ratio_estimate(closed, total, self.visible.sum(axis=1))

    def take(self, rows: Ints) -> LightSums:
        """The sums of some of the points."""
        return LightSums(self.closed[rows], self.total[rows], self.visible[rows])

    def batched(self, size: int) -> LightSums:
        """The sums (n, 1) of single rays as the batches of points of `size` rays each."""
        parts = (self.closed, self.total, self.visible)
        return LightSums(*(each.reshape(-1, size) for each in parts))

    def joined(self, other: LightSums) -> LightSums:
        """Means over the batches of two sets of equally many rays: two consecutive ones become one.

        A single batch, of a light without extent, stays as it is.
        """

        def pairs(a: Array, b: Array) -> Array:
            if a.shape[1] == 1:
                return a
            both = np.concatenate([a, b], axis=1)
            mean: Array = 0.5 * (both[:, ::2] + both[:, 1::2])
            return mean

        return LightSums(
            pairs(self.closed, other.closed),
            pairs(self.total, other.total),
            pairs(self.visible, other.visible),
        )


def ratio_estimate(closed: Array, total: Array, visible: Array) -> Array:
    """closed * visible / total; equal to `closed` where no point of light is above the horizon.

    There a sliver of the light may be above the horizon although no point met it: its closed form
    is the better estimate.
    """
    known = total > 0.0
    share: Array = np.where(known, visible, 1.0) / np.where(known, total, 1.0)
    return closed * share


def light_points(
    plan: Plan, pixel: Ints, light: int, samples: int, rays: int
) -> tuple[Array, Array]:
    """Points on a light for the rays of a pixel's samples: two (n, samples * rays) in [0, 1).

    A single sample uses Fibonacci's lattice. More samples use the last two of five dimensions, of
    which the first three are the samples' time and position in the pixel.
    """
    if samples == 1:
        a, b = low_discrepancy_points(plan.settings.seed, pixel, 1 + light, rays, 2)
        return a, b
    *_, a, b = low_discrepancy_points(plan.settings.seed, pixel, 1 + light, samples * rays, 5)
    return a, b


def gather_light(
    plan: Plan,
    surface: Surface,
    light: Emitter,
    pairs: Pairs,
    spots: tuple[Array, Array] | None,
    time: Array | float,
    used: NDArray[np.bool_] | None = None,
    tracer: SolidTracer | None = None,
    wants_closed: bool = True,
) -> LightSums:
    """Trace shadow rays from n points to a light.

    Parameters
    ----------
    surface : n points.
    light : shape of the light; its shadows come from `plan.as_shadow_caster`.
    pairs : occluders, sorted by point.
    spots : points on the light, two (n, k s) arrays, s rays for each of k samples; None for a light
    without size.
    time : shutter times of the samples, a number (k = 1) or (n, k).
    used : (n, k) samples that count; the sums of the others are 0.
    tracer : as that of `blocked_segments`.
    wants_closed : whether the sums are to have `closed`; else it is 0, where rays do not need it.

    Returns
    -------
    Sums with (n, k) entries.
    """
    surface, count = _shadow_starts(surface, light), surface.item.size
    samples = time.shape[1] if isinstance(time, np.ndarray) else 1
    rays = 1 if spots is None else spots[0].shape[1] // samples
    parts = []
    step = max(1, CHUNK // (samples * rays))
    bounds = np.searchsorted(pairs.pixel, np.arange(0, count + step, step))
    for index, first in enumerate(range(0, count, step)):
        plan.raise_if_cancelled()
        report_progress(first / count)
        rows = slice(first, min(first + step, count))
        own = slice(bounds[index], bounds[index + 1])
        local = Pairs(pairs.pixel[own] - first, pairs.item[own])
        when = time[rows] if isinstance(time, np.ndarray) else time
        where = None if spots is None else (spots[0][rows], spots[1][rows])
        part = surface.take(np.arange(count)[rows])
        known = wants_closed or where is None
        parts.append(_gather(plan, part, light, local, where, when, tracer, known))
    sums = _concatenated(parts, samples)
    if used is not None:
        return LightSums(sums.closed * used, sums.total * used, sums.visible * used)
    return sums


def _concatenated(parts: list[tuple[Array, Array, Array]], samples: int) -> LightSums:
    """Sums (n, k) of batches of points one after another; each array broadcasts to k samples."""
    if not parts:
        empty = np.zeros((0, samples))
        return LightSums(empty, empty, empty)
    closed, total, visible = (
        np.concatenate([np.broadcast_to(p, (p.shape[0], samples)) for p in column])
        for column in zip(*parts, strict=True)
    )
    return LightSums(closed, total, visible)


def _shadow_starts(surface: Surface, light: Emitter) -> Surface:
    """Surface points as shadow rays to a light leave them: those to a uniform sky leave facets.

    Cycles samples no uniform world as a light: it finds it by the rays that surfaces scatter, which
    leave the facets also where those of other lights begin above them.
    """
    return surface.without_smooth() if light.uniform_hemisphere else surface


def _gather(
    plan: Plan,
    surface: Surface,
    light: Emitter,
    pairs: Pairs,
    spots: tuple[Array, Array] | None,
    time: Array | float,
    tracer: SolidTracer | None,
    wants_closed: bool,
) -> tuple[Array, Array, Array]:
    """Sums of one batch, each of a shape that broadcasts to (n, k)."""
    samples = time.shape[1] if isinstance(time, np.ndarray) else 1
    point, normal = surface.point[:, :, None], surface.normal[:, :, None]
    to = light.to_center(point, np.reshape(time, (1, 1)) if np.ndim(time) == 0 else time)
    closed = np.zeros((surface.item.size, 1))
    if wants_closed:
        closed = _closed_form(plan, light, to, surface)
    if spots is None:
        if to.shape[2] < samples:
            to = np.broadcast_to(to, (3, surface.item.size, samples))
        free = ~blocked_segments(plan, surface, to, pairs, time, tracer)
        return closed, closed, closed * free
    rays = spots[0].shape[1] // samples
    spread = np.repeat(to, rays, axis=2) if to.shape[2] > 1 else to
    to, weight = light.sample(spread, point, normal, *spots)
    when = np.repeat(time, rays, axis=1) if isinstance(time, np.ndarray) else time
    free = ~blocked_segments(plan, surface, to, pairs, when, tracer)
    shape = (surface.item.size, samples, rays)
    total = weight.reshape(shape).sum(axis=2) / rays
    return closed, total, (weight * free).reshape(shape).sum(axis=2) / rays


def unoccluded_factor(light: Emitter, shape: Emitter, to: Array, surface: Surface) -> Array:
    """Irradiance factors (n,) of a light that only the horizons of the points' own surfaces hide.

    to : (3, n) metres, vectors from the points to the light's centre.

    With hard shadows (`shape` is the center of the light) a light counts as a whole if its center
    is above the horizon, else not at all. A light without a center casts no hard shadows.
    """
    factor = light.irradiance_factor(to, surface.point, surface.normal)
    # surfaces in the plane of the light receive none of it, on whichever side rounding puts them
    nothing = light.receives_nothing(surface.item)
    if nothing is not None:
        factor = np.where(nothing, 0.0, factor)
    if light.extended and not shape.extended and shape.casts_shadow:
        factor = np.where(dot(surface.normal, to) > 0.0, factor, 0.0)
    return factor


def _closed_form(plan: Plan, light: Emitter, to: Array, surface: Surface) -> Array:
    """Unoccluded irradiance factors (n, 1) or, if the light moves, (n, k)."""
    k, shape = to.shape[2], plan.as_shadow_caster(light)
    if k == 1:
        return unoccluded_factor(light, shape, to[:, :, 0], surface)[:, None]
    flat = to.reshape(3, -1)
    many = surface.take(np.repeat(np.arange(surface.item.size), k))
    return unoccluded_factor(light, shape, flat, many).reshape(-1, k)
