# SPDX-License-Identifier: GPL-3.0-or-later
"""Method 'RAYS': one ray for pixels that are not flagged, distributed rays for the others.

The distributed domains nest. A pixel flagged for a penumbra keeps its camera ray and distributes
rays towards the lights; one flagged for motion takes samples over the shutter, one flagged for
edges over its square. Each such sample sends its share of the light rays (Cook and others 1984), so
the number of rays is that of the largest domain, not the product of all.
"""

from __future__ import annotations

from collections.abc import Generator
from contextlib import closing
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .detection.detect import CenterRays, DetectionFlags, detect, flag_everywhere, trace_center_rays
from .detection.occlusion import classify_occluders
from .image.schedule import StageTimer
from .lights.emitter import Emitter
from .lights.environment_backdrop import mean_over_boxes
from .numerics.arrays import Array, Ints, Mask
from .numerics.gather import columns
from .numerics.low_discrepancy import low_discrepancy_points
from .parallel.call_progress import progress_range, report_progress
from .parallel.executor import CallProgress, RenderExecutor
from .parallel.pool import Call, SharedArguments
from .scene.film import Film
from .shading.direct_light import diffuse_brdf, emission, irradiance
from .shading.ratio_estimator import (
    CHUNK,
    gather_light,
    light_points,
    ratio_estimate,
    unoccluded_factor,
)
from .tracing.compile import Plan
from .tracing.intersect import (
    Pairs,
    Surface,
    Tile,
    find_candidates,
    intersect_pairs,
    screen_bounds,
    surface,
)
from .tracing.occluder_culling import (
    Occluders,
    all_pairs_unculled,
    find_group_candidates,
)
from .tracing.shadow_rays import batches_by_rank

__all__ = ["DistributedRender", "ResolvedPixels", "Resolver"]


TEST_ALL_OBJECTS = 64
"""Largest number of objects for which a shadow ray without results of detection tests all of them;
beyond, candidate occluders are found first."""
CAMERA_RAYS_DONE, DETECTION_DONE, PENUMBRAE_DONE = 0.05, 0.3, 0.6
"""Fractions of the work of a tile that are done after its camera rays, after detection and after
penumbrae, roughly; for a progress bar."""


@dataclass
class DistributedRender:
    """One render by method 'RAYS', and its statistics.

    Attributes
    ----------
    plan, occluders : the compiled scene.
    stage : what is being done, in words, for the user.
    seconds : by stage, summed over threads.  rays : numbers of rays traced, by kind.
    """

    plan: Plan
    occluders: Occluders
    stage: str = "Tracing rays"
    seconds: dict[str, float] = field(default_factory=dict)
    rays: dict[str, int] = field(default_factory=dict)

    def run(self, film: Film) -> Generator[float, None, None]:
        """Write a picture to a film, tile by tile; yields the fraction of the work done, 0 to 1, at
        least once a heartbeat.
        """
        plan, size, progress = self.plan, film.width * film.height, CallProgress()
        done, tiles = 0, _tile_count(plan)
        shared = SharedArguments((plan, self.occluders, screen_bounds(plan)))
        calls = [Call(_render_tile, shared, (first, tiles)) for first in range(tiles)]
        with closing(RenderExecutor(plan.stop, plan.threads)) as executor:
            for outcome in executor.run(calls, progress):
                if outcome is not None:
                    _, result = outcome
                    result.write(film)
                    self._count(result)
                    done += result.tile.index.size
                running = sum(progress.copy().values()) * (size - 1) / tiles
                yield min((done + int(running)) / size, 1.0)

    def _count(self, result: _TileResult) -> None:
        for kind, count in result.pixels.rays.items():
            self.rays[kind] = self.rays.get(kind, 0) + count
        for stage, span in result.seconds.items():
            self.seconds[stage] = self.seconds.get(stage, 0.0) + span


@dataclass
class _TileResult:
    """Resolved pixels of one tile, and the seconds of each stage.

    `mask` is (3, n) bool, `depth` (n,) metres, `normal` (3, n).
    """

    tile: Tile
    pixels: ResolvedPixels
    mask: Mask
    depth: Array
    normal: Array
    seconds: dict[str, float]

    def write(self, film: Film) -> None:
        """Write the pixels to a film."""
        planes = {
            "color": self.pixels.color, "alpha": self.pixels.alpha, "mask": self.mask,
            "samples": self.pixels.samples, "depth": self.depth, "normal": self.normal,
        }  # fmt: skip
        tables = {
            name: values.reshape(*values.shape[:-1], -1, film.width)
            for name, values in planes.items()
        }
        film.write_rows(slice(self.tile.first, None, self.tile.step), **tables)


