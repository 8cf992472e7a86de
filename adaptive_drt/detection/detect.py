# SPDX-License-Identifier: GPL-3.0-or-later
"""Detection for the pixels of a tile: the paper's three tests, for lights, shutter and pixel.

One ray with derivatives is traced at the centre of the pixel, the shutter and the lights. For each
domain a test bounds what may change within it; a pixel is flagged unless nothing can.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from ..lights.emitter import Emitter
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.axes import SHUTTER_ENDS
from ..numerics.gather import columns
from ..numerics.vector import dot
from ..parallel.call_progress import iterate_with_progress, progress_range
from ..tracing.ball_groups import MANY_OBJECTS
from ..tracing.compile import Plan
from ..tracing.few_occluders import FewOccluders
from ..tracing.intersect import Pairs, Surface, curvature, intersect_pairs, nearest_hits, surface
from ..tracing.occluder_culling import Occluders
from ..tracing.ray_costs import occluder_costs, rays_cost_less, regions_cost_more
from .edges import EdgeTest, detect_edges
from .moving_shadows import light_changes, patch_light_changes
from .moving_silhouettes import detect_moving_silhouettes, moves_under_fixed_ray
from .occlusion import (
    LightVisibility,
    classify_horizon,
    classify_light_visibility,
)
from .shadow_discontinuities import detect_shadow_edges, detect_steep_irradiance, patch_reach
from .swept_occlusion import classify_patches

__all__ = [
    "CenterRays",
    "DetectionFlags",
    "SmoothBlockFlags",
    "detect",
    "detect_smooth_blocks",
    "trace_center_rays",
]

StageCallback: TypeAlias = Callable[[str], None]
"""Callback that is called with the name of each stage that has ended."""


CANDIDATES_FOUND, OCCLUSION_CLASSIFIED = 0.15, 0.4
"""Progress of the detection for one light, 0 to 1: when its candidate occluders are found, and when
its visibility is classified."""
MIN_RELATIVE_GAP = 1.0
"""Distance of occluders from a block of pixels whose sky they may hide in part, in units of the
block's reach: nearer ones change the light over the block too quickly for an interpolation. Of
the blocks at distances of 1 to 2 two thirds can be interpolated, of nearer ones hardly any."""
CROWD, CROWD_SHARE = 48.0, 1.0 / 64.0
"""Number of objects before a light from which the surfaces that outlines bring into a pixel count
as hidden in part by as many, whatever its centre shows; and the number of them where the centre
hits nothing, as a fraction of the spheres. Chosen for cost, not fitted."""
MOST_LISTED = 1_024.0
"""Number of occluders of a point from which they are never all listed: it bounds memory."""
UNBOUNDED_REACH = 1e100
"""Reach in metres from which a patch of surface is treated as unbounded."""


@dataclass(frozen=True)
class CenterRays:
    """The centre rays of a tile of n pixels at the middle of the shutter.

    Attributes
    ----------
    w : (3, n) directions.
    pairs : m candidate pairs.  t : (m,) ray parameters of their hits, inf for a miss.
    depth, item : (n,) ray parameter and object of the nearest hit (inf and -1: none).
    depth_at_rest, item_at_rest : (n,) the same among objects that do not move.
    rows : (k,) the pixels that hit something.  hits : their k surface points.
    """

    w: Array
    pairs: Pairs
    t: Array
    depth: Array
    item: Ints
    depth_at_rest: Array
    item_at_rest: Ints
    rows: Ints
    hits: Surface


@dataclass(frozen=True)
class DetectionFlags:
    """In which domains rays are distributed for n pixels, and what detection found on the way.

    Attributes
    ----------
    mask : (3, n) bool, whether rays are distributed over the lights, the shutter and the pixel.
    visibilities : for each light, its visibility from the tile's hits; empty without detection.
    candidates : for each light, the occluders that may matter anywhere in the pixels of the hits.
    reach : (hits,) metres, bounds on the distance of the other points of those surfaces that the
        pixels show; empty without detection.
    silhouette : (n,) whether silhouettes, or curves in which two surfaces intersect, may pass
        through the pixel during the shutter.
    visible_candidates : pairs of such pixels and objects that may be seen in them, sorted by
        object.
    by_rays : (n,) whether sampling the pixel costs less than light in closed form.
    """

    mask: Mask
    visibilities: tuple[LightVisibility, ...]
    candidates: tuple[Pairs, ...]
    reach: Array
    silhouette: Mask
    visible_candidates: Pairs
    by_rays: Mask


def trace_center_rays(plan: Plan, x: Array, y: Array, pairs: Pairs) -> CenterRays:
    """Trace the centre rays of n pixels.

    Parameters
    ----------
    x, y : (n,) pixel coordinates of the centres.
    pairs : pairs of pixels and all objects that may be seen in them, sorted by object.
    """
    count = x.size
    w = plan.lens.directions(x, y)
    t = intersect_pairs(plan, columns(w, pairs.pixel), pairs.item)
    depth, item = nearest_hits(count, pairs, t)
    depth_still, item_still = depth, item
    if plan.motion:
        still = (~plan.is_moving[pairs.item]).nonzero()[0]
        depth_still, item_still = nearest_hits(count, pairs.take(still), t[still])
    rows = (item >= 0).nonzero()[0]
    hits = surface(plan, columns(w, rows), depth[rows], item[rows])
    return CenterRays(w, pairs, t, depth, item, depth_still, item_still, rows, hits)


def flag_everywhere(plan: Plan, center: CenterRays) -> DetectionFlags:
    """The flags of the paper's baseline: every effect of the scene is flagged in every pixel."""
    count = center.depth.size
    mask = np.zeros((3, count), dtype=np.bool_)
    mask[0, center.rows] = plan.penumbra
    mask[1] = plan.motion
    mask[2] = plan.edges
    nothing = np.zeros(0, dtype=np.int64)
    no = np.zeros(count, dtype=np.bool_)
    return DetectionFlags(mask, (), (), np.zeros(0), no, Pairs(nothing, nothing), no)


