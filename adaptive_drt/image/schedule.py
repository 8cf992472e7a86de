# SPDX-License-Identifier: GPL-3.0-or-later
"""Scheduling of pixel tasks in an exact render: sizes of parts, threads and workers, statistics."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from contextlib import closing
from typing import TypeAlias, TypeVar

from ..cubature.adaptive import InitialCells, RefinedPixels, RefinementTask, refine
from ..cubature.sampled_centers import CenterTask, SampledCenters
from ..cubature.sampled_pixels import SampledPixels, SamplingTask
from ..geometry.ray_counts import counted_rays, rays_since
from ..numerics.arrays import Ints
from ..parallel.executor import CallProgress, DeferredCalls, RenderExecutor
from ..parallel.pool import Call, SharedArguments, worker_pool
from ..tracing.compile import Plan
from ..tracing.occluder_culling import Occluders
from .memory_bound import listed_pixels

__all__ = ["CenterTasks", "SamplingTasks", "Scheduler", "StageTimer", "Tasks"]

Tasks: TypeAlias = list[tuple[Ints, RefinementTask]]
"""Pixel indices, and what is to be done for those pixels."""
SamplingTasks: TypeAlias = list[tuple[Ints, SamplingTask]]
"""Pixel indices, and how those pixels are sampled."""
CenterTasks: TypeAlias = list[tuple[Ints, CenterTask]]
"""Pixel indices, and how the light at those pixels' centres is sampled."""
AnyTask: TypeAlias = RefinementTask | SamplingTask | CenterTask
AnyTasks: TypeAlias = Tasks | SamplingTasks | CenterTasks
Done = TypeVar("Done", InitialCells, RefinedPixels, SampledPixels, SampledCenters)
Outcomes: TypeAlias = Generator[tuple[int, tuple[Done, float, dict[str, int]]] | None, None, None]

MAX_PIXELS = 32_768
"""Largest number of pixels refined in one call."""
MIN_THREAD_PIXELS = 16_384
"""Smallest number of pixels refined in one call by a thread, if there are as many: with fewer, two
threads that wait for each other at every call of NumPy take longer than one (300 x 300, 1 %: 0.98
to 1.32 s)."""
MIN_TRACED_PIXELS = 512
"""The same where rays against a set of spheres sample the pixels: each takes a millisecond."""
MIN_WORKER_PIXELS = 1_024
"""Smallest number of pixels refined in one call by a worker process: each call costs 5 ms."""
MAX_BACKGROUND_PIXELS = 8_192
"""Largest number of pixels refined in one background call. The time of a part of a few thousand
pixels is set by its number of rounds (4,500 pixels at 0.1 %: 0.56 s, but in quarters 0.19 each)."""
BACKGROUND_CALL_COST = 131_072.0
"""Cost, as `Frame.refinement_cost` gives it, of one background call, roughly: in the end all
workers share what takes long (7,000 pixels, ten moving spheres in each: one call took 68 s, and the
other 2)."""


class StageTimer:
    """Timer of stages, in seconds: each call ends a stage."""

    def __init__(self) -> None:
        """Start the first stage."""
        self.seconds: dict[str, float] = {}
        self._last = time.perf_counter()

    def __call__(self, stage: str) -> None:
        """End a stage and add its time to the seconds of that name."""
        now = time.perf_counter()
        self.seconds[stage] = self.seconds.get(stage, 0.0) + now - self._last
        self._last = now

    def restart(self) -> None:
        """Begin a stage now; the time since the last one is counted elsewhere."""
        self._last = time.perf_counter()


