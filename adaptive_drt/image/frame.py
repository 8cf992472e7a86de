# SPDX-License-Identifier: GPL-3.0-or-later
"""The working frame of method 'EXACT': what is known of each pixel of a region during the render.

After the first pass, smooth pixels get their means by second differences (I + h^2/24 (Ixx + Iyy)).
The frame tells which pixels are left to refine, and takes in the results. What it enters it also
writes to the film.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from ..cubature.adaptive import InitialCells, RefinedPixels, RefinementTask
from ..cubature.error_budget import (
    GOAL_GROWTH,
    MIN_GOAL,
    Goal,
    MotionErrors,
    make_goal,
)
from ..cubature.evaluate import multi_node_error
from ..cubature.heap_limits import LIMIT_GROWTH, SamplingErrors, SamplingLaw, first_limit
from ..cubature.regions import Cells
from ..cubature.sampled_centers import CenterTask
from ..cubature.sampled_pixels import (
    FIRST_POINTS,
    SampledPixels,
    SamplingTask,
)
from ..numerics.arrays import Array, Ints, Mask
from ..numerics.axes import TIME
from ..numerics.gather import columns, place
from ..numerics.vector import rms
from ..scene.film import FILM_BORDER, Film
from ..shading.filled_light import FIRST_RAYS
from ..shading.sample_light import NET_RAYS, rays_of_point
from ..shading.sampled_occlusion import SAMPLING_ERROR_SHARE
from ..shading.variation import STEP_KIND, steps_after_shutter
from ..tracing.compile import Plan
from ..tracing.intersect import Pairs
from ..visibility.fragments import MAX_REFINED_CANDIDATES
from .block_interpolation import SmoothBlocks
from .center_values import CenterValues
from .coarse_blocks import COARSE_SIDES, has_coarse_blocks
from .first_pass import FilledPixels, FirstPassPixels
from .first_points import FirstPoints
from .midpoint_correction import PixelCenters
from .sampled_budget import sampled_limits
from .schedule import CenterTasks, SamplingTasks, Tasks
from .traced_variation import TracedVariation
from .visibility_key import NO_KEY

__all__ = [
    "Frame",
    "interleaved_parts",
    "widened_plan",
]


BORDER = 3
"""Border in pixels around a region. Blocks use nodes on its first pixel, and the error of a pixel
depends on second differences of its neighbours, which use pixels two further away."""
REGION_ALIGNMENT = 8
"""Regions are extended to multiples of this many pixels, within the picture, so that blocks are
complete whatever part of the picture is rendered."""
SAMPLED_ALIGNMENT = 16
"""The same for scenes with objects that are sampled, whose shadows are interpolated over larger
blocks."""
STORAGE_ALIGNMENT = 8
"""Frames begin and end at multiples of this many pixels, so that blocks of the first pass are
contiguous sub-arrays."""
NEGLIGIBLE_ERROR = 0.01
"""Predicted error below which a pixel needs no correction of its curvature, as a fraction of the
tolerance times the RMS over channels of its own radiance. Chosen for cost, not fitted."""
MULTI_NODE_GOAL = 0.03
"""Goal, as a fraction of the contrast, below which the multi-node rule is used for visible regions
from the first. Chosen for cost, not fitted."""


CENTER_ERROR_SHARE = 0.5
"""Error of the mean of the unhidden light over a pixel, as a fraction of the goal, up to which the
pixel's light is interpolated between centres. Chosen for cost, not fitted."""


def widened_plan(plan: Plan, region: tuple[int, int, int, int]) -> Plan:
    """Plan for a region extended to whole blocks and a border around them."""
    left, bottom, right, top = region
    width, height = plan.resolution
    step = SAMPLED_ALIGNMENT if plan.may_sample else REGION_ALIGNMENT
    if has_coarse_blocks(plan):
        step = COARSE_SIDES[0]
    left, bottom = left - left % step, bottom - bottom % step
    right = max(right, min(right + -right % step, width))
    top = max(top, min(top + -top % step, height))
    return replace(plan, region=(left - BORDER, bottom - BORDER, right + BORDER, top + BORDER))


