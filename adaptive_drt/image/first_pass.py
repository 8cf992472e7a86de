# SPDX-License-Identifier: GPL-3.0-or-later
"""First pass of method 'EXACT': one exactly shaded camera ray a pixel, and predicted pixel errors.

Pixels that are cut by outlines, where light has steps or strong curvature, or where something moves
are refined to an error goal in the second pass (`adaptive`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..detection.detect import CenterRays, DetectionFlags, detect, trace_center_rays
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns, place
from ..parallel.call_progress import progress_range
from ..shading.direct_light import DirectLight, shade
from ..shading.footprint import make_patch
from ..shading.variation import STEP_KIND, zero_variation
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs
from ..tracing.occluder_culling import Occluders
from .visibility_key import NO_KEY, find_visibility_keys

__all__ = ["FirstPassPixels", "SmoothBlocks", "first_pass"]


DETECTION_WORK_SHARE = 0.4
"""Fraction of the work of a first pass that precedes shading (a third to a half, with 2 to 2,000
objects); for a progress bar."""


@dataclass(frozen=True)
class FirstPassPixels:
    """Results of the first pass for n pixels.

    Attributes
    ----------
    color : (3, n) radiance at the centres.  alpha : (n,) coverage there.
    deviation : (4, 3, n) predicted errors of the centre as pixel mean, by kind and axis: see
        `variation`.
    sampling : (n,) estimated errors of light that distributed rays or other estimates cause.
    error : (n,) the sum of those.
    across : (n,) the sum of those along x and y except steps, which neighbouring centres may
        correct.
    mask : (3, n) penumbra, motion, edge.  outline : (n,) whether outlines may pass.
    item : (n,) object at the centre, -1 for none.
    sight : (n,) visibility key: see `find_visibility_keys`.
    depth : (n,), normal : (3, n) of the hits.
    rivals : objects that may be visible in pixels with outlines, sorted by pixel.
    """

    color: Array
    alpha: Array
    deviation: Array
    sampling: Array
    error: Array
    across: Array
    mask: Mask
    outline: Mask
    item: Ints
    sight: Ints
    depth: Array
    normal: Array
    rivals: Pairs


def first_pass(
    plan: Plan, occluders: Occluders, x: Array, y: Array, pairs: Pairs, clock: Callable[[str], None]
) -> FirstPassPixels:
    """Trace, detect and shade the centres of n pixels; arguments as those of `trace_center`."""
    center = trace_center_rays(plan, x, y, pairs)
    clock("camera rays")
    with progress_range(0.0, DETECTION_WORK_SHARE):
        flags = detect(plan, occluders, center, clock)
    n = x.size
    color = np.zeros((3, n))
    if not plan.transparent:
        color[:] = plan.background[:, None]
    alpha = np.full(n, 0.0 if plan.transparent else 1.0)
    deviation = zero_variation(n)
    rows = center.rows
    with progress_range(DETECTION_WORK_SHARE, 1.0):
        light = _shade_centers(plan, occluders, center, flags)
    place(color, rows, light.color)
    alpha[rows] = 1.0
    place(deviation, rows, light.deviation)
    sampling = np.zeros(n)
    sampling[rows] = light.error
    normal = np.zeros((3, n))
    place(normal, rows, center.hits.normal)
    clock("exact light")
    rivals = flags.rivals.take(np.argsort(flags.rivals.pixel, kind="stable"))
    sight = _visibility_keys(plan, np.array([x, y]), center, flags, rivals)
    clock("sights")
    return FirstPassPixels(
        color, alpha, deviation, sampling, deviation.sum(axis=(0, 1)) + sampling,
        deviation[:STEP_KIND, :2].sum(axis=(0, 1)), flags.mask, flags.outline,
        center.item, sight, center.depth, normal, rivals,
    )  # fmt: skip


def _visibility_keys(
    plan: Plan, place: Array, center: CenterRays, flags: DetectionFlags, rivals: Pairs
) -> Ints:
    """Visibility keys (n,) of pixels with centres (2, n); `rivals` is sorted by pixel."""
    sight = np.where(flags.outline, NO_KEY, center.item + 1)
    rows = (flags.outline & flags.mask[1]).nonzero()[0]
    if rows.size:
        half = 0.5 if plan.edges else 0.0
        own = rivals.of(rows, sight.size)
        sight[rows] = find_visibility_keys(plan, columns(place, rows), half, own)
    return sight


def _shade_centers(
    plan: Plan, occluders: Occluders, center: CenterRays, flags: DetectionFlags
) -> DirectLight:
    rows = center.rows
    half = np.zeros((3, rows.size))
    if plan.edges:
        half[:2] = 0.5
    half[2] = np.where(flags.mask[1, rows], 0.5, 0.0)
    w = columns(center.w, rows)
    with np.errstate(over="ignore", invalid="ignore"):  # overflow affects error estimates only
        patch = make_patch(plan, w, center.depth[rows], center.hits, half)
    time = np.zeros(rows.size) if plan.motion else 0.0
    known = tuple(zip(flags.shadows, flags.candidates, strict=True))
    return shade(plan, occluders, center.hits, time, patch, known)


@dataclass(frozen=True)
class SmoothBlocks:
    """n smooth blocks of s x s pixels, whose pixels need no ray of their own.

    Attributes
    ----------
    side : s.  x, y : (n,) the lower left corners in the picture, in units of s.
    color : (3, s, s, n) mean radiance, y first.  error : (n,) its estimated error.
    item : (n,) object that fills the block, -1 for none.
    depth : (s, s, n), normal : (3, s, s, n) of the hits at the pixels' centres.
    moving : (n,) whether the light on it changes during the shutter.
    """

    side: int
    x: Ints
    y: Ints
    color: Array
    error: Array
    item: Ints
    depth: Array
    normal: Array
    moving: Mask
