# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a call is while it is being made: it tells whoever listens in its own thread."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TypeVar

__all__ = ["each_of", "heard_by", "part_of_call", "tell"]


class _Listener(threading.local):
    """Of each thread: who is told, if anybody, and from where to where on."""

    told: Callable[[float], None] | None = None
    first, last = 0.0, 1.0


_listener = _Listener()


@contextmanager
def heard_by(told: Callable[[float], None]) -> Iterator[None]:
    """Have a function told what this thread tells meanwhile."""
    here = _listener
    before = here.told, here.first, here.last
    here.told, here.first, here.last = told, 0.0, 1.0
    try:
        yield
    finally:
        here.told, here.first, here.last = before


@contextmanager
def part_of_call(first: float, last: float) -> Iterator[None]:
    """Have what is told meanwhile, 0 to 1, count as from `first` to `last` of what is done here."""
    here = _listener
    low, high = here.first, here.last
    here.first, here.last = low + first * (high - low), low + last * (high - low)
    try:
        yield
    finally:
        here.first, here.last = low, high


Thing = TypeVar("Thing")


def each_of(things: Sequence[Thing]) -> Iterator[Thing]:
    """Things one after the other: what is told meanwhile counts as that part of them all."""
    for index, thing in enumerate(things):
        with part_of_call(index / len(things), (index + 1) / len(things)):
            yield thing


def tell(part: float) -> None:
    """Tell what part (0 to 1) is done of what this thread does, which may be part of a call."""
    here = _listener
    if here.told is not None:
        here.told(here.first + part * (here.last - here.first))