def interleaved_parts(rows: Ints, size: int) -> list[Ints]:
    """Divide pixels into interleaved parts of at most `size`: every k-th pixel, so that all parts
    take about the same time.
    """
    step = -(-rows.size // size)
    return [rows[first::step] for first in range(step)]


class Frame:
    """What is known of the n pixels of a region and its border, in the first pass and later.

    Pixels are numbered row by row, from the lower left; arrays as in `FirstPassPixels`.
    """

    def __init__(
        self, plan: Plan, region: tuple[int, int, int, int], film: Film | None = None
    ) -> None:
        """Make an empty frame.

        Parameters
        ----------
        plan : `widened_plan` of the region.
        region : pixels (left, bottom, right, top).
        film : takes the pixels of the region; None if nobody is to see them.
        """
        self.plan, self.film = plan, film
        self._set_extent(region)
        # rows of the first pass that are not in the film yet
        self._unwritten_rows = np.zeros(self.height, dtype=np.bool_)
        n = self.width * self.height
        self.color, self.alpha = np.zeros((3, n)), np.zeros(n)
        self.variation, self.sampling = TracedVariation(n), np.zeros(n)
        self.mask = np.zeros((3, n), dtype=np.bool_)
        self.outline, self.error = np.zeros(n, dtype=np.bool_), np.zeros(n)
        # visibility keys: see `find_visibility_keys`
        self.item, self.visibility_key = np.full(n, -1), np.full(n, NO_KEY)
        # pixels that need no refinement, are being refined already, are sampled by rays (nothing is
        # known of them until then), and are sampled and have outlines
        self.settled, self._in_progress, self.sampled, self.cut = np.zeros((4, n), dtype=np.bool_)
        # for pixels with outlines: whether their regions are shaded, whether those may use the
        # multi-node rule, and their errors of shape
        self.regions_shaded, self._multi_node = np.zeros((2, n), dtype=np.bool_)
        self._spatial_error, self._shape_error = np.zeros((2, n))
        # of sampled pixels: the law of their errors in heaps of spheres, what their first points
        # tell, and light at the centres of those that one object fills
        self.law, sampled = SamplingLaw(), plan.may_sample
        self.first_points = FirstPoints(n if sampled else 0, self.width)
        self.centers = CenterValues(self.width, n) if sampled else None
        # pixels traced by a ray of their own; predicted errors of the first pass are 0 elsewhere
        self.traced = np.zeros(n, dtype=np.bool_)
        self.corrected, self.change = np.zeros(0, dtype=np.int64), np.zeros((3, 0))
        # a picture made of smooth blocks only has no pixel with candidate objects
        nothing = np.zeros(0, dtype=np.int64)
        self._candidates: list[Pairs] = [Pairs(nothing, nothing)]

    def _set_extent(self, region: tuple[int, int, int, int]) -> None:
        """Set the frame's place and size, and the columns and rows of the region itself."""
        (left, bottom, right, top), align = self.plan.region, STORAGE_ALIGNMENT
        self.left, self.bottom = left - left % align, bottom - bottom % align
        self.width, self.height = (
            end + -end % align - first for first, end in ((self.left, right), (self.bottom, top))
        )
        self.region_slices = (
            slice(region[1] - self.bottom, region[3] - self.bottom),
            slice(region[0] - self.left, region[2] - self.left),
        )
        assert max(self.region_slices[0].start, self.region_slices[1].start) <= FILM_BORDER

    def add_pixels(self, x: Ints, y: Ints, pixels: FirstPassPixels) -> None:
        """Enter pixels that the first pass has traced, given their coordinates (n,)."""
        index = self.pixel_indices(x, y)
        for name in (
            "color", "alpha", "sampling", "error", "mask", "outline", "item",
            "visibility_key", "sampled", "cut",
        ):  # fmt: skip
            place(getattr(self, name), index, getattr(pixels, name))
        some = pixels.deviation.any(axis=(0, 1)).nonzero()[0]
        self.variation.enter(index[some], columns(pixels.deviation, some, -1))
        self._spatial_error[index] = pixels.spatial_error
        if self.plan.backdrop is not None:
            alone = (pixels.item < 0) & ~pixels.outline & ~pixels.sampled
            self.settled[index[alone]] = True
        self.traced[index] = True
        self._candidates.append(Pairs(index[pixels.candidates.pixel], pixels.candidates.item))
        if pixels.centers is not None:
            self._add_centers(index, pixels.centers)
        self._write_surfaces(x, y, pixels.depth, pixels.normal)

    def _add_centers(self, index: Ints, filled: FilledPixels) -> None:
        """Enter the light at the centres of sampled pixels that one object fills.

        index : (n,) the pixels of the first pass that `filled` tells of.
        """
        assert self.centers is not None
        rows, light = index[filled.rows], filled.light
        self.centers.enter(rows, light)
        self.centers.enter_first(rows, filled.item, filled.reached)
        self.first_points.enter_centers(rows, filled.item, light)

    def add_smooth_blocks(self, blocks: SmoothBlocks) -> None:
        """Enter smooth blocks, whose pixel means are known."""
        across = np.arange(blocks.side)
        x, y = blocks.side * blocks.x, blocks.side * blocks.y
        first = self.pixel_indices(x, y)
        index = first + (self.width * across[:, None] + across)[..., None]
        place(self.color, index, blocks.color)
        place(self.error, index, blocks.error)
        place(self.item, index, blocks.item)
        place(self.visibility_key, index, blocks.item + 1)
        place(self.alpha, index, self.plan.opacity(blocks.item))
        self.settled[index] = True
        for channel, flagged in ((0, blocks.penumbra), (1, blocks.moving)):
            if flagged.any():
                place(self.mask[channel], index, flagged)
        x, y = x + across[None, :, None], y + across[:, None, None]
        self._write_surfaces(x, y, blocks.depth, blocks.normal)

    def _write_surfaces(self, x: Ints, y: Ints, depth: Array, normal: Array) -> None:
        """Write what the frame itself does not need, of pixels given by their coordinates."""
        self._unwritten_rows[y - self.bottom] = True
        if self.film is not None:
            down, across = self.region_slices
            x, y = x - (self.left + across.start), y - (self.bottom + down.start)
            self.film.write_pixels(x, y, depth=depth, normal=normal)

    def write_new_rows(self) -> None:
        """Write to the film the rows that the first pass has entered since the last call."""
        if self.film is None:
            return
        ends = np.diff(self._unwritten_rows[self.region_slices[0]], prepend=False, append=False)
        for first, last in ends.nonzero()[0].reshape(-1, 2).tolist():
            rows = slice(first, last)
            color, alpha, mask = (
                self._part(values)[..., rows, :] for values in (self.color, self.alpha, self.mask)
            )
            self.film.write_rows(rows, color=color, alpha=alpha, mask=mask, samples=1)
        self._unwritten_rows[:] = False

    def _write_pixels(self, index: Ints) -> None:
        """Write the colour and coverage of some pixels to the film."""
        if self.film is not None and index.size:
            color, alpha = columns(self.color, index), self.alpha[index]
            self.film.write_pixels(*self._film_coordinates(index), color=color, alpha=alpha)

    def _film_coordinates(self, index: Ints) -> tuple[Ints, Ints]:
        """Coordinates x, y (n,) in the film of pixels given by their indices."""
        y, x = np.divmod(index, self.width)
        return x - self.region_slices[1].start, y - self.region_slices[0].start

    def pixel_indices(self, x: Ints, y: Ints) -> Ints:
        """Indices of pixels given by their coordinates."""
        return (y - self.bottom) * self.width + (x - self.left)

    def correct_smooth_pixels(self) -> None:
        """Compute the means of smooth pixels from their centres: where no outline passes and
        nothing moves.
        """
        if self.plan.edges:
            traced = self.traced.nonzero()[0]
            flat = (
                NEGLIGIBLE_ERROR * self.plan.settings.tolerance * rms(columns(self.color, traced))
            )
            # the outermost pixels lack neighbours on one side
            inside = np.zeros((self.height, self.width), dtype=np.bool_)
            inside[1:-1, 1:-1] = True
            some = (self._spatial_error[traced] > flat) | self.mask[0, traced]
            some &= inside.ravel()[traced] & ~self.outline[traced] & ~self.mask[1, traced]
            some &= ~self.sampled[traced]
            index = traced[some]
            sharp = self.mask[0] | self.mask[2]
            middles = PixelCenters(self.width, self.color, self.item, sharp, self.variation.values)
            self.corrected = index
            self.change = middles.correct(index, self.variation.places(index), self.plan.threads)
            self.error[index] = self.variation.of(index).sum(axis=(0, 1))
            self.error[index] += self.sampling[index]

    def correct_centers(self) -> None:
        """Compute the means of the unhidden light of sampled pixels from their centres."""
        if self.centers is None:
            return
        rows = self.centers.correct()
        place(self.color, rows, self.centers.mean_color(rows))
        self.alpha[rows] = self.plan.opacity(self.centers.item[rows])
        self._write_pixels(rows[self.inner()[rows]])

    @property
    def usable_centers(self) -> Mask:
        """Mask (n,) of the sampled pixels whose mean follows from centres."""
        if self.centers is None:
            return np.zeros_like(self.sampled)
        usable: Mask = self.centers.usable
        return usable

    def unsettled_sampled(self, goal: Goal) -> Ints:
        """Sampled pixels of the region itself whose error is above the goal: ascending indices."""
        least = first_limit(goal.error) if self.plan.foresees_errors else goal.error
        wanted = self.sampled & self.inner() & ~self.settled & (self.error > least)
        index: Ints = wanted.nonzero()[0]
        return index

    def unsettled_centers(self, goal: Goal) -> Mask:
        """Mask (n,) of the pixels whose light is to be interpolated between centres."""
        wanted: Mask = self.usable_centers & self.inner() & ~self.settled
        wanted &= self.error > goal.error
        if self.centers is not None:
            wanted &= self.centers.variation <= CENTER_ERROR_SHARE * goal.error
        return wanted

    @property
    def interpolates_shadows(self) -> bool:
        """Whether the light of pixels in penumbrae may be interpolated between centres.

        Meshes may throw thin shadows where a fraction of 0 or 1 tells that light is uniform, which
        it does not where lights of both signs add up.
        """
        return not (self.plan.any_mesh and self.plan.least_radiance < 0.0)

    def goal(self, rows: Mask, found: tuple[Ints, Array] | None = None) -> Goal:
        """Find the error goal from some rows of pixels.

        rows : (height,) mask.  found : indices and colours (3, m) of pixels to be used instead of
        those stored, if any.
        """
        index, color = self.region_pixels(rows), self.color
        if found is not None:
            color = color.copy()
            color[:, found[0]] = found[1]
        color = self._in_rows(color, rows)
        settled = self.settled[index]
        done, index = self.error[index[settled]], index[~settled]
        motion = None
        if self.plan.motion:
            deviation = self.variation.of(index)
            hard, steps = deviation[:, :TIME].sum(axis=(0, 1)), deviation[STEP_KIND, TIME]
            # sampled pixels have errors of no kind, which more points reduce as cells do
            hard += np.where(self.sampled[index], self.error[index], 0.0)
            crowded = self._candidate_counts[index] > MAX_REFINED_CANDIDATES
            # shadows of lights without extent stay steps, however short the shutter interval
            left = (
                steps_after_shutter(deviation[STEP_KIND])
                if self.plan.all_shadows_soft
                else np.full(index.size, np.inf)
            )
            motion = MotionErrors(crowded, self.mask[1, index], hard, left, steps)
        rest = float((done * done).sum()), done.size
        tolerance = self.plan.settings.tolerance
        starred = self._multi_node_errors(index, MIN_GOAL * tolerance * float(np.abs(color).mean()))
        cut = (self.unknown & (self.visibility_key < 0))[index]
        by_rays = self.sampling_errors(index) if self.plan.foresees_errors else None
        scale = self._error_scale[index]
        goal = make_goal(
            tolerance, color, self.error[index] * scale, starred * scale, cut, rest, motion, by_rays
        )
        if self.plan.transparent:
            return goal
        # outlines may show a bright background in a dark picture; the accuracy of regions follows
        # from the contrast
        return replace(goal, contrast=max(goal.contrast, float(rms(self.plan.background))))

    @property
    def _error_scale(self) -> Array:
        """Factors (n,) of the errors that are foreseen of pixels in closed form: see `law`."""
        return np.where(self.traced & ~self.sampled, self.law.closed, 1.0)

    def sampling_errors(self, index: Ints) -> SamplingErrors:
        """What the errors of pixels (k,) follow from as far as rays sample them."""
        assert self.centers is not None
        few, blocks = self.usable_centers[index], self.centers.fill_blocks(STORAGE_ALIGNMENT)
        rays = np.where(few, FIRST_RAYS, FIRST_POINTS * NET_RAYS)
        blocks = blocks[index] & self.interpolates_shadows
        return SamplingErrors(self.sampled[index], self.error[index], rays, blocks, self.law)

    def _multi_node_errors(self, index: Ints, least: float) -> Array:
        """Predicted errors of some pixels under the multi-node rule, where the errors exceed
        `least`.
        """
        starred = self.error[index]
        # errors of regions that may use the multi-node rule are already those
        rows = ((starred > least) & ~self._multi_node[index]).nonzero()[0]
        more = index[rows]
        left = multi_node_error(self.variation.of(more), np.full(more.size, 2))
        starred[rows] = left + self._shape_error[more] + self.sampling[more]
        return starred

    def outline_pixels(self, rows: Mask | None = None) -> Ints:
        """Pixels of the region, in the rows given by a mask, of which nothing is known but
        outlines.
        """
        unknown = self.unknown & ~self.settled & self.inner()
        if rows is not None:
            unknown &= np.repeat(rows, self.width)
        index: Ints = unknown.nonzero()[0]
        return index

    def sampled_pixels(self) -> Ints:
        """Pixels of the region and its border that are to be sampled by several points."""
        index: Ints = (self.sampled & ~self.usable_centers).nonzero()[0]
        return index

    def any_lit(self, rows: Mask) -> bool:
        """Whether any pixel of the region itself, in the rows given by a mask, is known lit."""
        return bool(self._in_rows(self.color, rows).any())

    def region_pixels(self, rows: Mask) -> Ints:
        """Indices of the pixels of the region itself in the rows given by a mask."""
        y, x = (np.arange(own.start, own.stop) for own in self.region_slices)
        index: Ints = self.width * y[rows[y], None] + x
        return index.ravel()

    def estimate_error(self) -> float:
        """Estimated RMS error of the region, relative to its mean."""
        return self._relative(self.error * self._error_scale)

    def sampling_error(self) -> tuple[int, float]:
        """Number of pixels of the region whose light is not exact, and the RMS error due to that.

        The error is relative to the region's mean, and a part of `estimate_error`.
        """
        count = int(np.count_nonzero(self._part(self.sampling)))
        return count, self._relative(self.sampling) if count else 0.0

    def _relative(self, error: Array) -> float:
        """RMS over the region of errors (n,), relative to its mean radiance."""
        # plane by plane: temporary arrays of the picture's size take longer than the sums
        mean = float(np.mean([np.abs(plane).mean() for plane in self._part(self.color)]))
        square = float((self._part(error) ** 2).mean())
        return square**0.5 / mean if mean > 0.0 else 0.0

    def inner(self) -> Mask:
        """Mask (n,) of the pixels of the region itself, without the border."""
        inside = np.zeros((self.height, self.width), dtype=np.bool_)
        inside[self.region_slices] = True
        return inside.ravel()

    def chosen(self, goal: Goal) -> Mask:
        """Mask (n,) of pixels to be refined, without those settled or being refined already."""
        above = self.error * self._error_scale > goal.error
        chosen: Mask = (self.unknown | above) & self.inner()
        chosen &= ~(self.settled | self._in_progress | self.sampled)
        return chosen

    @property
    def unknown(self) -> Mask:
        """Mask (n,) of the pixels of which nothing is known except that outlines cut them."""
        unknown: Mask = self.outline & ~self.regions_shaded
        return unknown

    def grid(self, side: int) -> tuple[int, int, int, int]:
        """Grid of blocks of one side: column and row of the first pixel, and numbers of columns and
        rows of blocks.
        """
        left, bottom, right, top = self.plan.region
        x, y = left + BORDER - self.left, bottom + BORDER - self.bottom
        return x, y, (right - left - 2 * BORDER) // side, (top - bottom - 2 * BORDER) // side

    def block_windows(self, values: NDArray[Any], side: int, size: int) -> NDArray[Any]:
        """Values (n,) of pixels as windows (rows, columns, size, size), one at each block's first
        pixel. side : of the blocks, at least one row and column of them.
        """
        x, y, columns, rows = self.grid(side)
        table = values.reshape(self.height, self.width)[y:, x:]
        return sliding_window_view(table, (size, size))[::side, ::side][:rows, :columns]

    def settle(self, rows: Ints, color: Array, alpha: Array, error: Array, sampling: Array) -> None:
        """Enter final means of pixels that need no refinement."""
        place(self.color, rows, color)
        self.alpha[rows], self.error[rows], self.sampling[rows] = alpha, error, sampling
        self.settled[rows] = True
        self._write_pixels(rows)

    def apply_corrections(self, chosen: Mask) -> None:
        """Correct the smooth pixels that are not refined; chosen (n,) are those that will be."""
        rest = self.corrected
        kept = (~(chosen[rest] | self.settled[rest] | self._in_progress[rest])).nonzero()[0]
        rows = rest[kept]
        # the differences may leave the range that radiance has
        changed = columns(self.color, rows) + columns(self.change, kept)
        self.color[:, rows] = np.maximum(changed, self.plan.least_radiance)
        self._write_pixels(rows)

    def tasks(self, rows: Ints, goal: Goal, size: int) -> Tasks:
        """Tasks of at most `size` pixels that refine the pixels `rows`, each with its own pixels'
        indices.
        """
        return self._tasks(rows, goal, size, self.plan.edges)

    def point_tasks(self, rows: Ints, goal: Goal, size: int) -> Tasks:
        """Tasks like those of `tasks` that integrate over the shutter at pixel centres only."""
        return self._tasks(rows, goal, size, False)

    def _tasks(self, rows: Ints, goal: Goal, size: int, whole: bool) -> Tasks:
        parts = interleaved_parts(rows, size)
        if self.law.closed != 1.0:
            goal = replace(goal, error=goal.error / self.law.closed)
        return [(part, self._task(part, goal, whole)) for part in parts]

    def mark_in_progress(self, rows: Ints) -> None:
        """Mark pixels as being refined, so that they are not chosen again."""
        self._in_progress[rows] = True

    def refinement_cost(self, rows: Ints) -> float:
        """Sum over pixels of the squared number of candidate objects: a cost of finding regions."""
        return float((self._candidate_counts[rows].astype(np.float64) ** 2).sum())

    @property
    def _candidate_counts(self) -> Ints:
        """Number of candidate objects of each pixel: (n,)."""
        pixel = np.concatenate([pairs.pixel for pairs in self._candidates])
        return np.bincount(pixel, minlength=self.item.size)

    def _candidates_of(self, rows: Ints) -> Pairs:
        """Candidate objects of some pixels, which are renumbered from 0; sorted by pixel."""
        number = np.full(self.item.size, -1)
        number[rows] = np.arange(rows.size)
        own = [number[pairs.pixel] for pairs in self._candidates]
        kept = [(each >= 0).nonzero()[0] for each in own]
        pixel = np.concatenate([each[index] for each, index in zip(own, kept, strict=True)])
        item = np.concatenate(
            [pairs.item[index] for pairs, index in zip(self._candidates, kept, strict=True)]
        )
        order = np.argsort(pixel, kind="stable")
        return Pairs(pixel[order], item[order])

    def _pixel_centers(self, rows: Ints) -> Array:
        """Centres (3, m) of pixels and shutter."""
        y, x = np.divmod(rows, self.width)
        return np.array([self.left + x + 0.5, self.bottom + y + 0.5, np.zeros(rows.size)])

    def _task(self, part: Ints, goal: Goal, whole: bool) -> RefinementTask:
        middle, half = self._pixel_centers(part), np.zeros((3, part.size))
        deviation = self.variation.of(part)
        if whole:
            half[:2] = 0.5
        else:
            deviation[:, :2] = 0.0
        half[2] = np.where(self.mask[1, part], 0.5, 0.0)
        # what distributed rays leave is reduced by more of them
        blank = self.unknown[part] | (self.sampling[part] > SAMPLING_ERROR_SHARE * goal.error)
        star = self._multi_node[part] | (blank & (goal.error < MULTI_NODE_GOAL * goal.contrast))
        cells = Cells(
            np.arange(part.size), middle - half, middle + half, np.ones(part.size),
            columns(self.color, part), self.alpha[part], deviation, self._shape_error[part],
            self.sampling[part], star,
        )  # fmt: skip
        return RefinementTask(
            cells, blank, self.item[part], self.outline[part], self._candidates_of(part), goal,
            GOAL_GROWTH if whole else 0.0,
        )  # fmt: skip

    def sampling_tasks(
        self, rows: Ints, goal: Goal | None, size: int, foreseen: bool
    ) -> SamplingTasks:
        """Tasks of at most `size` pixels that sample the pixels `rows`.

        goal : error goal; a pixel's own limit grows with its present error, as the goal of a pixel
            of many cells does (`make_goal` counts on it). None: the first points only.
        foreseen : whether `law` tells how errors end; limits then grow with the number of points.
        """
        parts = interleaved_parts(rows, size) if rows.size else []
        return [(part, self._sampling_task(part, goal, foreseen)) for part in parts]

    def _sampling_task(self, part: Ints, goal: Goal | None, foreseen: bool) -> SamplingTask:
        x, y, _ = self._pixel_centers(part)
        index = self._picture_numbers(x, y)
        limit, growth = np.full(part.size, np.inf), 0.0
        if goal is not None and not foreseen:
            limit = sampled_limits(self.error[part], goal.error, self.plan.motion)
        elif goal is not None:
            limit[:], growth = first_limit(goal.error), LIMIT_GROWTH
        known, most = self.first_points, goal.contrast if goal else 0.0
        contrast = known.contrasts(part, self.cut[part], most)
        moves, agreeing = self.mask[1, part], known.agreeing[part]
        return SamplingTask(
            x, y, index, moves, self._candidates_of(part), limit, contrast, agreeing, growth,
            self.law.spread if foreseen else 1.0,
        )  # fmt: skip

    def center_tasks(self, rows: Ints, limit: float, size: int) -> CenterTasks:
        """Tasks of at most `size` pixels that sample the light at the centres of the pixels
        `rows`, up to an error `limit`.
        """
        assert self.centers is not None
        tasks = self._light_tasks(rows, 0.0, self.centers.item[rows], limit, size)
        return [(rows[part], task) for part, task in tasks]

    def corner_tasks(self, corners: Ints, items: Ints, limit: float, size: int) -> CenterTasks:
        """Tasks of at most `size` corners of pixels, with their positions among all `corners`.

        corners : (n,) indices of the pixels of which they are the lower left ones.
        items : (n,) the objects that fill the pixels around.  limit : as that of `center_tasks`.
        """
        return self._light_tasks(corners, -0.5, items, limit, size)

    def _light_tasks(
        self, rows: Ints, shift: float, items: Ints, limit: float, size: int
    ) -> CenterTasks:
        """Tasks for points at a distance `shift`, in x and in y, from the centres of pixels."""
        tasks = []
        for part in interleaved_parts(np.arange(rows.size), size) if rows.size else []:
            x, y, _ = self._pixel_centers(rows[part])
            index, limits = self._picture_numbers(x, y), np.full(part.size, limit)
            tasks.append((part, CenterTask(x + shift, y + shift, index, items[part], limits)))
        return tasks

    def _picture_numbers(self, x: Array, y: Array) -> Ints:
        """Numbers (n,) in the whole picture of pixels with centres x, y (n,)."""
        return (y - 0.5).astype(np.int64) * self.plan.resolution[0] + (x - 0.5).astype(np.int64)

    def contrast(self, inside: Mask) -> float:
        """Size of the radiance of a sample of the picture: its rows in a mask (height,)."""
        color = columns(self.color, self.region_pixels(inside))
        size = float(np.sqrt((color * color).mean())) if color.size else 0.0
        return size if self.plan.transparent else max(size, float(rms(self.plan.background)))

    def count_unseen(self, contrast: float) -> None:
        """Correct the errors of sampled pixels by what their first points may not have met.

        contrast : of the picture.
        """
        rows = self.sampled.nonzero()[0]
        if not rows.size:
            return
        unreached = np.zeros_like(self.sampled)
        if self.centers is not None:
            unreached = (self.centers.item >= 0) & ~self.centers.reached
        together = rays_of_point(self.plan) * self.plan.any_mesh
        self.first_points.compare_neighbours(
            self.usable_centers, unreached, self.mask[1], together, rms(self.color)
        )
        error = self.first_points.errors(rows, self.cut[rows], contrast)
        if self.centers is not None:
            error = np.hypot(error, self.centers.variation[rows])
        self.error[rows] = self.sampling[rows] = error

    def enter_sampled(self, rows: Ints, done: SampledPixels) -> None:
        """Enter sampled pixels."""
        place(self.color, rows, done.color)
        self.first_points.enter_points(rows, done)
        self.alpha[rows] = done.alpha
        self.error[rows] = self.sampling[rows] = done.error(self.first_points.agreeing[rows])
        inside = rows[self.inner()[rows]]
        self._write_pixels(inside)
        self.count_samples(inside, done.samples[self.inner()[rows]])

    def enter_cut(self, goal: Goal, rows: Ints, done: SampledPixels) -> None:
        """Enter pixels that lines have sampled; those above their limits are left as they are."""
        limit = sampled_limits(self.error[rows], goal.error, self.plan.motion)
        fine = (done.spread <= limit).nonzero()[0]
        rows, error = rows[fine], done.spread[fine]
        self.settle(rows, columns(done.color, fine), done.alpha[fine], error, error)
        self.count_samples(rows, done.samples[fine] + 1)

    def enter_initial_cells(self, rows: Ints, shaded: InitialCells) -> None:
        """Enter the initial cells of pixels with outlines; they may still be refined."""
        cells = shaded.cells
        place(self.color, rows, cells.color)
        self.variation.enter(rows, cells.deviation)
        self.alpha[rows], self._shape_error[rows] = cells.alpha, cells.shape_error
        self.sampling[rows] = cells.sampling
        self._multi_node[rows], self.regions_shaded[rows] = cells.multi_node, True
        self.error[rows] = shaded.error
        self._write_pixels(rows)
        self.count_samples(rows, shaded.samples)

    def enter_refined(self, rows: Ints, refined: RefinedPixels) -> None:
        """Enter refined pixels."""
        place(self.color, rows, refined.color)
        self.alpha[rows], self.error[rows] = refined.alpha, refined.error
        self.sampling[rows] = refined.sampling
        self._write_pixels(rows)
        self.count_samples(rows, refined.samples)

    def count_samples(self, rows: Ints, samples: Ints) -> None:
        """Add the numbers (n,) of points shaded, beyond the first pass' own."""
        if self.film is not None:
            self.film.add_samples(*self._film_coordinates(rows), samples - 1)

    def _in_rows(self, color: Array, rows: Mask) -> Array:
        """Colours (3, rows, width) of the region in the rows of a mask, from colours (3, n)."""
        part, own = self._part(color), rows[self.region_slices[0]]
        return part if own.all() else part[:, own]

    def _part(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values (..., height, width) of the region, from values (..., n) of the frame."""
        table = values.reshape(*values.shape[:-1], self.height, self.width)
        return table[..., *self.region_slices]
