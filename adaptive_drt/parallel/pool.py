# SPDX-License-Identifier: GPL-3.0-or-later
"""Worker processes beside this one: what threads share, they share better.

Python runs one thread at a time, and hands over at each call of NumPy. Where calls are short, at
300 x 300, two threads take longer than one; two processes take little more than half.

Workers are started when a picture is large enough, are used once they have loaded, and end with
this process, when they are told to, or when nobody has called for a while. Where none can be had
all is done by threads, to the same picture.
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

from .call_progress import tell
from .cancellation import Stopped
from .transport import receive, send
from .worker import READY

__all__ = ["Call", "Crew", "Share", "Shift", "crew"]

BOOT = """
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
"""What a worker runs: this package under the name that it has here, without those around it, which
may need Blender."""
ENVIRONMENT = {
    # there are as many workers as processors
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    # glibc's largest thresholds: memory of arrays is kept for the next, and not faulted in anew
    # (0.35 of 1.3 s, 400 spheres)
    "MALLOC_MMAP_THRESHOLD_": str(32 << 20),
    "MALLOC_TRIM_THRESHOLD_": str(1 << 30),
}
"""What a worker's own differs in."""
PACKAGE = __name__.rpartition(".")[0].rpartition(".")[0]
"""Name of the core's package, whatever is around it."""
IDLE = 120.0
"""Seconds without a call after which a worker ends: an artist looks, and renders again."""
PIPE = 1 << 20
"""Bytes that a pipe holds where that can be set: on Linux, whose limit that is for all but root. Of
the usual 64 KiB at a time, each of which the reader must wake up for, 4 MB take 5 ms, not 2."""


@dataclass(frozen=True)
class Share:
    """What many calls have in common: sent to each worker once."""

    values: tuple[Any, ...]
    number: int = field(default_factory=itertools.count().__next__)


@dataclass(frozen=True)
class Call:
    """A call of a function of this package: `function(*share.values, *arguments)`."""

    function: Callable[..., Any]
    share: Share
    arguments: tuple[Any, ...]

    def here(self) -> Any:
        """Make the call in this process."""
        return self.function(*self.share.values, *self.arguments)


class _Worker:
    """One process."""

    def __init__(self) -> None:
        # the core's own package, which holds the one that this file is in
        package, folder = PACKAGE, Path(__file__).resolve().parent.parent
        words = [
            sys.executable,
            "-I",
            "-c",
            BOOT,
            json.dumps([package, str(folder), IDLE, [*map(str, sys.path)]]),
        ]
        self._process = subprocess.Popen(
            words,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            # Ctrl-C is for the host to answer
            start_new_session=os.name == "posix",
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
            env={**os.environ, **ENVIRONMENT},
        )
        stdin, stdout = self._process.stdin, self._process.stdout
        assert stdin is not None and stdout is not None  # both are pipes
        self._calls, self._answers = stdin, stdout
        _widen(stdin)
        _widen(stdout)
        self._share = -1
        self.ready = False
        self.failed = False
        self._killed = False
        self._watching = threading.Thread(target=self._watch, name="Worker", daemon=True)
        self._watching.start()

    def _watch(self) -> None:
        """See the process load, and wait for its end: one that nobody waits for stays a zombie."""
        try:
            self.ready = receive(self._answers) == READY
        except (EOFError, OSError, ValueError, pickle.UnpicklingError):
            self.failed = True
        self._process.wait()

    @property
    def alive(self) -> bool:
        # a process that has been told to end may take a while
        return not self._killed and self._process.poll() is None

    def tell(self, call: Call) -> None:
        """Begin a call; raises OSError if the process has ended."""
        values = None if call.share.number == self._share else call.share.values
        send(self._calls, (call.function, values, call.arguments))
        self._share = call.share.number

    def answer(self) -> tuple[Any, Exception | None]:
        """The result or the exception; raises EOFError or OSError if the process has ended.

        Tells meanwhile what the worker tells.
        """
        while isinstance(got := receive(self._answers), float):
            tell(got)
        answer: tuple[Any, Exception | None] = got
        return answer

    def kill(self) -> None:
        """End it in the midst of a call, which raises EOFError or OSError."""
        self._killed = True
        self._process.kill()

    def close(self) -> None:
        """End it, and leave nothing behind; nobody may be calling."""
        self._process.kill()
        self._watching.join()
        for pipe in (self._calls, self._answers):
            with suppress(OSError):
                pipe.close()


