# SPDX-License-Identifier: GPL-3.0-or-later
"""Jobs over threads, their results in order, with signs of life between."""

from __future__ import annotations

from collections import deque
from collections.abc import Generator, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import TimeoutError as FutureTimeout
from typing import Any

from .crew import Call, Shift, crew
from .plan import Plan

__all__ = ["in_order"]

HEARTBEAT = 0.05
"""Seconds between signs of life, at which a host may cancel."""


def in_order(plan: Plan, calls: Iterable[Call]) -> Generator[Any, None, None]:
    """The results of calls in order; None where one lets wait for longer than a heartbeat.

    Closing the generator early tells the plan to stop.
    """
    todo, shift = iter(calls), Shift()
    make = shift.make if plan.threads > 1 else Call.here
    hands = crew.hands(plan.threads)
    with ThreadPoolExecutor(hands) as pool:
        waiting: deque[Future[Any]] = deque()
        try:
            while True:
                while len(waiting) < 2 * hands and (call := next(todo, None)) is not None:
                    waiting.append(pool.submit(make, call))
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
                shift.break_off()
            for future in waiting:
                future.cancel()
