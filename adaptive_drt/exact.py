# SPDX-License-Identifier: GPL-3.0-or-later
"""Method 'EXACT' over threads: first pass by tiles, error goal, adaptive refinement."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import closing
from dataclasses import dataclass, field, replace
from itertools import chain
from typing import Any

import numpy as np

from .cubature.adaptive import refine, shade_initial_cells
from .cubature.error_budget import Goal, make_goal
from .image.biquadratic_blocks import SIDES, BiquadraticBlocks
from .image.buffers import Frame, widened_plan
from .image.chebyshev_blocks import SIDES as SQUARES
from .image.chebyshev_blocks import PixelBlocks, coarse_bounds, coarse_plan
from .image.node_values import NodeValues
from .image.progress_model import LEVEL_SHARES, progress_shares
from .image.schedule import Scheduler, StageTimer
from .image.smooth_blocks import FirstPass, trace_first_pass
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


FIRST_PASS_PIXELS = 262_144
"""Largest number of pixels in one call of the first pass: most of them lie in smooth blocks and
need only a few points."""
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
    stage : what is being done, in words, for the user.
    """

    plan: Plan
    occluders: Occluders
    goal: Goal = field(default_factory=lambda: Goal(0.0, 1.0))
    error_estimate: float = 0.0
    stage: str = "Looking at squares"

    def __post_init__(self) -> None:
        """Make the scheduler; nothing is done yet."""
        self.work = Scheduler(self.plan, self.occluders)

    def run(self, film: Film) -> Generator[float, None, None]:
        """Fill a film; yields the fraction of the work done, 0 to 1, at least once a heartbeat."""
        with closing(self.work):
            yield from self._run(film)

    def _run(self, film: Film) -> Generator[float, None, None]:
        wide = widened_plan(self.plan, self.plan.region)
        surveyed, settled = progress_shares(self.plan, self.work.free > 0)
        calls = self._survey(wide, 0, 1)
        parts: CallProgress = {}
        with closing(self.work.hands.results(calls, parts)) as results:
            # memory for the frame is allocated while workers trace
            frame = Frame(wide, self.plan.region)
            frame.develop(film)
            for number in self._entered(frame, results, parts):
                yield surveyed * number / len(calls)
        clock = StageTimer()
        self.stage = "Setting the goal"
        frame.correct()
        clock("means of smooth pixels")
        for done in self._set_goal(frame):
            yield surveyed + (settled - surveyed) * done
        if self.plan.motion:
            self.stage = "Integrating motion"
            for done in self._interpolate(frame):
                yield surveyed + (settled - surveyed) * done
        clock.restart()
        self.stage = "Refining pixels"
        tasks = frame.tasks(self.goal, self.work.part(int(frame.chosen(self.goal).sum())))
        clock("means of smooth pixels")
        self.work.add(clock.seconds)
        rest, done = sum(rows.size for rows, _ in [*tasks, *self.work.aside]), 0
        yield settled if rest else 1.0
        for outcome in chain(self.work.results(refine, tasks), self.work.gathered()):
            if outcome is not None:
                rows, refined = outcome
                frame.enter(rows, refined)
                done += rows.size
            yield settled + (1.0 - settled) * min((done + self.work.under_way) / rest, 1.0)
        self.error_estimate = frame.estimate()

    def _survey(self, wide: Plan, first: int, step: int) -> list[Call]:
        """Calls that trace the first pass over every `step`-th row of blocks, from row `first`."""
        side = SQUARES[0]
        rough = coarse_plan(wide, side)
        fine = screen_bounds(wide)
        bounds = coarse_bounds(fine, side)
        left, bottom, right, top = rough.region
        rows = -(-(top - bottom - first) // step)
        most = min(FIRST_PASS_PIXELS, FIRST_PASS_BATCHES * wide.settings.batch)
        most = max(1, most // (side * side * (right - left)))
        count = -(-rows // most)
        pixels = side * side * rows * (right - left)
        hands = worker_pool.hands(wide.threads)
        if pixels >= THREADS_PIXELS or worker_pool.ready or wide.object_count > THREADS_OBJECTS:
            count = min(rows, -(-count // hands) * hands)
        tiles = [Tile.make(rough, first + step * k, step * count) for k in range(count)]
        share = SharedArguments((wide, self.occluders, fine))
        squares = [PixelBlocks.of_tile(rough, side, bounds, tile) for tile in tiles]
        return [Call(_first_pass_call, share, (some,)) for some in squares]

    def _entered(
        self,
        frame: Frame,
        results: Generator[tuple[int, Any] | None, None, None],
        parts: CallProgress,
    ) -> Generator[float, None, None]:
        """Enter the results of the first pass; yields the number of calls done.

        parts : completed fractions of the calls in progress.
        """
        done = 0
        for result in results:
            if result is not None:
                _, (found, seconds) = result
                self.work.add(seconds)
                for lawn in found.lawns:
                    frame.lay(lawn)
                for rest in found.rest:
                    frame.add(*rest)
                self.work.shaded += found.points + sum(x.size for x, _, _ in found.rest)
                done += 1
            yield done + sum(parts.copy().values())

    def _set_goal(self, frame: Frame) -> Generator[float, None, None]:
        """Set the error goal of the whole picture, whatever part of it this frame covers.

        In still pictures the visible regions of pixels with outlines are shaded first: then their
        errors are known, and they are less than what has to be assumed before (a quad light, 1 %:
        nothing is left to refine).

        Yields the fraction of the work done.
        """
        width, height = self.plan.picture
        whole, own = (0, 0, width, height), frame
        side = SQUARES[0]
        step = max(1, height // (side * GOAL_ROWS))
        first = step // 2
        y = np.arange(height)
        chosen = ((y // side) % step == first) & (y % side >= GOAL_ROW_BORDER)
        chosen &= y % side < side - GOAL_ROW_BORDER
        if step == 1 or not chosen.any():
            chosen[:] = True
        if self.plan.region != whole:
            wide = widened_plan(self.plan, whole)
            frame = Frame(wide, whole)
            # the frame's first row of blocks is the one below the picture
            below = -(frame.bottom // side)
            calls = self._survey(wide, (first + below) % step, step)
            with closing(self.work.hands.results(calls)) as results:
                for _ in self._entered(frame, results, {}):
                    yield 0.0
            frame.correct()
        inside = np.zeros(frame.height, dtype=np.bool_)
        inside[frame.own[0]] = chosen
        self._take_goal(frame, inside)
        if not frame.lit(inside):
            for _ in self._look(frame, inside):
                yield 0.0
        elif not self.plan.motion:
            self.stage = "Shading outlines"
            yield from self._begin(own, own.outlines())
            if frame is not own:
                for _ in self._begin(frame, frame.outlines(inside)):
                    yield 1.0
            most = MAX_GOAL_RAISE * self.goal.error
            self._take_goal(frame, inside)
            self.goal = replace(self.goal, error=min(self.goal.error, most))

    def _take_goal(self, frame: Frame, inside: Mask) -> None:
        clock = StageTimer()
        self.goal = frame.goal(inside)
        clock("goal")
        self.work.add(clock.seconds)

    def _begin(self, frame: Frame, rows: Ints) -> Generator[float, None, None]:
        """Shade the visible regions of pixels with outlines; yields the fraction done."""
        tasks = frame.in_parts(rows, self.goal, self.work.part(rows.size), True)
        done = 0
        with closing(self.work.results(shade_initial_cells, tasks, "outlines")) as outcomes:
            for outcome in outcomes:
                if outcome is not None:
                    own, begun = outcome
                    frame.begin(own, begun)
                    done += own.size
                yield (done + self.work.under_way) / rows.size

    def _look(self, frame: Frame, inside: Mask) -> Generator[None, None, None]:
        """If no pixel centre is lit, search for light first and set the goal from what is found."""
        some = frame.some(inside)
        color, error, cut = columns(frame.color, some), frame.error[some], frame.outline[some]
        goal = make_goal(UNLIT_TOLERANCE, color, error, error, cut)
        some = some[cut | (error > goal.error)]
        if not some.size:
            return
        tasks = frame.in_parts(some, goal, self.work.part(some.size), True)
        found: list[tuple[Ints, Array]] = []
        with closing(self.work.results(refine, tasks)) as outcomes:
            for outcome in outcomes:
                if outcome is not None:
                    rows, refined = outcome
                    found.append((rows, refined.color))
                    frame.count(rows, refined)
                yield
        pixels = np.concatenate([rows for rows, _ in found])
        color = np.concatenate([part for _, part in found], axis=1)
        # if no light is found, the picture is too dark to be resolved
        self.goal = frame.goal(inside, (pixels, color)) if color.any() else Goal(np.inf, 1.0)

    def _interpolate(self, frame: Frame) -> Generator[float, None, None]:
        """Resolve pixels under motion by interpolation between shutter means, where these are
        smooth.

        Pixels that no block can resolve are meanwhile refined in the background, if there are
        workers. Yields the fraction done.
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
        rows = hard.nonzero()[0]
        if rows.size and (size := self.work.part_aside(rows.size, frame.crowd(rows))):
            self.work.put_aside(frame.in_parts(rows, self.goal, size, True))
            frame.hold(rows)
        before = 0.0
        for level, share in zip(levels, LEVEL_SHARES, strict=True):
            wanted = level.ask()
            clock("blocks")
            for done in self._integrate(frame, points, wanted):
                yield before + share * done
            before += share
            clock.restart()
            level.settle()
            clock("blocks")
        self.work.add(clock.seconds)

    def _integrate(
        self, frame: Frame, points: NodeValues, wanted: Ints
    ) -> Generator[float, None, None]:
        """Integrate over the shutter at pixel centres; yields the fraction done."""
        done = 0
        tasks = frame.point_tasks(wanted, self.goal, self.work.part(wanted.size))
        with closing(self.work.results(refine, tasks, "nodes of blocks")) as outcomes:
            for outcome in outcomes:
                if outcome is not None:
                    points.enter(*outcome)
                    done += outcome[0].size
                yield (done + self.work.under_way) / wanted.size


def _first_pass_call(
    plan: Plan, occluders: Occluders, bounds: Ints, squares: PixelBlocks
) -> tuple[FirstPass, dict[str, float]]:
    plan.go_on()
    clock = StageTimer()
    return trace_first_pass(plan, occluders, bounds, squares, clock), clock.seconds