def _widen(pipe: IO[bytes]) -> None:
    """Let a pipe hold more, where the system can."""
    with suppress(ImportError, AttributeError, OSError):
        import fcntl

        fcntl.fcntl(pipe, fcntl.F_SETPIPE_SZ, PIPE)


class Crew:
    """The workers of this process."""

    def __init__(self) -> None:
        """None at first."""
        self._lock = threading.Lock()
        self._idle: list[_Worker] = []
        self._busy: set[_Worker] = set()
        self._useless = not Path(sys.executable or "").name.lower().startswith("python")
        atexit.register(self.stop)

    @property
    def ready(self) -> int:
        """How many have loaded and are not called."""
        with self._lock:
            return sum(worker.ready and worker.alive for worker in self._idle)

    def hands(self, threads: int) -> int:
        """How many calls to make at a time, of so many threads allowed.

        With workers one is made in this process: two would wait for each other.
        """
        ready = self.ready
        return min(threads, 1 + ready) if ready else threads

    def muster(self, count: int) -> None:
        """Have so many workers, as soon as they have loaded; returns at once."""
        with self._lock:
            dead = [worker for worker in self._idle if not worker.alive]
            # one that never got ready: no other would
            self._useless |= any(worker.failed for worker in dead)
            self._idle = [worker for worker in self._idle if worker not in dead]
            lacking = 0 if self._useless else count - len(self._idle) - len(self._busy)
            for _ in range(lacking):
                try:
                    self._idle.append(_Worker())
                except OSError:
                    self._useless = True
                    break
        for worker in dead:
            worker.close()

    def borrow(self) -> _Worker | None:
        """A worker to call, if one is ready."""
        with self._lock:
            for worker in self._idle:
                if worker.ready and worker.alive:
                    self._idle.remove(worker)
                    self._busy.add(worker)
                    return worker
        return None

    def give_back(self, worker: _Worker) -> None:
        """After a call."""
        with self._lock:
            self._busy.discard(worker)
            self._idle.append(worker)

    def stop(self) -> None:
        """End all workers."""
        with self._lock:
            idle, self._idle = self._idle, []
            for worker in self._busy:
                worker.kill()
        for worker in idle:
            worker.close()


crew = Crew()
"""The one crew: renders at the same time share it."""


class Shift:
    """Calls that are made together, and may be broken off together."""

    def __init__(self) -> None:
        """With no call yet."""
        self._lock, self._telling = threading.Lock(), threading.Lock()
        self._busy: set[_Worker] = set()
        self._over = False

    def make(self, call: Call) -> Any:
        """Make a call by a worker, or here where none is ready."""
        try:
            answer = self._asked(call)
        except (EOFError, OSError):
            if self._over:
                raise Stopped from None
            answer = None
        if answer is None:
            return call.here()
        result, error = answer
        if error is not None:
            raise error
        return result

    def _asked(self, call: Call) -> tuple[Any, Exception | None] | None:
        """What a worker answers, if one is ready; raises EOFError or OSError if it has ended."""
        worker = self._tell(call)
        if worker is None:
            return None
        try:
            return worker.answer()
        finally:
            self._give_back(worker)

    def _tell(self, call: Call) -> _Worker | None:
        """A worker that has been told to make a call, if one is ready.

        One call at a time, before any is made here: Python lets a thread that computes go on for
        5 ms before another may write.
        """
        with self._telling:
            worker = crew.borrow()
            if worker is None:
                return None
            try:
                with self._lock:
                    if self._over:
                        raise Stopped
                    self._busy.add(worker)
                worker.tell(call)
            except BaseException:
                self._give_back(worker)
                raise
            return worker

    def _give_back(self, worker: _Worker) -> None:
        with self._lock:
            self._busy.discard(worker)
        crew.give_back(worker)

    def break_off(self) -> None:
        """End all calls, and those who make them."""
        with self._lock:
            self._over = True
            for worker in self._busy:
                worker.kill()
