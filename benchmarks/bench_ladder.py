# SPDX-License-Identifier: GPL-3.0-or-later
"""Times a renderer over a ladder of settings: what every renderer's own process runs."""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

__all__ = ["climb", "parse"]

ROUNDS = 5
"""Times that a short render is timed at most."""
GROWTH = 4.5
"""From one rung to the next the time grows by about this: a rung that would be late is left out."""


def parse(about: str, *switches: str) -> argparse.Namespace:
    """The command line of a renderer's process."""
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("scene")
    parser.add_argument("width", type=int)
    parser.add_argument("height", type=int)
    parser.add_argument("folder", type=Path, help="where pictures and times go")
    parser.add_argument("seconds", type=float, help="the longest render to try")
    for switch in switches:
        parser.add_argument(switch, nargs="?", const=True, default=None)
    return parser.parse_args()


def climb(
    render: Callable[[Any, int], Any],
    rungs: Sequence[Any],
    given: argparse.Namespace,
    version: str,
    read: Callable[[Any], np.ndarray] = np.asarray,
    warm: int = 1_000,
    growth: float = GROWTH,
) -> None:
    """Render rung after rung until the next would take too long; write pictures and times.

    Parameters
    ----------
    render : takes a rung and a seed; this is what is timed.  rungs : settings, coarse to fine.
    read : the picture (3, height, width), row 0 lowest, from what `render` returned; not timed.
    warm : rungs that are rendered once untimed before, so that compilers and caches are warm.
    growth : of the time from rung to rung; 0 = climb to the top whatever it takes.
    """
    given.folder.mkdir(parents=True, exist_ok=True)
    said: dict[str, Any] = {"version": version, "rungs": []}
    for k, rung in enumerate(rungs):
        if k < warm:
            render(rung, 99)
        result, seconds = _timed(render, rung, given.seconds)
        np.save(given.folder / f"{k}.npy", read(result).astype(np.float32))
        least, median = min(seconds), statistics.median(seconds)
        said["rungs"].append({"setting": rung, "least": least, "median": median})
        (given.folder / "rungs.json").write_text(json.dumps(said), encoding="utf-8")
        if least * growth > given.seconds:
            break


def _timed(render: Callable[[Any, int], Any], rung: Any, longest: float) -> tuple[Any, list[float]]:
    """What the last round returned, and the seconds of all: more than one if they are short."""
    seconds: list[float] = []
    result = None
    while len(seconds) < ROUNDS and (not seconds or sum(seconds) + seconds[-1] < 0.5 * longest):
        start = time.perf_counter()
        result = render(rung, len(seconds))
        seconds.append(time.perf_counter() - start)
    return result, seconds
