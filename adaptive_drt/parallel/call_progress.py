# SPDX-License-Identifier: GPL-3.0-or-later
"""Progress of a running call, reported to a callback of the thread that runs it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TypeVar

__all__ = ["iterate_with_progress", "progress_range", "report_progress", "report_progress_to"]


class _ProgressListener(threading.local):
    """The progress callback of each thread, if any, and the range that progress is mapped to."""

    callback: Callable[[float], None] | None = None
    first, last = 0.0, 1.0


_listener = _ProgressListener()


@contextmanager
def report_progress_to(told: Callable[[float], None]) -> Iterator[None]:
    """Within the context, pass the progress that this thread reports to a function."""
    here = _listener
    before = here.callback, here.first, here.last
    here.callback, here.first, here.last = told, 0.0, 1.0
    try:
        yield
    finally:
        here.callback, here.first, here.last = before


@contextmanager
def progress_range(first: float, last: float) -> Iterator[None]:
    """Within the context, map reported progress from 0..1 to `first`..`last` of the outer range."""
    here = _listener
    low, high = here.first, here.last
    here.first, here.last = low + first * (high - low), low + last * (high - low)
    try:
        yield
    finally:
        here.first, here.last = low, high


Item = TypeVar("Item")


def iterate_with_progress(things: Sequence[Item]) -> Iterator[Item]:
    """Iterate over a sequence. Progress reported for one item counts for its share of the whole."""
    for index, thing in enumerate(things):
        with progress_range(index / len(things), (index + 1) / len(things)):
            yield thing


def report_progress(part: float) -> None:
    """Report the completed fraction (0 to 1) of the innermost range. No-op without a callback."""
    here = _listener
    if here.callback is not None:
        here.callback(here.first + part * (here.last - here.first))
