# SPDX-License-Identifier: GPL-3.0-or-later
"""Jobs over threads, their results in order, with signs of life between."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import TimeoutError as FutureTimeout
from typing import TypeVar

from .plan import Plan

__all__ = ["in_order"]

HEARTBEAT = 0.05
"""Seconds between signs of life, at which a host may cancel."""

Result = TypeVar("Result")


def in_order(
    plan: Plan, jobs: Iterable[Callable[[], Result]]
) -> Generator[Result | None, None, None]:
    """The results of jobs in order; None where one lets wait for longer than a heartbeat.

    Closing the generator early tells the plan to stop.
    """
    todo = iter(jobs)
    with ThreadPoolExecutor(plan.threads) as pool:
        waiting: deque[Future[Result]] = deque()
        try:
            while True:
                while len(waiting) < 2 * plan.threads and (job := next(todo, None)) is not None:
                    waiting.append(pool.submit(job))
                if not waiting:
                    return
                try:
                    result = waiting[0].result(HEARTBEAT)
                except FutureTimeout:
                    yield None
                else:
                    waiting.popleft()
                    yield result
        finally:
            # left early: cancelled, or by an error
            if waiting:
                plan.stop.set()
            for future in waiting:
                future.cancel()
