# SPDX-License-Identifier: GPL-3.0-or-later
"""First pass of method 'EXACT': smooth blocks, and one exactly shaded ray for each other pixel.

With each pixel comes its predicted error. Pixels that are cut by outlines, where light has steps or
strong curvature, or where something moves are refined to an error goal in the second pass
(`adaptive`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from ..detection.detect import (
    CenterRays,
    DetectionFlags,
    detect,
    detect_smooth_blocks,
    trace_center_rays,
)
from ..lights.environment_backdrop import mean_over_boxes
from ..lights.environment_map import EnvironmentMap
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.gather import columns, place
from ..parallel.call_progress import progress_range, report_progress
from ..shading.center_light import CenterLight
from ..shading.direct_light import DirectLight, interpolates_occlusion, shade
from ..shading.filled_light import FilledPoints, sample_filled_light
from ..shading.footprint import make_patch
from ..shading.variation import STEP_KIND, zero_variation
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs
from ..tracing.occluder_culling import Occluders
from .block_interpolation import SmoothBlocks, interpolate_blocks
from .chebyshev_blocks import SIDES, PixelBlocks, coarse_plan
from .coarse_blocks import has_coarse_blocks, interpolate_coarse_blocks
from .memory_bound import listed_pixels
from .visibility_key import NO_KEY, find_visibility_keys

__all__ = ["FirstPass", "FirstPassPixels", "trace_first_pass"]

Clock: TypeAlias = Callable[[str], None]
"""Callback that is called with the name of each stage that has ended."""


BACKDROP_ERROR = 0.3
"""Error of an environment in a pixel that shows nothing else, as a fraction of the tolerance times
its own radiance, up to which it is not looked at again."""
SAMPLED_ITEM = -2
"""Item of sampled pixels: no object, so that no neighbour counts as showing the same one."""
BATCH_PAIRS = 1 << 16
"""Number of pairs of pixels and objects that may be seen in them in one batch, unless those of one
pixel are more: each takes up to 2 KB while outlines are looked for."""
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
    candidates : objects that may be visible in pixels with outlines, or in those that are sampled,
        sorted by pixel.
    sampled : (n,) pixels that are to be sampled: see `ShapeSet.sampled`. Nothing is known of their
        radiance yet, and no outlines are stated.
    cut : (n,) sampled pixels in which outlines may pass.
    centers : the light at the centres of those sampled pixels that one object at rest fills; None
        if there are none.
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
    sampled: Mask
    cut: Mask
    centers: FilledPixels | None


@dataclass(frozen=True)
class FilledPixels:
    """Some of n sampled pixels, each filled by one object at rest.

    Attributes
    ----------
    rows : (k,) the pixels, ascending.  item : (k,) the objects.
    light : their light, by few rays: see `sample_filled_light`.
    reached : (k,) whether the visible part of a light may change within the pixel.
    """

    rows: Ints
    item: Ints
    light: CenterLight
    reached: Mask


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
    smooth_blocks: list[SmoothBlocks] = []
    points = 0
    if has_coarse_blocks(plan):
        smooth_blocks, blocks, points = interpolate_coarse_blocks(
            plan, occluders, bounds, blocks, clock
        )
    for side, smaller in zip(SIDES, (*SIDES[1:], 1), strict=True):
        plan.raise_if_cancelled()
        cut = np.ones(blocks.x.size, dtype=np.bool_)
        if plan.edges:
            rough = coarse_plan(plan, side)
            center = trace_center_rays(rough, *blocks.centers, blocks.pairs)
            with progress_range(BLOCK_WORK_SHARE / (2 * side), BLOCK_WORK_SHARE / side):
                # smaller blocks have as many pixels as nodes
                part = tuple(
                    side == SIDES[0] and interpolates_occlusion(plan, each) for each in plan.lights
                )
                found = detect_smooth_blocks(rough, occluders, center, clock, part)
            blocks = PixelBlocks(side, blocks.x, blocks.y, found.pairs)
            clear = found.smooth.nonzero()[0]
            interpolated, smooth, count = interpolate_blocks(plan, occluders, blocks, clear, found)
            smooth_blocks.append(interpolated)
            points += count
            cut[clear[smooth]] = False
        blocks = blocks.subdivide(cut.nonzero()[0], smaller, plan.region, bounds)
        clock("smooth blocks")
        report_progress(BLOCK_WORK_SHARE / side)
    pixels = _trace_batches(plan, occluders, blocks, clock)
    return FirstPass(smooth_blocks, pixels, points)


def _trace_batches(
    plan: Plan, occluders: Occluders, blocks: PixelBlocks, clock: Clock
) -> list[tuple[Ints, Ints, FirstPassPixels]]:
    """Trace pixels, given as blocks of side 1, in batches."""
    pixels = []
    count = blocks.x.size
    with progress_range(BLOCK_WORK_SHARE / SIDES[-1], 1.0):
        for first, end in _batches(blocks, min(plan.settings.batch, listed_pixels(plan))):
            plan.raise_if_cancelled()
            part = blocks.part(first, end)
            with progress_range(first / count, end / count):
                traced = _trace_pixels(plan, occluders, *part.centers, part.pairs, clock)
            pixels.append((part.x, part.y, traced))
    return pixels


def _batches(blocks: PixelBlocks, most: int) -> list[tuple[int, int]]:
    """First pixels and ends of batches of at most `most` pixels, and of not too many pairs."""
    count = blocks.x.size
    if blocks.pairs.item.size <= BATCH_PAIRS:
        return [(first, min(first + most, count)) for first in range(0, count, most)]
    before = np.concatenate([[0], np.bincount(blocks.pairs.pixel, minlength=count).cumsum()])
    ends = [0]
    while ends[-1] < count:
        first = ends[-1]
        enough = int(before.searchsorted(before[first] + BATCH_PAIRS, side="right")) - 1
        ends.append(min(max(enough, first + 1), first + most, count))
    return list(pairwise(ends))


def _trace_pixels(
    plan: Plan, occluders: Occluders, x: Array, y: Array, pairs: Pairs, clock: Clock
) -> FirstPassPixels:
    """Trace, detect and shade the centres of n pixels; see `trace_center_rays`."""
    center = trace_center_rays(plan, x, y, pairs)
    clock("camera rays")
    with progress_range(0.0, DETECTION_WORK_SHARE):
        flags = detect(plan, occluders, center, clock)
    n = x.size
    color, sampling = np.zeros((3, n)), np.zeros(n)
    if not plan.transparent:
        color[:] = plan.background[:, None]
        if plan.backdrop is not None:
            _show_backdrop(plan, plan.backdrop, center, x, y, color, sampling)
    alpha = np.full(n, 0.0 if plan.transparent else 1.0)
    deviation = zero_variation(n)
    sampled = _sampled_pixels(plan, center, flags)
    kept = (~sampled[center.rows]).nonzero()[0]
    rows = center.rows[kept]
    with progress_range(DETECTION_WORK_SHARE, 1.0):
        light = _shade_centers(plan, occluders, center, flags, kept)
    place(color, rows, light.color)
    alpha[rows] = plan.opacity(center.item[rows])
    place(deviation, rows, light.deviation)
    sampling[rows] = light.error
    normal = np.zeros((3, n))
    place(normal, center.rows, center.hits.normal)
    clock("exact light")
    outline = flags.silhouette & ~sampled
    candidates = flags.visible_candidates.take(
        np.argsort(flags.visible_candidates.pixel, kind="stable")
    )
    refined = candidates.take(outline[candidates.pixel])
    visibility_key = _visibility_keys(plan, np.array([x, y]), center, flags, outline, refined)
    clock("visibility keys")
    item, filled = center.item, None
    if sampled.any():
        filled = _sample_filled_pixels(plan, occluders, (x, y), center, flags, sampled)
        candidates = _sampled_candidates(plan, occluders, center, flags, sampled, candidates)
        visibility_key[sampled] = NO_KEY
        item = np.where(sampled, SAMPLED_ITEM, item)
    return FirstPassPixels(
        color, alpha, deviation, sampling, deviation.sum(axis=(0, 1)) + sampling,
        deviation[:STEP_KIND, :2].sum(axis=(0, 1)), flags.mask, outline,
        item, visibility_key, center.depth, normal, candidates, sampled,
        sampled & flags.silhouette, filled,
    )  # fmt: skip


def _show_backdrop(
    plan: Plan,
    backdrop: EnvironmentMap,
    center: CenterRays,
    x: Array,
    y: Array,
    color: Array,
    error: Array,
) -> None:
    """Enter what is seen of an environment in pixels whose centres hit nothing, and its error."""
    rows = (center.item < 0).nonzero()[0]
    half = 0.5 if plan.settings.use_edges else 0.0
    share = BACKDROP_ERROR * plan.settings.tolerance
    color[:, rows], error[rows] = mean_over_boxes(
        backdrop, plan.lens, x[rows], y[rows], half, share
    )


def _sampled_pixels(plan: Plan, center: CenterRays, flags: DetectionFlags) -> Mask:
    """Pixels (n,) that may show an object that is sampled, or be shaded by one in part, or whose
    light costs less by rays.
    """
    chosen = plan.shapes.sampled
    sampled = flags.by_rays.copy()
    if not chosen.any():
        return sampled
    seen = flags.visible_candidates
    sampled[seen.pixel[chosen[seen.item]]] = True
    sampled[center.rows[chosen[center.hits.item]]] = True
    for pairs in flags.candidates:
        sampled[center.rows[pairs.pixel[chosen[pairs.item]]]] = True
    return sampled


def _sample_filled_pixels(
    plan: Plan,
    occluders: Occluders,
    middle: tuple[Array, Array],
    center: CenterRays,
    flags: DetectionFlags,
    sampled: Mask,
) -> FilledPixels | None:
    """Light at the centres of those sampled pixels that one object at rest fills.

    middle : coordinates x, y (n,) of the pixels' centres.
    """
    if not plan.edges:
        return None
    filled = (sampled & ~flags.silhouette & ~flags.mask[1])[center.rows].nonzero()[0]
    if not filled.size:
        return None
    rows = center.rows[filled]
    x, y = ((values[rows] - 0.5).astype(np.int64) for values in middle)
    points = FilledPoints(
        middle[0][rows], middle[1][rows], y * plan.resolution[0] + x, center.hits.take(filled),
        flags.reach[filled], [each.take(filled) for each in flags.visibilities],
        [pairs.for_pixels(filled, center.rows.size) for pairs in flags.candidates],
    )  # fmt: skip
    light, reached = sample_filled_light(plan, occluders, points)
    return FilledPixels(rows, center.item[rows], light, reached)


def _sampled_candidates(
    plan: Plan,
    occluders: Occluders,
    center: CenterRays,
    flags: DetectionFlags,
    sampled: Mask,
    candidates: Pairs,
) -> Pairs:
    """Candidates, with those of the sampled pixels that one object fills, and without those that
    rays find; sorted by pixel.
    """
    filled = (sampled & ~flags.silhouette & (center.item >= 0)).nonzero()[0]
    found = Pairs(
        np.concatenate([candidates.pixel, filled]),
        np.concatenate([candidates.item, center.item[filled]]),
    )
    tracer = occluders.tracer
    if tracer is not None and plan.seen is None and not plan.shapes.sampled.any():
        # of a million balls, lists of those that a pixel may show take more memory than the picture
        found = found.take(~(sampled[found.pixel] & tracer.traced[found.item]))
    return found.take(np.argsort(found.pixel, kind="stable"))


def _visibility_keys(
    plan: Plan,
    place: Array,
    center: CenterRays,
    flags: DetectionFlags,
    outline: Mask,
    candidates: Pairs,
) -> Ints:
    """Visibility keys (n,) of pixels with centres (2, n).

    outline : (n,) pixels that may be refined.  candidates : of those, sorted by pixel.
    """
    visibility_key = np.where(flags.silhouette, NO_KEY, center.item + 1)
    rows = (outline & flags.mask[1]).nonzero()[0]
    if rows.size:
        half = 0.5 if plan.edges else 0.0
        own = candidates.for_pixels(rows, visibility_key.size)
        visibility_key[rows] = find_visibility_keys(plan, columns(place, rows), half, own)
    return visibility_key


def _shade_centers(
    plan: Plan, occluders: Occluders, center: CenterRays, flags: DetectionFlags, kept: Ints
) -> DirectLight:
    """Light at some of the hits of centre rays; `kept` are their indices, ascending."""
    hits, shadows, candidates = center.hits, flags.visibilities, flags.candidates
    count = center.rows.size
    if kept.size < count:
        hits = hits.take(kept)
        shadows = tuple(each.take(kept) for each in shadows)
        candidates = tuple(pairs.for_pixels(kept, count) for pairs in candidates)
    rows = center.rows[kept]
    half = np.zeros((3, rows.size))
    if plan.edges:
        half[:2] = 0.5
    half[2] = np.where(flags.mask[1, rows], 0.5, 0.0)
    w = columns(center.w, rows)
    with np.errstate(over="ignore", invalid="ignore"):  # overflow affects error estimates only
        patch = make_patch(plan, w, center.depth[rows], hits, half)
    known = tuple(zip(shadows, candidates, strict=True))
    return shade(plan, occluders, hits, 0.0, patch, known)