def detect(
    plan: Plan, occluders: Occluders, center: CenterRays, clock: StageCallback
) -> DetectionFlags:
    """Flag the pixels of a tile for which rays have to be distributed, for each domain.

    Parameters
    ----------
    occluders : the scene's occluders, for candidates.  center : the tile's centre rays.
    clock : called with the name of each stage that has ended.
    """
    pairs = center.pairs
    found = _find_silhouettes(plan, center, clock)
    test, outlines = found.test, found.silhouette
    mask = np.zeros((3, outlines.size), dtype=np.bool_)
    mask[1], mask[2] = found.motion, found.edge
    visible = _visible_candidates(plan, pairs, test, outlines)
    reach = _pixel_reach(plan, center, test)
    by_rays = _prefer_rays(plan, occluders, center, (outlines, reach))
    by_rays |= _crowded_outlines(plan, occluders, visible, outlines.size)
    sampled = by_rays, by_rays & outlines
    shadows, candidates = _detect_light(plan, occluders, center, reach, sampled, mask, clock)
    by_rays |= _crowded_penumbrae(plan, occluders, center, shadows, candidates, outlines)
    if test is not None and plan.motion:
        mask[1] |= _light_changes_at_silhouettes(plan, occluders, center, test, mask)
        clock("detect moving shadows")
    return DetectionFlags(mask, shadows, candidates, reach, outlines, visible, by_rays)


@dataclass(frozen=True)
class _SilhouetteFlags:
    """Silhouettes and intersection curves of surfaces in n pixels, during the shutter.

    Attributes
    ----------
    test : the test over the pixel at the middle of the shutter; None if edges are not computed.
    motion : (n,) the visible surface may change with time.
    edge : (n,) such a curve may be in the pixel at some time.
    silhouette : (n,) `edge`, or motion by an object that `detect_moving_silhouettes` finds.
    """

    test: EdgeTest | None
    motion: Mask
    edge: Mask
    silhouette: Mask


def _find_silhouettes(
    plan: Plan, center: CenterRays, clock: StageCallback, blocks: bool = False
) -> _SilhouetteFlags:
    """Find silhouettes and intersection curves in the pixels of a tile, during the shutter.

    blocks : whether the pixels stand for blocks of pixels.
    """
    count = center.depth.size
    pairs = center.pairs
    motion, edge = np.zeros((2, count), dtype=np.bool_)
    front_still = clear = center.depth_at_rest
    test = None
    if plan.edges:
        w = columns(center.w, pairs.pixel)
        test = detect_edges(plan, count, pairs, w, center.t, blocks)
        edge |= test.edge
        front_still, clear = test.covered_from_at_rest, test.nearest_at_rest
        clock("detect edges")
    outline = edge
    if plan.motion:
        moving = pairs.take(plan.is_moving[pairs.item])
        w = columns(center.w, moving.pixel)
        passing, swept = detect_moving_silhouettes(plan, count, moving, w, front_still, clear)
        motion = passing | moves_under_fixed_ray(plan, center.item)
        edge = edge | swept
        outline = edge | passing
        clock("detect motion")
    return _SilhouetteFlags(test, motion, edge, outline)


