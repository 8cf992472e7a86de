# SPDX-License-Identifier: GPL-3.0-or-later
"""A pool of worker processes, which scale better than threads.

Python runs one thread at a time and switches threads at each call of NumPy. Where these calls are
short, at 300 x 300, two threads take longer than one; two processes take little more than half.

Workers are started when an image is large enough, and get calls once they have loaded. They end
with this process, when the pool is stopped, and after `IDLE_TIMEOUT` without a call. Where no
worker can be started, threads run all calls, with the same image as result.
"""

from __future__ import annotations

import atexit
import itertools
import json
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from .call_progress import report_progress
from .cancellation import RenderCancelled
from .transport import receive, send
from .worker import READY_MESSAGE

__all__ = ["Call", "CallGroup", "SharedArguments", "WorkerPool", "worker_pool"]

BOOTSTRAP = """
import importlib.util, json, sys, types
package, folder, idle, sys.path[:] = json.loads(sys.argv[1])
parents = package.split(".")[:-1]
for end in range(1, len(parents) + 1):
    stub = types.ModuleType(".".join(parents[:end]))
    stub.__path__ = []
    sys.modules[stub.__name__] = stub
spec = importlib.util.spec_from_file_location(
    package, folder + "/__init__.py", submodule_search_locations=[folder])
sys.modules[package] = importlib.util.module_from_spec(spec)
spec.loader.exec_module(sys.modules[package])
for name in ("render", "parallel.worker"):
    module = importlib.import_module(package + "." + name)
module.serve(idle)
"""
"""Program of a worker. It imports the core under the package name that it has in this process.

The packages that enclose the core are replaced by empty modules, for they may need Blender."""
WORKER_ENVIRONMENT = {
    # one thread each: there are as many workers as processors
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    # glibc's largest thresholds: freed memory of arrays is reused instead of returned to the
    # system and faulted in again (0.35 of 1.3 s, 400 spheres)
    "MALLOC_MMAP_THRESHOLD_": str(32 << 20),
    "MALLOC_TRIM_THRESHOLD_": str(1 << 30),
}
"""Environment variables of a worker that differ from those of this process."""
CORE_PACKAGE = __name__.rpartition(".")[0].rpartition(".")[0]
"""Full name of the core's package, with the packages that enclose it."""
IDLE_TIMEOUT = 120.0
"""Seconds without a call after which a worker ends: an artist often renders again within them."""
PIPE = 1 << 20
"""Capacity of the pipes to a worker, in bytes, where it can be set: on Linux.

It is Linux's limit for users other than root. With the default of 64 KiB the reader wakes up for
each 64 KiB, and 4 MB take 5 ms instead of 2."""


@dataclass(frozen=True)
class SharedArguments:
    """Leading arguments that many calls have in common, sent to each worker only once."""

    values: tuple[Any, ...]
    number: int = field(default_factory=itertools.count().__next__)


@dataclass(frozen=True)
class Call:
    """A call of a function of the core: `function(*share.values, *arguments)`."""

    function: Callable[..., Any]
    shared: SharedArguments
    arguments: tuple[Any, ...]

    def here(self) -> Any:
        """Run the call in this process."""
        return self.function(*self.shared.values, *self.arguments)


