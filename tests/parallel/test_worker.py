# SPDX-License-Identifier: GPL-3.0-or-later
"""The main loop of a worker process, over its own pipes."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

from adaptive_drt.parallel import worker
from adaptive_drt.parallel.call_progress import report_progress
from adaptive_drt.parallel.transport import receive, send
from workers import LONG

ROOT = Path(worker.__file__).resolve().parents[2]


@contextmanager
def serving(idle=LONG):
    """A process that serves, ready for calls."""
    program = f"from adaptive_drt.parallel.worker import serve; serve({idle})"
    process = subprocess.Popen(
        [sys.executable, "-c", program], cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    try:
        assert receive(process.stdout) == worker.READY_MESSAGE
        yield process
    finally:
        process.kill()
        process.wait()
        process.stdin.close()
        process.stdout.close()


def ask(process, function, shared, *arguments):
    send(process.stdin, (function, shared, arguments))
    return receive(process.stdout)


def test_calls_are_answered_in_order_with_what_was_shared_last():
    with serving() as process:
        assert ask(process, math.pow, (2.0,), 3.0) == (8.0, None)
        assert ask(process, math.pow, None, 4.0) == (16.0, None)
        assert ask(process, math.pow, (3.0,), 2.0) == (9.0, None)
        # what calls print does not get into the answers
        assert ask(process, print, (), "anything") == (None, None)
        assert ask(process, os.getpid, ()) == (process.pid, None)
        answer, error = ask(process, math.sqrt, (), -1.0)
        assert answer is None and isinstance(error, ValueError)
        assert ask(process, math.sqrt, None, 4.0) == (2.0, None)
        # progress comes before the answer
        assert ask(process, report_progress, (), 0.25) == 0.25
        assert receive(process.stdout) == (None, None)
        # it ends with its input
        process.stdin.close()
        assert process.wait(LONG) == 0


def test_without_calls_it_ends():
    began = time.monotonic()
    with serving(0.2) as process:
        assert process.wait(LONG) == 0
        with pytest.raises(EOFError):
            receive(process.stdout)
    assert time.monotonic() - began < LONG