def _visible_candidates(plan: Plan, pairs: Pairs, test: EdgeTest | None, outlines: Mask) -> Pairs:
    """The candidates of pixels with silhouettes, without those that objects at rest hide."""
    keep = outlines[pairs.pixel]
    if test is not None:
        still = test.may_hit & (test.near <= test.covered_from_at_rest[pairs.pixel])
        keep &= plan.is_moving[pairs.item] | still
    return pairs.take(keep)


@dataclass(frozen=True)
class SmoothBlockFlags:
    """Which of n square blocks of pixels are smooth, and the objects that may be seen in each.

    Attributes
    ----------
    smooth : (n,) whether radiance is smooth over the block and the shutter: one object at rest
        fills the block, or none is in it; no silhouette, shadow edge or moving object reaches it;
        no light is so near that irradiance is steep. Each light is either visible as a whole from
        all of the block all the time, or contributes nothing to it.
    light_moves : (n,) whether a light that contributes to the block moves.
    hidden : for each light, (n,) whether one object occludes all of it from all of the block.
    item : (n,) the object that fills a block without silhouettes, -1 for none.
    pairs : pairs of blocks and objects that may be seen in them, sorted by object.
    penumbra : (n,) whether occluders may hide a part of a light of which that is allowed.
    """

    smooth: Mask
    light_moves: Mask
    hidden: tuple[Mask, ...]
    item: Ints
    pairs: Pairs
    penumbra: Mask


def detect_smooth_blocks(
    plan: Plan,
    occluders: Occluders,
    center: CenterRays,
    clock: StageCallback,
    part: tuple[bool, ...],
) -> SmoothBlockFlags:
    """Find the square blocks of pixels over which radiance is proven smooth.

    Parameters
    ----------
    plan : the scene compiled for an image whose pixels are the blocks, with `edges` enabled.
    part : for each light, whether occluders may hide a part of it, if they are not near.
    """
    found = _find_silhouettes(plan, center, clock, blocks=True)
    assert found.test is not None
    clear = ~(found.silhouette | found.motion | _prefer_rays(plan, occluders, center))
    rows = clear[center.rows].nonzero()[0]
    hits = center.hits.take(rows)
    reach = np.minimum(*_reach_bounds(plan, center, found.test))[rows]
    bend = curvature(plan, hits)
    dull = np.ones(rows.size, dtype=np.bool_)
    moving, penumbra = np.zeros_like(clear), np.zeros_like(clear)
    hidden = []
    for light, partly in zip(plan.lights, part, strict=True):
        shape = plan.as_shadow_caster(light)
        candidates = occluders.find_candidates(shape, hits, reach)
        none, full = classify_patches(plan, occluders, hits, shape, candidates, reach)
        blocked = np.zeros(rows.size, dtype=np.bool_)
        blocked[candidates.pixel[full]] = True
        hidden.append(np.zeros_like(clear))
        hidden[-1][center.rows[rows]] = blocked
        lit = np.ones(rows.size, dtype=np.bool_)
        if partly:
            penumbra[center.rows[rows[candidates.pixel[~none]]]] = True
            none |= occluders.are_far(hits, candidates, MIN_RELATIVE_GAP * reach)
        lit[candidates.pixel[~none]] = False
        even, dark = _is_evenly_lit(light, hits, reach, bend)
        dull &= blocked | (lit & even)
        if light.displacement is not None:
            moving[center.rows[rows]] |= ~(dark | blocked)
    clear[center.rows[rows]] &= dull
    whole = (~found.silhouette & (center.item >= 0)).nonzero()[0]
    candidates = _visible_candidates(plan, center.pairs, found.test, found.silhouette)
    item = np.concatenate([candidates.item, center.item[whole]])
    order = np.argsort(item, kind="stable")
    pairs = Pairs(np.concatenate([candidates.pixel, whole])[order], item[order])
    clock("smooth blocks")
    own = np.where(found.silhouette, -1, center.item)
    return SmoothBlockFlags(clear, moving, tuple(hidden), own, pairs, penumbra)


