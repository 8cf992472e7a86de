# SPDX-License-Identifier: GPL-3.0-or-later
"""Method 'EXACT' over threads: first pass by tiles, error goal, adaptive refinement.

`ExactRender` reads like the steps of docs/algorithm.md, whose numbers its comments give.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import chain
from typing import Any, TypeAlias, TypeVar

import numpy as np

from .cubature.adaptive import RefinedPixels, refine, shade_initial_cells
from .cubature.cut_pixels import sample_cut_pixels
from .cubature.error_budget import Goal, make_goal
from .cubature.heap_limits import CLOSED_RATIO, END_ROUNDS, PILOT_RATIO, PILOT_ROUNDS, Pilots
from .cubature.sampled_centers import sample_centers
from .cubature.sampled_pixels import SampledPixels, sample_pixels
from .geometry.ray_counts import counted_rays, rays_since
from .image.biquadratic_blocks import SIDES, BiquadraticBlocks
from .image.chebyshev_blocks import SIDES as SMOOTH_SIDES
from .image.chebyshev_blocks import PixelBlocks, coarse_bounds, coarse_plan
from .image.first_pass import FirstPass, trace_first_pass
from .image.frame import Frame, widened_plan
from .image.heap_pilots import closed_pilots, corrected_pilots, sampled_pilots
from .image.node_values import NodeValues
from .image.progress_model import LEVEL_SHARES, progress_shares
from .image.sampled_budget import sampled_rise
from .image.schedule import Scheduler, StageTimer
from .image.shadow_blocks import SIDES as SHADOW_SIDES
from .image.shadow_blocks import ShadowBlocks
from .image.shadow_corners import ShadowCorners
from .image.shadow_stencil import ShadowStencil
from .image.stencil_means import StencilMeans
from .numerics.arrays import Array, Ints, Mask
from .numerics.gather import columns
from .parallel.executor import CallProgress
from .parallel.pool import Call, SharedArguments, worker_pool
from .scene.film import Film
from .tracing.compile import Plan
from .tracing.intersect import Tile, screen_bounds
from .tracing.occluder_culling import Occluders

__all__ = ["ExactRender"]

Steps: TypeAlias = Generator[float, None, None]
"""Work in steps: yields the completed fraction of it, 0 to 1, at least once a heartbeat."""

Found = TypeVar("Found")
"""What is found of pixels."""

FIRST_PASS_PIXELS = 262_144
"""Largest number of pixels in one call of the first pass: most of them lie in smooth blocks and
need only a few points."""
FIRST_PASS_PAIRS = 1 << 15
"""Largest number of pairs of blocks and objects in one call, unless those of a row of blocks are
more: each takes up to 2 KB while outlines are looked for, and some are cut into four."""
FIRST_PASS_BATCHES = 8
"""Largest number of batches in one call of the first pass: a viewport render, whose batches are
small, then shows progress (a first pass of 1280 x 720 pixels took 5 % longer by 65,536 pixels than
by `FIRST_PASS_PIXELS`)."""
GOAL_ROWS = 32
"""Smallest number of rows of blocks, of the whole picture, that the error goal is computed from.
The goal of any render region is that of the whole picture, so parts rendered separately join to the
last bit."""
MAX_GOAL_RAISE = 4.0
"""Largest factor by which shading the outlines' regions may raise the goal that was set before: the
rows that the goal is computed from may just have missed the hardest pixels."""
GOAL_ROW_BORDER = 2
"""Pixels at both sides of such a row that are not used: second differences need their
neighbours."""
THREADS_PIXELS = 131_072
"""Number of pixels from which threads share a first pass: with fewer, two threads that wait for
each other at every call of NumPy take longer than one (0.16 to 0.21 s) ..."""
THREADS_OBJECTS = 48
"""... or number of objects: each pixel then takes so long that threads pay sooner (1.8 to 1.35
s)."""
UNLIT_TOLERANCE = 1.0
"""Tolerance used to search for light where no pixel centre is lit. It gives a goal of some 7 % of
the predicted errors. The tolerance itself would split all of a dark picture to the limit."""


@dataclass
class ExactRender:
    """One render by method 'EXACT', and its statistics.

    Attributes
    ----------
    plan, occluders : of the region itself.
    goal : error goal, set once the first pass is done.
    work : scheduler that runs the tasks and collects their statistics.
    error_estimate : estimated RMS error of the picture, relative to its mean.
    sampling_error : number of pixels whose light is not exact, and the part of the estimated error
        that is due to it: see `Frame.sampling_error`.
    stage : what is being done, in words, for the user.
    """

    plan: Plan
    occluders: Occluders
    goal: Goal = field(default_factory=lambda: Goal(0.0, 1.0))
    error_estimate: float = 0.0
    sampling_error: tuple[int, float] = (0, 0.0)
    stage: str = "First pass"

    def __post_init__(self) -> None:
        """Make the scheduler; nothing is done yet."""
        self.work = Scheduler(self.plan, self.occluders)

    @property
    def seconds(self) -> dict[str, float]:
        """Seconds by stage, summed over threads."""
        return self.work.seconds

    def run(self, film: Film) -> Steps:
        """Write a picture to a film; yields the fraction of the work done, 0 to 1."""
        with closing(self.work):
            yield from self._run(film)

    def _run(self, film: Film) -> Steps:
        traced, resolved = progress_shares(self.plan, self.work.free_workers > 0)
        wide = widened_plan(self.plan, self.plan.region)
        (count, calls), progress = self._first_pass_calls(wide, 0, 1), CallProgress()
        with closing(self.work.executor.run(calls, progress)) as results:
            # memory for the frame is allocated while workers trace
            frame = Frame(wide, self.plan.region, film)
            # steps 1 to 5: centre rays, mask, smooth blocks, light, predicted errors
            for done in self._enter_first_pass(frame, results, progress):
                yield traced * done / count
        # step 6: the goal of each pixel
        self.stage = "Setting the goal"
        self._correct_smooth_pixels(frame)
        yield from _within(traced, resolved, self._set_goal(frame))
        self.stage = "Sampling pixels"
        goal = self._sampling_goal
        for _ in self._interpolate_shadows(frame, goal):
            yield resolved
        for _ in self._sample_cut_pixels(frame, goal):
            yield resolved
        for _ in self._sample(frame, frame.unsettled_sampled(goal), goal):
            yield resolved
        frame.settled[frame.sampled] = True
        # step 7: pixels smooth in time
        if self.plan.motion:
            self.stage = "Integrating motion"
            yield from _within(traced, resolved, self._interpolate_means(frame))
        # step 8: adaptive cubature of all others
        self.stage = "Refining pixels"
        yield from _within(resolved, 1.0, self._refine(frame))
        # step 9: the error
        self.error_estimate, self.sampling_error = frame.estimate_error(), frame.sampling_error()

    # --- steps 1 to 5: the first pass ------------------------------------------------------

    def _first_pass_calls(self, wide: Plan, first: int, step: int) -> tuple[int, Iterator[Call]]:
        """Calls that trace the first pass over every `step`-th row of blocks, from row `first`.

        They are made as they are needed, and come with their number.
        """
        side = SMOOTH_SIDES[0]
        rough = coarse_plan(wide, side)
        fine = screen_bounds(wide)
        bounds = coarse_bounds(fine, side)
        left, bottom, right, top = rough.region
        rows = -(-(top - bottom - first) // step)
        most = min(FIRST_PASS_PIXELS, FIRST_PASS_BATCHES * wide.settings.batch)
        most = max(1, most // (side * side * (right - left)))
        area = np.prod(np.maximum(bounds[2:] - bounds[:2], 0), axis=0).sum() / step
        count = -(-rows // min(most, max(1, int(FIRST_PASS_PAIRS * rows / max(area, 1)))))
        pixels = side * side * rows * (right - left)
        if (
            pixels >= THREADS_PIXELS
            or worker_pool.ready_count
            or wide.object_count > THREADS_OBJECTS
        ):
            at_a_time = worker_pool.concurrency(wide.threads)
            count = min(rows, -(-count // at_a_time) * at_a_time)
        tiles = (Tile.make(rough, first + step * k, step * count) for k in range(count))
        shared = SharedArguments((wide, self.occluders, fine))
        blocks = (PixelBlocks.of_tile(rough, side, bounds, tile) for tile in tiles)
        return count, (Call(_first_pass_call, shared, (each,)) for each in blocks)

    def _enter_first_pass(
        self,
        frame: Frame,
        results: Generator[tuple[int, Any] | None, None, None],
        progress: CallProgress,
    ) -> Steps:
        """Enter the results of the first pass; yields the number of calls done.

        progress : completed fractions of the calls that are running.
        """
        done = 0
        for result in results:
            if result is not None:
                _, (found, seconds, rays) = result
                self.work.add(seconds, rays)
                for blocks in found.blocks:
                    frame.add_smooth_blocks(blocks)
                for x, y, pixels in found.pixels:
                    frame.add_pixels(x, y, pixels)
                frame.write_new_rows()
                self.work.shaded += found.points + sum(x.size for x, _, _ in found.pixels)
                done += 1
            yield done + sum(progress.copy().values())

    def _correct_smooth_pixels(self, frame: Frame) -> None:
        clock = StageTimer()
        frame.correct_smooth_pixels()
        frame.correct_centers()
        clock("means of smooth pixels")
        self.work.add(clock.seconds)

    # --- step 6: the goal --------------------------------------------------------------------

    def _set_goal(self, frame: Frame) -> Steps:
        """Set the error goal of the whole picture, whatever part of it this frame covers.

        In still pictures the visible regions of pixels with outlines are shaded first: then their
        errors are known, and they are less than what has to be assumed before (a quad light, 1 %:
        nothing is left to refine).
        """
        chosen = self._goal_rows()
        own = frame
        width, height = self.plan.resolution
        if self.plan.region != (0, 0, width, height):
            frame = Frame(widened_plan(self.plan, (0, 0, width, height)), (0, 0, width, height))
            for _ in self._trace_goal_rows(frame):
                yield 0.0
        inside = np.zeros(frame.height, dtype=np.bool_)
        inside[frame.region_slices[0]] = chosen
        self.stage = "Sampling pixels"
        yield from _within(0.0, 0.5, self._sample(own, own.sampled_pixels(), None))
        if frame is not own:
            for _ in self._sample(frame, frame.sampled_pixels(), None):
                yield 0.5
        contrast = frame.contrast(inside)
        own.count_unseen(contrast)
        if frame is not own:
            frame.count_unseen(contrast)
        self._take_goal(frame, inside)
        if self.plan.foresees_errors and frame.any_lit(inside):
            for _ in self._sample_pilots(frame, inside):
                yield 0.5
            own.law = frame.law
        if not frame.any_lit(inside):
            for _ in self._search_light(own, frame, inside):
                yield 0.0
        elif not self.plan.motion:
            self.stage = "Shading outlines"
            yield from self._shade_outlines(own, own.outline_pixels())
            if frame is not own:
                for _ in self._shade_outlines(frame, frame.outline_pixels(inside)):
                    yield 1.0
            most = MAX_GOAL_RAISE * self.goal.error
            self._take_goal(frame, inside)
            if self.plan.traced is not None:
                for _ in self._refine_pilots(frame, inside):
                    yield 1.0
                own.law = frame.law
            self.goal = replace(self.goal, error=min(self.goal.error, most))

    def _goal_row_step(self) -> int:
        """Number of rows of blocks from each that the goal is computed from to the next."""
        return max(1, self.plan.resolution[1] // (SMOOTH_SIDES[0] * GOAL_ROWS))

    def _goal_rows(self) -> Mask:
        """Mask (height,) of the rows of pixels, of the whole picture, that set the goal."""
        side, step = SMOOTH_SIDES[0], self._goal_row_step()
        y = np.arange(self.plan.resolution[1])
        chosen: Mask = ((y // side) % step == step // 2) & (y % side >= GOAL_ROW_BORDER)
        chosen &= y % side < side - GOAL_ROW_BORDER
        return chosen if step > 1 and chosen.any() else np.ones_like(chosen)

    def _trace_goal_rows(self, frame: Frame) -> Steps:
        """Trace the first pass for the rows that set the goal, in a frame of the whole picture."""
        step = self._goal_row_step()
        # the frame's first row of blocks is the one below the picture
        below = -(frame.bottom // SMOOTH_SIDES[0])
        _, calls = self._first_pass_calls(frame.plan, (step // 2 + below) % step, step)
        with closing(self.work.executor.run(calls)) as results:
            yield from self._enter_first_pass(frame, results, {})
        frame.correct_smooth_pixels()
        frame.correct_centers()

    @property
    def _sampling_goal(self) -> Goal:
        """The error goal of pixels that are sampled by rays."""
        plan = self.plan
        if plan.foresees_errors:
            return self.goal
        rise = sampled_rise(plan.settings.tolerance, plan.motion)
        return replace(self.goal, error=rise * self.goal.error)

    def _take_goal(self, frame: Frame, inside: Mask) -> None:
        clock = StageTimer()
        self.goal = frame.goal(inside)
        clock("goal")
        self.work.add(clock.seconds)

    def _shade_outlines(self, frame: Frame, rows: Ints) -> Steps:
        """Shade the visible regions of pixels with outlines, whose indices are `rows`."""
        tasks = frame.tasks(rows, self.goal, self.work.pixels_per_call(rows.size))
        outcomes = self.work.run(shade_initial_cells, tasks, "outlines")
        return self._enter_outcomes(outcomes, frame.enter_initial_cells, rows.size)

    def _sample(self, frame: Frame, rows: Ints, goal: Goal | None) -> Steps:
        """Sample the pixels whose indices are `rows`; without a goal, by the first points only."""
        size, foreseen = self.work.sampled_pixels_per_call(rows.size), self.plan.foresees_errors
        tasks = frame.sampling_tasks(rows, goal, size, foreseen)
        outcomes = self.work.run(sample_pixels, tasks, "sampled pixels")
        return self._enter_outcomes(outcomes, frame.enter_sampled, rows.size)

    def _sample_pilots(self, frame: Frame, inside: Mask) -> Steps:
        """Sample a few pixels by many points, to learn how the errors of all others will end."""
        rows = sampled_pilots(frame, inside, self.goal)
        fine = replace(self.goal, error=self.goal.error / PILOT_RATIO)
        reference = yield from self._pilots(frame, rows, fine, 1)
        for number in range(PILOT_ROUNDS + END_ROUNDS):
            pilots = yield from self._pilots(frame, rows, self.goal, 0)
            expected = frame.sampling_errors(rows).expected(self.goal.error)
            law = frame.law.corrected(expected, pilots, reference)
            if number >= PILOT_ROUNDS:
                if pilots.end_as(expected):
                    return
                law = replace(law, spread=frame.law.spread)
            frame.law = law
            self._take_goal(frame, inside)

    def _refine_pilots(self, frame: Frame, inside: Mask) -> Steps:
        """Refine a few pixels in closed form far below the goal, to learn what errors are."""
        rows = closed_pilots(frame, inside, self.goal)
        found = [corrected_pilots(frame, rows)]
        for part in (1.0, CLOSED_RATIO):
            goal = replace(self.goal, error=self.goal.error / part)
            tasks = (
                frame.tasks(rows, goal, self.work.pixels_per_call(rows.size)) if rows.size else []
            )
            color, error = np.zeros((3, rows.size)), np.zeros(rows.size)

            def enter(
                some: Ints, done: RefinedPixels, to: tuple[Array, Array] = (color, error)
            ) -> None:
                at = np.searchsorted(rows, some)
                to[0][:, at], to[1][at] = done.color, done.error

            outcomes = self.work.run(refine, tasks, "pilot pixels")
            yield from self._enter_outcomes(outcomes, enter, rows.size)
            found.append(Pilots(color, error))
        frame.law = frame.law.with_closed(found[:2], found[2])
        self._take_goal(frame, inside)

    def _pilots(
        self, frame: Frame, rows: Ints, goal: Goal, other: int
    ) -> Generator[float, None, Pilots]:
        """Pixels `rows`, ascending, sampled to a goal; other : number of their set of points."""
        shift = other * self.plan.resolution[0] * self.plan.resolution[1]
        size = self.work.sampled_pixels_per_call(rows.size)
        tasks = [
            (part, replace(task, index=task.index + shift))
            for part, task in frame.sampling_tasks(rows, goal, size, foreseen=True)
        ]
        found = SampledPixels.zeros(rows.size)

        def enter(some: Ints, done: SampledPixels) -> None:
            found.enter(np.searchsorted(rows, some), done)

        outcomes = self.work.run(sample_pixels, tasks, "pilot pixels")
        yield from self._enter_outcomes(outcomes, enter, rows.size)
        whole = found.error(frame.first_points.agreeing[rows])
        return Pilots(found.color, found.spread, whole)

    def _sample_cut_pixels(self, frame: Frame, goal: Goal) -> Steps:
        """Sample the pixels that edges cut by lines across them, where that is possible."""
        rows = frame.unsettled_sampled(goal)
        rows = rows[frame.cut[rows] & self.plan.shapes.sampled.any()]
        size = self.work.pixels_per_call(rows.size)
        tasks = frame.sampling_tasks(rows, goal, size, foreseen=False)
        outcomes = self.work.run(sample_cut_pixels, tasks, "cut pixels")
        return self._enter_outcomes(outcomes, partial(frame.enter_cut, goal), rows.size)

    def _interpolate_shadows(self, frame: Frame, goal: Goal) -> Steps:
        """Interpolate the light of sampled pixels between centres, where it varies smoothly."""
        if frame.centers is None:
            return
        clock = StageTimer()
        # small blocks of spheres hardly ever succeed, and their nodes take more rays than pixels do
        sides = (*SHADOW_SIDES, 1) if self.plan.traced is None else SHADOW_SIDES[:-1]
        for side in sides:
            blocks: ShadowBlocks | ShadowStencil = (
                ShadowStencil(frame, goal)
                if side == 1
                else ShadowBlocks(frame, self.goal, goal, side)
            )
            rows = blocks.missing_pixels()
            clock("shadow blocks")
            tasks = frame.center_tasks(
                rows, blocks.node_limit, self.work.pixels_per_call(rows.size)
            )
            outcomes = self.work.run(sample_centers, tasks, "shadow nodes")

            yield from self._enter_outcomes(outcomes, blocks.enter, rows.size)
            clock.restart()
            if isinstance(blocks, ShadowBlocks):
                blocks.settle()
            else:
                corners = ShadowCorners(frame, goal, blocks.estimates())
                tasks = corners.tasks(self.work.pixels_per_call(corners.size))
                clock("shadow blocks")
                outcomes = self.work.run(sample_centers, tasks, "shadow nodes")
                yield from self._enter_outcomes(outcomes, corners.enter, corners.size)
                clock.restart()
                corners.settle()
            clock("shadow blocks")
        self.work.add(clock.seconds)

    def _enter_outcomes(
        self,
        outcomes: Generator[tuple[Ints, Found] | None, None, None],
        enter: Callable[[Ints, Found], None],
        count: int,
    ) -> Steps:
        """Enter what is found of pixels, `count` in all; yields the fraction that is done."""
        done = 0
        with closing(outcomes):
            for outcome in outcomes:
                if outcome is not None:
                    pixels, found = outcome
                    enter(pixels, found)
                    done += pixels.size
                yield (done + self.work.in_progress) / max(count, 1)

    def _search_light(self, own: Frame, frame: Frame, inside: Mask) -> Generator[None, None, None]:
        """If no pixel centre is lit, search for light first and set the goal from what is found.

        Without a goal, sampled pixels that are black would be sampled up to the limit.
        """
        rows = frame.region_pixels(inside)
        color, error, cut = columns(frame.color, rows), frame.error[rows], frame.outline[rows]
        goal = make_goal(UNLIT_TOLERANCE, color, error, error, cut)
        rows = rows[(cut | (error > goal.error)) & ~frame.sampled[rows]]
        dark = frame.sampled.any()
        for each in {id(one): one for one in (own, frame)}.values():
            for _ in self._sample(each, each.unsettled_sampled(goal), goal):
                yield
        tasks = frame.tasks(rows, goal, self.work.pixels_per_call(rows.size)) if rows.size else []
        found: list[tuple[Ints, Array]] = [(rows[:0], np.zeros((3, 0)))]
        with closing(self.work.run(refine, tasks)) as outcomes:
            for outcome in outcomes:
                if outcome is not None:
                    pixels, refined = outcome
                    found.append((pixels, refined.color))
                    frame.count_samples(pixels, refined.samples)
                yield
        index = np.concatenate([pixels for pixels, _ in found])
        color = np.concatenate([part for _, part in found], axis=1)
        if color.any() or frame.any_lit(inside):
            self.goal = frame.goal(inside, (index, color))
        elif rows.size or dark:
            # if no light is found, the picture is too dark to be resolved
            self.goal = Goal(np.inf, 1.0)

    # --- step 7: pixels smooth in time -------------------------------------------------------

    def _interpolate_means(self, frame: Frame) -> Steps:
        """Resolve pixels under motion by interpolation between shutter means, where these are
        smooth.

        Pixels that no block can resolve are meanwhile refined in the background, if there are
        workers.
        """
        clock = StageTimer()
        points = NodeValues(frame, self.goal)
        levels: list[BiquadraticBlocks | StencilMeans] = [
            BiquadraticBlocks(points, side) for side in SIDES
        ]
        levels.append(StencilMeans(points))
        hard = frame.chosen(self.goal)
        for level in levels:
            hard[level.pixels] = False
        self._refine_in_background(frame, hard.nonzero()[0])
        before = 0.0
        for level, share in zip(levels, LEVEL_SHARES, strict=True):
            wanted = level.missing_pixels()
            clock("blocks")
            yield from _within(before, before + share, self._integrate(frame, points, wanted))
            before += share
            clock.restart()
            level.settle()
            clock("blocks")
        self.work.add(clock.seconds)

    def _refine_in_background(self, frame: Frame, rows: Ints) -> None:
        """Start the refinement of the pixels `rows` in the background, if there are workers."""
        if not rows.size:
            return
        size = self.work.background_pixels_per_call(rows.size, frame.refinement_cost(rows))
        if size:
            self.work.start_background(frame.tasks(rows, self.goal, size))
            frame.mark_in_progress(rows)

    def _integrate(self, frame: Frame, points: NodeValues, wanted: Ints) -> Steps:
        """Integrate over the shutter at the centres of the pixels `wanted`."""
        tasks = frame.point_tasks(wanted, self.goal, self.work.pixels_per_call(wanted.size))
        outcomes = self.work.run(refine, tasks, "nodes of blocks")
        return self._enter_outcomes(outcomes, points.enter, wanted.size)

    # --- step 8: adaptive cubature -----------------------------------------------------------

    def _refine(self, frame: Frame) -> Steps:
        """Refine the pixels that are above the goal, and take in those of the background."""
        clock = StageTimer()
        chosen = frame.chosen(self.goal)
        frame.apply_corrections(chosen)
        rows = chosen.nonzero()[0]
        tasks = frame.tasks(rows, self.goal, self.work.pixels_per_call(rows.size))
        clock("means of smooth pixels")
        self.work.add(clock.seconds)
        count = sum(pixels.size for pixels, _ in [*tasks, *self.work.background_tasks])
        done = 0
        yield 0.0 if count else 1.0
        for outcome in chain(self.work.run(refine, tasks), self.work.background_results()):
            if outcome is not None:
                pixels, refined = outcome
                frame.enter_refined(pixels, refined)
                done += pixels.size
            yield min((done + self.work.in_progress) / count, 1.0)


def _within(low: float, high: float, steps: Steps) -> Steps:
    """Steps of a part of the work whose progress lies between two fractions of the whole."""
    for done in steps:
        yield low + (high - low) * done


def _first_pass_call(
    plan: Plan, occluders: Occluders, bounds: Ints, blocks: PixelBlocks
) -> tuple[FirstPass, dict[str, float], dict[str, int]]:
    plan.raise_if_cancelled()
    clock, before = StageTimer(), counted_rays()
    found = trace_first_pass(plan, occluders, bounds, blocks, clock)
    return found, clock.seconds, rays_since(before)
