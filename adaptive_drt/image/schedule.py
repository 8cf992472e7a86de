# SPDX-License-Identifier: GPL-3.0-or-later
"""Work on the pixels of one exact render: in what parts, by whom, and what it took."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from contextlib import closing
from typing import TypeAlias, TypeVar

from ..cubature.adaptive import Begun, Refined, Task, refine
from ..numerics.arrays import Ints
from ..parallel.executor import Aside, Hands, Parts
from ..parallel.pool import Call, Share, crew
from ..tracing.compile import Plan
from ..tracing.occluder_culling import Occluders

__all__ = ["Clock", "Tasks", "Work"]

Tasks: TypeAlias = list[tuple[Ints, Task]]
"""Numbers of pixels, and what is to be done for them."""
Done = TypeVar("Done", Begun, Refined)
Outcomes: TypeAlias = Generator[tuple[int, tuple[Done, float]] | None, None, None]

PART = 32_768
"""Pixels refined at a time, at most; fewer where threads would have none."""
LEAST_PART = 16_384
"""Pixels refined at a time, if there are as many: with fewer, two threads that wait for each other
at every call of NumPy take longer than one (300 x 300, 1 %: 0.98 to 1.32 s)."""
CREWS_PART = 1_024
"""Pixels refined at a time, at least, where processes share them: each call costs 5 ms."""
ASIDE_PART = 8_192
"""Pixels refined at a time beside what is done for others, at most. Parts of a few thousand take as
long as they have rounds (4,500 pixels at 0.1 %: 0.56 s, but in quarters 0.19 each)."""
ASIDE_CROWD = 131_072.0
"""Squares of candidates refined at a time beside that, about: what takes long is shared by all in
the end (7,000 pixels, ten moving spheres in each: one took 68 s, and the other 2)."""


class Clock:
    """Seconds by stage: each call ends a stage."""

    def __init__(self) -> None:
        """Start."""
        self.seconds: dict[str, float] = {}
        self._last = time.perf_counter()

    def __call__(self, stage: str) -> None:
        """End a stage."""
        now = time.perf_counter()
        self.seconds[stage] = self.seconds.get(stage, 0.0) + now - self._last
        self._last = now

    def restart(self) -> None:
        """Begin a stage here: what was since the last is counted elsewhere."""
        self._last = time.perf_counter()


class Work:
    """What is done for the pixels of one render.

    Attributes
    ----------
    hands : who does it.  share : what calls of it have in common.
    seconds : by stage, of all threads together.  shaded : points shaded in all.
    under_way : pixels' worth of what is done of calls that are being made.
    """

    def __init__(self, plan: Plan, occluders: Occluders) -> None:
        """Nothing done yet."""
        self.hands, self.share = Hands(plan.stop, plan.threads), Share((plan, occluders))
        self.seconds: dict[str, float] = {}
        self.shaded, self.under_way = 0, 0.0
        self._plan = plan
        # what is done beside others
        self.aside: Tasks = []
        self._made = Aside(0)

    @property
    def free(self) -> int:
        """How many workers are free to refine pixels beside what is done for others."""
        return crew.ready if self._plan.threads > 1 else 0

    def add(self, seconds: dict[str, float]) -> None:
        """Add to the seconds by stage."""
        for stage, span in seconds.items():
            self.seconds[stage] = self.seconds.get(stage, 0.0) + span

    def part(self, count: int) -> int:
        """Pixels of a part, when so many are to be refined."""
        least = CREWS_PART if crew.ready else LEAST_PART
        return self._within(-(-count // crew.hands(self._plan.threads)), least, PART)

    def part_aside(self, count: int, crowd: float) -> int:
        """The same of what workers alone do beside others, with so much in its boxes (see
        `Frame.crowd`); 0 if there are none."""
        # asked once: one may have loaded a moment later
        free = self.free
        if not free:
            return 0
        parts = max(free, int(crowd / ASIDE_CROWD))
        return self._within(-(-count // parts), CREWS_PART, ASIDE_PART)

    def _within(self, size: int, least: int, most: int) -> int:
        most = max(1, min(most, self._plan.settings.batch))
        return min(max(size, least), most)

    def results(
        self, work: Callable[..., Done], tasks: Tasks, stage: str = "refining"
    ) -> Generator[tuple[Ints, Done] | None, None, None]:
        """What comes of work on tasks, with their pixels; None at heartbeats between."""
        parts: Parts = {}
        outcomes = self.hands.results(self._calls(work, tasks), parts)
        return self._entered(outcomes, tasks, stage, parts)

    def put_aside(self, tasks: Tasks) -> None:
        """Have pixels refined beside what is done for others."""
        self.aside = tasks
        self._made = self.hands.aside(self._calls(refine, tasks))

    def gathered(self) -> Generator[tuple[Ints, Refined] | None, None, None]:
        """What comes of the pixels put aside; as `results`."""
        outcomes = self.hands.gather(self._made)
        return self._entered(outcomes, self.aside, "refining", self._made.parts)

    def _calls(self, work: Callable[..., Done], tasks: Tasks) -> list[Call]:
        return [Call(_timed, self.share, (work, task)) for _, task in tasks]

    def _entered(
        self, outcomes: Outcomes[Done], tasks: Tasks, stage: str, parts: Parts
    ) -> Generator[tuple[Ints, Done] | None, None, None]:
        """Outcomes with their tasks' pixels, counted."""
        with closing(outcomes):
            for outcome in outcomes:
                # threads enter more meanwhile
                begun = parts.copy()
                self.under_way = sum(part * tasks[k][0].size for k, part in begun.items())
                if outcome is None:
                    yield None
                    continue
                number, (done, seconds) = outcome
                rows, _ = tasks[number]
                self.add({stage: seconds})
                self.shaded += int(done.samples.sum()) - rows.size
                yield rows, done

    def close(self) -> None:
        """End the threads; cancels the render if anything is left to do."""
        self.hands.close()


def _timed(
    plan: Plan, occluders: Occluders, work: Callable[..., Done], task: Task
) -> tuple[Done, float]:
    """What comes of a task, and the seconds that took."""
    began = time.perf_counter()
    done = work(plan, occluders, task)
    return done, time.perf_counter() - began