def _is_evenly_lit(light: Emitter, hits: Surface, reach: Array, bend: Array) -> tuple[Mask, Mask]:
    """Where a light without shadows is smooth over patches, and where it contributes nothing.

    hits : n points.  reach, bend : (n,) metres and 1 / m, extent and curvature of the patches.
    """
    lit, whole, dark = np.ones((3, reach.size), dtype=np.bool_)
    for time in SHUTTER_ENDS if light.displacement is not None else (0.0,):
        # both tests are linear in the light's position, so its ends decide for its whole path
        to = light.to_center(hits.point, time)
        lit &= ~detect_steep_irradiance(light, hits, reach, time=time)
        whole &= light.is_above_horizon(to, hits.point, hits.normal, reach, bend)
        dark &= classify_horizon(light, to, hits, reach, bend)[0]
    even: Mask = lit & (whole | dark)
    return even, dark


def _detect_light(
    plan: Plan,
    occluders: Occluders,
    center: CenterRays,
    reach: Array,
    sampled: tuple[Mask, Mask],
    mask: Mask,
    clock: StageCallback,
) -> tuple[tuple[LightVisibility, ...], tuple[Pairs, ...]]:
    """Add to the mask the flags that follow from each light, at the hits of the centre rays.

    sampled : (n,) pixels whose light rays find, and those of them that silhouettes may cut.
    Returns for each light its visibility from the hits, and its candidate occluders.
    """
    rows, hits = center.rows, center.hits
    shadows, found = [], []
    for light in iterate_with_progress(plan.lights):
        shape = plan.as_shadow_caster(light)
        with progress_range(0.0, CANDIDATES_FOUND):
            by_rays, cut = (each[rows] for each in sampled)
            candidates = _find_occluders(occluders, shape, hits, reach, (by_rays, cut))
        with progress_range(CANDIDATES_FOUND, OCCLUSION_CLASSIFIED):
            shadow = classify_light_visibility(plan, hits, shape, candidates, closely=True)
        shadows.append(shadow)
        found.append(candidates)
        mask[0, rows] |= shadow.partial & plan.penumbra
        clock("detect penumbrae")
        if plan.edges:
            to = shape.to_center(hits.point)
            dark = classify_horizon(shape, to, hits, reach, curvature(plan, hits))[0]
            open_ = ~dark & ~mask[2, rows]
            live = candidates.take(open_[candidates.pixel])
            with progress_range(OCCLUSION_CLASSIFIED, 1.0):
                mask[2, rows] |= detect_shadow_edges(plan, hits, shape, live, reach)
            mask[2, rows] |= detect_steep_irradiance(light, hits, reach, plan) & ~dark
            clock("detect shadow edges")
        if plan.motion:
            open_ = ~mask[1, rows]
            live = candidates.take(open_[candidates.pixel])
            mask[1, rows] |= light_changes(plan, hits, shape, live, reach)
            clock("detect moving shadows")
    return tuple(shadows), tuple(found)


def _pixel_reach(plan: Plan, center: CenterRays, test: EdgeTest | None) -> Array:
    """Bounds (hits,) on the reach of each hit's surface within its pixel, metres; 0 for points."""
    if test is None:
        return np.zeros(center.rows.size)
    reach, deep = _reach_bounds(plan, center, test)
    # an unbounded reach is replaced by the distance to the camera
    away = np.sqrt(dot(center.hits.point, center.hits.point))
    bounded: Array = np.minimum(np.where(np.isinf(reach), away, reach), deep)
    return bounded


def _find_occluders(
    occluders: Occluders, light: Emitter, hits: Surface, reach: Array, sampled: tuple[Mask, Mask]
) -> Pairs:
    """Candidate occluders of n points; only enough of them to detect what they do where rays
    follow, in still scenes under lights that surround the points or are behind very many spheres.

    sampled : as that of `_detect_light`. In pixels that silhouettes cut the edge is flagged, so
    that only what hides light from the point itself matters; and where the light is below the
    horizon of the point there is no penumbra to be found.
    """
    by_rays, cut = sampled
    if not by_rays.any() or not _may_know_few(occluders, light):
        return occluders.find_candidates(light, hits, reach)
    parts = []
    if not light.surrounds:
        dark = classify_horizon(light, light.to_center(hits.point), hits)[0]
        by_rays = by_rays & ~(cut & dark)
    few, every = by_rays.nonzero()[0], (~sampled[0]).nonzero()[0]
    far, known = np.where(cut, 0.0, reach)[few], FewOccluders.of(occluders)
    for rows, found in (
        (few, known.find(light, hits.take(few), reach[few], far)),
        (every, occluders.find_candidates(light, hits.take(every), reach[every])),
    ):
        parts.append(Pairs(rows[found.pixel], found.item))
    pixel, item = (
        np.concatenate([getattr(part, name) for part in parts]) for name in ("pixel", "item")
    )
    order = np.argsort(pixel, kind="stable")
    return Pairs(pixel[order], item[order])


