# SPDX-License-Identifier: GPL-3.0-or-later
"""Direct light at single points, of which rays estimate the visible parts of lights.

Unhidden light is exact, and rays estimate the fraction of each light that is visible: a ratio
estimator (Heitz, Hill and McGuire 2018). The rays of a point form one low-discrepancy sequence,
which is cut into consecutive batches; the spread of their estimates gives the error (batch means:
Owen 2013, chapter 17).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..detection.occlusion import LightVisibility
from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Ints
from ..numerics.floats import TINY
from ..numerics.low_discrepancy import hashed_kronecker_points
from ..numerics.vector import rms
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface
from ..tracing.solid_rays import SolidTracer
from .direct_light import add_emission, diffuse_brdf
from .line_light import LINE_COUNTS, line_fractions, points_for_lines
from .ratio_estimator import LightSums, gather_light, ratio_estimate, unoccluded_factor
from .sample_light import LIGHT_STREAM
from .sampled_occlusion import BATCHES, UNSEEN_SHARE

__all__ = [
    "MIXED",
    "CenterLight",
    "CenterLights",
    "mean_and_spread",
    "sample_center_light",
    "visibility_numbers",
]


MIXED = -1
"""Number of points from which a light is visible in part, or of pixels that show several
objects."""


FEW_RAYS = 256
"""Number of rays that points send to a light before lines across it are tried, where a rough
fraction will do. They take as long as a fifth of the lines (300 µs, before 100,000 faces) ..."""
FEW_RAYS_ERROR = 3e-3
"""... and this error of the fraction is about the least that they reach."""


@dataclass(frozen=True)
class CenterLight:
    """Light that n points send to the camera: of lights, and their own.

    Attributes
    ----------
    unhidden : (3, n) sizes of the radiance without shadows, by absolute values of lights.
    taken : (3, n) what of it lights of negative power would take if nothing hid them.
    color : (3, n) radiance with shadows, from `-taken` to `unhidden - taken`.
    spread : (n,) estimated error by the spread of the rays' batches.
    unseen : (n,) error of parts of lights that no ray may have met.
    visibility : (n,) a number that tells which lights all rays have reached, and which none; or
        `MIXED` where a light is visible in part.
    """

    unhidden: Array
    taken: Array
    color: Array
    spread: Array
    unseen: Array
    visibility: Ints

    @property
    def fraction(self) -> Array:
        """Places (3, n) of the radiance, from 0 to 1, between the least and the most that shadows
        can leave: visible fractions, where no light is negative. 1 where there is no light."""
        lit = self.unhidden > 0.0
        above = self.color + self.taken
        found: Array = np.where(lit, above, 1.0) / np.where(lit, self.unhidden, 1.0)
        return found


def sample_center_light(
    plan: Plan,
    hits: Surface,
    pixel: Ints,
    shadows: Sequence[LightVisibility],
    rays: tuple[int, int],
    allowed: Array | None = None,
    tracer: SolidTracer | None = None,
) -> CenterLight:
    """Sample the lights that are visible in part from n points.

    Parameters
    ----------
    hits : the points, at mid-shutter.  pixel : (n,) numbers that the points' rays depend on.
    shadows : for each light, its visibility from the points.
    rays : number of rays that each point sends to each light at first, and up to which it is
        doubled.
    allowed : (n,) error, as a radiance, up to which no more rays are sent; None for any.
    tracer : as that of `blocked_segments`.
    """
    count, sums = pixel.size, CenterLights(plan, hits)
    for number, (light, shadow) in enumerate(zip(plan.lights, shadows, strict=True)):
        weight, factor = sums.unhidden(number)
        share, errors = np.ones(count), np.zeros((2, count))
        if light.casts_shadow:
            share[shadow.hidden] = 0.0
            pairs = shadow.pairs.take(factor[shadow.pairs.pixel] > 0.0)
            size = rms(weight) * factor
            most = None if allowed is None else allowed / np.sqrt(len(plan.lights))
            fractions = _Fractions(plan, hits, pixel, number, pairs, tracer)
            fractions.sample(rays, size, most, share, errors)
            sums.add_errors(size, *errors)
        sums.add(number, weight, factor, share)
    return sums.light


class CenterLights:
    """Sums over the lights of what n points send to the camera, at mid-shutter."""

    def __init__(self, plan: Plan, hits: Surface) -> None:
        """No light is entered yet; what surfaces emit themselves is."""
        self._plan, self._hits = plan, hits
        count = hits.item.size
        self._brdf = diffuse_brdf(plan, hits.item)
        self._unhidden = np.zeros((3, count))
        add_emission(plan, hits, self._unhidden)
        self._color, self._taken = self._unhidden.copy(), np.zeros((3, count))
        self._spread, self._unseen = np.zeros((2, count))
        self._whole, self._seen = np.zeros((2, len(plan.lights), count))

    def unhidden(self, number: int) -> tuple[Array, Array]:
        """Weights (3, n) and irradiance factors (n,) of a light without shadows."""
        light = self._plan.lights[number]
        shape = self._plan.as_shadow_caster(light)
        to = light.to_center(self._hits.point, 0.0)
        factor = unoccluded_factor(light, shape, to, self._hits)
        return self._brdf * light.power[:, None], factor

    def add(self, number: int, weight: Array, factor: Array, share: Array) -> None:
        """Enter a light: what `unhidden` gives of it, and its visible fractions (n,)."""
        self._unhidden += np.abs(weight) * factor
        self._taken += np.maximum(-weight, 0.0) * factor
        self._color += weight * (factor * share)
        self._whole[number], self._seen[number] = factor, share

    def add_errors(self, size: Array, spread: Array, unseen: Array) -> None:
        """Enter errors (n,) of the fraction of a light that sends a radiance of `size` (n,)."""
        self._spread += (size * spread) ** 2
        self._unseen += (size * unseen) ** 2

    @property
    def light(self) -> CenterLight:
        """The light of all that is entered."""
        numbers = visibility_numbers(self._whole, self._seen * self._whole)
        errors = np.sqrt(self._spread), np.sqrt(self._unseen)
        return CenterLight(self._unhidden, self._taken, self._color, *errors, numbers)


def visibility_numbers(total: Array, visible: Array) -> Ints:
    """Numbers (n,) of which lights (l, n) are seen by all rays, by none, or dark; or `MIXED`."""
    number, mixed = np.zeros(total.shape[1], dtype=np.int64), np.zeros(total.shape[1], dtype=bool)
    for whole, seen in zip(total, visible, strict=True):
        state = np.where(seen == whole, 1, np.where(seen > 0.0, 3, 2)) * (whole > 0.0)
        number, mixed = 3 * number + state % 3, mixed | (state == 3)
    return np.where(mixed, MIXED, number)


@dataclass(frozen=True)
class _Fractions:
    """Estimator of the visible fractions of one light.

    Attributes
    ----------
    plan, hits, pixel : see `sample_center_light`.  number : the light's.
    pairs : pairs of points and occluders, sorted by point.
    tracer : as that of `blocked_segments`.
    """

    plan: Plan
    hits: Surface
    pixel: Ints
    number: int
    pairs: Pairs
    tracer: SolidTracer | None

    def sample(
        self,
        rays: tuple[int, int],
        size: Array,
        allowed: Array | None,
        share: Array,
        errors: Array,
    ) -> None:
        """Enter fractions (n,) and errors (2, n), by spread and unseen parts, of some points.

        size : (n,) radiance of the whole light.  allowed : (n,) error as a radiance, or None.
        """
        some = np.zeros(self.pixel.size, dtype=np.bool_)
        some[self.pairs.pixel] = True
        rows = some.nonzero()[0]
        if allowed is not None:
            rough = some & (size * FEW_RAYS_ERROR <= allowed)
            few = rays[0], FEW_RAYS
            left = self._by_rays(rough.nonzero()[0], few, size, allowed, share, errors)
            rows = np.sort(np.concatenate([left, (some & ~rough).nonzero()[0]]))
            rows = self._by_lines(rows, size, allowed, share, errors)
        self._by_rays(rows, rays, size, allowed, share, errors)

    def _by_rays(
        self,
        rows: Ints,
        rays: tuple[int, int],
        size: Array,
        allowed: Array | None,
        share: Array,
        errors: Array,
    ) -> Ints:
        """Enter fractions and errors of the points `rows`; see `sample`.

        Returns the points whose errors are above those allowed.
        """
        first, end, sums = 0, rays[0], None
        extended = self.plan.as_shadow_caster(self._light).extended
        while rows.size:
            new = self._sums(rows, first, end)
            sums = new if sums is None else sums.joined(new)
            share[rows], errors[0, rows] = mean_and_spread(sums)
            errors[1, rows] = UNSEEN_SHARE / end if extended else 0.0
            if allowed is None:
                break
            more = (size * errors.max(axis=0) > allowed)[rows].nonzero()[0]
            rows, sums = rows[more], sums.take(more)
            first, end = end, 2 * end
            if end > rays[1]:
                break
        return rows

    def _by_lines(
        self, rows: Ints, size: Array, allowed: Array, share: Array, errors: Array
    ) -> Ints:
        """Enter fractions of the points `rows` by lines across the light, where these are known.

        Returns the other points.
        """
        pairs = self.pairs.for_pixels(rows, self.pixel.size)
        fit = points_for_lines(self.plan, self._light, self.hits.take(rows), pairs)
        left, rows = rows[~fit], rows[fit]
        for lines in LINE_COUNTS:
            if not rows.size:
                break
            pairs = self.pairs.for_pixels(rows, self.pixel.size)
            found, error = line_fractions(
                self.plan, self._light, self.hits.take(rows), pairs, lines
            )
            known = np.isfinite(error)
            share[rows[known]], errors[0, rows[known]] = found[known], error[known]
            left = np.concatenate([left, rows[~known]])
            rows = rows[known & (size[rows] * error > allowed[rows])]
        return np.sort(left)

    @property
    def _light(self) -> Emitter:
        return self.plan.lights[self.number]

    def _sums(self, rows: Ints, first: int, end: int) -> LightSums:
        """Sums (k, batches) of k points over rays `first` to `end` - 1."""
        pairs = self.pairs.for_pixels(rows, self.pixel.size)
        hits, light = self.hits.take(rows), self._light
        if not self.plan.as_shadow_caster(light).extended:
            return gather_light(self.plan, hits, light, pairs, None, 0.0, tracer=self.tracer)
        start = np.full(rows.size, first)
        spots = hashed_kronecker_points(
            self.plan.settings.seed, self.pixel[rows], LIGHT_STREAM + self.number, start,
            end - first,
        )  # fmt: skip
        times = np.zeros((rows.size, BATCHES))
        return gather_light(self.plan, hits, light, pairs, spots, times, tracer=self.tracer)


def mean_and_spread(sums: LightSums) -> tuple[Array, Array]:
    """Visible fractions (n,) and their standard errors, by the residuals of the batches' ratios."""
    every, visible = sums.total.mean(axis=1), sums.visible.mean(axis=1)
    share = ratio_estimate(np.ones_like(every), every, visible)
    residual = sums.visible - share[:, None] * sums.total
    batches = residual.shape[1]
    square = (residual * residual).sum(axis=1) / (batches * max(batches - 1, 1))
    return share, np.sqrt(square) / np.maximum(every, TINY)
