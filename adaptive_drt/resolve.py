# SPDX-License-Identifier: GPL-3.0-or-later
"""Method 'EXACT' over threads: the first pass by tiles, then the pixels that need refining."""

from __future__ import annotations

import time
from collections.abc import Generator
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .blocks import SIDES, Blocks
from .exact import RIM, Frame, Sheet, first_pass, lattice, widened
from .film import Film
from .goal import Goal
from .occluder import Occluders
from .plan import Plan
from .primary import Tile, screen_bounds
from .refine import Refined, Task, refine
from .threads import in_order

__all__ = ["Clock", "Exact"]

Ints: TypeAlias = NDArray[np.int64]

PART = 32_768
"""Pixels refined at a time, at most; fewer where threads would have none."""
LEAST_PART = 1_024
"""Pixels refined at a time, if there are as many: fewer do not pay for NumPy's calls."""


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


@dataclass
class Exact:
    """One exact render, and what there is to say of it.

    Attributes
    ----------
    plan, occluders : of the region itself.
    seconds : by stage, of all threads together.
    goal : set once the first pass is done.
    shaded : points shaded in all.
    error_estimate : RMS error of the picture over its mean, as the renderer sees it.
    """

    plan: Plan
    occluders: Occluders
    seconds: dict[str, float] = field(default_factory=dict)
    goal: Goal = field(default_factory=lambda: Goal(0.0, 1.0))
    shaded: int = 0
    error_estimate: float = 0.0

    def run(self, film: Film) -> Generator[int, None, None]:
        """Fill a film; yields how many of its pixels are done, at least once a heartbeat."""
        wide = widened(self.plan, self.plan.region)
        frame = Frame(wide, self.plan.region)
        size = film.width * film.height
        done = 0
        jobs, tiles = self._first(wide, range(frame.height))
        with closing(in_order(self.plan, jobs)) as results:
            for result in results:
                if result is not None:
                    sheet, seconds = result
                    self._add(seconds)
                    tile = tiles.pop(0)
                    frame.add(tile, sheet)
                    frame.show(film, tile)
                    done += tile.index.size
                yield size * done // (2 * frame.width * frame.height)
        clock = Clock()
        frame.correct()
        for _ in self._set_goal(frame):
            yield size // 2
        clock("means of smooth pixels")
        if self.plan.motion:
            for _ in self._interpolate(frame):
                yield size // 2
        clock.restart()
        tasks = frame.tasks(self.goal, self._part(int(frame.chosen(self.goal).sum())))
        frame.show(film)
        clock("means of smooth pixels")
        self._add(clock.seconds)
        rest = sum(rows.size for rows, _ in tasks)
        yield size - rest
        done = size - rest
        todo = [partial(_refine, self.plan, self.occluders, task) for _, task in tasks]
        with closing(in_order(self.plan, todo)) as outcomes:
            for outcome in outcomes:
                if outcome is not None:
                    refined, seconds = outcome
                    self._add(seconds)
                    rows = tasks.pop(0)[0]
                    frame.enter(rows, refined)
                    frame.show(film, rows=rows)
                    done += rows.size
                yield done
        self.shaded = int(film.samples.sum())
        self.error_estimate = frame.estimate()

    def _first(self, wide: Plan, rows: range) -> tuple[list[Any], list[Tile]]:
        """The first pass' jobs and tiles over rows of a plan's region."""
        left, _, right, _ = wide.region
        bounds = screen_bounds(wide)
        most = max(1, wide.settings.batch // (right - left))
        count = -(-len(rows) // most)
        count = min(len(rows), -(-count // wide.threads) * wide.threads)
        tiles = [Tile.make(wide, rows[k], rows.step * count) for k in range(count)]
        return [partial(_first, wide, self.occluders, bounds, tile) for tile in tiles], tiles

    def _set_goal(self, frame: Frame) -> Generator[None, None, None]:
        """Set the goal of the whole picture, whatever part of it this frame is."""
        width, height = self.plan.picture
        if self.plan.region == (0, 0, width, height):
            self.goal = frame.goal()
            return
        whole = widened(self.plan, (0, 0, width, height))
        sample = Frame(whole, (0, 0, width, height))
        first, step = lattice(height)
        for above in range(min(2 * RIM + 1, step)):
            jobs, tiles = self._first(whole, range(first + above, height + 2 * RIM, step))
            with closing(in_order(whole, jobs)) as results:
                for result in results:
                    if result is not None:
                        sample.add(tiles.pop(0), result[0])
                    yield
        sample.correct()
        self.goal = sample.goal()

    def _interpolate(self, frame: Frame) -> Generator[None, None, None]:
        """Settle what motion leaves smooth, from points at the nodes of blocks."""
        clock = Clock()
        blocks = Blocks(frame, self.goal)
        for side in SIDES:
            rows = blocks.nodes(side)
            tasks = frame.point_tasks(rows, self.goal, self._part(rows.size))
            clock("blocks")
            todo = [partial(_refine, self.plan, self.occluders, task) for _, task in tasks]
            with closing(in_order(self.plan, todo)) as outcomes:
                for outcome in outcomes:
                    if outcome is not None:
                        refined, seconds = outcome
                        self._add({"nodes of blocks": seconds["refining"]})
                        blocks.enter(tasks.pop(0)[0], refined)
                    yield
            clock.restart()
            blocks.settle()
            clock("blocks")
        self._add(clock.seconds)

    def _part(self, count: int) -> int:
        """Pixels of a part, when so many are to be refined."""
        return int(np.clip(-(-count // self.plan.threads), LEAST_PART, PART))

    def _add(self, seconds: dict[str, float]) -> None:
        for stage, span in seconds.items():
            self.seconds[stage] = self.seconds.get(stage, 0.0) + span


def _first(
    plan: Plan, occluders: Occluders, bounds: Ints, tile: Tile
) -> tuple[Sheet, dict[str, float]]:
    plan.go_on()
    clock = Clock()
    return first_pass(plan, occluders, bounds, tile, clock), clock.seconds


def _refine(plan: Plan, occluders: Occluders, task: Task) -> tuple[Refined, dict[str, float]]:
    clock = Clock()
    refined = refine(plan, occluders, task)
    clock("refining")
    return refined, clock.seconds