class _Worker:
    """A worker process, with a pipe for calls and a pipe for answers."""

    def __init__(self) -> None:
        # the core's package, which contains the package of this file
        package, folder = CORE_PACKAGE, Path(__file__).resolve().parent.parent
        words = [
            sys.executable,
            "-I",
            "-c",
            BOOTSTRAP,
            json.dumps([package, str(folder), IDLE_TIMEOUT, [*map(str, sys.path)]]),
        ]
        self._process = subprocess.Popen(
            words,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            # only the host process is to handle Ctrl-C
            start_new_session=os.name == "posix",
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
            env={**os.environ, **WORKER_ENVIRONMENT},
        )
        stdin, stdout = self._process.stdin, self._process.stdout
        assert stdin is not None and stdout is not None  # both are pipes
        self._calls, self._answers = stdin, stdout
        _enlarge_pipe(stdin)
        _enlarge_pipe(stdout)
        self._shared_number = -1
        self.ready = False
        self.failed = False
        self._killed = False
        self._watcher = threading.Thread(target=self._wait_for_process, name="Worker", daemon=True)
        self._watcher.start()

    def _wait_for_process(self) -> None:
        """Wait until the process has loaded, then for its end: otherwise it would stay a zombie."""
        try:
            self.ready = receive(self._answers) == READY_MESSAGE
        except (EOFError, OSError, ValueError, pickle.UnpicklingError):
            self.failed = True
        self._process.wait()

    @property
    def process_id(self) -> int:
        """The system's number of the process."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        # a process may run for a while after it was killed
        return not self._killed and self._process.poll() is None

    def send_call(self, call: Call) -> None:
        """Send a call; raises OSError if the process has ended."""
        values = None if call.shared.number == self._shared_number else call.shared.values
        send(self._calls, (call.function, values, call.arguments))
        self._shared_number = call.shared.number

    def receive_result(self) -> tuple[Any, Exception | None]:
        """Wait for the result or the exception of the call, and report its progress meanwhile.

        Raises EOFError or OSError if the process has ended.
        """
        while isinstance(got := receive(self._answers), float):
            report_progress(got)
        answer: tuple[Any, Exception | None] = got
        return answer

    def kill(self) -> None:
        """Kill the process during a call; its `receive_result` then raises EOFError or OSError."""
        self._killed = True
        self._process.kill()

    def close(self) -> None:
        """End the process, its thread and its pipes. No call may be running."""
        self._process.kill()
        self._watcher.join()
        for pipe in (self._calls, self._answers):
            with suppress(OSError):
                pipe.close()


def _enlarge_pipe(pipe: IO[bytes]) -> None:
    """Enlarge the capacity of a pipe, where the system can."""
    with suppress(ImportError, AttributeError, OSError):
        import fcntl

        fcntl.fcntl(pipe, fcntl.F_SETPIPE_SZ, PIPE)


class WorkerPool:
    """The worker processes of this process."""

    def __init__(self) -> None:
        """Create an empty pool, which ends its workers when this process exits."""
        self._lock = threading.Lock()
        self._idle: list[_Worker] = []
        self._busy: set[_Worker] = set()
        self._unavailable = not Path(sys.executable or "").name.lower().startswith("python")
        atexit.register(self.stop)

    @property
    def ready_count(self) -> int:
        """Number of workers that have loaded and run no call."""
        with self._lock:
            return sum(worker.ready and worker.alive for worker in self._idle)

    @property
    def process_ids(self) -> list[int]:
        """System's numbers of the workers' processes."""
        with self._lock:
            return [worker.process_id for worker in (*self._idle, *self._busy)]

    def concurrency(self, threads: int) -> int:
        """Number of calls to run at a time, at most `threads`.

        With workers only one call runs in this process: two would wait for Python's lock.
        """
        ready = self.ready_count
        return min(threads, 1 + ready) if ready else threads

    def start_workers(self, count: int) -> None:
        """Start workers until there are `count`. Returns before they have loaded."""
        with self._lock:
            dead = [worker for worker in self._idle if not worker.alive]
            # if a worker failed to load, so would any other
            self._unavailable |= any(worker.failed for worker in dead)
            self._idle = [worker for worker in self._idle if worker not in dead]
            lacking = 0 if self._unavailable else count - len(self._idle) - len(self._busy)
            for _ in range(lacking):
                try:
                    self._idle.append(_Worker())
                except OSError:
                    self._unavailable = True
                    break
        for worker in dead:
            worker.close()

    def acquire(self) -> _Worker | None:
        """Take a ready worker out of the pool, or return None if there is none."""
        with self._lock:
            for worker in self._idle:
                if worker.ready and worker.alive:
                    self._idle.remove(worker)
                    self._busy.add(worker)
                    return worker
        return None

    def release(self, worker: _Worker) -> None:
        """Return a worker to the pool after a call."""
        with self._lock:
            self._busy.discard(worker)
            self._idle.append(worker)

    def stop(self) -> None:
        """End all workers. Calls that they are running raise EOFError or OSError."""
        with self._lock:
            idle, self._idle = self._idle, []
            for worker in self._busy:
                worker.kill()
        for worker in idle:
            worker.close()


worker_pool = WorkerPool()
"""The pool of this process, shared by all renders that run at the same time."""


class CallGroup:
    """A group of calls that are run by workers where possible and can be cancelled together."""

    def __init__(self) -> None:
        """Create a group without calls."""
        self._lock, self._sending = threading.Lock(), threading.Lock()
        self._busy: set[_Worker] = set()
        self._cancelled = False

    def make(self, call: Call) -> Any:
        """Run a call in a worker, or in this process if no worker is ready or its worker has ended.

        Raises what the call raises, and `RenderCancelled` after `cancel`.
        """
        try:
            answer = self._run_in_worker(call)
        except (EOFError, OSError):
            if self._cancelled:
                raise RenderCancelled from None
            answer = None
        if answer is None:
            return call.here()
        result, error = answer
        if error is not None:
            raise error
        return result

    def _run_in_worker(self, call: Call) -> tuple[Any, Exception | None] | None:
        """The result and the exception of a call run by a worker, or None if no worker is ready.

        Raises EOFError or OSError if the worker has ended.
        """
        worker = self._send_to_worker(call)
        if worker is None:
            return None
        try:
            return worker.receive_result()
        finally:
            self._release(worker)

    def _send_to_worker(self, call: Call) -> _Worker | None:
        """Send a call to a ready worker and return the worker, or None if no worker is ready.

        Calls are sent one at a time, before one is run in this process: Python lets a thread that
        computes hold its lock for 5 ms before another thread may write.
        """
        with self._sending:
            worker = worker_pool.acquire()
            if worker is None:
                return None
            try:
                with self._lock:
                    if self._cancelled:
                        raise RenderCancelled
                    self._busy.add(worker)
                worker.send_call(call)
            except BaseException:
                self._release(worker)
                raise
            return worker

    def _release(self, worker: _Worker) -> None:
        with self._lock:
            self._busy.discard(worker)
        worker_pool.release(worker)

    def cancel(self) -> None:
        """Cancel all calls of the group by killing the workers that run them."""
        with self._lock:
            self._cancelled = True
            for worker in self._busy:
                worker.kill()
