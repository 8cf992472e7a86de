# SPDX-License-Identifier: GPL-3.0-or-later
"""Main loop of a worker process: it runs the calls that it receives, until its input ends.

A call is the message (function, shared, arguments), its answer (result, None) or (None, exception).
`shared` are the leading arguments that many calls have in common, or None if they are those of the
last call. Before the answer the worker may send floats: the completed fraction of the call.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from typing import IO, Any

from .call_progress import report_progress_to
from .transport import receive, send

__all__ = ["READY_MESSAGE", "serve"]

READY_MESSAGE = "ready"
"""First message of a worker, sent when it has imported everything that it needs."""
PROGRESS_INTERVAL = 0.1
"""Least time between two progress messages, in seconds: each wakes up a thread of the receiver."""


class _ProgressSender:
    """Callback that sends the progress of a call, at most once every `PROGRESS_INTERVAL`."""

    def __init__(self, answers: IO[bytes]) -> None:
        self._answers, self._next_time = answers, 0.0

    def __call__(self, part: float) -> None:
        now = time.monotonic()
        if now >= self._next_time:
            send(self._answers, float(part))
            self._next_time = now + PROGRESS_INTERVAL


def serve(idle: float) -> None:
    """Answer calls until the input ends or no call has come for `idle` seconds; then exit."""
    calls, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    # what the calls print must not get into the pipe of answers
    nothing = os.open(os.devnull, os.O_RDWR)
    os.dup2(nothing, 0)
    os.dup2(nothing, 1)
    send(answers, READY_MESSAGE)
    share: tuple[Any, ...] = ()
    teller = _ProgressSender(answers)
    while True:
        alarm = threading.Timer(idle, os._exit, (0,))
        alarm.daemon = True
        alarm.start()
        try:
            call = receive(calls)
        except EOFError:
            sys.exit()
        finally:
            alarm.cancel()
        function, news, arguments = call
        share = share if news is None else news
        try:
            with report_progress_to(teller):
                answer: Any = (function(*share, *arguments), None)
        except Exception as error:
            answer = (None, error)
        send(answers, answer)