def _tile_count(plan: Plan) -> int:
    """Number of tiles of at most `batch` pixels, if possible a multiple of the threads' number."""
    left, bottom, right, top = plan.region
    height = top - bottom
    most = max(1, plan.settings.batch // (right - left))
    count = -(-height // most)
    return min(height, -(-count // plan.threads) * plan.threads)


def _render_tile(
    plan: Plan, occluders: Occluders, bounds: Ints, first: int, step: int
) -> _TileResult:
    """Render one tile by the steps of the paper: every `step`-th row of the picture from row
    `first`.
    """
    clock = StageTimer()
    # steps 1 and 2: one ray through the centres of the domains
    tile = Tile.make(plan, first, step)
    center = trace_center_rays(plan, tile.x, tile.y, find_candidates(plan, bounds, tile))
    clock("camera rays")
    report_progress(CAMERA_RAYS_DONE)
    # step 3: could the result change within a domain?
    with progress_range(CAMERA_RAYS_DONE, DETECTION_DONE):
        flags = _flags(plan, occluders, center, clock)
    resolver = Resolver(plan, occluders, tile, center, flags)
    # step 5, and step 4 for penumbrae: pixels that keep their camera ray
    with progress_range(DETECTION_DONE, PENUMBRAE_DONE):
        resolver.resolve_single_ray()
    clock("one-ray pixels and penumbrae")
    # step 4: distribute rays over the shutter and the pixel
    with progress_range(PENUMBRAE_DONE, 1.0):
        resolver.resolve_distributed()
    clock("motion and edges")
    normal = np.zeros((3, tile.index.size))
    normal[:, center.rows] = center.hits.normal
    return _TileResult(tile, resolver.out, flags.mask, center.depth, normal, clock.seconds)


def _flags(
    plan: Plan, occluders: Occluders, center: CenterRays, clock: StageTimer
) -> DetectionFlags:
    """Which domains are distributed in which pixels: by detection, or everywhere."""
    if plan.settings.distribution == "EVERYWHERE":
        return flag_everywhere(plan, center)
    return detect(plan, occluders, center, clock)


@dataclass
class ResolvedPixels:
    """Resolved pixels of a tile.

    `color` is (3, n), `alpha` and `samples` are (n,), `rays` counts the rays traced by kind.
    """

    color: Array
    alpha: Array
    samples: NDArray[np.int32]
    rays: dict[str, int] = field(default_factory=dict)

    def count(self, kind: str, rays: int) -> None:
        """Add to the number of rays of a kind."""
        self.rays[kind] = self.rays.get(kind, 0) + int(rays)


class Resolver:
    """Resolves the pixels of one tile.

    `reuse` tells whether results of detection are reused; if not, samples are traced and shaded
    anew.
    """

    def __init__(
        self,
        plan: Plan,
        occluders: Occluders,
        tile: Tile,
        center: CenterRays,
        flags: DetectionFlags,
    ) -> None:
        """Start with the background in all pixels."""
        n = tile.index.size
        self.plan, self.occluders, self.tile = plan, occluders, tile
        self.center, self.flags = center, flags
        self.reuse = plan.settings.reuse and plan.settings.distribution == "ADAPTIVE"
        color = np.repeat(plan.background[:, None], n, axis=1)
        if plan.backdrop is not None:
            share = plan.settings.tolerance
            half = 0.5 if plan.settings.use_edges else 0.0
            color, _ = mean_over_boxes(plan.backdrop, plan.lens, tile.x, tile.y, half, share)
        alpha = np.full(n, 0.0 if plan.transparent else 1.0)
        if plan.transparent:
            color[:] = 0.0
        self.out = ResolvedPixels(color, alpha, np.ones(n, dtype=np.int32))

    # --- one camera ray -------------------------------------------------------------------

    def resolve_single_ray(self) -> None:
        """Resolve pixels that keep their camera ray; light rays are distributed in penumbrae."""
        plan, center, mask = self.plan, self.center, self.flags.mask
        keep = (~(mask[1, center.rows] | mask[2, center.rows])).nonzero()[0]
        rows = center.rows[keep]
        hits = center.hits.take(keep)
        factors = (
            self._direct(index, light, hits, keep, rows) for index, light in enumerate(plan.lights)
        )
        total = irradiance(plan.lights, factors, rows.size)
        self.out.color[:, rows] = columns(plan.albedo, hits.item) * total / np.pi
        glow = emission(plan, hits)
        if glow is not None:
            self.out.color[:, rows] += glow
        self.out.alpha[rows] = plan.opacity(hits.item)
        self.out.count("camera", self.tile.index.size)
        red = rows[mask[0, rows]]
        self.out.samples[red] = plan.settings.light_rays

    def _direct(self, index: int, light: Emitter, hits: Surface, keep: Ints, rows: Ints) -> Array:
        """Irradiance factors (n,) of one light at hits of camera rays through pixel centres."""
        plan = self.plan
        shape = plan.as_shadow_caster(light)
        factor = unoccluded_factor(light, shape, light.to_center(hits.point), hits)
        if not light.casts_shadow:
            return factor
        if self.flags.visibilities:
            shadow = self.flags.visibilities[index]
            factor = np.where(shadow.hidden[keep], 0.0, factor)
            chosen = shadow.partial[keep].nonzero()[0]
            source = shadow.pairs if self.reuse else None
        else:
            chosen, source = np.arange(rows.size), None
        self.out.count("shadow", rows.size)
        if not chosen.size:
            return factor
        part = hits.take(chosen)
        if source is None:
            pairs = self._all_occluders(shape, part)
        else:
            pairs = source.for_pixels(keep[chosen], self.center.rows.size)
        spots = None
        if shape.extended:
            pixel = self.tile.index[rows[chosen]]
            spots = light_points(plan, pixel, index, 1, plan.settings.light_rays)
            self.out.count("light", spots[0].size)
        factor[chosen] = gather_light(plan, part, light, pairs, spots, 0.0).estimate()
        return factor

    def _all_occluders(self, shape: Emitter, hits: Surface) -> Pairs:
        """Candidate occluders of points, without results of detection."""
        if not shape.casts_shadow:
            return Pairs(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64))
        if self.plan.object_count > TEST_ALL_OBJECTS:
            return self.occluders.find_candidates(shape, hits)
        return all_pairs_unculled(self.plan, shape, hits)

    # --- many camera rays -----------------------------------------------------------------

    def resolve_distributed(self) -> None:
        """Resolve the pixels flagged for motion or edges."""
        motion, edge = self.flags.mask[1], self.flags.mask[2]
        self._class((edge & ~motion).nonzero()[0], moves=False, spreads=True)
        self._class((edge & motion).nonzero()[0], moves=True, spreads=True)
        self._class((~edge & motion).nonzero()[0], moves=True, spreads=False)

    def _class(self, pixels: Ints, moves: bool, spreads: bool) -> None:
        """Resolve pixels by samples over the shutter (`moves`), the square (`spreads`) or both."""
        plan, settings = self.plan, self.plan.settings
        if not pixels.size:
            return
        count = max(settings.time_rays if moves else 1, settings.pixel_rays if spreads else 1)
        step = max(1, CHUNK // count)
        found = self.center.pairs
        if self.reuse and not spreads:
            found = found.take(plan.is_moving[found.item])
        number = np.full(self.tile.index.size, -1)
        number[pixels] = np.arange(pixels.size)
        found = Pairs(number[found.pixel], found.item)
        found = found.take(found.pixel >= 0)
        found = found.take(np.argsort(found.pixel, kind="stable"))
        starts = np.arange(0, pixels.size + step, step)
        bounds = np.searchsorted(found.pixel, starts)
        for index, first in enumerate(range(0, pixels.size, step)):
            plan.raise_if_cancelled()
            own = slice(bounds[index], bounds[index + 1])
            local = Pairs(found.pixel[own] - first, found.item[own])
            with progress_range(first / pixels.size, min((first + step) / pixels.size, 1.0)):
                self._chunk(pixels[first : first + step], local, count, moves, spreads)

    def _chunk(self, pixels: Ints, pairs: Pairs, count: int, moves: bool, spreads: bool) -> None:
        """Resolve some of these pixels with `count` samples each; `pairs` are their candidates."""
        plan = self.plan
        rays = _DistributedRays.make(plan, self.tile, self.center, pixels, count, moves, spreads)
        still = self.reuse and not spreads
        depth, item = rays.nearest(plan, pairs, self.center if still else None)
        kept = (item == self.center.item_at_rest[pixels][:, None]) & (item >= 0)
        if spreads:
            kept[:] = False
        flat_row, flat_sample = np.nonzero((item >= 0) & ~kept)
        flat = rays.surfaces(plan, depth, item, flat_row, flat_sample)
        hit = (item >= 0).sum(axis=1) / count
        miss = 1.0 - hit
        total = columns(self.out.color, pixels) * miss
        self.out.alpha[pixels] = 1.0 if not plan.transparent else hit
        if plan.holdout is not None:
            self.out.alpha[pixels] = plan.opacity(item).mean(axis=1)
        light_rays = -(-plan.settings.light_rays // count) if plan.penumbra else 1
        if self.reuse:
            total += self._still_surface_light(rays, kept, light_rays) / count
        else:
            # the paper's tracer reuses nothing: it shades each sample anew
            row, sample = np.nonzero(kept)
            again = rays.surfaces(plan, depth, item, row, sample)
            total += self._sample_light(rays, again, row, sample, light_rays) / count
        total += self._sample_light(rays, flat, flat_row, flat_sample, light_rays) / count
        self.out.color[:, pixels] = total
        self.out.samples[pixels] = count * light_rays
        self.out.count("time" if moves else "pixel", pixels.size * count)

    def _still_surface_light(self, rays: _DistributedRays, kept: Mask, light_rays: int) -> Array:
        """Radiance (3, n), summed over the samples that hit the still surface at the pixel's
        centre.
        """
        plan = self.plan
        total = np.zeros((3, rays.pixel.size))
        rows = kept.any(axis=1).nonzero()[0]
        if not rows.size:
            return total
        at = rays.pixel[rows]
        item = self.center.item_at_rest[at]
        hits = surface(plan, columns(self.center.w, at), self.center.depth_at_rest[at], item)
        factors = (
            self._kept_factors(index, rays, rows, hits, kept, light_rays)
            for index in range(len(plan.lights))
        )
        total[:, rows] = irradiance(plan.lights, factors, rows.size) * diffuse_brdf(plan, item)
        glow = emission(plan, hits)
        if glow is not None:
            total[:, rows] += glow * kept[rows].sum(axis=1)
        return total

    def _kept_factors(
        self,
        index: int,
        rays: _DistributedRays,
        rows: Ints,
        hits: Surface,
        kept: Mask,
        light_rays: int,
    ) -> Array:
        """Irradiance factors (m,) of one light at hits of camera rays, summed over samples.

        Parameters
        ----------
        index : number of the light.  rows : (m,) the pixels of the hits.
        kept : (n, k) which samples of all pixels hit the same surface as the camera ray.
        """
        plan, light = self.plan, self.plan.lights[index]
        shape = plan.as_shadow_caster(light)
        pairs, blocked = self._changing_occluders(shape, hits)
        factor = np.zeros(rows.size)
        busy = np.zeros(rows.size, dtype=np.bool_)
        busy[pairs.pixel] = True
        busy |= light.displacement is not None
        busy &= ~blocked
        calm = (~busy & ~blocked).nonzero()[0]
        rest = hits.take(calm)
        known = unoccluded_factor(light, shape, light.to_center(rest.point), rest)
        factor[calm] = known * kept[rows[calm]].sum(axis=1)
        some = busy.nonzero()[0]
        spots = None
        if shape.extended:
            pixel = self.tile.index[rays.pixel[rows[some]]]
            spots = light_points(plan, pixel, index, rays.count, light_rays)
        part, when, used = hits.take(some), rays.time[rows[some]], kept[rows[some]]
        sums = gather_light(plan, part, light, pairs.for_pixels(some, rows.size), spots, when, used)
        self.out.count("light", some.size * rays.count * light_rays)
        factor[some] = sums.estimate()
        return factor

    def _changing_occluders(self, shape: Emitter, hits: Surface) -> tuple[Pairs, Mask]:
        """Occluders whose shadow on hits may be partial or change, and which hits are fully
        occluded.

        Still occluders that hide all or nothing of a still light need no rays.
        """
        plan = self.plan
        pairs = self.occluders.find_candidates(shape, hits)
        blocked = np.zeros(hits.item.size, dtype=np.bool_)
        if shape.displacement is not None:
            return pairs, blocked
        still = (~plan.is_moving[pairs.item]).nonzero()[0]
        none, full = classify_occluders(plan, hits, shape, pairs.take(still), 0.0)
        blocked[pairs.pixel[still[full]]] = True
        keep = np.ones(pairs.item.size, dtype=np.bool_)
        keep[still[none | full]] = False
        return pairs.take(keep), blocked

    def _sample_light(
        self, rays: _DistributedRays, flat: Surface, row: Ints, sample: Ints, light_rays: int
    ) -> Array:
        """Radiance (3, n), summed over given samples, each shaded at its own hit."""
        plan = self.plan
        n = rays.pixel.size
        total = np.zeros((3, n))
        if not row.size:
            return total
        factors = (
            self._flat_factors(index, rays, flat, row, sample, light_rays)
            for index in range(len(plan.lights))
        )
        total = irradiance(plan.lights, factors, n)
        glow = emission(plan, flat)
        if glow is not None:
            total += np.array([_grouped_sums(row, channel, n) for channel in glow])
        return total

    def _flat_factors(
        self,
        index: int,
        rays: _DistributedRays,
        flat: Surface,
        row: Ints,
        sample: Ints,
        light_rays: int,
    ) -> Array:
        """BRDF times irradiance factor (3, n) of one light, summed over samples of n pixels."""
        plan, light, n = self.plan, self.plan.lights[index], rays.pixel.size
        brdf = diffuse_brdf(plan, flat.item)
        time = rays.time[row, sample][:, None]
        shape = plan.as_shadow_caster(light)
        pairs = (
            find_group_candidates(self.occluders, shape, flat, row)
            if self.reuse
            else self._all_occluders(shape, flat)
        )
        spots = None
        if shape.extended:
            pixel = self.tile.index[rays.pixel]
            a, b = light_points(plan, pixel, index, rays.count, light_rays)
            cells = (n, rays.count, light_rays)
            spots = a.reshape(cells)[row, sample], b.reshape(cells)[row, sample]
        sums = gather_light(plan, flat, light, pairs, spots, time)
        self.out.count("light", row.size * light_rays)
        parts = np.empty((3, n))
        for channel in range(3):
            closed, every, visible = (
                _grouped_sums(row, brdf[channel] * part[:, 0], n)
                for part in (sums.closed, sums.total, sums.visible)
            )
            parts[channel] = ratio_estimate(closed, every, visible)
        return parts


def _grouped_sums(row: Ints, values: Array, count: int) -> Array:
    """Sum values by group: (count,). `row` is the group of each value; they are added in their
    order.
    """
    return np.bincount(row, weights=values, minlength=count).astype(np.float64, copy=False)


@dataclass(frozen=True)
class _DistributedRays:
    """Distributed camera rays: k samples for each of n pixels of a tile.

    `w` (3, n, k) are ray directions, `time` (n, k) shutter times.
    """

    pixel: Ints
    count: int
    w: Array
    time: Array

    @classmethod
    def make(
        cls,
        plan: Plan,
        tile: Tile,
        center: CenterRays,
        pixel: Ints,
        count: int,
        moves: bool,
        spreads: bool,
    ) -> _DistributedRays:
        dimensions = 5 if moves and spreads else 2 if spreads else 1
        spots = low_discrepancy_points(plan.settings.seed, tile.index[pixel], 0, count, dimensions)
        time = spots[0] - 0.5 if moves else np.zeros((pixel.size, count))
        if not spreads:
            w = np.broadcast_to(columns(center.w, pixel[:, None]), (3, pixel.size, count))
            return cls(pixel, count, w, time)
        a, b = spots[1:3] if moves else spots
        w = plan.lens.directions(tile.x[pixel, None] + (a - 0.5), tile.y[pixel, None] + (b - 0.5))
        return cls(pixel, count, w, time)

    def nearest(self, plan: Plan, pairs: Pairs, center: CenterRays | None) -> tuple[Array, Ints]:
        """Nearest hits (n, k): ray parameters and objects; `center` provides the hits on still
        objects.
        """
        shape = (self.pixel.size, self.count)
        depth, item = np.full(shape, np.inf), np.full(shape, -1)
        if center is not None:
            depth[:] = center.depth_at_rest[self.pixel][:, None]
            item[:] = center.item_at_rest[self.pixel][:, None]
        for rows, ids in batches_by_rank(self.pixel.size, pairs):
            t = intersect_pairs(plan, columns(self.w, rows), ids, self.time[rows])
            before, which = depth[rows], item[rows]
            ids = ids[:, None]
            # at equal depth the object of lower index is nearer, as at the centre
            closer = (t < before) | ((t == before) & np.isfinite(t) & (ids < which))
            depth[rows] = np.where(closer, t, before)
            item[rows] = np.where(closer, ids, which)
        return depth, item

    def surfaces(self, plan: Plan, depth: Array, item: Ints, row: Ints, sample: Ints) -> Surface:
        """Surfaces at the hits of some of the rays, given by row and sample."""
        return surface(
            plan,
            self.w[:, row, sample],
            depth[row, sample],
            item[row, sample],
            self.time[row, sample],
        )
