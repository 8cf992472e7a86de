# SPDX-License-Identifier: GPL-3.0-or-later
"""What works on a render: threads, which call workers where these are ready."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice
from queue import Empty, SimpleQueue
from typing import Any, TypeAlias, TypeVar

from .call_progress import heard_by
from .pool import Call, Shift, crew

__all__ = ["Aside", "Hands", "Parts", "beside"]

HEARTBEAT = 0.05
"""Seconds between signs of life, at which a host may cancel."""

Outcome: TypeAlias = tuple[int, Any, BaseException | None]
Parts: TypeAlias = dict[int, float]
"""What part is done of calls that are being made, by their numbers."""
Result = TypeVar("Result")


def beside(function: Callable[..., Result], *arguments: Any) -> Generator[None, None, Result]:
    """Make one call in a thread of its own; yields at heartbeats, and returns what comes of it.

    Closing the generator early waits for its end: it cannot be stopped.
    """
    done: SimpleQueue[tuple[Result | None, BaseException | None]] = SimpleQueue()

    def make() -> None:
        try:
            done.put((function(*arguments), None))
        except BaseException as error:
            done.put((None, error))

    thread = threading.Thread(target=make, name="Prepare", daemon=True)
    thread.start()
    try:
        while True:
            try:
                result, error = done.get(timeout=HEARTBEAT)
                break
            except Empty:
                yield
    finally:
        thread.join()
    if error is not None:
        raise error
    return result  # type: ignore[return-value]


@dataclass(frozen=True)
class Aside:
    """Calls put aside: how many, and what came of those that have been made."""

    count: int
    done: SimpleQueue[Outcome] = field(default_factory=SimpleQueue)
    parts: Parts = field(default_factory=dict)


@dataclass(frozen=True)
class _Job:
    """A call of some that are made together, and where what comes of it goes.

    Meanwhile `parts` holds what part of it is done.
    """

    number: int
    call: Call
    done: SimpleQueue[Outcome]
    parts: Parts

    def note(self, part: float) -> None:
        """Take in what part of it is done; of parts within parts some may be done once more."""
        self.parts[self.number] = max(part, self.parts.get(self.number, 0.0))


class Hands:
    """The threads of one render. Closing ends them, and cancels the calls that are left.

    Results come as they are ready, whatever their order: what is called must not mind.
    """

    def __init__(self, stop: threading.Event, threads: int) -> None:
        """No thread yet.

        stop : is set where calls are left when this closes.
        threads : how many calls may be made at a time.
        """
        self._stop, self._count, self._shift = stop, threads, Shift()
        self._change = threading.Condition()
        self._next: deque[_Job] = deque()
        self._aside: deque[_Job] = deque()
        self._threads: list[threading.Thread] = []
        # how many calls may be made at a time, how many are, and how many of those put aside
        self._most = self._busy = self._lent = 0
        self._spare = 1
        self._over = False

    def results(
        self, calls: Iterable[Call], parts: Parts | None = None
    ) -> Generator[tuple[int, Any] | None, None, None]:
        """What comes of calls, with their numbers; None at each heartbeat between.

        The first are under way when this returns. Raises what a call raises. Closing the generator
        early sets the event `stop`.

        parts : kept up with what part is done of those that are being made.
        """
        parts = {} if parts is None else parts
        self._employ()
        done: SimpleQueue[Outcome] = SimpleQueue()
        todo = enumerate(calls)
        waiting = self._begin(todo, 0, done, parts)
        return self._collected(done, waiting, todo, parts)

    def aside(self, calls: Sequence[Call]) -> Aside:
        """Have calls made where hands are free beside others; one is kept for these."""
        aside = Aside(len(calls))
        self._employ()
        self._put(
            self._aside,
            [_Job(number, call, aside.done, aside.parts) for number, call in enumerate(calls)],
        )
        return aside

    def gather(self, aside: Aside) -> Generator[tuple[int, Any] | None, None, None]:
        """What comes of calls put aside, by all hands now; as `results`."""
        with self._change:
            self._spare = 0
            self._change.notify_all()
        yield from self._collected(aside.done, aside.count, iter(()), aside.parts)

    def _collected(
        self,
        done: SimpleQueue[Outcome],
        waiting: int,
        todo: Iterator[tuple[int, Call]],
        parts: Parts,
    ) -> Generator[tuple[int, Any] | None, None, None]:
        """What comes of calls, of which so many have been put already, and the rest is to be."""
        try:
            while True:
                waiting += self._begin(todo, waiting, done, parts)
                if not waiting:
                    return
                try:
                    number, result, error = done.get(timeout=HEARTBEAT)
                except Empty:
                    yield None
                    continue
                waiting -= 1
                parts.pop(number, None)
                if error is not None:
                    raise error
                yield number, result
        finally:
            # left early: cancelled, or by an error
            if waiting:
                self._break_off()

    def _begin(
        self,
        todo: Iterator[tuple[int, Call]],
        waiting: int,
        done: SimpleQueue[Outcome],
        parts: Parts,
    ) -> int:
        """Put more calls beside those waiting, and return how many."""
        # as many again as can be made at a time: nobody waits for this thread
        some = islice(todo, max(2 * self._most - waiting, 0))
        jobs = [_Job(*each, done, parts) for each in some]
        self._put(self._next, jobs)
        return len(jobs)

    def close(self) -> None:
        """End the threads."""
        if self._busy or self._next or self._aside:
            self._break_off()
        with self._change:
            self._over = True
            self._change.notify_all()
        for thread in self._threads:
            thread.join()

    def _break_off(self) -> None:
        self._stop.set()
        with self._change:
            self._next.clear()
            self._aside.clear()
        self._shift.break_off()

    def _employ(self) -> None:
        """Have a thread for each call to make at a time: workers may be ready now."""
        with self._change:
            hands = crew.hands(self._count)
            # those that work for this render are no less ready
            self._most = max(hands, self._most) if self._busy else hands
            for _ in range(len(self._threads), self._most):
                thread = threading.Thread(target=self._serve, name="Render", daemon=True)
                self._threads.append(thread)
                thread.start()

    def _put(self, where: deque[_Job], jobs: list[_Job]) -> None:
        with self._change:
            where.extend(jobs)
            self._change.notify_all()

    def _take(self) -> tuple[_Job, bool] | None:
        """A call to make and whether it was put aside; None when all is over."""
        with self._change:
            while not self._over:
                if self._busy < self._most:
                    if self._next:
                        self._busy += 1
                        return self._next.popleft(), False
                    if self._aside and self._lent < self._most - self._spare:
                        self._busy += 1
                        self._lent += 1
                        return self._aside.popleft(), True
                self._change.wait()
        return None

    def _serve(self) -> None:
        make = self._shift.make if self._count > 1 else Call.here
        while (taken := self._take()) is not None:
            job, lent = taken
            result: Any = None
            failure: BaseException | None = None
            try:
                with heard_by(job.note):
                    result = make(job.call)
            except BaseException as error:
                failure = error
            with self._change:
                self._busy -= 1
                self._lent -= lent
                self._change.notify_all()
            job.done.put((job.number, result, failure))