class Scheduler:
    """Scheduler of the pixel tasks of one render.

    Attributes
    ----------
    executor : runs the calls.
    seconds : by stage, summed over threads.  shaded : number of points shaded.
    rays : numbers of rays against meshes, by kind: see `ray_counts`.
    in_progress : completed fractions of the calls in progress, in pixels.
    background_tasks : the tasks that run in the background.
    """

    def __init__(self, plan: Plan, occluders: Occluders) -> None:
        """Nothing is done yet."""
        self.executor = RenderExecutor(plan.stop, plan.threads)
        self._shared = SharedArguments((plan, occluders))
        self.seconds: dict[str, float] = {}
        self.shaded, self.in_progress = 0, 0.0
        self.rays: dict[str, int] = {}
        self._plan = plan
        self.background_tasks: Tasks = []
        self._deferred = DeferredCalls(0)

    @property
    def free_workers(self) -> int:
        """Number of workers that can refine pixels in the background."""
        return worker_pool.ready_count if self._plan.threads > 1 else 0

    def add(self, seconds: dict[str, float], rays: dict[str, int] | None = None) -> None:
        """Add to the seconds by stage, and to the numbers of rays against meshes by kind."""
        for kind, count in (rays or {}).items():
            self.rays[kind] = self.rays.get(kind, 0) + count
        for stage, span in seconds.items():
            self.seconds[stage] = self.seconds.get(stage, 0.0) + span

    def pixels_per_call(self, count: int) -> int:
        """Number of pixels a call, when `count` are to be refined."""
        least = MIN_WORKER_PIXELS if worker_pool.ready_count else MIN_THREAD_PIXELS
        return self._shared_evenly(count, least, min(MAX_PIXELS, listed_pixels(self._plan)))

    def sampled_pixels_per_call(self, count: int) -> int:
        """Number of pixels a call, when `count` are to be sampled."""
        if self._plan.traced is None:
            return self.pixels_per_call(count)
        return self._shared_evenly(count, MIN_TRACED_PIXELS, MAX_PIXELS)

    def _shared_evenly(self, count: int, least: int, most: int) -> int:
        calls = worker_pool.concurrency(self._plan.threads)
        return self._within(-(-count // calls), least, most)

    def background_pixels_per_call(self, count: int, cost: float) -> int:
        """Number of pixels a background call, run by workers only; 0 if there are none.

        count : pixels to be refined.  cost : theirs: see `Frame.refinement_cost`.
        """
        # read once: another worker may become ready a moment later
        free = self.free_workers
        if not free:
            return 0
        parts = max(free, int(cost / BACKGROUND_CALL_COST))
        most = min(MAX_BACKGROUND_PIXELS, listed_pixels(self._plan))
        return self._within(-(-count // parts), MIN_WORKER_PIXELS, most)

    def _within(self, size: int, least: int, most: int) -> int:
        most = max(1, min(most, self._plan.settings.batch))
        return min(max(size, least), most)

    def run(
        self, work: Callable[..., Done], tasks: AnyTasks, stage: str = "refining"
    ) -> Generator[tuple[Ints, Done] | None, None, None]:
        """Run tasks; yields pixel indices with results as they come, and None at heartbeats in
        between.
        """
        parts: CallProgress = {}
        outcomes = self.executor.run(self._calls(work, tasks), parts)
        return self._counted(outcomes, tasks, stage, parts)

    def start_background(self, tasks: Tasks) -> None:
        """Start the refinement of pixels in the background."""
        self.background_tasks = tasks
        self._deferred = self.executor.defer(self._calls(refine, tasks))

    def background_results(self) -> Generator[tuple[Ints, RefinedPixels] | None, None, None]:
        """Yield the results of the background tasks, as `run` does."""
        outcomes = self.executor.finish_deferred(self._deferred)
        return self._counted(outcomes, self.background_tasks, "refining", self._deferred.progress)

    def _calls(self, work: Callable[..., Done], tasks: AnyTasks) -> list[Call]:
        return [Call(_timed, self._shared, (work, task)) for _, task in tasks]

    def _counted(
        self,
        outcomes: Outcomes[Done],
        tasks: AnyTasks,
        stage: str,
        parts: CallProgress,
    ) -> Generator[tuple[Ints, Done] | None, None, None]:
        """Outcomes with the pixel indices of their tasks; also updates the statistics."""
        with closing(outcomes):
            for outcome in outcomes:
                # threads add entries meanwhile
                begun = parts.copy()
                self.in_progress = sum(part * tasks[k][0].size for k, part in begun.items())
                if outcome is None:
                    yield None
                    continue
                number, (done, seconds, rays) = outcome
                rows, _ = tasks[number]
                self.add({stage: seconds}, rays)
                self.shaded += int(done.samples.sum()) - rows.size
                yield rows, done

    def close(self) -> None:
        """End the threads; this cancels the render if anything is left to do."""
        self.executor.close()


def _timed(
    plan: Plan, occluders: Occluders, work: Callable[..., Done], task: AnyTask
) -> tuple[Done, float, dict[str, int]]:
    """Result of a task, the seconds it took, and the rays against meshes that it traced."""
    began, before = time.perf_counter(), counted_rays()
    done = work(plan, occluders, task)
    return done, time.perf_counter() - began, rays_since(before)
