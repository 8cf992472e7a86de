# SPDX-License-Identifier: GPL-3.0-or-later
"""The executor of a render: threads that run calls, in worker processes where these are ready."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice
from queue import Empty, SimpleQueue
from typing import Any, TypeAlias, TypeVar

from .call_progress import report_progress_to
from .pool import Call, CallGroup, worker_pool

__all__ = ["CallProgress", "DeferredCalls", "RenderExecutor", "run_in_thread"]

POLL_INTERVAL = 0.05
"""Seconds to wait for a result before control returns to the caller, who may cancel the render."""

Outcome: TypeAlias = tuple[int, Any, BaseException | None]
"""Number of a call, its result, and the exception that it raised or None."""
CallProgress: TypeAlias = dict[int, float]
"""Completed fraction, 0 to 1, of each running call, by the call's number."""
Result = TypeVar("Result")


def run_in_thread(
    function: Callable[..., Result], *arguments: Any
) -> Generator[None, None, Result]:
    """Run a function in a new thread. Yields every `POLL_INTERVAL` and returns the result.

    Raises what the function raises. Closing the generator early waits for the thread to end: the
    function cannot be interrupted.
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
                result, error = done.get(timeout=POLL_INTERVAL)
                break
            except Empty:
                yield
    finally:
        thread.join()
    if error is not None:
        raise error
    return result  # type: ignore[return-value]


@dataclass(frozen=True)
class DeferredCalls:
    """Deferred calls: their number, and the outcomes and progress of those run so far."""

    count: int
    outcomes: SimpleQueue[Outcome] = field(default_factory=SimpleQueue)
    progress: CallProgress = field(default_factory=dict)


@dataclass(frozen=True)
class _Job:
    """A call, its number in its batch, and where its outcome and its progress are stored.

    While it runs, `parts[number]` is its completed fraction.
    """

    number: int
    call: Call
    outcomes: SimpleQueue[Outcome]
    progress: CallProgress

    def update_progress(self, part: float) -> None:
        """Store the completed fraction; it never decreases, though nested parts may be repeated."""
        self.progress[self.number] = max(part, self.progress.get(self.number, 0.0))


class RenderExecutor:
    """The executor of one render, with its own threads.

    Results are returned in the order of completion, so calls must not depend on each other.
    Closing ends the threads and cancels calls that have not completed.
    """

    def __init__(self, stop: threading.Event, threads: int) -> None:
        """Create the executor. Threads are started with the first calls.

        Parameters
        ----------
        stop : event that is set when calls are cancelled.
        threads : largest number of calls that run at a time.
        """
        self._stop, self._threads_allowed, self._group = stop, threads, CallGroup()
        self._condition = threading.Condition()
        self._queue: deque[_Job] = deque()
        self._deferred: deque[_Job] = deque()
        self._threads: list[threading.Thread] = []
        # limit of calls that run at a time, how many do, how many of those are deferred
        self._limit = self._running = self._running_deferred = 0
        self._reserved = 1
        self._closed = False

    def run(
        self, calls: Iterable[Call], parts: CallProgress | None = None
    ) -> Generator[tuple[int, Any] | None, None, None]:
        """Run calls and yield (number, result) in order of completion; None each `POLL_INTERVAL`.

        The first calls are running when this method returns. The generator raises what a call
        raises. Closing it early cancels the calls and sets the event `stop`.

        Parameters
        ----------
        parts : updated with the completed fraction of the calls that are running.
        """
        parts = {} if parts is None else parts
        self._start_threads()
        done: SimpleQueue[Outcome] = SimpleQueue()
        todo = enumerate(calls)
        waiting = self._enqueue(todo, 0, done, parts)
        return self._collect(done, waiting, todo, parts)

    def defer(self, calls: Sequence[Call]) -> DeferredCalls:
        """Run calls on threads without other work. One thread is kept for calls of `run`."""
        deferred = DeferredCalls(len(calls))
        self._start_threads()
        self._push(
            self._deferred,
            [
                _Job(number, call, deferred.outcomes, deferred.progress)
                for number, call in enumerate(calls)
            ],
        )
        return deferred

    def finish_deferred(
        self, deferred: DeferredCalls
    ) -> Generator[tuple[int, Any] | None, None, None]:
        """Yield the results of deferred calls, which may now use all threads; as `run`."""
        with self._condition:
            self._reserved = 0
            self._condition.notify_all()
        yield from self._collect(deferred.outcomes, deferred.count, iter(()), deferred.progress)

    def _collect(
        self,
        done: SimpleQueue[Outcome],
        waiting: int,
        todo: Iterator[tuple[int, Call]],
        parts: CallProgress,
    ) -> Generator[tuple[int, Any] | None, None, None]:
        """Yield results. `waiting` calls have been queued already; those in `todo` have not."""
        try:
            while True:
                waiting += self._enqueue(todo, waiting, done, parts)
                if not waiting:
                    return
                try:
                    number, result, error = done.get(timeout=POLL_INTERVAL)
                except Empty:
                    yield None
                    continue
                waiting -= 1
                parts.pop(number, None)
                if error is not None:
                    raise error
                yield number, result
        finally:
            # closed early by cancelling, or left by an exception
            if waiting:
                self._cancel()

    def _enqueue(
        self,
        todo: Iterator[tuple[int, Call]],
        waiting: int,
        done: SimpleQueue[Outcome],
        parts: CallProgress,
    ) -> int:
        """Queue more calls beside the `waiting` ones, and return how many."""
        # twice as many as run at a time, so that no thread waits for this one
        some = islice(todo, max(2 * self._limit - waiting, 0))
        jobs = [_Job(*each, done, parts) for each in some]
        self._push(self._queue, jobs)
        return len(jobs)

    def close(self) -> None:
        """End the threads, after cancelling calls that have not completed."""
        if self._running or self._queue or self._deferred:
            self._cancel()
        with self._condition:
            self._closed = True
            self._condition.notify_all()
        for thread in self._threads:
            thread.join()

    def _cancel(self) -> None:
        """Cancel the queued calls and those that are running."""
        self._stop.set()
        with self._condition:
            self._queue.clear()
            self._deferred.clear()
        self._group.cancel()

    def _start_threads(self) -> None:
        """Start threads up to the current limit, which grows as workers become ready."""
        with self._condition:
            allowed = worker_pool.concurrency(self._threads_allowed)
            # the pool does not count the workers that run calls of this render as ready
            self._limit = max(allowed, self._limit) if self._running else allowed
            for _ in range(len(self._threads), self._limit):
                thread = threading.Thread(target=self._run_jobs, name="Render", daemon=True)
                self._threads.append(thread)
                thread.start()

    def _push(self, where: deque[_Job], jobs: list[_Job]) -> None:
        with self._condition:
            where.extend(jobs)
            self._condition.notify_all()

    def _next_job(self) -> tuple[_Job, bool] | None:
        """Wait for a job. Returns it and whether it is a deferred one, or None after `close`."""
        with self._condition:
            while not self._closed:
                if self._running < self._limit:
                    if self._queue:
                        self._running += 1
                        return self._queue.popleft(), False
                    if self._deferred and self._running_deferred < self._limit - self._reserved:
                        self._running += 1
                        self._running_deferred += 1
                        return self._deferred.popleft(), True
                self._condition.wait()
        return None

    def _run_jobs(self) -> None:
        """Loop of a thread: run jobs until the executor is closed."""
        execute = self._group.make if self._threads_allowed > 1 else Call.here
        while (taken := self._next_job()) is not None:
            job, is_deferred = taken
            result: Any = None
            failure: BaseException | None = None
            try:
                with report_progress_to(job.update_progress):
                    result = execute(job.call)
            except BaseException as error:
                failure = error
            with self._condition:
                self._running -= 1
                self._running_deferred -= is_deferred
                self._condition.notify_all()
            job.outcomes.put((job.number, result, failure))
