# SPDX-License-Identifier: GPL-3.0-or-later
"""Light of pixels that one object at rest fills, by few rays to each light.

Where outlines of occluders may reach the shaft from a pixel's surface to a light, the rays start at
points spread over the pixel: a shadow that lies between the centres of pixels is met as well as any
other. Elsewhere what the light's visible part is at the centre, it is everywhere in the pixel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..detection.occlusion import LightVisibility
from ..detection.pixel_footprint import make_footprint
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns
from ..numerics.low_discrepancy import hashed_sequence_points
from ..numerics.vector import rms
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs, Surface, intersect_pairs, surface
from ..tracing.occluder_culling import Occluders
from .center_light import (
    MIXED,
    CenterLight,
    CenterLights,
    mean_and_spread,
    sample_center_light,
)
from .ratio_estimator import gather_light, unoccluded_factor
from .sample_light import LIGHT_STREAM
from .sampled_occlusion import UNSEEN_SHARE

__all__ = ["FilledPoints", "sample_filled_light"]


FIRST_RAYS = 8
"""Number of rays to each light from a pixel: they tell where a light is visible in part."""
PLACE_STREAM = 39
"""Stream of the hashes that shift the places of a pixel's rays."""
DIMENSIONS = 4
"""Number of dimensions of the sequences of rays: a place in the pixel, and one on the light."""
POINTS_PER_CHUNK = 1 << 15
"""Number of points in one batch of work; it bounds memory."""


@dataclass(frozen=True)
class FilledPoints:
    """Centres of n pixels that one object at rest fills, at mid-shutter.

    Attributes
    ----------
    x, y : (n,) picture coordinates.  index : (n,) numbers in the whole picture.
    hits : the surface there.  reach : (n,) metres, bounds on the distance of the other points that
        the pixel shows.
    shadows : for each light, its visibility from the centres.
    candidates : for each light, pairs of pixels and occluders that may matter anywhere in these.
    """

    x: Array
    y: Array
    index: Ints
    hits: Surface
    reach: Array
    shadows: Sequence[LightVisibility]
    candidates: Sequence[Pairs]

    def take(self, rows: Ints) -> FilledPoints:
        """Some of the pixels, by ascending indices."""
        return FilledPoints(
            self.x[rows], self.y[rows], self.index[rows], self.hits.take(rows), self.reach[rows],
            [each.take(rows) for each in self.shadows],
            [pairs.for_pixels(rows, self.x.size) for pairs in self.candidates],
        )  # fmt: skip


def sample_filled_light(
    plan: Plan, occluders: Occluders, points: FilledPoints
) -> tuple[CenterLight, Mask]:
    """Light of n pixels by `FIRST_RAYS` rays to each light.

    Returns with it the pixels (n,) over which the visible part of a light may change.
    """
    count, rays = points.x.size, (FIRST_RAYS, FIRST_RAYS)
    if not plan.any_mesh:
        light = sample_center_light(
            plan, points.hits, points.index, points.shadows, rays, tracer=occluders.tracer
        )
        return light, np.ones(count, dtype=np.bool_)
    points = _without_dark(plan, points)
    sides = _flat_sides(plan, points)
    outlines = [
        occluders.outlines.before(number, points.hits, points.reach, pairs, sides)
        for number, pairs in enumerate(points.candidates)
    ]
    near = np.zeros(count, dtype=np.bool_)
    for each in outlines:
        near |= each.near
    some, rest = near.nonzero()[0], (~near).nonzero()[0]
    part = points.take(rest)
    sure = sample_center_light(plan, part.hits, part.index, part.shadows, rays)
    step = max(1, POINTS_PER_CHUNK // FIRST_RAYS)
    parts = [
        _sample_spread(plan, points.take(some[first : first + step]))
        for first in range(0, some.size, step)
    ]
    order = np.argsort(np.concatenate([rest, some]), kind="stable")
    light = CenterLight(
        **{
            name: columns(
                np.concatenate([getattr(each, name) for each in (sure, *parts)], axis=-1), order, -1
            )
            for name in CenterLight.__dataclass_fields__
        }
    )
    reached = near & (light.visibility == MIXED)
    dark = ~light.color.any(axis=0)
    for each in outlines:
        reached |= each.reached(~reached, dark) & near
    light.unseen[~reached] = 0.0
    return light, reached


def _flat_sides(plan: Plan, points: FilledPoints) -> tuple[Array, Array]:
    """Half sides, two of (3, n) metres, of parallelograms that hold what pixels show of planes; 0
    for other surfaces."""
    footprint = make_footprint(plan, points.hits, points.reach)
    flat = (footprint.thickness == 0.0) & np.isfinite(points.reach)
    one, other = (np.where(flat, step, 0.0) for step in footprint.steps)
    return one, other


def _without_dark(plan: Plan, points: FilledPoints) -> FilledPoints:
    """The points, without the occluders of lights that do not light them."""
    candidates = []
    for light, pairs in zip(plan.lights, points.candidates, strict=True):
        shape = plan.as_shadow_caster(light)
        to = light.to_center(points.hits.point, 0.0)
        factor = unoccluded_factor(light, shape, to, points.hits)
        candidates.append(pairs.take(factor[pairs.pixel] > 0.0))
    return replace(points, candidates=candidates)


def _sample_spread(plan: Plan, points: FilledPoints) -> CenterLight:
    """Light of n pixels by rays that start at points spread over them."""
    count, sums = points.x.size, CenterLights(plan, points.hits)
    starts, own = _starts(plan, points)
    for number, light in enumerate(plan.lights):
        weight, factor = sums.unhidden(number)
        share = np.ones(count)
        pairs = points.candidates[number]
        if light.casts_shadow and pairs.item.size:
            spots = None
            if plan.as_shadow_caster(light).extended:
                a, b = hashed_sequence_points(
                    plan.settings.seed, points.index, LIGHT_STREAM + number, (0, FIRST_RAYS),
                    DIMENSIONS,
                )[2:]  # fmt: skip
                spots = a.reshape(-1, 1), b.reshape(-1, 1)
            each = pairs.for_pixels(own, count)
            found = gather_light(plan, starts, light, each, spots, 0.0).batched(FIRST_RAYS)
            share, off = mean_and_spread(found)
            unseen = np.zeros(count)
            unseen[pairs.pixel] = UNSEEN_SHARE / FIRST_RAYS
            sums.add_errors(rms(weight) * factor, off, unseen)
        sums.add(number, weight, factor, share)
    return sums.light


def _starts(plan: Plan, points: FilledPoints) -> tuple[Surface, Ints]:
    """The starts of all rays of n pixels, pixel by pixel, and the pixels that these belong to."""
    own = np.repeat(np.arange(points.x.size), FIRST_RAYS)
    offset = hashed_sequence_points(
        plan.settings.seed, points.index, PLACE_STREAM, (0, FIRST_RAYS), DIMENSIONS
    )[:2]
    dx, dy = offset.reshape(2, -1) - 0.5
    w, item = plan.lens.directions(points.x[own] + dx, points.y[own] + dy), points.hits.item[own]
    t = intersect_pairs(plan, w, item)
    # where rounding leaves a gap, the centre stands for the place
    lost = (~np.isfinite(t)).nonzero()[0]
    if lost.size:
        w[:, lost] = plan.lens.directions(points.x[own[lost]], points.y[own[lost]])
        t[lost] = intersect_pairs(plan, w[:, lost], item[lost])
    return surface(plan, w, t, item), own
