# SPDX-License-Identifier: GPL-3.0-or-later
"""First pass of method 'EXACT': smooth blocks, and one exactly shaded ray for each other pixel.

With each pixel comes its predicted error. Pixels that are cut by outlines, where light has steps or
strong curvature, or where something moves are refined to an error goal in the second pass
(`adaptive`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from ..detection.detect import (
    CenterRays,
    DetectionFlags,
    detect,
    detect_smooth_blocks,
    trace_center_rays,
)
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns, place
from ..parallel.call_progress import progress_range, report_progress
from ..shading.direct_light import DirectLight, shade
from ..shading.footprint import make_patch
from ..shading.variation import STEP_KIND, zero_variation
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs
from ..tracing.occluder_culling import Occluders
from .block_interpolation import SmoothBlocks, interpolate_blocks
from .chebyshev_blocks import SIDES, PixelBlocks, coarse_plan
from .visibility_key import NO_KEY, find_visibility_keys

__all__ = ["FirstPass", "FirstPassPixels", "trace_first_pass"]

Clock: TypeAlias = Callable[[str], None]
"""Callback that is called with the name of each stage that has ended."""


DETECTION_WORK_SHARE = 0.4
"""Fraction of the work of a first pass that precedes shading (a third to a half, with 2 to 2,000
objects); for a progress bar."""
BLOCK_WORK_SHARE = 0.2
"""Fraction of the work of a first pass that is done after the blocks of a side, multiplied by that
side in pixels; for a progress bar."""


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
    spatial_error : (n,) the sum of those along x and y except steps, which neighbouring centres may
        correct.
    mask : (3, n) penumbra, motion, edge.  outline : (n,) whether outlines may pass.
    item : (n,) object at the centre, -1 for none.
    visibility_key : (n,) visibility key: see `find_visibility_keys`.
    depth : (n,), normal : (3, n) of the hits.
    candidates : objects that may be visible in pixels with outlines, sorted by pixel.
    """

    color: Array
    alpha: Array
    deviation: Array
    sampling: Array
    error: Array
    spatial_error: Array
    mask: Mask
    outline: Mask
    item: Ints
    visibility_key: Ints
    depth: Array
    normal: Array
    candidates: Pairs


@dataclass(frozen=True)
class FirstPass:
    """Results of the first pass over a tile.

    Attributes
    ----------
    blocks : the smooth blocks, by side.
    pixels : all other pixels in batches: their coordinates x, y (n,) and results.
    points : number of points shaded for the blocks.
    """

    blocks: list[SmoothBlocks]
    pixels: list[tuple[Ints, Ints, FirstPassPixels]]
    points: int


def trace_first_pass(
    plan: Plan, occluders: Occluders, bounds: Ints, blocks: PixelBlocks, clock: Clock
) -> FirstPass:
    """Find the smooth blocks; trace, detect and shade the centres of all other pixels.

    Parameters
    ----------
    plan : its region bounds the pixels.
    bounds : (4, objects) `screen_bounds` of the plan.
    blocks : blocks of the largest side.
    clock : called at the end of each stage.
    """
    smooth_blocks, points = [], 0
    for side, smaller in zip(SIDES, (*SIDES[1:], 1), strict=True):
        plan.raise_if_cancelled()
        cut = np.ones(blocks.x.size, dtype=np.bool_)
        if plan.edges:
            rough = coarse_plan(plan, side)
            center = trace_center_rays(rough, *blocks.centers, blocks.pairs)
            with progress_range(BLOCK_WORK_SHARE / (2 * side), BLOCK_WORK_SHARE / side):
                found = detect_smooth_blocks(rough, occluders, center, clock)
            blocks = PixelBlocks(side, blocks.x, blocks.y, found.pairs)
            clear = found.smooth.nonzero()[0]
            interpolated, smooth, count = interpolate_blocks(plan, blocks, clear, found)
            smooth_blocks.append(interpolated)
            points += count
            cut[clear[smooth]] = False
        blocks = blocks.subdivide(cut.nonzero()[0], smaller, plan.region)
        clock("smooth blocks")
        report_progress(BLOCK_WORK_SHARE / side)
    pixels = _trace_batches(plan, occluders, blocks.within(bounds), clock)
    return FirstPass(smooth_blocks, pixels, points)


def _trace_batches(
    plan: Plan, occluders: Occluders, blocks: PixelBlocks, clock: Clock
) -> list[tuple[Ints, Ints, FirstPassPixels]]:
    """Trace pixels, given as blocks of side 1, in batches."""
    pixels = []
    batch, count = plan.settings.batch, blocks.x.size
    with progress_range(BLOCK_WORK_SHARE / SIDES[-1], 1.0):
        for first in range(0, count, batch):
            plan.raise_if_cancelled()
            part = blocks.part(first, first + batch)
            with progress_range(first / count, min((first + batch) / count, 1.0)):
                traced = _trace_pixels(plan, occluders, *part.centers, part.pairs, clock)
            pixels.append((part.x, part.y, traced))
    return pixels


def _trace_pixels(
    plan: Plan, occluders: Occluders, x: Array, y: Array, pairs: Pairs, clock: Clock
) -> FirstPassPixels:
    """Trace, detect and shade the centres of n pixels; see `trace_center_rays`."""
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
    candidates = flags.visible_candidates.take(
        np.argsort(flags.visible_candidates.pixel, kind="stable")
    )
    visibility_key = _visibility_keys(plan, np.array([x, y]), center, flags, candidates)
    clock("visibility keys")
    return FirstPassPixels(
        color, alpha, deviation, sampling, deviation.sum(axis=(0, 1)) + sampling,
        deviation[:STEP_KIND, :2].sum(axis=(0, 1)), flags.mask, flags.silhouette,
        center.item, visibility_key, center.depth, normal, candidates,
    )  # fmt: skip


def _visibility_keys(
    plan: Plan, place: Array, center: CenterRays, flags: DetectionFlags, candidates: Pairs
) -> Ints:
    """Visibility keys (n,) of pixels with centres (2, n); `candidates` is sorted by pixel."""
    visibility_key = np.where(flags.silhouette, NO_KEY, center.item + 1)
    rows = (flags.silhouette & flags.mask[1]).nonzero()[0]
    if rows.size:
        half = 0.5 if plan.edges else 0.0
        own = candidates.for_pixels(rows, visibility_key.size)
        visibility_key[rows] = find_visibility_keys(plan, columns(place, rows), half, own)
    return visibility_key


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
    known = tuple(zip(flags.visibilities, flags.candidates, strict=True))
    return shade(plan, occluders, center.hits, 0.0, patch, known)