def _may_know_few(occluders: Occluders, light: Emitter) -> bool:
    """Whether `FewOccluders` may stand for all occluders of a light where rays find it."""
    if occluders.tracer is None or occluders.plan.motion or not light.casts_shadow:
        return False
    return light.surrounds or occluders.tracer.items.size >= MANY_OBJECTS


def _prefer_rays(
    plan: Plan,
    occluders: Occluders,
    center: CenterRays,
    patch: tuple[Mask, Array] | None = None,
) -> Mask:
    """Pixels (n,) in which sampling costs less than light in closed form under lights whose
    occluders are not all listed.

    patch : (n,) whether silhouettes may pass through the pixel, and (hits,) metres, the reach of
        its surface; None where pixels stand for blocks that may be interpolated.
    """
    silhouette = None if patch is None else patch[0]
    by_rays = np.zeros(center.depth.size, dtype=np.bool_)
    unlisted = [light for light in plan.lights if _may_know_few(occluders, light)]
    if plan.motion:
        unlisted = [light for light in plan.lights if light.surrounds and light.casts_shadow]
    if not unlisted or occluders.tracer is None:
        return by_rays
    one = [np.ones(plan.object_count)] * len(unlisted)
    costs = [occluder_costs(plan.shapes, light) for light in unlisted]
    number = cost = _count_occluders(plan, occluders, center, patch, unlisted, one)
    if not np.array_equal(costs, one):
        cost = _count_occluders(plan, occluders, center, patch, unlisted, costs)
    seen = by_rays.copy() if silhouette is None else silhouette.copy()
    seen[center.rows] = True
    less = (number >= MOST_LISTED) | rays_cost_less(cost, silhouette, plan.settings.tolerance)
    if not any(light.surrounds for light in unlisted):
        less &= number > 0.0
    return seen & less


def _count_occluders(
    plan: Plan,
    occluders: Occluders,
    center: CenterRays,
    patch: tuple[Mask, Array] | None,
    lights: Sequence[Emitter],
    costs: Sequence[Array],
) -> Array:
    """Numbers (n,) of occluders of lights in pixels, by samples of the traced solids.

    patch : as that of `_prefer_rays`.  costs : (objects,) for each light, what each counts as.
    """
    few, number = FewOccluders.of(occluders), np.zeros(center.depth.size)
    around = [cost for cost, each in zip(costs, lights, strict=True) if each.surrounds]
    if around:
        most = np.max(around, axis=0)
        # where the centre hits nothing, half of the solids count
        number[:] = 0.5 * most[few.items].sum()
        number[center.rows] = few.count_above_horizons(center.hits, most)
    for light, cost in zip(lights, costs, strict=True):
        if not light.surrounds:
            shape = plan.as_shadow_caster(light)
            number[center.rows] += few.count_before(shape, center.hits, cost)
            if patch is not None:
                _add_other_surfaces(number, few, shape, center, patch, cost)
    return number


def _add_other_surfaces(
    number: Array,
    few: FewOccluders,
    light: Emitter,
    center: CenterRays,
    patch: tuple[Mask, Array],
    cost: Array,
) -> None:
    """Count occluders before the surfaces around centres that have none, as these may face away.

    number : (n,) occluders of each pixel, changed in place.  patch : as that of `_prefer_rays`.
    """
    own = (patch[0] & (number == 0.0))[center.rows].nonzero()[0]
    if own.size:
        found = few.count_before(light, center.hits.take(own), cost, patch[1][own])
        number[center.rows[own]] = np.where(found >= CROWD, found, 0.0)


def _crowded_outlines(plan: Plan, occluders: Occluders, visible: Pairs, count: int) -> Mask:
    """Which of `count` pixels may show so many objects that sampling costs less than their regions.

    visible : pixels with outlines and objects that may be seen in them.
    """
    if occluders.tracer is None:
        return np.zeros(count, dtype=np.bool_)
    seen = np.bincount(visible.pixel, minlength=count)
    return regions_cost_more(seen, plan.settings.tolerance)


