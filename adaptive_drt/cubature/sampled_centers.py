# SPDX-License-Identifier: GPL-3.0-or-later
"""Light at the centres of pixels by distributed shadow rays, to a stated error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..detection.occlusion import classify_light_visibility
from ..numerics.arrays import Array, Ints
from ..parallel.call_progress import progress_range
from ..shading.center_light import CenterLight, sample_center_light
from ..tracing.compile import Plan
from ..tracing.intersect import intersect_pairs, surface
from ..tracing.occluder_culling import Occluders

__all__ = ["CenterTask", "SampledCenters", "sample_centers"]


CENTER_RAYS = (64, 16_384)
"""Number of rays that a pixel's centre sends to each light at first, and up to which it is
doubled."""
CENTERS_PER_CHUNK = 2_048
"""Number of pixels in one batch of work; it bounds memory."""


@dataclass(frozen=True)
class CenterTask:
    """n pixels, each filled by one object at rest.

    Attributes
    ----------
    x, y : (n,) picture coordinates of the centres.
    index : (n,) numbers of the pixels in the whole picture, which their rays depend on.
    item : (n,) the object that fills each pixel.
    limit : (n,) error, as a radiance, at which a pixel is done.
    """

    x: Array
    y: Array
    index: Ints
    item: Ints
    limit: Array


@dataclass(frozen=True)
class SampledCenters:
    """Light at the centres of n pixels: `light`, and `samples` (n,) points shaded."""

    light: CenterLight
    samples: Ints


def sample_centers(plan: Plan, occluders: Occluders, task: CenterTask) -> SampledCenters:
    """Light at the centres of pixels."""
    count, parts = task.x.size, []
    for first in range(0, count, CENTERS_PER_CHUNK):
        plan.raise_if_cancelled()
        end = min(first + CENTERS_PER_CHUNK, count)
        with progress_range(first / count, end / count):
            parts.append(_sample_chunk(plan, occluders, task, slice(first, end)))
    names = CenterLight.__dataclass_fields__
    light = CenterLight(
        **{name: np.concatenate([getattr(p, name) for p in parts], axis=-1) for name in names}
    )
    return SampledCenters(light, np.ones(count, dtype=np.int64))


def _sample_chunk(plan: Plan, occluders: Occluders, task: CenterTask, rows: slice) -> CenterLight:
    item = task.item[rows]
    w = plan.lens.directions(task.x[rows], task.y[rows])
    # the first pass has hit the same objects by the same rays
    hits = surface(plan, w, intersect_pairs(plan, w, item), item)
    shadows = []
    for light in plan.lights:
        shape = plan.as_shadow_caster(light)
        pairs = occluders.find_ray_candidates(shape, hits)
        shadows.append(classify_light_visibility(plan, hits, shape, pairs, 0.0, plan.traced))
    return sample_center_light(
        plan, hits, task.index[rows], shadows, CENTER_RAYS, task.limit[rows], occluders.tracer
    )
