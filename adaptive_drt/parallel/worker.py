# SPDX-License-Identifier: GPL-3.0-or-later
"""The side of a worker process: it calls what it is told to, until its input ends.

A message is (function, share, arguments) and the answer (result, None) or (None, exception). The
share is what many calls have in common; None stands for the one before. Before the answer may come
numbers: what part of the call is done.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from typing import IO, Any

from .call_progress import heard_by
from .transport import receive, send

__all__ = ["READY", "serve"]

READY = "ready"
"""The first word of a worker that has loaded all it needs."""
NEWS = 0.1
"""Seconds at least between two numbers that tell how far a call is: each wakes up a thread."""


class _Teller:
    """Sends on what a call tells, now and then."""

    def __init__(self, answers: IO[bytes]) -> None:
        self._answers, self._due = answers, 0.0

    def __call__(self, part: float) -> None:
        now = time.monotonic()
        if now >= self._due:
            send(self._answers, float(part))
            self._due = now + NEWS


def serve(idle: float) -> None:
    """Answer calls until there are no more, or none comes for so many seconds."""
    calls, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    # whatever is printed is no answer
    nothing = os.open(os.devnull, os.O_RDWR)
    os.dup2(nothing, 0)
    os.dup2(nothing, 1)
    send(answers, READY)
    share: tuple[Any, ...] = ()
    teller = _Teller(answers)
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
            with heard_by(teller):
                answer: Any = (function(*share, *arguments), None)
        except Exception as error:
            answer = (None, error)
        send(answers, answer)