def _crowded_penumbrae(
    plan: Plan,
    occluders: Occluders,
    center: CenterRays,
    shadows: Sequence[LightVisibility],
    candidates: Sequence[Pairs],
    silhouette: Mask,
) -> Mask:
    """Pixels (n,) in which sampling costs less than light that so many occluders hide in part.

    Of lights that surround the points only few occluders may be known: see `_prefer_rays`.
    """
    if occluders.tracer is None:
        return np.zeros(silhouette.size, dtype=np.bool_)
    rows = center.rows
    partly, before = np.zeros((2, rows.size))
    near = [not light.surrounds and light.casts_shadow for light in plan.lights]
    for chosen, light, shadow, pairs in zip(near, plan.lights, shadows, candidates, strict=True):
        if chosen:
            cost = occluder_costs(plan.shapes, light)
            partly += np.bincount(shadow.pairs.pixel, cost[shadow.pairs.item], rows.size)
            before += np.bincount(pairs.pixel, cost[pairs.item], rows.size)
    # where the centre hits nothing, a part of the spheres counts
    number = np.full(silhouette.size, any(near) * CROWD_SHARE * occluders.tracer.items.size)
    number[rows] = before
    # a pixel's other surfaces may be in penumbrae where its centre is not
    number[~silhouette | (number < CROWD)] = 0.0
    number[rows] = np.where(number[rows] > 0.0, number[rows], partly)
    return (number > 0.0) & rays_cost_less(number, silhouette, plan.settings.tolerance)


def _reach_bounds(plan: Plan, center: CenterRays, test: EdgeTest) -> tuple[Array, Array]:
    """Two upper bounds (hits,) on the reach of each hit's surface within its pixel, metres.

    The first follows from the angle at which the surface is seen (see `patch_reach`), the second
    from the range of depths at which the object may be visible in the pixel.
    """
    rows, pairs = center.rows, center.pairs
    w = columns(center.w, rows)
    own = (pairs.item == center.item[pairs.pixel]).nonzero()[0]
    deep = np.zeros(center.depth.size)
    t = center.depth[pairs.pixel[own]]
    deep[pairs.pixel[own]] = np.maximum(test.far[own] - t, t - test.near[own])
    h = plan.lens.half_pixel
    across = (center.depth[rows] + deep[rows]) * h
    by_depth = np.maximum(deep[rows], 0.0) * (np.sqrt(dot(w, w)) + h) + across
    return patch_reach(plan, center.hits, w), by_depth


def _light_changes_at_silhouettes(
    plan: Plan, occluders: Occluders, center: CenterRays, test: EdgeTest, mask: Mask
) -> Mask:
    """Whether the light on any surface in a pixel with a silhouette may change in time: (n,).

    The centre ray hits only one of the surfaces in the pixel. The others are bounded by balls
    around the segment of the pixel's rays in which they lie.
    """
    pairs = center.pairs
    changes = np.zeros(mask.shape[1], dtype=np.bool_)
    open_ = mask[2] & ~mask[1]
    rests = ~moves_under_fixed_ray(plan, pairs.item)
    rows = (test.may_be_visible & open_[pairs.pixel] & rests).nonzero()[0]
    if not rows.size:
        return changes
    w = columns(center.w, pairs.pixel[rows])
    near, far = test.near[rows], test.far[rows]
    length = np.sqrt(dot(w, w)) + plan.lens.half_pixel
    with np.errstate(over="ignore", invalid="ignore"):
        reach = 0.5 * (far - near) * length + far * plan.lens.half_pixel
    # no finite ball bounds a surface that is seen edge-on
    endless = ~(np.abs(reach) < UNBOUNDED_REACH)
    changes[pairs.pixel[rows[endless]]] = True
    rows, w, near, far, reach = (columns(x, ~endless, -1) for x in (rows, w, near, far, reach))
    patch = Surface(
        0.5 * (near + far) * w,
        np.zeros_like(w),
        pairs.item[rows],
        np.zeros(rows.size, dtype=np.bool_),
    )
    for light in plan.lights:
        shape = plan.as_shadow_caster(light)
        candidates = occluders.find_candidates(shape, patch, reach)
        found = patch_light_changes(plan, patch, shape, candidates, reach)
        changes[pairs.pixel[rows[found]]] = True
    return changes
